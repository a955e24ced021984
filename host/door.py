# SPDX-License-Identifier: Apache-2.0
"""The one door from the host to the test bench.

The simulated machine and the measurements belong to the test bench, which imports the host. So the
host imports the test bench in this module only, and only when one of the two is asked for.
"""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from host.errors import UserError
from host.places import ROOT

__all__ = ["measure", "start"]


def start(*, machine: dict[str, Any], clock_hz: int, seed: int, waves: Path | None, trace: bool,
          flash: bytes | None, progress: Callable[[str], None]) -> Any:
    """Switch a simulated machine on: ``testbench.native.start``.

    Raises
    ------
    UserError
        If this installation has no test bench.
    """
    try:
        from testbench.native import start as start_native
    except ImportError as error:
        raise UserError("the simulated machine is not part of this installation: run gapkeeper "
                        f"from a clone of the project ({error}).") from error
    return start_native(machine=machine, clock_hz=clock_hz, seed=seed, waves=waves, trace=trace,
                        flash=flash, progress=progress)


def measure() -> bool:
    """Print every figure that ``testbench.bench`` measures; return whether it was completed."""
    return not subprocess.run([sys.executable, "-m", "testbench.bench"], cwd=ROOT,
                              check=False).returncode
