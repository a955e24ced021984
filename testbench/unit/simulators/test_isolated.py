# SPDX-License-Identifier: Apache-2.0
"""A test under cocotb fails if anything in it fails, and says why."""

import os

import pytest
from amaranth.hdl import Assert, Fragment, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from testbench.simulators.benches import SettleError, settle
from testbench.simulators.emitted import emit
from testbench.simulators.isolated import DiedError, Simulator, isolated


class Counter(wiring.Component):
    """Counts the clocks in which ``step`` is high; ``next`` tells the following count."""

    step: In(1)
    count: Out(8)
    next: Out(8)

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.next.eq(self.count + self.step)
        m.d.sync += self.count.eq(self.next)
        return m


@pytest.fixture
def own(workdir):
    """A simulator for a test that forks by itself."""
    return Simulator(workdir, seed=1, waves=False)


def told(test):
    """What a test raises, as text; else what it returns."""
    try:
        return test()
    except BaseException as error:
        return f"{type(error).__name__}: {error}"


def in_fork(own, bench, after=lambda: None, *, deadline=1e-3):
    """Run a bench on a counter in a fork, then ``after()``; return what came of it."""
    def test():
        dut = Counter()
        results = own.run(emit(Fragment.get(dut, None)), (lambda ctx: bench(ctx, dut),), deadline)
        after()
        return results

    return isolated(lambda: told(test), own)


def test_a_bench_runs_and_what_it_returns_comes_back(own):
    async def bench(ctx, dut):
        ctx.set(dut.step, 1)
        await ctx.tick().repeat(5)
        return ctx.get(dut.count)

    assert in_fork(own, bench) == [5]


def test_an_assertion_in_a_bench_is_told(own):
    async def bench(ctx, dut):
        await ctx.tick()
        assert ctx.get(dut.count) == 7, "seven"

    assert in_fork(own, bench).startswith("AssertionError: seven")


def test_what_a_bench_collects_is_there_for_the_lines_behind_it(own):
    seen = []

    async def bench(ctx, dut):
        await ctx.tick()
        seen.append(ctx.get(dut.count))

    def after():
        assert seen == [1], seen

    assert in_fork(own, bench, after).startswith("AssertionError: [0]")
    assert seen == [], "it was the list of the fork"


def test_a_bench_that_waits_in_vain_is_ended(own):
    async def bench(ctx, dut):
        while not ctx.get(dut.count):
            await ctx.tick()

    assert in_fork(own, bench, deadline=1e-6) == (
        "TimeoutError: testbench still waiting after 1e-06 s")


def test_reading_before_what_was_set_has_settled_is_an_error(own):
    async def bench(ctx, dut):
        ctx.set(dut.step, 1)
        await settle(ctx)
        assert ctx.get(dut.next) == 1
        ctx.set(dut.step, 0)
        ctx.get(dut.next)

    assert in_fork(own, bench) == f"SettleError: {SettleError()}"


def test_a_combinational_signal_cannot_be_set(own):
    async def bench(ctx, dut):
        ctx.set(dut.next, 1)

    assert in_fork(own, bench).startswith("DriverConflict")


def test_a_failed_assertion_of_the_design_is_told(own):
    async def bench(ctx):
        await ctx.tick().repeat(9)

    def test():
        m = Module()
        counter = Signal(4)
        m.d.sync += [counter.eq(counter + 1), Assert(counter != 5)]
        own.run(emit(Fragment.get(m, None)), (bench,), 1e-3)

    assert isolated(lambda: told(test), own).startswith(
        "AssertionError: an assertion of the design has failed")


def test_a_test_simulates_once(own):
    async def bench(ctx, dut):
        await ctx.tick()

    def test():
        dut = Counter()
        for _ in range(2):
            own.run(emit(Fragment.get(dut, None)), (lambda ctx: bench(ctx, dut),), 1e-3)

    assert isolated(lambda: told(test), own) == (
        "RuntimeError: under cocotb a test can call simulate once")


@pytest.mark.parametrize("how", [lambda: os._exit(0), lambda: os._exit(3), os.abort],
                         ids=["leaves", "leaves with 3", "aborts"])
def test_a_process_that_dies_is_a_failure(own, how):
    async def bench(ctx, dut):
        how()

    with pytest.raises(DiedError, match="said 0 bytes"):
        in_fork(own, bench)


def test_a_process_that_says_nothing_is_ended(own):
    with pytest.raises(DiedError, match="said 0 bytes"):
        isolated(lambda: own.answers.get(), own, wall_s=0.5)


def test_simulations_apart_give_back_what_their_benches_return(own):
    seen = []

    def counted(clocks):
        dut = Counter()

        async def bench(ctx):
            ctx.set(dut.step, 1)
            await ctx.tick().repeat(clocks)
            seen.append(clocks)
            assert clocks != 6, "six"
            return ctx.get(dut.count)

        return own.run(emit(Fragment.get(dut, None)), (bench,), 1e-3, apart=True)

    three, six, seven = isolated(
        lambda: [told(lambda clocks=clocks: counted(clocks)) for clocks in (3, 6, 7)], own)
    assert (three, seven) == ([3], [7])
    assert six.startswith("AssertionError: six")
    assert isolated(lambda: (counted(2), seen), own) == ([2], [])


def test_a_simulation_apart_that_dies_is_told_to_its_test(own):
    async def bench(ctx, dut):
        os._exit(3)

    def test():
        dut = Counter()
        own.run(emit(Fragment.get(dut, None)), (lambda ctx: bench(ctx, dut),), 1e-3, apart=True)

    assert isolated(lambda: told(test), own).startswith("DiedError: the process of the test ended")
