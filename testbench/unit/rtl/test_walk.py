# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.retraction``: the operator walks along the path, back and forward."""

import pytest

from rtl.states import State
from testbench.checkers.motion_bench import DATA, ONE, change, ordered, outline
from testbench.models.retraction import (
    ADVANCE,
    AT_LIMIT,
    CLEARED,
    END,
    HIGH,
    LOW,
    OPERATOR,
    RESUME,
    SHORT,
    START,
)
from testbench.some import some
from testbench.unit.rtl.test_retraction_ramps import FAST, SLOW, TOP, watched

LONG = [(200, ONE // 10, [200]), (120, ONE // 10, [120])]    # from -200 to 120


async def walks(ctx, bench, distance, *, order):
    """Set the walk, and order the retraction if it leads back."""
    bench.set(ctx, walk=distance)
    await bench.idle(ctx, 8)
    if order:
        bench.gap.order = OPERATOR
        await bench.until(ctx, State.STOPPING)


def test_there_and_back_in_steps(simulate):
    """It stands where it is sent, beyond the limit of 40 too, and never has a main pulse there."""
    dut, bench = ordered(LONG)
    seen = []

    async def stands(ctx, place):
        await bench.to(ctx, place)
        await bench.idle(ctx, 300)
        assert bench.position == place
        seen.append((ctx.get(dut.retraction.state), ctx.get(dut.retraction.sensing)))

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 50)
        for distance, order in ((10, True), (25, True), (150, True), (120, False), (130, True),
                                (5, False), (30, True)):
            await walks(ctx, bench, distance, order=order)
            await stands(ctx, 50 - distance)
        bench.set(ctx, walk=0)
        await bench.until(ctx, State.FRONT)
        await bench.to(ctx, 60)
        bench.check_axes(ctx)

    simulate(dut, run)
    assert {sensing for _, sensing in seen} == {1}
    assert {state for state, _ in seen} == {State.HIGH, State.LOW}
    assert outline(bench)[-3:] == [(ADVANCE, HIGH, 20), (ADVANCE, LOW, 42), (RESUME, 0, 50)]
    assert [place for kind, _, place in outline(bench) if kind == END] == [40, 25, -100, -80, 20]


def test_the_back_limit_ends_it(simulate):
    dut, bench = ordered(LONG)

    async def run(ctx):
        await bench.begin(ctx, DATA, back_limit=-30)
        await bench.to(ctx, 50)
        await walks(ctx, bench, 150, order=True)
        await bench.to(ctx, -30)
        await bench.idle(ctx, 300)
        assert bench.position == -30
        bench.set(ctx, walk=60)
        await bench.to(ctx, -10)
        await bench.idle(ctx, 300)
        assert bench.position == -10

    simulate(dut, run)


def test_it_waits_for_rest_at_speed(simulate):
    """A nearer bound in fast motion would stop the machine at once; here speed never jumps."""
    dut, bench = watched([(900, TOP, [900]), (800, TOP, [800])], before=1)

    async def run(ctx):
        await bench.begin(ctx, FAST)
        await bench.to(ctx, 300)
        await walks(ctx, bench, 900, order=True)
        await bench.until(ctx, State.HIGH, clocks=30_000)
        place = bench.position
        assert place + 900 == pytest.approx(300, abs=200)
        bench.set(ctx, walk=200)
        await bench.to(ctx, place + 300, clocks=30_000)
        assert bench.rate > 2 * SLOW
        bench.set(ctx, walk=850)     # behind the machine
        await bench.idle(ctx, 5000)
        assert ctx.get(dut.retraction.front) - bench.position == 200, "the walk that was in force"
        bench.gap.order = OPERATOR
        await bench.until(ctx, State.STOPPING)
        await bench.until(ctx, State.HIGH, clocks=30_000)
        assert ctx.get(dut.retraction.front) - bench.position == 850

    simulate(dut, run)


def test_a_short_on_the_walk_retracts_by_its_own_rules(simulate):
    dut, bench = ordered(LONG)

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 50)
        await walks(ctx, bench, 30, order=True)
        await bench.to(ctx, 20)
        bench.set(ctx, walk=10)
        await bench.to(ctx, 35)
        bench.short = True
        await bench.to(ctx, 25)
        bench.short = False
        await bench.to(ctx, 40)
        await bench.idle(ctx, 300)
        assert bench.position == 40
        bench.set(ctx, walk=0)
        await bench.to(ctx, 60)

    simulate(dut, run)
    assert outline(bench) == [
        (START, OPERATOR, 50), (END, AT_LIMIT, 20), (ADVANCE, HIGH, 20), (START, SHORT, 35),
        (END, CLEARED, 25), (ADVANCE, HIGH, 25), (ADVANCE, LOW, 42), (RESUME, 0, 50)]


def test_hold_stops_the_way_forward_and_not_the_way_back(simulate):
    dut, bench = ordered(LONG)

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 50)
        bench.set(ctx, hold=1)
        await walks(ctx, bench, 30, order=True)
        await bench.to(ctx, 20)
        bench.set(ctx, walk=10)
        await bench.idle(ctx, 300)
        assert bench.position == 20
        bench.set(ctx, hold=0)
        await bench.to(ctx, 40)

    simulate(dut, run)


@pytest.mark.parametrize("turn", some(range(5)))
def test_any_walk_ends_where_it_should(simulate, rng, turn):
    """Random distances, at random times, with an order where they lead back."""
    dut, bench = ordered(LONG)
    limit = rng.choice((-200, -60, 10))
    data = change(changeover=rng.choice((0, 8, 60)))

    async def run(ctx):
        await bench.begin(ctx, data, back_limit=limit)
        await bench.to(ctx, rng.randint(20, 100))
        bench.set(ctx, hold=1)
        await bench.idle(ctx, 60)
        front = bench.position
        await walks(ctx, bench, rng.randint(1, 200), order=True)
        bench.set(ctx, hold=0)
        for _ in range(6):
            await bench.idle(ctx, rng.randint(1, 400))
            walk = rng.choice((1, 2, rng.randint(1, 250)))
            stop = max(front - walk, limit)
            bench.set(ctx, walk=walk)
            await bench.idle(ctx, 30)
            if bench.position > stop:
                bench.gap.order = OPERATOR
            await bench.idle(ctx, 4500)
            assert bench.position == stop, (front, walk, limit)
            bench.gap.order = 0
        bench.set(ctx, walk=0)
        await bench.to(ctx, front + 5)
        bench.check_axes(ctx)

    simulate(dut, run)
