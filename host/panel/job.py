# SPDX-License-Identifier: Apache-2.0
"""A tape that has been chosen on the panel."""

from dataclasses import dataclass
from pathlib import Path

from host.errors import UserError
from host.panel.outline import Outline, outline
from host.tape.tape import Tape, decode, is_punched, load, text_of

__all__ = ["Job"]


@dataclass(frozen=True)
class Job:
    """A tape that has been chosen: its file, its bytes, its lines and their outline."""

    path: Path
    tape: Tape
    lines: list[str]
    outline: Outline

    @classmethod
    def of(cls, path: Path) -> "Job":
        """The tape of a file.

        Raises
        ------
        UserError
            If it cannot be punched or read.
        """
        tape = load(path)
        try:
            text = decode(tape.rows)[0] if is_punched(path) else text_of(path, path.read_bytes())
        except OSError as error:
            raise UserError(f"{path.name} cannot be read: {error.strerror}.") from error
        lines = text.splitlines()
        return cls(path, tape, lines, outline(lines))
