# SPDX-License-Identifier: Apache-2.0
"""The machine that a tape names."""

import re
from pathlib import Path

from host.errors import TapeError
from host.machines.machine import built_in
from host.tape.subprograms import COMMENT
from host.tape.tape import decode, is_punched, text_of

__all__ = ["machine_named"]

_NAMED = re.compile(r"\(\s*MACHINE\s+(\w+)", re.IGNORECASE)


def machine_named(path: Path) -> str | None:
    """Name of the built-in machine that a comment before a tape's first block names.

    Such a comment begins with ``(MACHINE WIRE``. None if there is none, if no such machine comes
    with the project, or if the file cannot be read as a tape.
    """
    try:
        data = path.read_bytes()
        text = decode(data)[0] if is_punched(path) else text_of(path, data)
    except (OSError, TapeError):
        return None
    for line in text.splitlines():
        if found := _NAMED.search(line):
            name = found[1].lower()
            return name if name in built_in() else None
        if COMMENT.sub("", line).strip(" \t%"):
            break
    return None
