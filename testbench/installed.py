# SPDX-License-Identifier: Apache-2.0
"""What a test does without a program of the system that it needs, such as a browser."""

import os
from typing import NoReturn

import pytest

__all__ = ["left_out"]


def left_out(what: str, packages: str, needed_by: str) -> NoReturn:
    """Leave a test out, as a user need not have the program; the summary says what was left out.

    Where the environment's variable ``needed_by`` is ``needed``, as in the continuous integration,
    the test fails instead: there nothing passes by not running.
    """
    said = f"left out: {what} (apt-get install {packages})"
    if os.environ.get(needed_by) == "needed":
        pytest.fail(said)
    pytest.skip(said)
