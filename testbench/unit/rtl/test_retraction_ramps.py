# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.retraction``: above the start/stop speed, and at random."""

import pytest

from rtl.states import State
from testbench.checkers.motion import Motion
from testbench.checkers.motion_bench import ONE, START_RATE, Ordered, change, ordered
from testbench.models.retraction import (
    ADVANCE,
    AT_LIMIT,
    BURST,
    CLEARED,
    END,
    HALT,
    HIGH,
    JUMP,
    LOW,
    NO_DATA,
    OPERATOR,
    RESUME,
    SHORT,
    START,
    Gap,
)
from testbench.simulators.benches import settle
from testbench.some import some

SLOW = ONE // 20     # start/stop speed
STEP = ONE // 200    # per 16 clocks: from a pulse in 20 clocks to one in 4 over about 100 pulses
TOP = (1 << 30) - 1
CRAWL = 10           # pulses at the start/stop speed before a bound
REACTION = 6         # clocks from the first of the short, hence 7 from its sample
FAST = change(rate=TOP, limit=400, high_rate=TOP, low_rate=SLOW // 2, changeover=60,
              jump_distance=300, jump_rate=TOP, jump_high_rate=TOP)


class Watched(Ordered):
    """Checks the speed in every clock: it changes by a step of the ramp, or not at all."""

    rate = SLOW
    step = STEP
    rose_at = None
    crawl = 0    # pulses since the ramp came back to the start/stop speed

    async def tick(self, ctx):
        dut = self.dut
        await settle(ctx)
        pulse = ctx.get(dut.ramp.pp)
        await super().tick(ctx)
        rate = ctx.get(dut.ramp.rate)
        assert abs(rate - self.rate) in (0, self.step // 4), "a jump in speed"
        forward = not ctx.get(dut.retraction.reverse)
        if not (self.short and forward):
            self.rose_at = None
        elif self.rose_at is None:
            self.rose_at, self.rose_rate = self.clock, rate
        elif self.clock >= self.rose_at + REACTION:
            assert rate <= self.rate, "faster into the short"
            assert rate < self.rose_rate or rate == SLOW, "deceleration has not begun"
        self.crawl = self.crawl + pulse if rate == SLOW else 0
        self.rate = rate


def watched(segments, *, axes=1, step=STEP, **options):
    dut = Motion(axes=axes)
    bench = Watched(dut, segments, Gap([]), start_rate=SLOW, acceleration=step, **options)
    bench.step = step
    return dut, bench


def lead(rate, step=STEP):
    """Braking distance from a rate to the start/stop speed, as firmware computes it."""
    return max(0, (rate * rate - SLOW * SLOW) // (2 * (step * ONE // 16)))


@pytest.mark.parametrize(("high", "low"), some([
    (TOP, SLOW // 2), (TOP, SLOW), (TOP, ONE // 8), (ONE // 7, ONE // 10), (ONE // 10, ONE // 10),
    (ONE // 10, ONE // 6), (SLOW + STEP // 2, SLOW - 1), (SLOW - 1, ONE // 10),
], (TOP, SLOW // 2), (ONE // 10, ONE // 6), (SLOW + STEP // 2, SLOW - 1)),
    ids=lambda rate: f"{rate / ONE:.3f}")
def test_every_bound_is_reached_at_the_start_stop_speed(simulate, high, low):
    dut, bench = watched([(300, SLOW, [300]), (60, SLOW, [60])], before=1)
    data = change(rate=high, limit=260, high_rate=high, low_rate=low, changeover=40,
                  low_lead=lead(low))

    async def run(ctx):
        await bench.begin(ctx, data, settle=100)
        await bench.to(ctx, 5)
        bench.short = True
        await bench.until(ctx, State.AT_LIMIT, clocks=30_000)
        assert (bench.position, bench.lowest) == (-255, -255), "the limit, to the pulse"
        assert bench.rate == SLOW
        assert bench.crawl <= CRAWL or high <= SLOW + STEP
        bench.short = False
        await bench.until(ctx, State.LOW, clocks=30_000)
        assert bench.position == -35, "the changeover, to the pulse"
        after = max(SLOW, min(low, high))
        # It brakes at most MARGIN pulses too early, at 0.2 to 0.4 steps a pulse.
        assert after - 4 * STEP <= bench.rate <= after
        assert bench.rate == SLOW or low > SLOW
        assert bench.crawl <= CRAWL or high <= SLOW + STEP
        await bench.until(ctx, State.FRONT, clocks=30_000)
        assert (bench.position, bench.rate) == (5, SLOW)
        assert bench.crawl <= CRAWL or low <= SLOW + STEP
        await bench.idle(ctx, 4)
        bench.check_axes(ctx)

    simulate(dut, run)
    assert [event[:3] for event in bench.events] == [
        (START, SHORT, 5), (END, CLEARED, -255), (ADVANCE, HIGH, -255), (ADVANCE, LOW, -35),
        (RESUME, 0, 5)]
    pulses, clocks = bench.events[1][3:5]
    assert abs(pulses / clocks * ONE / high - 1) < 0.01, "plateau"
    assert pulses > 260 - 2 * lead(high) - 40


BOUND, FREE = ONE // 20, ONE // 40    # of a segment: below all rates, and above none


@pytest.mark.parametrize("bound", [BOUND, FREE])
@pytest.mark.parametrize(("kind", "low"), some([
    (SHORT, ONE // 10), (SHORT, ONE // 50), (JUMP, ONE // 9),
], (SHORT, ONE // 10), (JUMP, ONE // 9)))
def test_no_way_is_faster_than_the_highest_rate_of_its_segment(simulate, kind, low, bound):
    """Back and forward over three segments; the middle one bounds the rate."""
    dut, bench = ordered([(60, ONE // 10, [60]), (40, ONE // 8, [40]), (60, ONE // 12, [60])],
                         start_rate=START_RATE, highest={1: bound >> 4})
    data = change(rate=ONE // 6, limit=80, high_rate=ONE // 7, low_rate=low, changeover=30,
                  jump_distance=80, jump_rate=ONE // 5, jump_high_rate=ONE // 8)
    gaps = {}    # clocks between pulses, by state and segment

    async def run(ctx):
        await bench.begin(ctx, data, jump_period=1)
        before = since = ordered_jump = 0
        while bench.clock < 12_000 and (RESUME, 0) not in [event[:2] for event in bench.events]:
            await settle(ctx)
            state = ctx.get(dut.retraction.state)
            bench.short = kind == SHORT and bench.position == 60 and state == State.FRONT
            if kind == SHORT and state in (State.STOPPING, State.RETRACTING):
                bench.short = bench.position > -15
            if kind == JUMP and bench.position == 60 and state == State.FRONT and not ordered_jump:
                bench.gap.order = ordered_jump = JUMP
            await bench.tick(ctx)
            if bench.position != before:
                segment = (min(before, bench.position) >= 0) + (min(before, bench.position) >= 40)
                if bench.clock - since < 300:
                    gaps.setdefault((state, segment), []).append(bench.clock - since)
                before, since = bench.position, bench.clock

    simulate(dut, run)
    back, high = ((data.rate, data.high_rate) if kind == SHORT
                  else (data.jump_rate, data.jump_high_rate))
    wanted = {State.RETRACTING: back, State.HIGH: high, State.LOW: low}
    for state, rate in wanted.items():
        for segment in ((0, 1, 2) if state == State.RETRACTING else (1,)):
            rate_there = min(rate, bound) if segment == 1 else rate
            seen = sorted(gaps[state, segment])
            assert seen[len(seen) // 2] == pytest.approx(ONE / rate_there, abs=1), (state, segment)
    assert min(gaps[State.FRONT, 1][1:]) >= ONE // min(ONE // 8, bound) - 1


def test_a_retraction_that_reaches_no_plateau_reports_none(simulate):
    dut, bench = watched([(450, ONE // 40, [450]), (100, ONE // 40, [100])], before=1)

    async def run(ctx):
        await bench.begin(ctx, change(rate=TOP, limit=100, low_rate=SLOW, high_rate=TOP))
        await bench.to(ctx, 5)
        bench.short = True
        await bench.until(ctx, State.AT_LIMIT, clocks=5000)
        bench.short = False
        await bench.until(ctx, State.FRONT, clocks=5000)
        await bench.to(ctx, 10)
        bench.short = True
        await bench.to(ctx, -40)
        bench.short = False
        await bench.until(ctx, State.FRONT, clocks=5000)

    simulate(dut, run)
    assert [event[3] for event in bench.events if event[0] == END] == [0, 0]


def test_a_short_at_speed_stops_within_the_braking_distance(simulate, rng):
    dut, bench = watched([(450, TOP, [450]), (1200, TOP, [1200])], before=1)

    async def run(ctx):
        await bench.begin(ctx, FAST, gain=1)
        for _ in range(6):
            await bench.until(ctx, State.FRONT, clocks=30_000)
            await bench.idle(ctx, rng.randint(100, 1200))
            reach = bench.position + ctx.get(dut.ramp.distance) + 8
            bench.short = True
            await bench.until(ctx, State.RETRACTING, clocks=3000)
            assert bench.position <= reach
            assert bench.rate == SLOW
            await bench.idle(ctx, rng.randint(10, 300))
            bench.short = False

    simulate(dut, run)


def test_corner_and_end_of_path_are_taken_slowly(simulate):
    dut, bench = watched([(50, TOP, [50]), (300, TOP, [300]), (350, TOP, [-350])], before=1)
    corners = []

    async def run(ctx):
        await bench.begin(ctx, FAST, fast_ahead=300)
        await bench.to(ctx, 150)
        assert bench.rate > SLOW + 20 * STEP
        await bench.to(ctx, 300)
        corners.append((bench.rate, bench.crawl))
        await bench.idle(ctx, 100)
        assert bench.rate == SLOW, "firmware has not moved the corner yet"
        bench.place(ctx, fast_ahead=10**6)
        await bench.to(ctx, 450)
        assert bench.rate > SLOW + 20 * STEP
        bench.set(ctx, hold=1)
        await settle(ctx)
        place = bench.position + ctx.get(dut.ramp.distance) + 8
        await bench.idle(ctx, 1500)
        assert ctx.get(dut.ramp.rest)
        assert bench.position <= place, "nothing left over from the corner"
        bench.set(ctx, hold=0)
        await bench.to(ctx, bench.end)
        corners.append((bench.rate, bench.crawl))
        await bench.idle(ctx, 200)
        assert bench.position == bench.end
        bench.check_axes(ctx)

    simulate(dut, run)
    for rate, crawl in corners:
        assert rate == SLOW
        assert crawl <= CRAWL


FOLLOWS = {
    None: {(START, 1), (START, 2), (START, 3), (HALT, NO_DATA)},
    (START, 1): {(END, CLEARED), (END, AT_LIMIT), (END, 3)},
    (START, 2): {(END, AT_LIMIT), (END, 3)},
    (START, 3): {(END, AT_LIMIT), (END, 3)},
    (END, CLEARED): {(START, 1), (ADVANCE, HIGH), (ADVANCE, LOW), (HALT, BURST)},
    (END, AT_LIMIT): {(START, 1), (ADVANCE, HIGH), (ADVANCE, LOW), (HALT, 1), (HALT, BURST)},
    (END, 3): {(START, 1), (ADVANCE, HIGH), (ADVANCE, LOW), (HALT, 2), (HALT, BURST)},
    (ADVANCE, HIGH): {(ADVANCE, LOW), (START, 1), (START, 3), (HALT, BURST)},
    (ADVANCE, LOW): {(RESUME, 0), (START, 1), (START, 3), (HALT, BURST)},
    (RESUME, 0): {(START, 1), (START, 2), (START, 3)},
    (HALT, 1): {(ADVANCE, HIGH), (ADVANCE, LOW)},
    (HALT, 2): {(ADVANCE, HIGH), (ADVANCE, LOW)},
    (HALT, BURST): {(ADVANCE, HIGH), (ADVANCE, LOW)},
}


@pytest.mark.parametrize("turn", some(range(3)))
def test_no_order_of_inputs_breaks_the_rules(simulate, rng, turn):
    """Shorts, holds, jumps, orders and walks in any clock; it never leaves its bounds."""
    axes = 2
    segments = [(200, TOP, [200, -13])]
    for _ in range(15):
        length = rng.randint(1, 50)
        segments.append((length, rng.choice((TOP, SLOW, ONE // 9)),
                         [rng.randint(-length, length) for _ in range(axes)]))
    dut, bench = watched(segments, axes=axes, before=1, step=5 * STEP)
    low = rng.choice((SLOW, SLOW // 2, ONE // 8))
    data = change(rate=rng.choice((TOP, SLOW)), limit=70, high_rate=rng.choice((TOP, ONE // 7)),
                  low_rate=low, low_lead=lead(low, 5 * STEP), changeover=rng.choice((0, 10, 25)),
                  jump_distance=40, jump_rate=TOP, jump_high_rate=TOP)
    back_limit = rng.choice((-65, -20))

    async def run(ctx):
        retraction, path = dut.retraction, dut.path
        await bench.begin(ctx, data, back_limit=back_limit, gain=5, repeats=6, settle=3,
                          jump_period=500)
        for clock in range(8000):
            if rng.random() < (0.03 if bench.short else 0.005):
                bench.short = not bench.short
            if clock % 64 == 0:
                bench.set(ctx, hold=rng.random() < 0.1, run=rng.random() > 0.05,
                          in_position=rng.random() < 0.8,
                          walk=rng.choice((0, 0, rng.randint(1, data.limit))),
                          fast_ahead_rate=rng.choice((0, SLOW >> 6)))
            bench.gap.order = OPERATOR if rng.random() < 0.001 else JUMP
            bench.set(ctx, release=rng.random() < 0.05)
            await bench.tick(ctx)
            position = bench.position
            assert position <= bench.end
            if position == bench.lowest:
                front, first = ctx.get(path.front), ctx.get(retraction.first)
                assert position >= min(max(min(front, first) - data.limit, back_limit), 0)
        bench.short = False
        bench.gap.order = 0
        bench.set(ctx, hold=0, run=1, release=1, jump_period=0, walk=0)
        await bench.run(ctx)
        bench.check_axes(ctx)

    simulate(dut, run)
    last = None
    for event in bench.events:
        kind = event[:2]
        assert kind in FOLLOWS[last], (last, kind, bench.events)
        last = kind
    assert len(bench.events) > 40
