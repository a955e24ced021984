# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.power.readback``, against the exact model."""

import pytest

from rtl.power.readback import ReadBack
from testbench.models import readback as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle

CLOCK_HZ = 1_000_000
QUIET = dict(on=0, sense=0, current=0, short=1, level=122)


class Bench:
    """The read-back and its model side by side; ``seen`` are the outputs clock by clock."""

    def __init__(self, *, dead=3, limit=20, settle=8):
        self.dut = ReadBack(clock_hz=CLOCK_HZ, dead_ns=1000 * dead, limit_us=limit,
                            settle_us=settle)
        self.model = model.ReadBack(dead, limit, settle)
        self.seen = []

    async def clock(self, ctx, times=1, **inputs):
        for name, value in (QUIET | inputs).items():
            ctx.set(getattr(self.dut, name), value)
        for _ in range(times):
            await settle(ctx)
            self.seen.append((ctx.get(self.dut.live), ctx.get(self.dut.stuck)))
            assert self.seen[-1] == (self.model.live, self.model.stuck), len(self.seen)
            self.model.clock(**QUIET | inputs)
            await ctx.tick()


@pytest.mark.parametrize(("dead", "limit", "settle"), [(1, 1, 1), (2, 10, 3), (3, 20, 8),
                                                       (7, 9, 1)])
def test_follows_the_model(simulate, rng, dead, limit, settle):
    bench = Bench(dead=dead, limit=limit, settle=settle)

    async def run(ctx):
        inputs = dict(QUIET)
        for _ in range(600):
            name = rng.choice(tuple(QUIET))
            if name != "level" or rng.random() < 0.3:
                inputs[name] = rng.choice((0, 122, 123)) if name == "level" else inputs[name] ^ 1
            if rng.random() < 0.1:
                inputs |= QUIET | dict(level=inputs["level"])
            await bench.clock(ctx, rng.choice((1, 1, 2, dead, limit, limit + 1, settle)), **inputs)

    simulate(bench.dut, run)
    assert set(bench.seen) == {(0, 0), (1, 0), (1, 1), (0, 1)}


@pytest.mark.parametrize("sign", [dict(current=1), dict(short=0)])
def test_what_does_not_die_away_is_stuck(simulate, sign):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 20)
        await bench.clock(ctx, 50, on=1, **sign)
        await bench.clock(ctx, 20, **sign)
        assert not any(stuck for _, stuck in bench.seen)
        await bench.clock(ctx, 5, **sign)
        assert bench.seen[-5:] == [(1, 1)] * 5
        await bench.clock(ctx, 5)
        assert bench.seen[-5:] == [(1, 1)] * 3 + [(0, 1), (0, 0)]

    simulate(bench.dut, run)


def test_what_dies_away_in_time_is_not(simulate):
    """A pulse, or 3 clocks that are not live, restart the count; 2 such clocks do not."""
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 20)
        for gap in (dict(times=3), dict(times=1, on=1), dict(times=1, sense=1)):
            await bench.clock(ctx, 5, on=1)
            await bench.clock(ctx, 16, current=1)
            await bench.clock(ctx, **gap)
            await bench.clock(ctx, 16, current=1)
            await bench.clock(ctx, 10)
        assert not any(stuck for _, stuck in bench.seen)
        await bench.clock(ctx, 15, current=1)
        await bench.clock(ctx, 2)
        await bench.clock(ctx, 6, current=1)
        assert bench.seen[-1] == (1, 1)

    simulate(bench.dut, run)


def test_voltage_waits_for_its_level_and_current_does_not(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 9, short=0)      # the level is another than before reset
        assert bench.seen == [(0, 0)] * 9
        await bench.clock(ctx, 3, short=0)
        assert bench.seen[-3:] == [(0, 0), (1, 0), (1, 0)]
        await bench.clock(ctx, 5)
        await bench.clock(ctx, 9, short=0, level=200)
        # In the clock of the change it still counts.
        assert bench.seen[-9:] == [(0, 0), *[(1, 0)] * 3, *[(0, 0)] * 5]
        await bench.clock(ctx, 2, short=0, current=1, level=300)
        assert bench.seen[-1] == (1, 0)

    simulate(bench.dut, run)


@pytest.mark.parametrize(("clock_hz", "clocks"), [
    (2_000_000, (2, 1000, 4000)), (50_000_000, (50, 25_000, 100_000)), (1000, (1, 1, 2)),
    (3001, (1, 2, 7))])
def test_times_are_rounded_up(clock_hz, clocks, simulate):
    dut = ReadBack(clock_hz=clock_hz)
    assert (dut.dead, dut.limit, dut.settle) == clocks

    async def build(ctx):
        await ctx.tick()

    simulate(dut, build)


def test_refuses_wrong_times():
    refuses(ReadBack, "times of the read-back must not be below 0, but are 1000, -1 and 2000",
            clock_hz=CLOCK_HZ, limit_us=-1)
