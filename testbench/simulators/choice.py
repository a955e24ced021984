# SPDX-License-Identifier: Apache-2.0
"""A block in one of two simulators: its Verilog under cocotb, or Amaranth's own."""

import contextlib
import gc
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from amaranth._unused import MustUse
from amaranth.hdl import Elaboratable, Fragment
from amaranth.sim import Simulator

from testbench.simulators import blocks, isolated
from testbench.simulators.benches import Strict
from testbench.simulators.emitted import PERIOD_NS, emit

__all__ = ["Elsewhere", "in_amaranth", "run_isolated", "under_cocotb"]


class Elsewhere(pytest.fail.Exception):
    """A test has failed in its own process: the text says how.

    ``error`` is what it raised there, ``raised_in`` the file that did.
    """

    def __init__(self, text: str, error: BaseException, raised_in: Path):
        super().__init__(text, pytrace=False)
        self.error = error
        self.raised_in = raised_in


def in_amaranth(dut: Elaboratable, benches: Sequence, *, deadline: float, waves: Path | None):
    """Run benches in Amaranth's simulator; return what they returned."""
    results: list = [None] * len(benches)

    async def watchdog(ctx):
        await ctx.delay(deadline)
        raise TimeoutError(f"testbench still waiting after {deadline} s")

    def kept(index, bench):
        async def run(ctx):
            results[index] = await bench(Strict(ctx))
        return run

    fragment = Fragment.get(dut, None)
    sim = Simulator(fragment)
    sim.add_clock(PERIOD_NS * 1e-9)
    for index, bench in enumerate(benches):
        sim.add_testbench(kept(index, bench))
    sim.add_testbench(watchdog, background=True)
    with sim.write_vcd(str(waves)) if waves else contextlib.nullcontext():
        sim.run()
    blocks.note(blocks.AMARANTH, fragment)
    return results


def under_cocotb(dut: Elaboratable, benches: Sequence, simulator: isolated.Simulator, *,
                 deadline: float, apart: bool):
    """Run benches on the Verilog of ``dut`` under cocotb; return what they returned."""
    fragment = Fragment.get(dut, None)
    results = simulator.run(emit(fragment), tuple(benches), deadline, apart=apart)
    blocks.note(blocks.COCOTB, fragment)
    return results


def run_isolated(item, simulator: isolated.Simulator) -> None:
    """Run a test in a fork, and raise here what it raised there.

    What Python can only report, such as a coroutine that nobody has awaited, fails the test: pytest
    would look for it in its own process.
    """
    # A design that a fixture has made here is elaborated in the fork: here it is never used, and
    # Amaranth need not say so. In the fork it is to say so of what the test makes.
    MustUse._MustUse__silence = True

    def test():
        gc.collect()
        MustUse._MustUse__silence = False
        wanted = {name: item.funcargs[name] for name in item._fixtureinfo.argnames}
        lost: list[str] = []
        sys.unraisablehook = lambda told: lost.append(f"{told.object!r}: {told.exc_value!r}")
        try:
            item.obj(**wanted)
            gc.collect()
            assert not lost, lost
        except pytest.skip.Exception as skipped:
            return "skipped", skipped.msg
        except BaseException as error:
            caught = pytest.ExceptionInfo.from_exception(error)
            return ("failed", str(item.repr_failure(caught)), isolated.portable(error),
                    Path(caught.traceback[-1].path))
        return "passed", blocks.taken()

    how, *told = isolated.isolated(test, simulator)
    if how == "skipped":
        pytest.skip(*told)      # the test asked for it in its fork: passed on, not decided here
    if how == "failed":
        raise Elsewhere(*told)
    blocks.add(*told)
