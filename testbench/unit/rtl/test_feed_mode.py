# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.feed_mode``, against the exact model."""

import pytest

from rtl.gap.feed_mode import FeedCalculator
from testbench.models import feed_mode as model
from testbench.simulators.benches import settle
from testbench.some import some

USUAL = {"rate": 1 << 24, "highest": 1 << 28, "gain": 1 << 22, "mean": 30_000, "reference": 20_000,
         "known": 1, "ratio": 4096}
SETTLED = 2 * FeedCalculator.ROUND


def put(ctx, dut, mode, inputs):
    ctx.set(dut.mode, mode)
    for name, value in inputs.items():
        ctx.set(getattr(dut, name), value)


def any_inputs(rng):
    def rate():
        return rng.choice((0, 1, model.HIGHEST, rng.randrange(1 << rng.randrange(1, 31))))

    def level():
        return rng.choice((0, 1, 65535, rng.randrange(65536)))

    near = level()
    return {"rate": rate(), "highest": rng.choice((model.HIGHEST, rate())), "gain": rate(),
            "mean": rng.choice((level(), near, max(0, near - 1), min(65535, near + 1))),
            "reference": near, "known": rng.random() < 0.8,
            "ratio": rng.choice((0, 1, 4095, 4096, 4097, level()))}


def test_follows_the_model(simulate, rng):
    dut = FeedCalculator()
    seen = {mode: set() for mode in range(4)}

    async def run(ctx):
        for _ in range(400):
            mode, inputs = rng.randrange(4), any_inputs(rng)
            put(ctx, dut, mode, inputs)
            await ctx.tick().repeat(SETTLED)
            for _ in range(rng.randrange(1, 30)):
                expected = model.feed(mode, **inputs)
                assert ctx.get(dut.feed) == expected, (mode, inputs)
                await ctx.tick()
            seen[mode].add((expected > inputs["rate"]) - (expected < inputs["rate"]))

    simulate(dut, run)
    assert seen == {0: {0}, 1: {0}, 2: {-1, 0, 1}, 3: {-1, 0, 1}}


def test_constant_feed_is_the_rate_in_the_same_clock(simulate, rng):
    dut = FeedCalculator()

    async def run(ctx):
        for _ in range(100):
            inputs = any_inputs(rng)
            put(ctx, dut, model.CONSTANT, inputs)
            await settle(ctx)
            assert ctx.get(dut.feed) == inputs["rate"]
            await ctx.tick()

    simulate(dut, run)


def test_until_the_mode_is_reckoned_the_feed_is_the_rate(simulate, rng):
    dut = FeedCalculator()

    async def run(ctx):
        for _ in range(40):
            mode, inputs = rng.choice((model.OFFSET, model.REMOVAL)), any_inputs(rng)
            put(ctx, dut, model.CONSTANT, any_inputs(rng))
            await ctx.tick().repeat(rng.randrange(1, 60))
            put(ctx, dut, mode, inputs)
            expected = model.feed(mode, **inputs)
            for _ in range(SETTLED):
                await settle(ctx)
                assert ctx.get(dut.feed) in (inputs["rate"], expected)
                await ctx.tick()
            assert ctx.get(dut.feed) == expected

    simulate(dut, run)


@pytest.mark.parametrize(("mean", "name"), some([(30_000, "down"), (10_000, "up")]))
def test_steps_come_at_the_speed_of_the_mode(simulate, mean, name):
    dut = FeedCalculator()
    inputs = USUAL | {"mean": mean}
    speed = model.speed(**{key: inputs[key] for key in ("gain", "mean", "reference", "known")})
    clocks = 40_000

    async def run(ctx):
        put(ctx, dut, model.ZERO, inputs)
        ctx.set(dut.held, 1)
        await ctx.tick().repeat(SETTLED)
        ctx.set(dut.held, 0)
        steps = {"up": 0, "down": 0}
        for _ in range(clocks):
            await ctx.tick()
            for way in steps:
                steps[way] += ctx.get(getattr(dut, way))
        assert steps.pop(name) == pytest.approx(abs(speed) * clocks / 2**32, abs=1)
        assert steps.popitem()[1] == 0
        assert ctx.get(dut.feed) == inputs["rate"]

    simulate(dut, run)


@pytest.mark.parametrize("change", [
    {"mean": 20_000}, {"known": 0}, {"held": 1}, {"gain": 0}, {"mode": model.OFFSET},
    {"mode": model.REMOVAL}, {"mode": model.CONSTANT}])
def test_no_steps_at_the_reference_nor_in_another_mode(simulate, change):
    dut = FeedCalculator()

    async def run(ctx):
        put(ctx, dut, model.ZERO, USUAL | {"gain": model.HIGHEST})
        await ctx.tick().repeat(500)
        put(ctx, dut, model.ZERO, USUAL | {"gain": model.HIGHEST} | change)
        await ctx.tick().repeat(SETTLED)
        for _ in range(1000):
            assert not ctx.get(dut.up | dut.down)
            await ctx.tick()

    simulate(dut, run)


@pytest.mark.parametrize(("name", "mean"), [("up", 0), ("down", 65535)])
def test_a_step_that_is_due_does_not_come_once_it_is_held(simulate, name, mean):
    """Held in each clock between two steps: also in that in which the next one is due."""
    dut = FeedCalculator()
    inputs = USUAL | {"mean": mean, "reference": 65535 - mean, "gain": model.HIGHEST}

    async def run(ctx):
        put(ctx, dut, model.ZERO, inputs)
        await ctx.tick().repeat(500)
        for clock in range(40):
            ctx.set(dut.held, 0)
            await ctx.tick().repeat(100 + clock)
            ctx.set(dut.held, 1)
            for _ in range(8):
                await ctx.tick()
                assert not ctx.get(getattr(dut, name))

    simulate(dut, run)


def test_mode_of_the_offset_with_the_gain_of_the_ratio_is_its_tangent(simulate):
    """With Vs = V0 - Es and K = F/Es, both modes are the same at Ex = Es, to the first order."""
    dut = FeedCalculator()
    no_load, reference, rate = 40_000, 8_000, 1 << 24
    gain = rate * 4096 // reference

    async def run(ctx):
        for drop in (7_900, 8_000, 8_100):
            inputs = USUAL | {"rate": rate, "gain": gain, "mean": no_load - drop,
                              "reference": no_load - reference,
                              "ratio": reference * 4096 // drop}
            feeds = []
            for mode in (model.OFFSET, model.REMOVAL):
                put(ctx, dut, mode, inputs)
                await ctx.tick().repeat(SETTLED)
                feeds.append(ctx.get(dut.feed) / rate)
            assert feeds[0] == pytest.approx(feeds[1], abs=((drop - 8_000) / 8_000)**2 + 1 / 4096)
            assert (feeds[0] > 1) == (drop < 8_000)

    simulate(dut, run)
