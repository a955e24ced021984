# SPDX-License-Identifier: Apache-2.0
"""The machine that a tape names."""

import re

from host.errors import TapeError
from host.tape.subprograms import COMMENT
from host.tape.tape import Tape, decode

__all__ = ["machine_named"]

# A whole sentence or the beginning of one: (MACHINE WIRE. A SLOT), but not (MACHINE HALF OF IT).
_NAMED = re.compile(r"[(;]\s*MACHINE[\s:]\s*([A-Z][\w-]*)\s*(?:[.,;)]|$)", re.IGNORECASE)
# What may stand before the first block: the start, a name or a number of the program or of a block.
_NO_BLOCK = re.compile(r"[\s%]*(?:[NO:]\s*\d+\s*)*")


def machine_named(tape: Tape) -> str | None:
    """Name, in small letters, of the machine that a comment before a tape's first block names.

    Such a comment begins with ``(MACHINE WIRE``. None if there is none, or if the tape is damaged.
    """
    try:
        text = decode(tape.rows)[0]
    except TapeError:
        return None
    for line in text.splitlines():
        for comment in COMMENT.findall(line):
            if found := _NAMED.match(comment):
                return found[1].lower()
        if not _NO_BLOCK.fullmatch(COMMENT.sub("", line)):
            return None
    return None
