# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.gear``, against the exact model and by the count of steps alone."""

import pytest

from rtl.motion.gear import Gear
from testbench.models import gear as model
from testbench.models.gear import steps_of
from testbench.native import gear as native
from testbench.simulators.benches import settle

RATIOS = [(1, 1), (640, 10_000), (1, 65_536), (65_535, 65_536), (1, 2), (2, 3), (400, 30_003)]


class Bench:
    """The gear, its model and the counter that they serve; every output is compared."""

    def __init__(self, dut, ratio):
        self.dut = dut
        self.model = model.Gear()
        self.ratio = ratio
        self.held = self.taken = self.sent = 0
        self.step = 0

    async def clock(self, ctx, *, added=0, times=(1, 1, 1), safe=False, begin=False):
        dut = self.dut
        n, m = self.ratio
        for signal, value in ((dut.steps, n), (dut.surplus, m - n), (dut.clear, begin),
                              (dut.pending, self.held != 0), (dut.negative, self.held < 0),
                              (dut.safe, safe), *zip((dut.width, dut.space, dut.setup), times,
                                                     strict=True)):
            ctx.set(signal, value)
        await settle(ctx)
        pulse = self.model.pulse
        assert ctx.get(dut.fp) == abs(pulse)
        assert not pulse or ctx.get(dut.fp_reverse) == (pulse < 0)
        width, space, setup = times
        self.model.tick(self.held, width=width, space=space, setup=setup, safe=safe,
                        clear=self.ratio if begin else None)
        self.held += added - pulse
        await ctx.tick()
        step = ctx.get(dut.step)
        assert (step, ctx.get(dut.dir)) == (self.model.step_dir.step, self.model.step_dir.dir)
        if step and not self.step:
            self.sent += -1 if ctx.get(dut.dir) else 1
        self.step = step
        # The pulse of the clock to come belongs to the step that has just begun.
        self.taken += self.model.pulse
        if begin:
            self.taken = self.sent = 0
        assert self.sent == steps_of(self.taken, *self.ratio)


@pytest.mark.parametrize("ratio", [*RATIOS, None], ids=str)
def test_follows_the_model_and_sends_the_steps_of_its_count(simulate, rng, ratio):
    dut = Gear()
    m = rng.randint(1, 1 << 16)
    bench = Bench(dut, ratio or (rng.randint(1, min(m, 65_535)), m))

    async def run(ctx):
        await bench.clock(ctx, begin=True, safe=True)
        for clock in range(4000):
            lean = (1, -1, 1, 0)[clock // 300 % 4]
            await bench.clock(
                ctx, added=rng.choice((0, lean, lean, rng.choice((-1, 1)))),
                times=(rng.randrange(4), rng.randrange(4), rng.randrange(4)),
                safe=rng.random() < (0.01 if clock % 1000 < 800 else 0.5))

    simulate(dut, run)
    assert bench.taken


@pytest.mark.parametrize("ratio", [(640, 10_000), (3, 7)], ids=str)
def test_a_way_and_its_way_back_send_the_same_steps(simulate, ratio):
    """The steps at each pulse are those of that pulse, whichever way it was reached."""
    dut = Gear()
    bench = Bench(dut, ratio)

    async def run(ctx):
        await bench.clock(ctx, begin=True, safe=True)
        seen = {}
        for way in (1, -1, -1, 1):
            for _ in range(100):
                await bench.clock(ctx, added=way)
                for _ in range(6):
                    await bench.clock(ctx)
                assert not bench.held
                assert seen.setdefault(bench.taken, bench.sent) == bench.sent
        assert (bench.taken, bench.sent) == (0, 0)
        assert set(range(-100, 101)) == set(seen)

    simulate(dut, run, deadline=1e-3)


def test_a_new_gear_counts_from_its_beginning(simulate):
    dut = Gear()
    bench = Bench(dut, (1, 4))

    async def run(ctx):
        await bench.clock(ctx, begin=True, safe=True)
        for _ in range(3):      # 3/4 of a step: one, as 3/4 rounds to it
            await bench.clock(ctx, added=1)
        for _ in range(20):
            await bench.clock(ctx)
        assert (bench.taken, bench.sent) == (3, 1)
        bench.ratio = 1, 6
        await bench.clock(ctx, begin=True)
        for _ in range(3):      # from 0 again
            await bench.clock(ctx, added=1)
        for _ in range(20):
            await bench.clock(ctx)
        assert (bench.taken, bench.sent) == (3, 1)

    simulate(dut, run)


def native_run(pulses, ratios):
    for seed, (n, m) in enumerate(ratios):
        found = native.run(n=n, m=m, pulses=pulses, seed=seed)
        assert found.taken == pulses
        # A gear of few steps seldom turns: 10 million pulses are 153 steps of 1/65536.
        assert found.reversals > pulses // 10_000 * min(1, 100 * n / m)
        assert found.wrong_counts == 0, f"steps of {n}/{m}: {found.first}"
        assert found.wrong_times == 0, f"times of {n}/{m}: {found.first}"


def test_the_count_is_right_in_every_clock(rng):
    m = rng.randint(2, 1 << 16)
    native_run(100_000, [(640, 10_000), (rng.randint(1, m - 1), m)])


@pytest.mark.soak
def test_the_count_is_right_in_every_clock_over_ten_million_pulses(rng):
    ratios = [(rng.randint(1, m - 1), m) for m in (rng.randint(2, 1 << 16) for _ in range(3))]
    native_run(10_000_000, [*RATIOS, *ratios])
