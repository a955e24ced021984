# SPDX-License-Identifier: Apache-2.0
"""Whole tests under pytest: what fails in the fork fails outside."""

import subprocess
import sys

import pytest

from host.places import ROOT

TEST = """
from rtl.gap.reference import References

async def look(ctx):
    assert False, "nobody looked"

def test_one(simulate):
    dut = References()

    async def bench(ctx):
        {line}
        await ctx.tick()

    simulate(dut, bench)
"""


@pytest.mark.parametrize(("line", "said"), [
    ("pass", "1 passed"),
    ("await look(ctx)", "nobody looked"),
    ("look(ctx)", "was never awaited"),
    ("pytest.fail('not so')", "not so"),
])
def test_a_failure_of_any_kind_is_told(workdir, line, said):
    path = workdir / "test_one.py"
    path.write_text("import pytest\n" + TEST.format(line=line))
    result = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "testbench.conftest", "-p", "no:cacheprovider",
         "--rootdir", ROOT, "-c", ROOT / "pyproject.toml", path],
        cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert said in result.stdout
    assert result.returncode == (line != "pass")
