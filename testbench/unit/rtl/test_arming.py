# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.safety.arming``, against the exact model."""

import pytest

from rtl.safety.arming import Arming
from testbench.models import arming as model
from testbench.simulators.benches import settle

BOUNCE, CLOSING = 3, 7  # clocks


class Bench:
    """Arming and its model side by side; the button bounces for 3 clocks, contacts close in 7."""

    def __init__(self, strapped=False):
        self.dut = Arming(clock_hz=1000, button_ms=BOUNCE, close_ms=CLOSING, strapped=strapped)
        self.model = model.Arming(BOUNCE, CLOSING, strapped)

    async def clock(self, ctx, times=1, *, arm=0, safe=0, disarm=0):
        for _ in range(times):
            for name, value in (("arm", arm), ("safe", safe), ("disarm", disarm)):
                ctx.set(getattr(self.dut, name), value)
            self.model.begin(arm, safe, disarm)
            await settle(ctx)
            assert ctx.get(self.dut.contactor) == self.model.contactor
            assert ctx.get(self.dut.armed) == self.model.armed
            self.model.end()
            await ctx.tick()


@pytest.mark.parametrize("strapped", [False, True])
def test_follows_the_model(simulate, rng, strapped):
    bench = Bench(strapped)
    armed = 0

    async def run(ctx):
        nonlocal armed
        arm = safe = 0
        for clock in range(6000):
            if rng.random() < (0.4 if clock // 50 % 3 == 0 else 0.06):
                arm = rng.randrange(2)
            if rng.random() < 0.02:
                safe = rng.random() < 0.3
            await bench.clock(ctx, arm=arm, safe=safe, disarm=rng.random() < 0.005)
            armed += bench.model.armed

    simulate(bench.dut, run)
    assert bench.model.presses > 30
    assert armed > 500


async def press(bench, ctx, **inputs):
    await bench.clock(ctx, BOUNCE, **inputs)
    await bench.clock(ctx, BOUNCE, arm=1, **inputs)
    await bench.clock(ctx, 2, **inputs)


def test_a_press_arms_when_the_contacts_have_closed(simulate):
    bench = Bench()

    async def run(ctx):
        await press(bench, ctx)
        assert ctx.get(bench.dut.contactor)
        assert not ctx.get(bench.dut.armed)
        await bench.clock(ctx, CLOSING)
        assert ctx.get(bench.dut.armed)

    simulate(bench.dut, run)


@pytest.mark.parametrize("how", ["safe", "disarm"])
def test_one_clock_disarms_until_the_next_press(simulate, how):
    bench = Bench()

    async def run(ctx):
        await press(bench, ctx)
        await bench.clock(ctx, CLOSING)
        await bench.clock(ctx, **{how: 1})
        await bench.clock(ctx, 100)
        assert not ctx.get(bench.dut.contactor)
        await press(bench, ctx)
        assert ctx.get(bench.dut.contactor)

    simulate(bench.dut, run)


@pytest.mark.parametrize("before", [dict(), dict(safe=1)])
def test_a_button_that_is_held_does_not_arm(simulate, before):
    """Neither from reset on nor from before the outputs ceased to be safe."""
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 5 * BOUNCE, arm=1, **before)
        await bench.clock(ctx, 100, arm=1)
        assert not ctx.get(bench.dut.contactor)
        await press(bench, ctx)
        assert ctx.get(bench.dut.contactor)

    simulate(bench.dut, run)


def test_a_bounce_is_no_press(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, BOUNCE)
        for _ in range(20):
            await bench.clock(ctx, BOUNCE - 1, arm=1)
            await bench.clock(ctx)
        assert not ctx.get(bench.dut.contactor)

    simulate(bench.dut, run)
