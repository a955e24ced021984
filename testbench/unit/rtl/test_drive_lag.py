# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.drive_lag``, against the exact model."""

import math

import pytest

from rtl.motion.drive_lag import SHARE_BITS, SHARE_INIT, DriveLag
from testbench.models.drive_lag import DriveLag as Model
from testbench.some import some

APART = 21      # clocks of a tick: as few as an axis has
TOLD = 16       # clocks from the tick to the speed commanded
FASTEST = (1 << 21) - 1


async def tick(ctx, dut, told, share):
    """A tick of the block; its lag at the end."""
    for clock in range(APART):
        ctx.set(dut.tick, clock == 0)
        ctx.set(dut.share, share if clock == 0 else 0)
        ctx.set(dut.tell, clock == TOLD)
        ctx.set(dut.told, told if clock == TOLD else -1)
        await ctx.tick()
    return ctx.get(dut.lag)


def test_follows_the_model(simulate, rng):
    dut, model = DriveLag(), Model()

    async def run(ctx):
        told, share = 0, SHARE_INIT
        for number in range(600):
            if rng.random() < 0.04:
                told = rng.choice((0, 1, -1, FASTEST, -FASTEST - 1,
                                   rng.randint(-FASTEST, FASTEST), rng.randint(-2000, 2000)))
            if rng.random() < 0.02:
                share = rng.choice((256, (1 << SHARE_BITS) - 1, rng.randint(256, 8191)))
            model.go(told, share)
            assert await tick(ctx, dut, told, share) == model.lag, number

    simulate(dut, run, deadline=1)


@pytest.mark.parametrize("told", some([FASTEST, -FASTEST - 1]))
def test_the_longest_lag_at_the_greatest_speed_is_in_range(simulate, told):
    dut, model = DriveLag(), Model()

    async def run(ctx):
        for _ in range(2000):
            model.go(told, 256)
            lag = await tick(ctx, dut, told, 256)
        assert lag == model.lag
        assert abs(lag) == pytest.approx(256 * 512, rel=1e-3)

    simulate(dut, run, deadline=1)


@pytest.mark.parametrize("share", some([635, 256, 512, 4194], 4194))
@pytest.mark.parametrize("told", [5000, -5000])
def test_a_lag_of_first_order_that_ends_at_rest(simulate, told, share):
    """After one time constant the way has 1 - 1/e of its end; at rest it is 0 again."""
    dut, ticks = DriveLag(), 65536 / share

    async def run(ctx):
        for _ in range(round(ticks)):
            lag = await tick(ctx, dut, told, share)
        whole = told / 4096 * ticks
        # A step of 32 us, and whole pulses.
        assert lag == pytest.approx(whole * (1 - 1 / math.e), rel=0.02, abs=1.1)
        for _ in range(round(12 * ticks)):
            lag = await tick(ctx, dut, 0, share)
        assert lag == 0

    simulate(dut, run, deadline=1)
