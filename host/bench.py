# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper bench``: runs the measurements of the test bench as a program of their own."""

from host import door
from host.errors import UserError


def bench() -> None:
    """Measure, and print the figures that the documentation quotes."""
    if not door.measure():
        raise UserError("the measurements did not come to an end; see above.")
