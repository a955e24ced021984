# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.limits``, against the exact model."""

import pytest

from rtl.motion.limits import SoftLimits
from testbench.models import limits as model
from testbench.simulators.benches import settle


class Bench:
    """The limits and their model, each followed by the counter of an axis."""

    def __init__(self, low, high, command=0):
        self.dut = SoftLimits()
        self.model = model.SoftLimits(low, high, command)

    async def begin(self, ctx):
        for name in ("low", "high", "command"):
            ctx.set(getattr(self.dut, name), getattr(self.model, name))
        await ctx.tick().repeat(3)

    async def clock(self, ctx, pi=0, *, barred=(), clear=False):
        dut = self.dut
        ctx.set(dut.pi, pi != 0)
        ctx.set(dut.pi_reverse, pi < 0)
        ctx.set(dut.barred_low, -1 in barred)
        ctx.set(dut.barred_high, 1 in barred)
        ctx.set(dut.clear, clear)
        await settle(ctx)
        assert ctx.get(dut.passed) == self.model.clock(pi, barred=barred, clear=clear)
        await ctx.tick()
        ctx.set(dut.command, self.model.command)
        await settle(ctx)
        assert ctx.get(dut.beyond_low) == (-1 in self.model.beyond)
        assert ctx.get(dut.beyond_high) == (1 in self.model.beyond)
        assert ctx.get(dut.onto) == self.model.onto


@pytest.mark.parametrize("command", [0, 40, -40], ids=["inside", "above", "below"])
def test_follows_the_model(simulate, rng, command):
    bench = Bench(-9, 12, command)
    lowest, highest = min(-9, command), max(12, command)
    seen = set()

    async def run(ctx):
        await bench.begin(ctx)
        for clock in range(4000):
            lean = (-1, 1)[clock // 200 % 2]
            await bench.clock(ctx, rng.choice((0, 0, lean, lean, -lean)),
                              barred=rng.choice(((), (), (), (1,), (-1,), (1, -1))),
                              clear=rng.random() < 0.02)
            assert lowest <= bench.model.command <= highest
            seen.add((bench.model.command, frozenset(bench.model.beyond)))

    simulate(bench.dut, run)
    assert {(-9, frozenset({-1})), (12, frozenset({1}))} <= seen


@pytest.mark.parametrize("way", [1, -1], ids=["up", "down"])
def test_takes_every_pulse_up_to_the_limit_and_none_beyond(simulate, way):
    bench = Bench(-5, 5)

    async def run(ctx):
        await bench.begin(ctx)
        for _ in range(5):
            await bench.clock(ctx, way)
            await bench.clock(ctx)
        assert bench.model.command == 5 * way
        assert not bench.model.beyond
        await bench.clock(ctx, way)
        assert bench.model.command == 5 * way
        assert bench.model.beyond == {way}
        await bench.clock(ctx, -way)
        assert bench.model.command == 4 * way, "back is always allowed"
        assert bench.model.beyond == {way}, "told until it is cleared"
        await bench.clock(ctx, clear=True)
        assert not bench.model.beyond

    simulate(bench.dut, run)


def test_out_of_reset_nothing_moves(simulate):
    bench = Bench(0, 0)

    async def run(ctx):
        for pi in (1, 0, -1, 0):
            await bench.clock(ctx, pi)
        assert bench.model.command == 0
        assert bench.model.beyond == {1, -1}

    simulate(bench.dut, run)
