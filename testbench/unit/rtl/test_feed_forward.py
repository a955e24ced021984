# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.feed_forward``, against the exact model and against plain numbers."""

import math

import pytest

from rtl.motion.feed_forward import FeedForward
from testbench.models import feed_forward as model
from testbench.models.feed_forward import Words
from testbench.refusal import refuses
from testbench.some import some

ROUND = FeedForward.ROUND
LAG = 40_000   # clocks: K = 50 1/s at 2 MHz


class Bench:
    """Block and model side by side."""

    def __init__(self, axes=3):
        self.dut = FeedForward(axes=axes)
        self.model = model.FeedForward(axes=axes)

    def put(self, ctx, words):
        dut = self.dut
        for axis, travel in enumerate(words.travel[:dut.axes]):
            ctx.set(dut.travel[axis].magnitude, abs(travel))
            ctx.set(dut.travel[axis].negative, travel < 0)
        for name in ("length", "arc", "major", "minor", "divisor", "pace", "along", "across"):
            ctx.set(getattr(dut, name), getattr(words, name))

    async def tick(self, ctx, words, *, rate, reverse=False, lead=LAG, ready=True):
        dut = self.dut
        self.put(ctx, words)
        for port, value in ((dut.rate, rate), (dut.reverse, reverse), (dut.lead, lead),
                            (dut.ready, ready)):
            ctx.set(port, value)
        await ctx.tick()
        self.model.tick(words, rate=rate, reverse=reverse, lead=lead, ready=ready)
        assert self.speeds(ctx) == self.model.speed[:dut.axes]

    def speeds(self, ctx):
        return [ctx.get(speed) for speed in self.dut.speed]


def any_words(rng, axes=3):
    """A segment: an arc with any place on it, or a line; often with values at their ends."""
    top = 1 << rng.choice((1, 8, 20, 30))
    length = rng.choice((1, top - 1, rng.randrange(1, top)))
    travel = tuple(rng.choice((0, 1, length, rng.randint(0, length))) * rng.choice((-1, 1))
                   for _ in range(axes))
    arc = axes > 1 and rng.random() < 0.5
    major = rng.randrange(min(axes, 3))
    minor = rng.choice([axis for axis in range(axes) if axis != major]) if axes > 1 else 1
    divisor = rng.choice((1, top - 1, rng.randrange(1, top)))
    across = rng.choice((0, 1, -1, -(1 << 31), rng.randrange(-(1 << 31), 1 << 31)))
    return Words(length=length, travel=travel, arc=arc, major=major, minor=minor, divisor=divisor,
                 pace=rng.choice((0, divisor, rng.randint(0, divisor), (1 << 32) - 1)),
                 along=rng.choice((0, across, rng.randint(-abs(across), abs(across)),
                                   rng.randrange(-(1 << 33), 1 << 33))),
                 across=across)


@pytest.mark.parametrize("axes", some([3, 2, 1]))
def test_follows_the_model(simulate, rng, axes):
    bench = Bench(axes)
    seen = set()

    async def run(ctx):
        lead = 0
        for _ in range(150):
            words = any_words(rng, axes)
            rate = rng.choice((0, 1, (1 << 30) - 1, rng.randrange(1 << 24), rng.randrange(1 << 30)))
            reverse = rng.random() < 0.5
            if rng.random() < 0.5:
                lead = rng.choice((0, 1, LAG, LAG, (1 << 27) - 1, rng.randrange(1 << 20)))
            for clock in range(rng.choice((1, ROUND, ROUND + 9, 2 * ROUND))):
                # A fetch now and then, in which the segment changes; a stop of one clock.
                fetches = rng.random() < 0.004
                if fetches:
                    words = any_words(rng, axes)
                stops = clock and rng.random() < 0.002
                await bench.tick(ctx, words, rate=0 if stops else rate, reverse=reverse, lead=lead,
                                 ready=not fetches and rng.random() > 0.001)
                seen.update(bench.speeds(ctx))

    simulate(bench.dut, run)
    assert {32767, -32767, 0} <= seen
    assert len(seen) > 12


async def after_a_round(bench, ctx, words, **options):
    """Speeds at the end of a whole round from rest on."""
    await bench.tick(ctx, words, **options | {"rate": 0})
    for _ in range(ROUND + 2):
        await bench.tick(ctx, words, **options)
    return bench.speeds(ctx)


def test_is_the_lag_of_the_plain_loop_on_a_line(simulate, rng):
    bench = Bench()

    async def run(ctx):
        for _ in range(20):
            travel = tuple(rng.randint(-40_000, 40_000) for _ in range(3))
            length = math.isqrt(sum(part * part for part in travel)) + 1
            rate = rng.randrange(1 << 18, 1 << 28)
            reverse = rng.random() < 0.5
            words = Words(length=length, travel=travel)
            found = await after_a_round(bench, ctx, words, rate=rate, reverse=reverse)
            for speed, part in zip(found, travel, strict=True):
                lag = rate / 2**32 * part / length * LAG * (-1 if reverse else 1)
                assert abs(speed - lag) <= 0.75 + abs(lag) / 2**15

    simulate(bench.dut, run)


@pytest.mark.parametrize("reverse", [False, True])
def test_is_the_tangent_on_an_arc(simulate, rng, reverse):
    bench = Bench()

    async def run(ctx):
        for _ in range(20):
            # A point of an octant: X is the faster axis, the centre lies below.
            slope, radius = rng.uniform(0.001, math.pi / 4), rng.randrange(1000, 1_000_000)
            x, y = round(radius * math.sin(slope)), round(radius * math.cos(slope))
            divisor, rate = 1 << 24, rng.randrange(1 << 20, 1 << 28)
            words = Words(arc=True, major=0, minor=2, length=1000, travel=(500, 100, -200),
                          divisor=divisor, pace=round(math.cos(slope) * divisor),
                          along=128 * x, across=-128 * y)
            found = await after_a_round(bench, ctx, words, rate=rate, reverse=reverse)
            path = rate / 2**32 * LAG * (-1 if reverse else 1)
            for speed, share in zip(found, (math.cos(slope), 0.1, -math.sin(slope)), strict=True):
                assert abs(speed - path * share) <= 1 + abs(path) / 2**12 + abs(path) / radius * 2

    simulate(bench.dut, run)


def test_is_zero_at_rest_and_changes_its_lead_there_only(simulate):
    bench = Bench()
    words = Words(length=10, travel=(10, -5, 0))

    async def run(ctx):
        moving = dict(rate=1 << 24)
        found = await after_a_round(bench, ctx, words, **moving)
        assert found == [156, -78, 0]
        for _ in range(2 * ROUND):
            await bench.tick(ctx, words, lead=2 * LAG, **moving)
            assert bench.speeds(ctx) == found
        await bench.tick(ctx, words, lead=2 * LAG, rate=0)
        assert bench.speeds(ctx) == [0, 0, 0]
        assert await after_a_round(bench, ctx, words, lead=2 * LAG, **moving) == [313, -156, 0]
        assert await after_a_round(bench, ctx, words, lead=0, **moving) == [0, 0, 0]

    simulate(bench.dut, run)


@pytest.mark.parametrize("axes", [0, 4])
def test_refuses_a_number_of_axes(axes):
    refuses(FeedForward, "1 to 3 axes", axes=axes)
