# SPDX-License-Identifier: Apache-2.0
"""The block in which a tape was interrupted, kept in a file while it runs.

The file is there at any time, whole: so it outlives an alarm, Ctrl-C, a cable that was pulled, and
a computer that lost its power. A tape that comes to its end has none.
"""

import json
import time
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from host.errors import UsageError
from host.tape.tape import Tape

__all__ = ["FILE", "LAST", "Interrupted", "block_of_last"]

FILE = "interrupted.json"
LAST = "last"       # what a user calls this block
EVERY_S = 0.2       # a tape of many short blocks does not write more often


def _digest(tape: Tape) -> str:
    return sha256(tape.rows).hexdigest()


class Interrupted:
    """Keeps the block of a tape that the machine works at, in a folder.

    ``block`` counts from 1, as the controller's messages do. Call ``keep`` again and again.
    """

    def __init__(self, folder: Path, tape: Tape) -> None:
        self._file = folder / FILE
        self._tape = _digest(tape)
        self._block = self._kept = 0
        self._written_s = 0.0

    def at(self, block: int) -> None:
        """The machine has begun a block."""
        self._block = block

    def keep(self) -> None:
        """Write the block, if it is another one and was not written just before."""
        if self._block != self._kept and time.monotonic() - self._written_s >= EVERY_S:
            with suppress(OSError):     # a full disk does not end a cut
                self._write()

    def over(self, outcome: str | None) -> int:
        """The run is over, in whatever way; ``outcome`` is as of ``Run``.

        Return the block in which it was interrupted, or 0.
        """
        if outcome == "end":
            self._file.unlink(missing_ok=True)
            return 0
        if self._block != self._kept:
            self._write()
        return self._block

    def _write(self) -> None:
        text = json.dumps({"tape_sha256": self._tape, "block": self._block}) + "\n"
        new = self._file.with_suffix(".new")
        new.write_text(text, encoding="utf-8")
        new.replace(self._file)
        self._kept, self._written_s = self._block, time.monotonic()


def block_of_last(folder: Path, tape: Tape) -> int:
    """Block in which the last run of a tape with results in a folder was interrupted.

    Raises
    ------
    UsageError
        If no run there was interrupted, or it was one of another tape.
    """
    file = folder / FILE
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
        block, of = int(kept["block"]), kept["tape_sha256"]
    except FileNotFoundError:
        raise UsageError(f'begin at "{LAST}": no run with results in {folder} was interrupted in a '
                         "block.") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(f'begin at "{LAST}": {file} cannot be read.') from error
    if of != _digest(tape):
        raise UsageError(f'begin at "{LAST}": the run interrupted with results in {folder} was one '
                         "of another tape; give the block itself.")
    return block
