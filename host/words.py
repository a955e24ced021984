# SPDX-License-Identifier: Apache-2.0
"""Words for the terminal."""


def counted(number: int, thing: str) -> str:
    """A number with what it counts, one or several."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
