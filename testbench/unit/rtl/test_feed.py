# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.feed``, against the exact model."""

from itertools import pairwise

import pytest

from rtl.motion.feed import PathPulseGenerator
from testbench.models.feed import Feed

ONE = 1 << 32           # 1 pulse/clock
TOP = (1 << 30) - 1
RATES = [1, 2, 3, (1 << 29) - 1, 1 << 29, TOP - 1, TOP]


def wrapped(value):
    """As a signed 32-bit number."""
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


class Bench:
    """Generator and model side by side."""

    def __init__(self, dut):
        self.dut = dut
        self.model = Feed()
        self.clock = 0
        self.pulses = []  # clocks with a pulse

    async def tick(self, ctx, *, rate=0, go=True, reverse=False, bound=0, pull=False, load=None):
        dut, feed = self.dut, self.model
        for port, value in ((dut.rate, rate), (dut.go, go), (dut.reverse, reverse),
                            (dut.bound, wrapped(bound)), (dut.pull, pull),
                            (dut.load, load is not None), (dut.load_value, wrapped(load or 0))):
            ctx.set(port, value)
        await ctx.tick()
        feed.tick(rate=rate, go=go, reverse=reverse, bound=bound, pull=pull, load=load)
        self.clock += 1
        assert ctx.get(dut.ps) == feed.ps
        assert ctx.get(dut.command) == wrapped(feed.command)
        assert ctx.get(dut.room) == feed.room
        if feed.ps:
            self.pulses.append(self.clock)

    def spaces(self):
        return [after - before for before, after in pairwise(self.pulses)]


@pytest.fixture
def bench():
    return Bench(PathPulseGenerator())


@pytest.mark.parametrize("origin", [0, (1 << 31) - 20, -(1 << 31) + 20], ids=hex)
def test_follows_the_model(simulate, rng, bench, origin):
    async def run(ctx):
        await bench.tick(ctx, go=False, load=origin)
        for _ in range(60):
            model = bench.model
            reverse = rng.random() < 0.5
            rate = rng.choice([*RATES, rng.randrange(TOP), ONE // rng.randint(5, 20)])
            bound = model.command + rng.choice((0, 1, 2, 5, 100, -3)) * (-1 if reverse else 1)
            for _ in range(2):
                await bench.tick(ctx, go=False, rate=rate, reverse=reverse, bound=bound)
            kind = rng.random()
            for _ in range(rng.randint(1, 70)):
                await bench.tick(
                    ctx, rate=rate, reverse=reverse, bound=bound,
                    go=kind < 0.6 or rng.random() < 0.9, pull=kind > 0.4 and rng.random() < 0.2,
                    load=model.command + rng.randint(-3, 3) if rng.random() < 0.01 else None)

    simulate(bench.dut, run)
    assert min(bench.spaces()) >= 4


@pytest.mark.parametrize("rate", [ONE // 5, 987654321, TOP])
def test_mean_rate_is_exact(simulate, bench, rate):
    async def run(ctx):
        await bench.tick(ctx, go=False, bound=10**6)
        for _ in range(4000):
            await bench.tick(ctx, rate=rate, bound=10**6)

    simulate(bench.dut, run)
    for number, clock in enumerate(bench.pulses, start=1):
        # The clock after ``go``, the one that has the overflow, and the register of ``ps``.
        assert clock == -(-number * ONE // rate) + 2
    assert min(bench.spaces()) >= 4


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("origin", [0, (1 << 31) - 3, 5 - (1 << 31)], ids=hex)
def test_stops_exactly_at_the_bound(simulate, bench, origin, reverse):
    bound = origin + (-6 if reverse else 6)

    async def run(ctx):
        await bench.tick(ctx, go=False, load=origin)
        for _ in range(2):
            await bench.tick(ctx, go=False, reverse=reverse, bound=bound)
        for clock in range(80):
            await bench.tick(ctx, rate=TOP, reverse=reverse, bound=bound, pull=clock > 40)
        assert len(bench.pulses) == 6
        assert ctx.get(bench.dut.command) == wrapped(bound)
        for _ in range(10):  # further away: the pulse that waits comes at once
            await bench.tick(ctx, rate=1, reverse=reverse, bound=bound + (-1 if reverse else 1))
        assert len(bench.pulses) == 7

    simulate(bench.dut, run)


def test_going_low_stops_in_the_next_clock(simulate, bench):
    async def run(ctx):
        await bench.tick(ctx, go=False, bound=1000)
        for length in range(1, 60):
            for _ in range(length):
                await bench.tick(ctx, rate=TOP, bound=1000)
            before = len(bench.pulses)
            for _ in range(6):
                await bench.tick(ctx, rate=TOP, go=False, bound=1000)
            assert len(bench.pulses) == before

    simulate(bench.dut, run)


def test_pull_needs_no_go(simulate, bench):
    async def run(ctx):
        for _ in range(3):
            await bench.tick(ctx, go=False, bound=3)
        for _ in range(40):
            await bench.tick(ctx, go=False, bound=3, pull=True)

    simulate(bench.dut, run)
    assert len(bench.pulses) == 3
    assert bench.spaces() == [4, 4]
