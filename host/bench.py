# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper bench``: the measurements are the test bench's, run as a program of their own."""

import subprocess
import sys

from host.errors import UserError
from host.machine import ROOT


def bench() -> None:
    """Measure and print; what is printed is what the README quotes."""
    done = subprocess.run([sys.executable, "-m", "testbench.bench"], cwd=ROOT, check=False)
    if done.returncode:
        raise UserError("the measurements did not come to an end; see above.")
