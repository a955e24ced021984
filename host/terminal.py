# SPDX-License-Identifier: Apache-2.0
"""What a person does at the terminal."""

import select
import sys

__all__ = ["enter_pressed"]


def enter_pressed() -> bool:
    """Whether somebody has pressed Enter since this was asked last; never, without a terminal."""
    if not sys.stdin.isatty() or not select.select([sys.stdin], [], [], 0)[0]:
        return False
    return bool(sys.stdin.readline())
