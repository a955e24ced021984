# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.fluid``, against the exact model."""

from dataclasses import replace

import pytest

from rtl.gap.fluid import FluidDetector
from testbench.models import fluid as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle
from testbench.some import some

USUAL = model.Settings()
EDGES = (0, 1, 2, 4093, 4094, 4095)


class Bench:
    """The detector and its model side by side, the settings in ``settings``."""

    def __init__(self, samples=16):
        self.dut = FluidDetector(samples=samples)
        self.model = model.FluidDetector(samples)
        self.settings = USUAL
        self.manual = (False, 0)
        self.changes = 0

    async def clock(self, ctx, sample=None, junk=0):
        dut, expected, settings = self.dut, self.model, self.settings
        manual, manual_class = self.manual
        for name, value in dict(
                zip(("threshold_0", "threshold_1", "threshold_2"), settings.thresholds,
                    strict=True), hysteresis=settings.hysteresis, lowest=settings.lowest,
                highest=settings.highest, sample=junk if sample is None else sample,
                sample_valid=sample is not None, manual=manual, manual_class=manual_class).items():
            ctx.set(getattr(dut, name), value)
        class_ = expected.class_(*self.manual)
        await settle(ctx)
        assert ctx.get(dut.class_) == class_
        assert ctx.get(dut.changed) == (class_ != expected.last)
        self.changes += class_ != expected.last
        expected.clock(sample=sample, settings=settings, manual=manual, manual_class=manual_class)
        await ctx.tick()
        for name in ("level", "measured", "known", "broken_low", "broken_high", "disordered"):
            assert ctx.get(getattr(dut, name)) == getattr(expected, name), name

    async def average(self, ctx, *codes):
        """Give the samples of one average, cycling through the codes; wait for the decision."""
        for n in range(self.model.samples):
            await self.clock(ctx, codes[n % len(codes)])
            for _ in range(9):
                await self.clock(ctx)




def any_settings(rng):
    """Settings of all kinds: sound ones, ones on the edge of order, and nonsense."""
    kind = rng.randrange(4)
    if kind == 0:
        return USUAL
    if kind == 1:
        return model.Settings(tuple(rng.choice(EDGES + (rng.randrange(4096),)) for _ in range(3)),
                              rng.choice((0, 1, 255, rng.randrange(256))),
                              rng.choice(EDGES), rng.choice(EDGES + (rng.randrange(4096),)))
    hysteresis = rng.choice((0, 1, 2, 100, 255))
    lowest = rng.choice((0, 40))
    third = lowest + hysteresis + 1 + rng.choice((-1, 0, 0, 1, 500))
    second = third + 2 * hysteresis + 1 + rng.choice((-1, 0, 0, 1, 500))
    first = second + 2 * hysteresis + 1 + rng.choice((-1, 0, 0, 1, 500))
    highest = first + hysteresis + rng.choice((-1, 0, 0, 1, 300))
    return model.Settings((first, second, third), hysteresis, lowest, max(0, highest))


@pytest.mark.parametrize("samples", some([1, 2, 16]))
def test_follows_the_model(simulate, rng, samples):
    bench = Bench(samples)
    seen = {name: set() for name in ("measured", "known", "broken_low", "broken_high",
                                     "disordered")}

    async def run(ctx):
        for _ in range(2400 // samples // 4):
            bench.settings = settings = any_settings(rng)
            near = [*settings.thresholds, settings.lowest, settings.highest]
            for _ in range(4):
                centre = rng.choice(near) + rng.choice((-1, 0, 1)) * rng.choice(
                    (0, settings.hysteresis)) + rng.randrange(-2, 3)
                if rng.random() < 0.2:
                    bench.manual = rng.random() < 0.5, rng.randrange(4)
                for _ in range(samples):
                    spread = rng.choice((0, 0, 1, 30)) if samples > 1 else 0
                    code = min(4095, max(0, centre + rng.randint(-spread, spread)))
                    await bench.clock(ctx, code)
                    for _ in range(9 + rng.choice((0, 0, 0, 5))):
                        await bench.clock(ctx, junk=rng.randrange(4096))
                for name, values in seen.items():
                    values.add(getattr(bench.model, name))

    simulate(bench.dut, run)
    assert seen["measured"] == {0, 1, 2, 3}
    assert all(seen[name] == {False, True} for name in seen if name not in ("measured", "known"))
    assert bench.changes > 20


@pytest.mark.parametrize(("resistance", "code", "expected"), [
    (1e6, 3863, 0), (1.25e5, 3224, 1), (4e4, 2300, 2), (1e3, 132, 3),
])
def test_the_fluids_of_the_patent(simulate, resistance, code, expected):
    cell = 1 / (1 / resistance + 1 / 1e6)
    assert code == pytest.approx(4095 * cell / (cell + 30e3), abs=1)
    bench = Bench()

    async def run(ctx):
        assert not ctx.get(bench.dut.known)
        await bench.average(ctx, code)
        assert ctx.get(bench.dut.known)
        assert ctx.get(bench.dut.class_) == expected
        assert bench.changes == (expected != 0), "over any number of classes at once"

    simulate(bench.dut, run)


@pytest.mark.parametrize("number", range(3))
def test_a_threshold_is_passed_by_the_hysteresis(simulate, number):
    bench = Bench(1)
    threshold = USUAL.thresholds[number]

    async def run(ctx):
        for code, expected in ((threshold + 20, number), (threshold - 20, number),
                               (threshold - 21, number + 1), (threshold + 19, number + 1),
                               (threshold + 20, number)):
            await bench.average(ctx, code)
            assert ctx.get(bench.dut.measured) == expected, code

    simulate(bench.dut, run)


@pytest.mark.parametrize("samples", some([1, 16]))
@pytest.mark.parametrize("number", range(3))
def test_noise_within_the_hysteresis_toggles_nothing(simulate, rng, samples, number):
    bench = Bench(samples)
    threshold = USUAL.thresholds[number]

    async def run(ctx):
        for start in (threshold + 300, threshold - 300):
            await bench.average(ctx, start)
            changes = bench.changes
            for _ in range(400 // samples):
                await bench.average(ctx, *(rng.randint(threshold - 20, threshold + 19)
                                           for _ in range(samples)))
            assert bench.changes == changes

    simulate(bench.dut, run)


def test_noise_toggles_without_hysteresis(simulate, rng):
    bench = Bench(1)
    bench.settings = replace(USUAL, hysteresis=0)

    async def run(ctx):
        for _ in range(100):
            await bench.average(ctx, rng.randint(2819 - 20, 2819 + 19))

    simulate(bench.dut, run)
    assert bench.changes > 20


@pytest.mark.parametrize(("code", "low", "high"), [
    (0, 1, 0), (39, 1, 0), (40, 0, 0), (4030, 0, 0), (4031, 0, 1), (4095, 0, 1),
])
def test_a_broken_cell_freezes_the_class(simulate, code, low, high):
    bench = Bench()

    async def run(ctx):
        await bench.average(ctx, code)
        assert ctx.get(bench.dut.known) == (not low | high), "a broken cell gives no class"
        await bench.average(ctx, 2300)
        assert ctx.get(bench.dut.measured) == 2
        await bench.average(ctx, code)
        assert ctx.get(bench.dut.broken_low) == low
        assert ctx.get(bench.dut.broken_high) == high
        assert ctx.get(bench.dut.level) == code
        assert (ctx.get(bench.dut.measured) == 2) == bool(low | high)
        await bench.average(ctx, 2300)
        assert not ctx.get(bench.dut.broken_low | bench.dut.broken_high)
        assert ctx.get(bench.dut.measured) == 2

    simulate(bench.dut, run)


@pytest.mark.parametrize(("settings", "ordered"), [
    (USUAL, True),
    (replace(USUAL, thresholds=(2819, 3670, 707)), False),
    (replace(USUAL, thresholds=(3670, 707, 2819)), False),
    (replace(USUAL, thresholds=(707, 2819, 3670)), False),
    (replace(USUAL, thresholds=(3670, 3670, 707)), False),
    (replace(USUAL, lowest=4030, highest=40), False),
    (replace(USUAL, highest=3690), True),              # class 0 from 3690 up
    (replace(USUAL, highest=3689), False),
    (replace(USUAL, lowest=686), True),                # class 3 below 687
    (replace(USUAL, lowest=687), False),
    (replace(USUAL, thresholds=(2860, 2819, 707)), True),   # class 1 at 2839
    (replace(USUAL, thresholds=(2859, 2819, 707)), False),
    (replace(USUAL, thresholds=(3670, 748, 707)), True),
    (replace(USUAL, thresholds=(3670, 747, 707)), False),
    (model.Settings((4095, 2, 1), 255, 0, 4095), False),    # both ends would wrap
    (model.Settings((4000, 2000, 100), 100, 0, 4095), False),
    (model.Settings((4000, 2000, 100), 255, 0, 4095), False),
    (model.Settings((4095, 2, 1), 0, 0, 4095), True),
])
def test_settings_out_of_order_freeze_the_class(simulate, settings, ordered):
    bench = Bench(1)

    async def run(ctx):
        for code in (0, 1, 2, 100, 687, 2839, 3000, 3689, 4000, 4095):
            bench.settings = USUAL
            await bench.average(ctx, 2300)
            bench.settings = settings
            await bench.average(ctx, code)
            assert ctx.get(bench.dut.disordered) == (not ordered)
            if not ordered:
                assert ctx.get(bench.dut.measured) == 2

    simulate(bench.dut, run)


def test_the_hand_overrides_and_the_measured_class_stays_on_show(simulate):
    bench = Bench(1)

    async def run(ctx):
        bench.manual = True, 3
        await bench.clock(ctx)
        assert ctx.get(bench.dut.class_) == 3, "also before the first average"
        assert not ctx.get(bench.dut.known)
        await bench.average(ctx, 3224)
        assert ctx.get(bench.dut.class_) == 3
        assert ctx.get(bench.dut.measured) == 1
        bench.manual = True, 0
        await bench.clock(ctx)
        assert ctx.get(bench.dut.class_) == 0
        bench.manual = False, 0
        await bench.clock(ctx)
        assert ctx.get(bench.dut.class_) == 1
        assert bench.changes == 3

    simulate(bench.dut, run)


def test_extremes_do_not_overflow_the_average(simulate):
    bench = Bench(64)

    async def run(ctx):
        for code in (4095, 0, 4095):
            await bench.average(ctx, code)
            assert ctx.get(bench.dut.level) == code
        await bench.average(ctx, *range(64))
        assert ctx.get(bench.dut.level) == 31, "31.5 is rounded down"

    simulate(bench.dut, run)


@pytest.mark.parametrize("samples", [0, -1, 3, 12])
def test_refuses_samples_that_are_no_power_of_two(samples):
    refuses(FluidDetector, rf"^samples must be a power of two, not {samples}$", samples=samples)
