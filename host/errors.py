# SPDX-License-Identifier: Apache-2.0
"""Failures that a user can understand: one clear sentence, and its exit status."""

# Exit statuses of ``gapkeeper``.
DONE, FAULT, USAGE, ALARM, REJECTED = 0, 1, 2, 3, 4
LONGEST = 60    # characters of a value, or of a name, in a sentence


def cut(text: str) -> str:
    """A text as a sentence shows it: its beginning, if it is long."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


def shown(value: object) -> str:
    """A value as a sentence shows it."""
    try:
        return cut(" ".join(repr(value).split()))
    except (RecursionError, ValueError):    # of tables, and of digits
        return "a value so long"


class UserError(Exception):
    """A failure that the user must know of; the text is the whole message."""

    status = FAULT


class UsageError(UserError):
    """The command, or one of its arguments, is wrong."""

    status = USAGE


class TapeError(UserError):
    """A tape or part program cannot be punched or read.

    ``block`` and ``character`` count from 1; block 1 is the one that starts the tape. A position
    that is not known is 0. ``of_text`` says that lines of a text are counted instead of blocks.
    """

    status = REJECTED

    def __init__(self, reason: str, block: int = 0, character: int = 0, *, of_text: bool = False):
        self.block, self.character = block, character
        name = "Line" if of_text else "Block"
        where = f"{name} {block}, character {character}: " if character else (
            f"{name} {block}: " if block else "")
        super().__init__(f"{where}{reason}")
