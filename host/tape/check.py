# SPDX-License-Identifier: Apache-2.0
"""Check a tape with the firmware's own reader and parser, compiled for this computer."""

import ctypes
import re
from collections.abc import Sequence

from host.errors import TapeError, UsageError
from host.link.link import check_line
from host.tape.tape import Tape

_PLACE = re.compile(r"^Block (\d+)")


def check(tape: Tape, mdi: Sequence[str] = ()) -> int:
    """Number of blocks of a tape that has no fault, after the lines ``mdi`` entered by hand.

    Raises
    ------
    TapeError
        With the firmware's sentence.
    UsageError
        If a line cannot be entered by hand, or the firmware refuses it.
    """
    from softcore.image import host_library
    library = ctypes.CDLL(str(host_library()))
    sentence = ctypes.create_string_buffer(200)
    library.gk_check_forget()
    for line in mdi:
        check_line(line)
        if library.gk_check_line(line.upper().encode(), sentence, len(sentence)):
            raise UsageError(f'the line "{line}" entered by hand is refused by the controller: '
                             f"{sentence.value.decode()}")
    blocks = int(library.gk_check(tape.rows, len(tape.rows), sentence, len(sentence)))
    if blocks < 0:
        text = _PLACE.sub(lambda m: f"Block {tape.line(int(m[1]))}", sentence.value.decode())
        raise TapeError(text)
    return blocks
