# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper bench``: the measurements are the test bench's, run as a program of their own."""

from host import door
from host.errors import UserError


def bench() -> None:
    """Measure and print; what is printed is what the README quotes."""
    if not door.measure():
        raise UserError("the measurements did not come to an end; see above.")
