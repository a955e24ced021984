# SPDX-License-Identifier: Apache-2.0
"""The types of the host, and of the soft core's plain modules, as ``make lint`` checks them.

In ``make test`` they are checked here: so both cores are at work meanwhile.
"""

import subprocess
import sys

from host.places import ROOT


def test_the_types_are_right():
    done = subprocess.run([sys.executable, "-m", "mypy"], cwd=ROOT, capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stdout + done.stderr
