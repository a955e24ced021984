# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.error_counter``, against the exact model."""

import pytest

from rtl.motion.error_counter import ErrorCounter
from testbench.models import error_counter as model
from testbench.models.error_counter import wrapped
from testbench.refusal import refuses


def drive(ctx, dut, pi, fp, adopt):
    ctx.set(dut.pi, pi != 0)
    ctx.set(dut.pi_reverse, pi < 0)
    ctx.set(dut.fp, fp != 0)
    ctx.set(dut.fp_reverse, fp < 0)
    ctx.set(dut.adopt, adopt)


def check(ctx, dut, counter):
    assert ctx.get(dut.command) == wrapped(counter.commanded, dut.travel)
    assert ctx.get(dut.position) == wrapped(counter.moved, dut.travel)
    assert ctx.get(dut.error) == counter.error
    assert ctx.get(dut.saturated) == counter.saturated
    assert not ctx.get(dut.damaged)


@pytest.mark.parametrize(("width", "travel"), [(3, 3), (4, 6), (18, 32)])
def test_follows_the_model(simulate, rng, width, travel):
    dut, counter = ErrorCounter(width=width, travel=travel), model.ErrorCounter(width)

    async def bench(ctx):
        for clock in range(3000):
            # Long runs to one side reach the limits of narrow counters, on both sides.
            lean = (-1, 0, 1, 0)[clock // 100 % 4]
            pi = rng.choice((-1, 0, 1, lean, lean))
            fp = rng.choice((-1, 0, 1, -lean, 0))
            adopt = rng.random() < 0.01
            drive(ctx, dut, pi, fp, adopt)
            await ctx.tick()
            counter.tick(pi, fp, adopt)
            check(ctx, dut, counter)

    simulate(dut, bench)


@pytest.mark.parametrize("sign", [1, -1], ids=["up", "down"])
@pytest.mark.parametrize("start", [0, 1], ids=["even", "odd"])
def test_sticks_at_the_limit_of_the_full_width(simulate, sign, start):
    dut, counter = ErrorCounter(), model.ErrorCounter()
    near = sign * (counter.limit - 3 - start)

    async def bench(ctx):
        ctx.set(dut.error, near)  # 131 000 clocks saved
        ctx.set(dut.command, near)
        counter.error = counter.commanded = near
        for pi, fp in [(sign, -sign)] * 4 + [(sign, 0)] * 4 + [(0, sign)] + [(0, -sign)] * 4:
            drive(ctx, dut, pi, fp, adopt=False)
            await ctx.tick()
            counter.tick(pi, fp)
            check(ctx, dut, counter)
        assert counter.saturated
        assert abs(counter.commanded - counter.moved) > counter.limit

    simulate(dut, bench)


@pytest.mark.parametrize("register", ["command", "position", "error"])
def test_every_bit_that_turns_over_is_found(simulate, rng, register):
    dut = ErrorCounter(width=6, travel=9)

    async def bench(ctx):
        signal = getattr(dut, register)
        for bit in range(len(signal)):
            for clock in range(20):
                drive(ctx, dut, rng.choice((-1, 0, 1)), (-1, 1)[clock & 1], adopt=False)
                await ctx.tick()
            assert not ctx.get(dut.damaged)
            ctx.set(signal, ctx.get(signal) ^ (1 << bit if bit < len(signal) - 1 else -1 << bit))
            for clock in range(6):
                drive(ctx, dut, rng.choice((-1, 0, 1)), rng.choice((-1, 0, 1)), adopt=False)
                await ctx.tick()
                assert ctx.get(dut.damaged | dut.saturated) == (clock > 0), (bit, clock)
            drive(ctx, dut, 0, 0, adopt=True)
            await ctx.tick().repeat(3)
            assert not ctx.get(dut.damaged)

    simulate(dut, bench)


@pytest.mark.parametrize("fp", [-1, 0, 1])
def test_adopts_the_position_with_the_pulse_of_that_clock(simulate, fp):
    dut = ErrorCounter(width=4)

    async def bench(ctx):
        drive(ctx, dut, -1, 1, adopt=False)
        await ctx.tick().repeat(7)
        assert ctx.get(dut.saturated)
        drive(ctx, dut, 1, fp, adopt=True)
        await ctx.tick()
        assert ctx.get(dut.position) == ctx.get(dut.command) == 7 + fp
        assert ctx.get(dut.error) == 0
        assert not ctx.get(dut.saturated)

    simulate(dut, bench)


@pytest.mark.parametrize(("wrong", "message"), [
    (dict(width=2), r"width must be at least 3 bits, not 2"),
    (dict(width=18, travel=17), r"travel must be at least the 18 bits .*, not 17"),
])
def test_refuses_wrong_parameters(wrong, message):
    refuses(ErrorCounter, message, **wrong)
