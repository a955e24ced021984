# SPDX-License-Identifier: Apache-2.0
"""A plugin of pytest that notes why each test failed: it saw something wrong, or could not look.

A test sees by an assertion, by ``pytest.fail`` (``pytest.raises`` uses it, too), by waiting for
something in vain, by a line that the controller refuses, or by stumbling over an answer of another
form than it expects. A name that does not exist, a design that does not elaborate and firmware that
does not compile are no sight.
"""

from pathlib import Path

import pytest

from host.link.link import RefusedError
from testbench.native.compiling import BuildError
from testbench.simulators.choice import Elsewhere
from testbench.simulators.isolated import DiedError

__all__ = ["SAW"]

SAW = "saw"
TESTBENCH = Path(__file__).parents[1]
NO_SIGHT = (NameError, ImportError, SyntaxError, AttributeError, TypeError, BuildError, DiedError)


def pytest_addoption(parser):
    """Take the file to note in."""
    parser.addoption("--witness", type=Path, help="file that gets a line for each failure")


def judge(error: BaseException, raised_in: Path) -> str:
    """``SAW``, or what it was instead, by the exception and the file that raised it."""
    if isinstance(error, Elsewhere):
        return judge(error.error, error.raised_in)
    if isinstance(error, (pytest.fail.Exception, TimeoutError, RefusedError)):
        return SAW
    stumbled = (TESTBENCH / "simulators" in raised_in.parents
                and not isinstance(error, AssertionError))
    if TESTBENCH in raised_in.parents and not stumbled and not isinstance(error, NO_SIGHT):
        return SAW
    return f"{type(error).__name__} in {raised_in.name}: {str(error).splitlines()[:1]}"


def pytest_exception_interact(node, call, report):
    """Note a failure; one at the collection is never a sight."""
    reason = judge(call.excinfo.value, Path(call.excinfo.traceback[-1].path))
    if isinstance(report, pytest.CollectReport):
        reason = f"not collected: {reason}"
    with node.config.getoption("--witness").open("a", encoding="utf-8") as notes:
        notes.write(f"{reason}\n")
