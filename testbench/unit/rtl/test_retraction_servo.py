# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.retraction``: the servo's steps along the path."""

import pytest

from rtl.states import State
from testbench.checkers.motion_bench import START_RATE, change, ordered, outline, wrapped
from testbench.models.retraction import CLEARED, END, HALT, RESUME, SERVO, SHORT, START
from testbench.simulators.benches import settle

STEP = 7
PATH = [(100, START_RATE, (100,)), (60, START_RATE, (-60,)), (90, START_RATE // 2, (30,)),
        (80, START_RATE, (80,))]
SETTLED = 400  # clocks: longer than a step takes


def command(ctx, dut, bench):
    return wrapped(ctx.get(dut.feed.command) - bench.offset)


async def strobe(ctx, dut, bench, order):
    """One clock with ``up`` or ``down``; return the goal by the contract."""
    await settle(ctx)
    goal = command(ctx, dut, bench) + (-STEP if order == "up" else STEP)
    bench.set(ctx, **{order: 1})
    await bench.tick(ctx)
    bench.set(ctx, **{order: 0})
    await settle(ctx)
    return goal


def serve():
    return ordered(PATH)


def test_goes_by_steps_and_else_stands_still(simulate, rng):
    dut, bench = serve()
    seen = set()

    async def run(ctx):
        await bench.begin(ctx, change(limit=1000), servo=1, step=STEP)
        await bench.idle(ctx)
        assert bench.position == 0
        for _ in range(60):
            order = rng.choice(("up", "down", "down"))
            goal = await strobe(ctx, dut, bench, order)
            # From the end of the last step, or from somewhere on the way there.
            on_the_way = rng.random() < 0.4
            await bench.idle(ctx, rng.randrange(1, 60) if on_the_way else SETTLED)
            reached = min(max(goal, bench.borders[0]), bench.end)
            if not on_the_way:
                assert bench.position == reached
                bench.check_axes(ctx)
                seen.add((order, reached == goal))
        assert not ctx.get(dut.retraction.held)

    simulate(dut, run, deadline=1e-2)
    assert {("up", True), ("down", True)} <= seen


def test_ends_where_the_path_does(simulate):
    dut, bench = serve()

    async def run(ctx):
        await bench.begin(ctx, change(limit=1000), servo=1, step=STEP)
        for _ in range(50):
            await strobe(ctx, dut, bench, "down")
            await bench.idle(ctx, SETTLED)
        assert bench.position == bench.end
        bench.check_axes(ctx)

    simulate(dut, run, deadline=1e-2)


@pytest.mark.parametrize(("data", "back_limit", "room"), [
    (change(limit=40), None, 40),
    (change(limit=4000), 120, 50),
    (change(limit=0, valid=False), 149, 21),
], ids=["limit", "back_limit", "no data"])
def test_halts_rather_than_pass_the_limit_from_the_furthest_point(simulate, data, back_limit, room):
    dut, bench = serve()

    async def run(ctx):
        bounds = {} if back_limit is None else {"back_limit": back_limit}
        await bench.begin(ctx, data, ahead=170, **bounds)
        await bench.to(ctx, 170)
        await bench.idle(ctx, SETTLED)
        bench.set(ctx, servo=1, step=STEP)
        for number in range(room // STEP):
            await strobe(ctx, dut, bench, "up")
            await bench.idle(ctx, SETTLED)
            assert bench.position == 170 - STEP * (number + 1)
            assert ctx.get(dut.retraction.state) == State.FRONT
        place = bench.position
        assert outline(bench) == []
        await strobe(ctx, dut, bench, "up")
        await bench.idle(ctx, SETTLED)
        assert ctx.get(dut.retraction.state) == State.HALTED
        assert bench.position == place
        assert outline(bench) == [(HALT, SERVO, place)]

    simulate(dut, run, deadline=1e-2)


def test_short_freezes_it_and_comes_back_to_where_it_was(simulate):
    dut, bench = serve()

    async def run(ctx):
        await bench.begin(ctx, change(limit=60), servo=1, step=STEP)
        for order in ("down",) * 9 + ("up",) * 3:
            await strobe(ctx, dut, bench, order)
            await bench.idle(ctx, SETTLED)
        place = 6 * STEP
        assert bench.position == place
        bench.short = True
        await bench.to(ctx, place - 20)
        assert ctx.get(dut.retraction.held)
        await strobe(ctx, dut, bench, "down")
        bench.short = False
        await bench.until(ctx, State.LOW)
        await bench.until(ctx, State.FRONT)
        await bench.idle(ctx, SETTLED)
        assert bench.position == place
        kinds = outline(bench)
        assert kinds[0] == (START, SHORT, place)
        assert kinds[1][:2] == (END, CLEARED)
        assert kinds[-1] == (RESUME, 0, place)
        await strobe(ctx, dut, bench, "down")
        await bench.idle(ctx, SETTLED)
        assert bench.position == place + STEP
        bench.check_axes(ctx)

    simulate(dut, run, deadline=1e-2)


def test_limit_counts_from_the_furthest_point_though_the_servo_has_drawn_back(simulate):
    """Otherwise the way back could be longer than the remembered path."""
    dut, bench = serve()

    async def run(ctx):
        await bench.begin(ctx, change(limit=60), servo=1, step=STEP)
        for order in ("down",) * 12 + ("up",) * 6:
            await strobe(ctx, dut, bench, order)
            await bench.idle(ctx, SETTLED)
        assert bench.position == 6 * STEP
        bench.short = True
        await bench.until(ctx, State.AT_LIMIT)
        assert bench.position == 12 * STEP - 60
        bench.short = False
        await bench.until(ctx, State.FRONT)
        assert bench.position == 6 * STEP

    simulate(dut, run, deadline=1e-2)


def test_hold_and_the_end_of_the_mode(simulate):
    dut, bench = serve()

    async def run(ctx):
        await bench.begin(ctx, change(limit=60), servo=1, step=STEP)
        for order in ("down", "down", "up"):
            await strobe(ctx, dut, bench, order)
            await bench.idle(ctx, SETTLED)
        bench.set(ctx, hold=1)
        await bench.tick(ctx)
        assert ctx.get(dut.retraction.held)
        bench.set(ctx, hold=0, servo=0)
        await bench.to(ctx, bench.end, clocks=20_000)
        bench.check_axes(ctx)

    simulate(dut, run, deadline=1e-2)
