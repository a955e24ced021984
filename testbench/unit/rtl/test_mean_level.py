# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.mean_level``, against the exact model."""

from rtl.gap.mean_level import MeanLevel
from testbench.models import mean_level as model


class Bench:
    """The block and its model side by side."""

    def __init__(self):
        self.dut = MeanLevel()
        self.model = model.MeanLevel()
        self.lows = 0

    async def clock(self, ctx, sample=None, pulse=1, on=1, level=500, window=20, junk=0):
        dut = self.dut
        for name, value in (("pulse", pulse), ("on", on), ("level", level), ("window", window),
                            ("sample", junk if sample is None else sample),
                            ("sample_valid", sample is not None)):
            ctx.set(getattr(dut, name), value)
        self.model.clock(sample=sample, pulse=pulse, on=on, level=level, window=window)
        await ctx.tick()
        assert ctx.get(dut.low) == self.model.low
        self.lows += self.model.low


def test_follows_the_model(simulate, rng):
    bench = Bench()

    async def run(ctx):
        for _ in range(150):
            level = rng.choice((0, 1, 4095, rng.randrange(4096)))
            window = rng.choice((0, 1, 2, 3, rng.randrange(60)))
            near, spread = rng.choice((level, rng.randrange(4096))), rng.choice((0, 1, 30, 4095))
            dense, pulses = rng.choice((0, 0.1, 0.5, 1)), rng.choice((0, 0.05, 0.5))
            for _ in range(rng.randrange(120)):
                code = min(4095, max(0, near + rng.randint(-spread, spread)))
                await bench.clock(ctx, code if rng.random() < dense else None,
                                  rng.random() < pulses, rng.random() < 0.99, level, window,
                                  rng.randrange(4096))

    simulate(bench.dut, run)
    assert bench.lows > 50
    assert bench.model.judged - bench.lows > 50


def test_the_mean_is_judged_not_a_sample(simulate):
    """499 and 501 are a mean of 500, which is not below 500; 499 and 500 are below."""
    bench = Bench()

    async def run(ctx):
        for code, low in ((501, False), (500, True), (4095, False), (0, True)):
            for n in range(20):
                await bench.clock(ctx, 499 if n % 2 else code)
            assert ctx.get(bench.dut.low) == low

    simulate(bench.dut, run)


def test_no_short_while_pulses_stop(simulate):
    bench = Bench()

    async def run(ctx):
        for _ in range(200):
            await bench.clock(ctx, 0, pulse=0)
        for n in range(200):                        # the window in which they stop is dropped
            await bench.clock(ctx, 0, on=n % 20 != 19)
        assert bench.lows == 0
        for _ in range(20):
            await bench.clock(ctx, 0)
        assert ctx.get(bench.dut.low)

    simulate(bench.dut, run)
