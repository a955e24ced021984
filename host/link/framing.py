# SPDX-License-Identifier: Apache-2.0
"""Form of what goes to the controller over the link: numbered lines, and frames of a tape.

**A numbered line** carries its number and a check::

    @17 G00 X1*5A3C

The check is the CRC of everything before the ``*``, in four hexadecimal digits.

**A tape frame** carries punched bytes::

    0x02, then stuffed: length n, sequence, n bytes, CRC high, CRC low, then bare: 0x03

with the CRC over length, sequence and bytes. *Stuffed* means that a byte of ``linkmap.STUFFED`` is
sent as 0x10 and the byte with bit 6 inverted. So 0x02 always begins a frame, and a real-time byte
is never part of one. Any damage to a single byte of a frame is detected: by the CRC if the length
is right, else by the place of 0x03.

Length 0 begins a tape, length 0xFF says that no more bytes follow. The frames of a tape are
numbered from 0, modulo 256. The frame that begins the tape has number 255, so that a late answer to
it is not mistaken for the answer to the first bytes.

Ref: CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF): check value 0x29B1 for ``123456789``.
"""

import json
from binascii import crc_hqx
from collections.abc import Iterator

from host.errors import UsageError
from softcore.linkmap import FRAME_END, FRAME_ESCAPE, FRAME_FLIP, FRAME_START, STUFFED

PAYLOAD = 64
BEGIN, FINISH = 0x00, 0xFF
LONGEST_LINE = 255        # characters of a line's text


def crc(data: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    return crc_hqx(data, 0xFFFF)


def check_line(line: str) -> None:
    """Check that ``line`` can be sent as one line of line mode.

    Raises
    ------
    UsageError
        If it is empty or too long, or holds a character that is not printable ASCII or acts as a
        real-time byte.
    """
    wrong = next((char for char in line if not " " <= char <= "~" or char in "?!~"), None)
    if wrong is not None:
        said, char = (json.dumps(text, ensure_ascii=False) for text in (line, wrong))
        raise UsageError(f"the line {said} cannot be entered by hand: {char} is no character of a "
                         "block.")
    if not line.strip():
        raise UsageError("an empty line cannot be entered by hand.")
    if len(line) > LONGEST_LINE:
        raise UsageError(f'the line "{line[:20]}…" cannot be entered by hand: it has {len(line)} '
                         f"characters, and the controller takes {LONGEST_LINE}.")


def numbered(number: int, line: str) -> bytes:
    """Bytes of a line with its number and check."""
    text = f"@{number} {line}".encode("ascii")
    return text + b"*%04X\n" % crc(text)


def stuffed(data: bytes) -> bytes:
    """``data`` with its special bytes replaced, as it is sent within a frame."""
    return b"".join(bytes([FRAME_ESCAPE, byte ^ FRAME_FLIP]) if byte in STUFFED else bytes([byte])
                    for byte in data)


def frame(length: int, sequence: int, payload: bytes = b"") -> bytes:
    """Bytes of one frame. ``length`` is that of the payload, or ``BEGIN`` or ``FINISH``."""
    body = bytes([length, sequence]) + payload
    return bytes([FRAME_START, *stuffed(body + crc(body).to_bytes(2)), FRAME_END])


def frames(rows: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the frames of a tape, each with its sequence number."""
    yield 0xFF, frame(BEGIN, 0xFF)
    payloads = [rows[start:start + PAYLOAD] for start in range(0, len(rows), PAYLOAD)]
    for number, payload in enumerate(payloads):
        sequence = number % 256
        yield sequence, frame(len(payload), sequence, payload)
    yield (last := len(payloads) % 256), frame(FINISH, last)
