# SPDX-License-Identifier: Apache-2.0
"""The block in which a tape was interrupted, kept in a file while it runs.

The file is never half written. So it outlives an alarm, Ctrl-C, a cable that was pulled, and a
computer that lost its power. A tape that comes to its end has none.
"""

import json
import os
import time
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from host.errors import UsageError
from host.tape.start import LAST
from host.tape.tape import Tape

__all__ = ["FILE", "Interrupted", "Last", "last"]

FILE = "interrupted.json"
EVERY_S = 0.2       # a tape of many short blocks does not write more often
LARGEST = 99_999_999    # number of a block

# The block, and program zero at the start of its tape, mm by axis in the machine's frame.
Last = tuple[int, dict[str, float]]


def _digest(tape: Tape) -> str:
    return sha256(tape.rows).hexdigest()


class Interrupted:
    """Keeps the block of a tape that the machine works at, in a folder.

    ``block`` counts from 1, as the controller's messages do. Call ``keep`` again and again.
    ``zero`` is program zero at the start of the tape, by axis, in the machine's frame, mm.
    """

    def __init__(self, folder: Path, tape: Tape) -> None:
        self._file = folder / FILE
        self._tape = _digest(tape)
        self._block = self._kept = 0
        self._written_s = 0.0
        self.zero: dict[str, float] = {}

    def at(self, block: int) -> None:
        """The machine has begun a block."""
        self._block = block

    def keep(self) -> None:
        """Write the block, if it is another one and was not written just before."""
        if self._block != self._kept and time.monotonic() - self._written_s >= EVERY_S:
            self._write()

    def over(self, outcome: str | None) -> int:
        """The run is over, in whatever way; ``outcome`` is as of ``Run``.

        A tape that was rejected has moved nothing: what was kept stays. Return the block in which
        the tape was interrupted, or 0.
        """
        if outcome == "end":
            with suppress(OSError):
                self._file.unlink(missing_ok=True)
        if outcome in ("end", "rejected"):
            return 0
        if self._block != self._kept:
            self._write()
        return self._kept

    def _write(self) -> None:
        """Write the file anew; a disk that is full ends neither a cut nor its report."""
        self._written_s = time.monotonic()
        text = json.dumps({"tape_sha256": self._tape, "block": self._block, "zero": self.zero})
        new = self._file.with_suffix(".new")
        with suppress(OSError):
            with new.open("w", encoding="utf-8") as file:
                file.write(text + "\n")
                file.flush()
                os.fsync(file.fileno())     # before the name, or a power cut leaves an empty file
            new.replace(self._file)
            self._kept = self._block


def last(folder: Path, tape: Tape) -> Last:
    """Where the last run of a tape with results in a folder was interrupted.

    Raises
    ------
    UsageError
        If no run there was interrupted, or it was one of another tape.
    """
    file = folder / FILE
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
        block, of = int(kept["block"]), kept["tape_sha256"]
        zero = {axis: float(kept["zero"][axis]) for axis in "xyz"}
        if not 1 <= block <= LARGEST:
            raise ValueError(block)
    except FileNotFoundError:
        raise UsageError(f'begin at "{LAST}": the folder {folder} has no interrupted run.'
                         ) from None
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise UsageError(f'begin at "{LAST}": {file} cannot be read.') from error
    if of != _digest(tape):
        raise UsageError(f'begin at "{LAST}": the tape has changed since its run in {folder} was '
                         f"interrupted, in block {block}; look where this block is now, and give "
                         "its number.")
    return block, zero
