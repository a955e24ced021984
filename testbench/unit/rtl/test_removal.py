# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.removal``, against the exact model."""

from dataclasses import asdict, replace

import pytest

from rtl.gap.removal import RemovalDetector
from testbench.models import removal as model

USUAL = model.Settings()
OUTPUTS = ("mean", "drop", "ratio", "known", "windows")


class Bench:
    """The detector and its model side by side."""

    def __init__(self, settings=USUAL):
        self.dut = RemovalDetector()
        self.model = model.RemovalDetector()
        self.settings = settings
        self.on, self.discard, self.hold = True, False, False

    async def clock(self, ctx, sample=None, pulse=0, junk=0, burning=False):
        inputs = {"on": self.on, "discard": self.discard, "hold": self.hold}
        for name, value in (inputs | asdict(self.settings)).items():
            ctx.set(getattr(self.dut, name), value)
        ctx.set(self.dut.sample, junk if sample is None else sample)
        ctx.set(self.dut.sample_valid, sample is not None)
        ctx.set(self.dut.pulse, pulse)
        ctx.set(self.dut.burning, burning)
        self.model.clock(sample=sample, pulse=pulse, burning=burning, settings=self.settings,
                         **inputs)
        await ctx.tick()
        for name in OUTPUTS:
            assert ctx.get(getattr(self.dut, name)) == getattr(self.model, name), name

    async def go(self, ctx, pulses, code, *, every=10, samples=4):
        """Go so many path pulses at a constant gap voltage, a pulse each ``every`` clocks."""
        for n in range(pulses * every):
            await self.clock(ctx, code if n % samples == 0 else None, n % every == every - 1)

    async def settle(self, ctx):
        """Wait until the last window has been computed."""
        for _ in range(model.RATIO + 1):
            await self.clock(ctx)


def any_settings(rng):
    def level():
        return rng.choice((0, 1, 65535, rng.randrange(65536), rng.randrange(65536)))

    return model.Settings(
        unit=rng.choice((0, 1, 2, rng.randrange(40))),
        window=rng.choice((0, 1, 76, rng.randrange(400))),
        no_load=level(), reference=level(), least=rng.choice((0, 1, 500, level())),
        ratio_min=rng.choice((0, 1, 1024, level())),
        ratio_max=rng.choice((0, 4096, 65535, level())),
        shares=rng.random() < 0.5, share=level(),
        rate=rng.choice((0, 1, 2**30 - 1, rng.randrange(2**30), 4_000_000)))


def test_follows_the_model(simulate, rng):
    bench = Bench()
    ratios, windows, by_share, longest = set(), set(), set(), 0

    async def run(ctx):
        nonlocal longest
        for _ in range(150):
            bench.settings = rng.choice((USUAL, any_settings(rng)))
            level, spread = rng.randrange(4096), rng.choice((0, 100, 4095))
            dense, pace = rng.choice((0, 0.02, 0.2, 1)), rng.choice((0, 0.05, 0.3))
            bench.on = rng.random() < 0.97
            for _ in range(rng.randrange(400)):
                if rng.random() < 0.03:
                    bench.discard = rng.random() < 0.2
                    bench.hold = rng.random() < 0.2
                code = min(4095, max(0, level + rng.randint(-spread, spread)))
                await bench.clock(ctx, code if rng.random() < dense else None,
                                  rng.random() < pace, junk=rng.randrange(4096),
                                  burning=rng.random() < dense)
                by_share.add(bench.model.closed_way)
                ratios.add(bench.model.ratio)
                windows.add(bench.model.windows)
                longest = max(longest, len(bench.model.samples))

    simulate(bench.dut, run)
    assert len(ratios) > 20
    assert len(windows) > 50
    assert len(by_share) > 20
    assert longest > 200


def test_extremes_and_order_of_the_settings(simulate):
    """Every pair of extreme levels, each pair in its own window."""
    bench = Bench()

    async def run(ctx):
        for code in (0, 1, 4095):
            for no_load in (0, 16, 65535):
                for reference in (0, 1, 65535):
                    for least in (0, 1, 65535):
                        bench.settings = model.Settings(1, 0, no_load, reference, least, 3, 60000)
                        await bench.clock(ctx, code, 1)
                        await bench.settle(ctx)
        assert bench.model.windows == 81
        for low, high, ratio in ((5000, 4000, 4000), (0, 0, 0), (65535, 65535, 65535)):
            bench.settings = replace(USUAL, unit=1, ratio_min=low, ratio_max=high)
            await bench.clock(ctx, 2000, 1)
            await bench.settle(ctx)
            assert ctx.get(bench.dut.ratio) == ratio

    simulate(bench.dut, run)


def test_a_unit_distance_gives_the_ratio(simulate):
    """The ratio is Es over the drop of the mean; on- and off-time count alike."""
    bench = Bench()

    async def run(ctx):
        await bench.go(ctx, 19, 3000)
        assert ctx.get(bench.dut.ratio) == model.UNITY, "nothing is known yet"
        assert not ctx.get(bench.dut.known)
        await bench.go(ctx, 1, 3000)
        await bench.settle(ctx)
        assert not ctx.get(bench.dut.drop) > 400, "no load is 2500: no discharge at all"
        assert ctx.get(bench.dut.ratio) == 16384, "the bound of Es/Ex"
        bench.discard = True
        await bench.clock(ctx)
        bench.discard = False
        for n in range(200):  # a third on at 3000, two thirds off
            await bench.clock(ctx, 3000 if n % 30 < 10 else 0, n % 10 == 9)
        await bench.settle(ctx)
        mean = 16 * 3000 * 70 // 200
        assert ctx.get(bench.dut.mean) == mean
        assert ctx.get(bench.dut.drop) == 40000 - mean
        assert ctx.get(bench.dut.ratio) == 8000 * 4096 // (40000 - mean)

    simulate(bench.dut, run)


def test_without_a_way_the_time_ends_a_window(simulate):
    bench = Bench(replace(USUAL, window=1000))

    async def run(ctx):
        await bench.clock(ctx, 0, 1)
        for window in range(3):
            assert ctx.get(bench.dut.windows) == window
            for n in range(1000):
                await bench.clock(ctx, 1000 if n % 20 == 0 else None)
            await bench.settle(ctx)
            assert ctx.get(bench.dut.windows) == window + 1
            bench.discard = True
            await bench.clock(ctx)
            bench.discard = False
        assert ctx.get(bench.dut.ratio) == 8000 * 4096 // 24000

    simulate(bench.dut, run)


def test_a_short_discards_the_window_and_keeps_the_ratio(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.go(ctx, 20, 1500)
        await bench.settle(ctx)
        ratio = ctx.get(bench.dut.ratio)
        assert ratio == 8000 * 4096 // 16000
        await bench.go(ctx, 19, 0)
        bench.discard = True
        await bench.go(ctx, 30, 0)
        assert ctx.get(bench.dut.ratio) == ratio
        bench.discard = False
        await bench.go(ctx, 19, 2000)
        await bench.settle(ctx)
        assert ctx.get(bench.dut.ratio) == ratio, "the distance began anew"
        await bench.go(ctx, 1, 2000)
        await bench.settle(ctx)
        assert ctx.get(bench.dut.ratio) == 4096, "nothing of the short is in it"

    simulate(bench.dut, run)


def test_hold_stops_the_window_and_keeps_it(simulate):
    bench = Bench(replace(USUAL, window=5000))

    async def run(ctx):
        await bench.go(ctx, 15, 2000)
        bench.hold = True
        await bench.go(ctx, 600, 0)
        assert ctx.get(bench.dut.windows) == 0
        bench.hold = False
        await bench.go(ctx, 5, 2000)
        await bench.settle(ctx)
        assert ctx.get(bench.dut.windows) == 1
        assert ctx.get(bench.dut.mean) == 32000

    simulate(bench.dut, run)


def test_off_forgets(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.go(ctx, 30, 1000)
        assert ctx.get(bench.dut.known)
        assert ctx.get(bench.dut.ratio) != model.UNITY
        bench.on = False
        await bench.clock(ctx)
        assert not ctx.get(bench.dut.known)
        assert ctx.get(bench.dut.ratio) == model.UNITY
        bench.on = True
        await bench.go(ctx, 19, 1000)
        assert ctx.get(bench.dut.ratio) == model.UNITY

    simulate(bench.dut, run)


@pytest.mark.parametrize("samples", [3, 40])
def test_the_mean_over_time_is_exact_to_a_sixteenth_of_a_code(simulate, rng, samples):
    bench = Bench(model.Settings(unit=0, window=samples * 34))

    async def run(ctx):
        codes = []
        for _ in range(4 * samples):
            codes.append(rng.randrange(4096))
            await bench.clock(ctx, codes[-1])
            for _ in range(33):
                await bench.clock(ctx)
        await bench.settle(ctx)
        last = codes[-samples:]
        assert abs(ctx.get(bench.dut.mean) / 16 - sum(last) / samples) < 1 / 16

    simulate(bench.dut, run)


def test_discharge_per_distance_gives_the_ratio_whatever_the_feed(simulate):
    """Twice the discharge on the same way halves the ratio; pauses and voltage change nothing."""
    bench = Bench(replace(USUAL, shares=True, share=600, least=1, rate=1 << 24))

    async def run(ctx):
        for every, clocks, junk in ((50, 2, 0), (50, 4, 4095), (110, 4, 0), (110, 2, 900)):
            bench.discard = True
            await bench.clock(ctx)
            bench.discard = False
            for n in range(20 * every):
                await bench.clock(ctx, junk, n % every == every - 1, burning=n % every < clocks)
            await bench.settle(ctx)
            # A clock with discharge is 2**-8 pulse at the feed F.
            assert ctx.get(bench.dut.drop) == clocks * 2**16 // 2**8
            assert ctx.get(bench.dut.ratio) == 600 * 4096 // (clocks * 2**8)
            assert ctx.get(bench.dut.mean) == 0

    simulate(bench.dut, run)


def test_a_stand_with_and_without_discharge(simulate):
    """Time ends the window: no way counts as one pulse, and no discharge as ``least``."""
    bench = Bench(replace(USUAL, shares=True, window=300, least=7, rate=1 << 24))

    async def run(ctx):
        for burning, drop in ((False, 7), (True, 65535)):
            bench.discard = True
            await bench.clock(ctx)
            bench.discard = False
            for _ in range(400):
                await bench.clock(ctx, burning=burning)
            assert ctx.get(bench.dut.drop) == drop
        bench.settings = replace(bench.settings, unit=0, window=65536 * 4, rate=2**30 - 1)
        bench.discard = True
        await bench.clock(ctx, burning=True)
        bench.discard = False
        # The way with discharge ends at 2**16 pulses: it does not wrap.
        bench.model.way = 2**48 - 2**31
        ctx.set(bench.dut.total, 2**48 - 2**31)
        for _ in range(3):
            await bench.clock(ctx, burning=True)
        bench.settings = replace(bench.settings, window=1)
        await bench.clock(ctx, burning=True)
        await bench.settle(ctx)
        assert ctx.get(bench.dut.drop) == 65535

    simulate(bench.dut, run)
