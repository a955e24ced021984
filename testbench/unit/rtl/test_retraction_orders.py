# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.retraction``: orders, and the clocks they take."""

import pytest

from rtl.states import State
from testbench.checkers.motion_bench import (
    DATA,
    ONE,
    START_RATE,
    change,
    ordered,
    outline,
    wrapped,
)
from testbench.models.retraction import (
    ADVANCE,
    AT_LIMIT,
    CLEARED,
    END,
    HALT,
    HIGH,
    JUMP,
    LOW,
    OPERATOR,
    RESUME,
    SHORT,
    START,
    STILL_LIMIT,
)
from testbench.simulators.benches import settle
from testbench.some import some


def test_halts_only_after_settling_in_position(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA, settle=25)
        await bench.to(ctx, 50)
        bench.short = True
        bench.set(ctx, in_position=0)
        await bench.until(ctx, State.AT_LIMIT)
        assert bench.position == 10
        await bench.idle(ctx)
        assert ctx.get(dut.retraction.state) == State.AT_LIMIT
        bench.set(ctx, in_position=1)
        for _ in range(25):
            await bench.tick(ctx)
            assert ctx.get(dut.retraction.state) == State.AT_LIMIT
        bench.set(ctx, in_position=0)
        await bench.until(ctx, State.HALTED)
        await bench.idle(ctx)
        assert outline(bench) == [(START, SHORT, 50), (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]

    simulate(dut, run)


def test_sensing_and_quiet_follow_the_state(simulate):
    dut, bench = ordered()
    seen = set()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await settle(ctx)
        while ctx.get(dut.retraction.state) != State.HALTED:
            await bench.tick(ctx)
            if bench.position == 50:
                bench.short = True
            if bench.position == 20 and len(bench.events) == 1:
                bench.short = False
            if bench.position == 45 and len(bench.events) == 4:
                bench.short = True
            seen.add((ctx.get(dut.retraction.state), ctx.get(dut.retraction.sensing),
                      ctx.get(dut.retraction.quiet)))

    simulate(dut, run)
    assert seen == {(State.FRONT, 0, 0), (State.STOPPING, 1, 0), (State.RETRACTING, 1, 0),
                    (State.AT_LIMIT, 1, 0), (State.HIGH, 1, 0), (State.LOW, 0, 0),
                    (State.HALTED, 0, 1)}


def test_hold_stops_forward_motion_and_never_a_retraction(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 30)
        bench.set(ctx, hold=1)
        await bench.idle(ctx)
        assert bench.position == 30
        bench.short = True
        await bench.to(ctx, 10)
        bench.short = False
        await bench.idle(ctx)
        assert bench.position == 10
        assert ctx.get(dut.retraction.state) == State.HIGH
        bench.set(ctx, hold=0)
        await bench.to(ctx, 25)
        bench.set(ctx, hold=1)
        await bench.idle(ctx)
        assert bench.position == 25
        assert ctx.get(dut.retraction.state) == State.LOW
        bench.short = True
        await bench.to(ctx, 20)
        bench.short = False
        await bench.idle(ctx)
        bench.set(ctx, hold=0)
        await bench.to(ctx, 31)

    simulate(dut, run)
    assert outline(bench) == [
        (START, SHORT, 30), (END, CLEARED, 10), (ADVANCE, HIGH, 10), (ADVANCE, LOW, 22),
        (START, SHORT, 25), (END, CLEARED, 20), (ADVANCE, HIGH, 20), (ADVANCE, LOW, 22),
        (RESUME, 0, 30)]


@pytest.mark.parametrize("phase", [0, 3, 6])
def test_the_overshoot_counts_from_when_all_pulses_have_reached_the_axes(simulate, phase):
    """The short may clear in any clock between two pulses."""
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 30)
        bench.short = True
        await bench.to(ctx, 15)
        await bench.idle(ctx, phase)
        bench.short = False
        for _ in range(100):
            await bench.tick(ctx)
            if ctx.get(dut.retraction.mark):
                break
        marked = ctx.get(dut.axis[0])
        for _ in range(6):
            await bench.tick(ctx)
            assert ctx.get(dut.axis[0]) == marked
        assert outline(bench)[1] == (END, CLEARED, marked)

    simulate(dut, run)


def test_no_way_forward_while_events_are_not_taken(simulate):
    """Forward motion waits for firmware that is behind; a short retracts in any case."""
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        for position, state in ((30, State.FRONT), (12, State.HIGH), (25, State.LOW)):
            await bench.to(ctx, position)
            bench.set(ctx, backpressure=1)
            await bench.idle(ctx)
            assert (bench.position, ctx.get(dut.retraction.state)) == (position, state)
            if state == State.FRONT:
                bench.short = True
                await bench.to(ctx, 10)
                bench.short = False
                await bench.until(ctx, State.HIGH)
            bench.set(ctx, backpressure=0)
        await bench.to(ctx, 40)

    simulate(dut, run)
    assert outline(bench)[:2] == [(START, SHORT, 30), (END, CLEARED, 10)]


@pytest.mark.parametrize(("state", "position"), [
    (State.FRONT, 5), (State.HIGH, 15), (State.LOW, 25)])
def test_what_forbids_the_way_forward_does_in_its_clock(simulate, state, position):
    """The retraction stops at once, whatever else drops the pulses under way."""
    dut, bench = ordered()
    levels = dict(run=0, hold=1, shorted=1, safe=1, backpressure=1, wait=1, contact=1)

    async def run(ctx):
        await bench.begin(ctx, DATA)
        if state != State.FRONT:
            await bench.to(ctx, 30)
            bench.short = True
            await bench.to(ctx, 10)
            bench.short = False
        await bench.to(ctx, position)
        assert ctx.get(dut.retraction.state) == state
        for name, level in levels.items():
            assert ctx.get(dut.retraction.go)
            bench.set(ctx, **{name: level})
            await settle(ctx)
            assert not ctx.get(dut.retraction.go), name
            bench.set(ctx, **{name: 1 - level})
            await settle(ctx)

    simulate(dut, run)


def test_nothing_moves_without_run(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA, run=0)
        await bench.idle(ctx)
        assert bench.position == 0
        bench.short = True
        await bench.idle(ctx)
        assert (bench.position, ctx.get(dut.retraction.state)) == (0, State.FRONT)
        bench.set(ctx, run=1)
        await bench.to(ctx, -20)
        bench.set(ctx, run=0)
        await bench.idle(ctx)
        assert (bench.position, ctx.get(dut.retraction.state)) == (-20, State.RETRACTING)
        bench.set(ctx, run=1)
        await bench.until(ctx, State.AT_LIMIT)
        assert bench.position == -40

    simulate(dut, run)


def test_hold_keeps_jumps_waiting(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA, jump_period=100)
        bench.gap.order = JUMP  # discharging
        bench.set(ctx, hold=1)
        await bench.idle(ctx, 300)
        bench.set(ctx, hold=0)
        await bench.idle(ctx, 100)
        bench.set(ctx, hold=1)  # in the clock in which the jump is due
        await bench.idle(ctx, 50)
        assert ctx.get(dut.retraction.state) == State.FRONT
        bench.set(ctx, hold=0)
        await bench.tick(ctx)
        assert ctx.get(dut.retraction.state) == State.STOPPING

    simulate(dut, run)


def test_data_are_taken_over_at_the_front_only(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 50)
        bench.short = True
        await bench.to(ctx, 40)
        await bench.commit(ctx, change(limit=5, changeover=2))
        await bench.to(ctx, 30)
        bench.short = False
        await bench.until(ctx, State.LOW)
        assert bench.position == 42, "the old changeover"
        await bench.to(ctx, 48)
        bench.short = True
        await bench.to(ctx, 15)
        bench.short = False
        await bench.to(ctx, 70)
        bench.short = True
        await bench.until(ctx, State.AT_LIMIT)
        assert bench.position == 65, "the new limit"

    simulate(dut, run)


def test_release_comes_forward_again(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 50)
        bench.short = True
        await bench.until(ctx, State.HALTED)
        bench.short = False
        await bench.idle(ctx)
        assert bench.position == 10, "it waits"
        bench.events.clear()
        bench.set(ctx, release=1)
        await bench.tick(ctx)
        bench.set(ctx, release=0)
        await bench.to(ctx, 55)
        assert ctx.get(dut.retraction.burst) == 0
        assert outline(bench) == [(ADVANCE, HIGH, 10), (ADVANCE, LOW, 42), (RESUME, 0, 50)]

    simulate(dut, run)


def test_safe_stops_at_once_and_drops_what_is_stored(simulate, rng):
    dut, bench = ordered(start_rate=ONE // 30, acceleration=ONE // 600)

    async def run(ctx):
        await bench.begin(ctx, change(high_rate=ONE // 5, rate=ONE // 5))
        for _ in range(3):
            await bench.idle(ctx, rng.randint(300, 500))
            bench.short = True
            await bench.idle(ctx, rng.randint(1, 300))
            bench.set(ctx, safe=1)
            bench.short = False
            await bench.tick(ctx)
            held = wrapped(ctx.get(dut.path.position))
            await bench.idle(ctx, 20)
            assert bench.position == held
            assert ctx.get(dut.retraction.state) == State.HALTED
            assert wrapped(ctx.get(dut.feed.command)) == held
            assert ctx.get(dut.ramp.rate) == ONE // 30
            bench.set(ctx, release=1)
            await bench.idle(ctx, 5)
            assert ctx.get(dut.retraction.state) == State.HALTED, "not while safe"
            bench.set(ctx, safe=0)
            await bench.tick(ctx)
            bench.set(ctx, release=0)
            await bench.until(ctx, State.FRONT)
        await settle(ctx)
        bench.check_axes(ctx)

    simulate(dut, run)


def test_a_release_while_safe_is_none(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 30)
        bench.short = True
        await bench.to(ctx, 15)
        bench.set(ctx, safe=1)
        await bench.tick(ctx)
        bench.set(ctx, release=1)
        await bench.idle(ctx, 5)
        assert ctx.get(dut.retraction.state) == State.HALTED
        assert ctx.get(dut.retraction.reverse), "still as it was"

    simulate(dut, run)


def test_waits_for_segments_behind(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA, behind=0)
        await bench.to(ctx, 20)
        bench.short = True
        await bench.idle(ctx, 500)
        assert (bench.position, ctx.get(dut.retraction.state)) == (0, State.RETRACTING)
        bench.place(ctx, behind=-10)
        await bench.idle(ctx, 500)
        assert (bench.position, ctx.get(dut.retraction.state)) == (-10, State.RETRACTING)
        bench.place(ctx, behind=-60)
        await bench.until(ctx, State.AT_LIMIT)
        assert bench.position == -20

    simulate(dut, run)


def test_an_order_in_the_clock_of_the_resume_is_obeyed(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 50)
        bench.short = True
        await bench.to(ctx, 45)
        bench.short = False
        await bench.until(ctx, State.FRONT)
        bench.set(ctx, retract=1)  # one clock
        bench.gap.order = OPERATOR
        await bench.tick(ctx)
        bench.gap.order = 0
        await bench.idle(ctx, 20)
        assert outline(bench)[-2:] == [(RESUME, 0, 50), (START, OPERATOR, 50)]

    simulate(dut, run)


@pytest.mark.parametrize("start_rate", some([START_RATE, ONE // 9, ONE // 6 + 12345]), ids=hex)
def test_reaction(simulate, rng, start_rate):
    """Last forward pulse at most 8 clocks after the sample; reversed command at most 16."""
    feed = min(start_rate, ONE // 5)
    dut, bench = ordered([(60, feed, [0]), (600, feed, [0])], start_rate=start_rate)
    latencies = []

    async def run(ctx):
        await bench.begin(ctx, change(low_rate=ONE // 10, rate=ONE // 10), gain=1)
        await bench.idle(ctx, 20)
        for _ in range(25):
            await bench.idle(ctx, rng.randint(5, 60))
            if ctx.get(dut.retraction.state) != State.FRONT:
                await bench.until(ctx, State.FRONT)
                await bench.idle(ctx, rng.randint(10, 30))
            sample = bench.clock - 1
            bench.short = True
            last = reversed_at = 0
            while not reversed_at:
                forward = ctx.get(dut.ramp.pp) and not ctx.get(dut.retraction.reverse)
                if forward:
                    last = bench.clock - sample
                await bench.tick(ctx)
                if ctx.get(dut.feed.go) and ctx.get(dut.feed.reverse):
                    reversed_at = bench.clock - sample
            assert reversed_at <= 16
            latencies.append(last)
            assert bench.events[-1][0] == START
            assert bench.events[-1][3] == last
            assert bench.events[-1][5] == sample + 1, "stamped when Ss rose"
            await bench.idle(ctx, rng.randint(1, 40))
            bench.short = False
            await bench.until(ctx, State.FRONT)

    simulate(dut, run)
    assert max(latencies) <= 8
    assert len(set(latencies)) > 2


def test_latency_is_that_of_its_own_short(simulate):
    """A short that comes as the retraction ends has no forward pulse after it."""
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 20)
        while not ctx.get(dut.feed.ps):
            await bench.tick(ctx)
        bench.short = True
        await bench.idle(ctx, 60)
        bench.short = False
        await bench.idle(ctx, 2)
        bench.short = True
        await bench.until(ctx, State.AT_LIMIT)

    simulate(dut, run)
    assert [event[:2] for event in bench.events] == [
        (START, SHORT), (END, CLEARED), (START, SHORT)]
    assert [event[3] for event in bench.events if event[0] == START] == [3, 0]
