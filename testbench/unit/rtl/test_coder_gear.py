# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.coder_gear``, against the exact model and by the count alone."""

import pytest

from rtl.motion.coder_gear import CoderGear
from testbench.models import coder_gear as model
from testbench.models.coder_gear import pulses_of
from testbench.simulators.benches import settle

# Coders of 0.5, 1, 2 and 0.3175 um an edge, and others.
RATIOS = [(1, 5), (1, 10), (1, 20), (40, 127), (999, 1000), (3, 7), (1, 65_536), (65_535, 65_536)]


class Bench:
    """The gear and its model; every output is compared."""

    def __init__(self, dut, ratio):
        self.dut, self.ratio = dut, ratio
        self.model = model.CoderGear()
        self.pulses = 0

    async def clock(self, ctx, edge=0, *, begin=False, forget=False):
        dut, (n, m) = self.dut, self.ratio
        for signal, value in ((dut.steps, n), (dut.surplus, m - n), (dut.clear, begin),
                              (dut.edge, edge != 0), (dut.edge_reverse, edge < 0),
                              (dut.forget, forget)):
            ctx.set(signal, value)
        self.model.tick(edge, clear=self.ratio if begin else None, forget=forget)
        await ctx.tick()
        await settle(ctx)
        pulse = self.model.pulse
        assert ctx.get(dut.fp) == abs(pulse)
        assert not pulse or ctx.get(dut.fp_reverse) == (pulse < 0)
        assert ctx.get(dut.lost) == self.model.lost
        assert not ctx.get(dut.damaged)
        self.pulses = 0 if begin else self.pulses + pulse


@pytest.mark.parametrize("ratio", [*RATIOS, None], ids=str)
def test_follows_the_model(simulate, rng, ratio):
    m = rng.randint(2, 1 << 16)
    dut = CoderGear()
    bench = Bench(dut, ratio or (rng.randint(1, min(m - 1, 65_535)), m))
    spread = set()

    async def run(ctx):
        await bench.clock(ctx, begin=True)
        for clock in range(4000):
            lean = (1, -1, 1, 0)[clock // 300 % 4]
            busy = rng.random() < (0.3 if clock % 1000 < 800 else 0.02)
            await bench.clock(ctx, rng.choice((lean, lean, rng.choice((-1, 1)))) if busy else 0,
                              begin=rng.random() < 0.001, forget=rng.random() < 0.01)
            spread.add(bench.model.lost)

    simulate(dut, run)
    assert ratio is None or (True in spread) == (ratio == (1, 65_536))


@pytest.mark.parametrize("ratio", RATIOS[:6], ids=str)
def test_an_edge_has_the_same_place_from_both_sides(simulate, rng, ratio):
    """After any way, the pulses are those of the edges."""
    n, m = ratio
    dut = CoderGear()
    bench = Bench(dut, ratio)

    async def run(ctx):
        await bench.clock(ctx, begin=True)
        edges = 0
        for _ in range(300):
            way = rng.choice((-1, 1)) if rng.random() < 0.3 else (1 if edges < 5 else -1)
            edges += way
            await bench.clock(ctx, way)
            for _ in range(m // n + 2):
                await bench.clock(ctx)
            assert bench.pulses == pulses_of(edges, n, m)
        assert not bench.model.lost

    simulate(dut, run, deadline=2e-2)


@pytest.mark.parametrize("wrong", ["rest", "parity"])
def test_a_bit_that_turns_over_is_found(simulate, wrong):
    """``damaged`` rises, and stays until the gear begins anew."""
    dut = CoderGear()
    bench = Bench(dut, (3, 7))

    async def run(ctx):
        await bench.clock(ctx, begin=True)
        for clock in range(40):
            await bench.clock(ctx, clock % 8 == 0)
        signal = getattr(dut, wrong)
        ctx.set(signal, ctx.get(signal) ^ 1)
        await ctx.tick().repeat(2)
        assert ctx.get(dut.damaged)
        ctx.set(dut.edge, 1)
        await ctx.tick()
        ctx.set(dut.edge, 0)
        await ctx.tick().repeat(10)
        assert ctx.get(dut.damaged)
        ctx.set(dut.clear, 1)
        await ctx.tick().repeat(2)
        assert not ctx.get(dut.damaged)

    simulate(dut, run)
