# SPDX-License-Identifier: Apache-2.0
"""Check a tape with the firmware's own reader and parser, compiled for this computer."""

import ctypes
import re

from host.errors import TapeError
from host.tape import Tape

_PLACE = re.compile(r"^Block (\d+)")


def check(tape: Tape) -> int:
    """Number of blocks of a tape that has no fault.

    Raises
    ------
    TapeError
        With the firmware's sentence.
    """
    from softcore.image import host_library
    library = ctypes.CDLL(str(host_library()))
    sentence = ctypes.create_string_buffer(200)
    blocks = library.gk_check(tape.rows, len(tape.rows), sentence, len(sentence))
    if blocks < 0:
        text = _PLACE.sub(lambda m: f"Block {int(m[1]) + tape.shift}", sentence.value.decode())
        raise TapeError(text)
    return blocks
