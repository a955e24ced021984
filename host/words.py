# SPDX-License-Identifier: Apache-2.0
"""Words for the terminal."""


def counted(number: int, thing: str) -> str:
    """A number with what it counts, one or several."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def exact(value: float) -> str:
    """A number with all of its digits, and no point behind a whole one."""
    return str(int(value)) if abs(value) < 1e16 and value == int(value) else str(value)
