# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.short``, against the exact model."""

import pytest

from rtl.gap.short import ShortDetector
from testbench.models import short as model

QUIET = dict(sample=0, sample_shorted=0, shorted_now=0, restart=0, needed=4, window=5, duration=0,
             clear_needed=3, by_mean=0, mean_low=0)


class Bench:
    """The detector and its model side by side."""

    def __init__(self):
        self.dut = ShortDetector()
        self.model = model.ShortDetector()
        self.rises = 0

    async def clock(self, ctx, **inputs):
        dut = self.dut
        inputs = QUIET | inputs
        for name, value in inputs.items():
            ctx.set(getattr(dut, name), value)
        self.model.clock(**inputs)
        await ctx.tick()
        assert ctx.get(dut.shorted) == self.model.shorted
        assert ctx.get(dut.completed) == self.model.completed
        self.rises += self.model.completed

    async def samples(self, ctx, text, **settings):
        """Give samples, ``s`` shorted and ``c`` clear, some clocks apart."""
        for letter in text:
            await self.clock(ctx, sample=1, sample_shorted=letter == "s", **settings)
            await self.clock(ctx, **settings)


@pytest.mark.parametrize("part", range(4))
def test_follows_the_model(simulate, rng, part):
    bench = Bench()

    async def run(ctx):
        for _ in range(60):
            window = rng.choice((0, 1, 2, 5, 31, 32, 33, 63, rng.randrange(64)))
            settings = dict(
                window=window, clear_needed=rng.choice((0, 1, 2, 3, 7)),
                needed=rng.choice((0, 1, window - 1, window, window + 1, rng.randrange(64))) % 64,
                duration=rng.choice((0, 0, 1, 2, 9, 30)), by_mean=rng.random() < 0.3)
            likely = rng.choice((0.1, 0.5, 0.8, 0.95))
            for _ in range(40):
                sample = rng.random() < 0.6
                await bench.clock(ctx, sample=sample, sample_shorted=rng.random() < likely,
                                  shorted_now=not sample and rng.random() < likely,
                                  mean_low=rng.random() < 0.1, restart=rng.random() < 0.01,
                                  **settings)

    simulate(bench.dut, run)
    assert bench.rises > 20


def test_a_changed_window_starts_over(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.samples(ctx, "sss", needed=4, window=5)
        await bench.clock(ctx, needed=4, window=6)
        await bench.samples(ctx, "sss", needed=4, window=6)
        assert not ctx.get(bench.dut.shorted)
        await bench.samples(ctx, "s", needed=4, window=6)
        assert ctx.get(bench.dut.shorted)

    simulate(bench.dut, run)


def test_ratio_of_the_last_pulses(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.samples(ctx, "sscscssc")
        assert not bench.model.shorted, "never 4 of the last 5"
        await bench.samples(ctx, "ss")
        assert bench.model.shorted

    simulate(bench.dut, run)


@pytest.mark.parametrize(("needed", "window", "before"), [
    (0, 5, 0), (1, 1, 0), (0, 0, 0), (63, 0, 0),       # the first shorted sample
    (5, 5, 4), (6, 5, 4), (63, 5, 4),                  # all of the window
    (32, 32, 31), (33, 32, 31), (63, 63, 31), (32, 63, 31),
])
def test_edges_of_the_ratio(simulate, needed, window, before):
    bench = Bench()
    settings = dict(needed=needed, window=window)

    async def run(ctx):
        await bench.clock(ctx, **settings)
        await bench.samples(ctx, "s" * before, **settings)
        assert not ctx.get(bench.dut.shorted)
        await bench.clock(ctx, sample=1, sample_shorted=1, **settings)
        assert ctx.get(bench.dut.shorted), "1 clock after the sample"
        assert ctx.get(bench.dut.completed)
        await bench.clock(ctx, **settings)
        assert not ctx.get(bench.dut.completed)

    simulate(bench.dut, run)


def test_duration_counts_over_pauses_up_to_a_clear_sample(simulate):
    bench = Bench()
    settings = dict(needed=32, window=32, duration=6)

    async def run(ctx):
        for _ in range(2):
            for _ in range(5):
                await bench.clock(ctx, shorted_now=1, **settings)
            await bench.samples(ctx, "c", **settings)
        for _ in range(5):
            await bench.clock(ctx, shorted_now=1, **settings)
            await bench.clock(ctx, **settings)
        assert not ctx.get(bench.dut.shorted)
        await bench.clock(ctx, shorted_now=1, **settings)
        assert ctx.get(bench.dut.shorted), "1 clock after the sixth"

    simulate(bench.dut, run)


def test_duration_count_does_not_wrap(simulate):
    dut = ShortDetector()

    async def bench(ctx):
        for name, value in (QUIET | dict(duration=0, shorted_now=1)).items():
            ctx.set(getattr(dut, name), value)
        ctx.set(dut.held, (1 << 24) - 50)
        await ctx.tick().repeat(100)
        assert not ctx.get(dut.shorted), "0 is never"
        ctx.set(dut.duration, 1000)
        await ctx.tick()
        assert ctx.get(dut.shorted)

    simulate(dut, bench)


def test_clear_samples_in_a_row_end_it_and_all_is_forgotten(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx)
        await bench.samples(ctx, "ssss" + "ccs" + "cc")
        assert ctx.get(bench.dut.shorted)
        await bench.clock(ctx, sample=1)
        assert not ctx.get(bench.dut.shorted), "1 clock after the third in a row"
        await bench.samples(ctx, "sss")
        assert not ctx.get(bench.dut.shorted), "the old samples are gone"
        await bench.samples(ctx, "s")
        assert ctx.get(bench.dut.shorted)
        await bench.clock(ctx, restart=1, sample=1, sample_shorted=1)
        assert not ctx.get(bench.dut.shorted)

    simulate(bench.dut, run)


def test_by_the_mean_it_rises_by_that_alone_and_ends_by_samples(simulate):
    bench = Bench()
    settings = dict(by_mean=1, duration=2)

    async def run(ctx):
        await bench.samples(ctx, "ssssssss", **settings)
        for _ in range(4):
            await bench.clock(ctx, shorted_now=1, **settings)
        assert not ctx.get(bench.dut.shorted)
        await bench.clock(ctx, mean_low=1, **settings)
        assert ctx.get(bench.dut.shorted)
        assert ctx.get(bench.dut.completed)
        await bench.samples(ctx, "ccscc", **settings)
        assert ctx.get(bench.dut.shorted)
        await bench.samples(ctx, "c", **settings)
        assert not ctx.get(bench.dut.shorted), "the third clear sample in a row"
        await bench.clock(ctx, mean_low=1, by_mean=0)
        assert not ctx.get(bench.dut.shorted), "it is not chosen"

    simulate(bench.dut, run)
