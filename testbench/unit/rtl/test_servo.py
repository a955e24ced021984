# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.servo`` against its contract."""

import pytest

from rtl.motion.servo import Servo
from testbench.simulators.benches import settle
from testbench.some import some

SPAN = 1 << 32


def wrapped(value):
    """As a signed coordinate of 32 bits."""
    return (value + SPAN // 2) % SPAN - SPAN // 2


@pytest.mark.parametrize("around", some([0, SPAN // 2, -SPAN // 4], 0, SPAN // 2))
def test_goal_is_a_step_from_the_command(simulate, rng, around):
    """Also where coordinates wrap, and with both strobes at once: then the gap is widened."""
    dut = Servo()
    seen = set()

    async def bench(ctx):
        goal, back = 0, 0
        for _ in range(600):
            on, up, down = (rng.random() < share for share in (0.8, 0.4, 0.4))
            step = rng.choice((0, 1, 7, 65_535, rng.getrandbits(16)))
            command = wrapped(around + rng.randint(-100_000, 100_000))
            lowest = wrapped(command - rng.choice((0, 1, step - 1, step, step + 1, 90_000)))
            for port, value in ((dut.on, on), (dut.up, up), (dut.down, down), (dut.step, step),
                                (dut.command, command), (dut.lowest, lowest)):
                ctx.set(port, value)
            await settle(ctx)
            assert (ctx.get(dut.goal), ctx.get(dut.back)) == (goal, back)
            refused = on and up and wrapped(command - step - lowest) < 0
            assert ctx.get(dut.refused) == refused
            seen.add((on, up, down, refused))
            if not on:
                goal, back = command, 0
            elif up:
                goal, back = wrapped(command - step), 1
            elif down:
                goal, back = wrapped(command + step), 0
            await ctx.tick()

    simulate(dut, bench)
    assert {(True, True, True, True), (True, True, True, False), (False, True, True, False),
            (True, False, False, False)} <= seen
