# SPDX-License-Identifier: Apache-2.0
"""The block at which a tape begins that is not run from its beginning."""

import re

from host.errors import UsageError
from host.tape.subprograms import COMMENT
from host.tape.tape import Tape, decode

__all__ = ["INTERRUPTED", "LAST", "STARTS_AT", "block_of"]

LAST = "last"       # in place of a block: where the tape was interrupted
# The controller's message before it goes to a block, and that after power-off in a cut.
STARTS_AT = re.compile(r"block (\d+) (?:begins|was left) at ")
INTERRUPTED = re.compile(r"a tape was interrupted in block (\d+)")

_WANTED = re.compile(r"(N?)(\d{1,8})", re.IGNORECASE)
_NUMBER = re.compile(r"N(\d+)", re.IGNORECASE)


def block_of(tape: Tape, wanted: str) -> int:
    """Block of a tape, counted from 1, that a user names.

    ``wanted`` is the number by which the controller's messages count blocks (``7``), or that of the
    block's N word (``N60``).

    Raises
    ------
    UsageError
        If it names no block of the tape, or several.
    """
    found = _WANTED.fullmatch(wanted.strip())
    if found is None:
        raise UsageError(f'begin at "{wanted}": give the number of a block, such as 7, or its N '
                         "word, such as N60.")
    text, _ = decode(tape.rows)
    lines = text.splitlines()
    number = int(found[2])
    if not found[1]:
        if not 1 <= number < len(lines):
            raise UsageError(f"begin at {wanted}: the tape has the blocks 1 to {len(lines) - 1}.")
        return number
    blocks = [block for block, line in enumerate(lines, start=1)
              if (word := _NUMBER.search(COMMENT.sub("", line))) and int(word[1]) == number]
    if not blocks:
        raise UsageError(f"begin at {wanted}: no block of the tape has this number.")
    if len(blocks) > 1:
        raise UsageError(f"begin at {wanted}: the blocks {', '.join(map(str, blocks))} of the tape "
                         "have this number; give one of those without N.")
    return blocks[0]
