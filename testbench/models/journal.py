# SPDX-License-Identifier: Apache-2.0
"""Reference model of the journal in the flash memory, from its format (``store/journal.h``)."""

import struct
from zlib import crc32

SECTOR, PAGE = 4096, 256
MARK = b"GKJ1"
SETTINGS, PLACES, CONDITIONS, CLASSES = KINDS = range(4)
OPENING = 0xFF
PART = 60       # most words of a page


def page(sequence: int, kind: int, words: list[int], part: int = 0, parts: int = 1) -> bytes:
    """Bytes of one page; those behind it stay erased."""
    body = struct.pack("<I4B4s", sequence, kind, part, parts, len(words), MARK)
    body += struct.pack(f"<{len(words)}I", *words)
    return body + struct.pack("<I", crc32(body))


def judged(data: bytes) -> tuple[int, int, int, int, list[int]] | None:
    """Sequence number, kind, part, parts and words of a page, or None if it is not whole."""
    sequence, kind, part, parts, count, mark = struct.unpack_from("<I4B4s", data)
    end = 12 + 4 * count
    if mark != MARK or count > PART or crc32(data[:end]) != struct.unpack_from("<I", data, end)[0]:
        return None
    return sequence, kind, part, parts, list(struct.unpack_from(f"<{count}I", data, 12))


def contents(region: bytes) -> dict[int, list[int]] | None:
    """Words of the newest whole record of every kind; None if no sector is valid."""
    openings = []
    for base in range(0, len(region), SECTOR):
        found = judged(region[base:base + PAGE])
        if found and found[1] == OPENING:
            openings.append((found[0], base))
    if not openings:
        return None
    newest: dict[int, list[int]] = {}
    begun: dict[tuple[int, int], list[int]] = {}
    base = max(openings)[1]
    for at in range(base + PAGE, base + SECTOR, PAGE):
        found = judged(region[at:at + PAGE])
        if found:
            sequence, kind, part, parts, words = found
            begun[sequence, part] = words
            if part == parts - 1 and all((sequence, one) in begun for one in range(parts)):
                newest[kind] = [word for one in range(parts) for word in begun[sequence, one]]
    return newest


def sector(records: dict[int, list[int]], sequence: int = 1) -> bytes:
    """Bytes of a sector with one record of every kind, each of one page; None leaves a kind out."""
    data = bytearray(b"\xff" * SECTOR)
    for index, (kind, words) in enumerate(records.items(), 1):
        made = page(sequence + index, kind, words)
        data[index * PAGE:index * PAGE + len(made)] = made
    opening = page(sequence + len(records) + 1, OPENING, [])
    data[:len(opening)] = opening
    return bytes(data)
