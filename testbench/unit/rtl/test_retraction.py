# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.retraction``: its rules, with feed, ramp, path and distributor."""

import pytest

from testbench.checkers.motion import Motion
from testbench.checkers.motion_bench import DATA, FOREVER, LINE, ONE, Bench, change, outline
from testbench.models import retraction as model
from testbench.models.retraction import (
    ADVANCE,
    AT_BACK_LIMIT,
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
    STILL_BACK_LIMIT,
    STILL_LIMIT,
    Cue,
    Gap,
)
from testbench.some import some

# After a border a pulse waits until the segment is fetched. The pulses here are further apart than
# that, so that none is under way when the next cue comes.
APART = change(rate=ONE // 15, high_rate=ONE // 14, low_rate=ONE // 19, jump_rate=ONE // 16,
               jump_high_rate=ONE // 14)


def agree(seen, expected):
    """Events in the model's form, with the plateaus of retractions as speeds."""
    assert [event[:3] for event in seen] == [event[:3] for event in expected]
    for event, (kind, _, _, first, second) in zip(seen, expected, strict=True):
        assert event[3] == first, event
        if second is not None:
            assert event[4] == second, event
        if kind == END and first > 0:
            assert event[4] > 0


def random_path(rng, axes, count=16, longest=30):
    """Random segments, with random travel."""
    segments = []
    for _ in range(count):
        length = rng.choice((1, 2, rng.randint(1, longest), rng.randint(1, longest)))
        rate = ONE // rng.randint(14, 22)
        travel = [rng.choice((0, length, -length, rng.randint(-length, length)))
                  for _ in range(axes)]
        segments.append((length, rate, travel))
    return segments


def random_cues(rng, end):
    """Cues that follow one another on the path."""
    cues, position, front = [], 0, 0
    while True:
        kind = rng.choice((SHORT, SHORT, SHORT, JUMP, OPERATOR))
        if kind == SHORT:
            at = position + rng.randint(1, rng.choice((4, 15, 60)))
            depth = rng.choice((1, 2, rng.randint(1, 12), rng.randint(1, 39)))
            cue = Cue(SHORT, at, at - depth)
            position = at - depth
        else:
            at = max(front, position) + rng.randint(1, 30)
            cue = Cue(kind, at)
            position = at
            if kind == JUMP and rng.random() < 0.3:
                cues.append(cue)
                top = at - DATA.jump_distance + rng.randint(0, 5)
                cue = Cue(SHORT, top, top - rng.randint(6, 14), forward=False)
                position = cue.clear
        if at > end:
            return cues
        front = max(front, at)
        cues.append(cue)


def expect(bench, data, gap, **rules):
    run = model.Retraction(data, gap, bench.end, bench.feed, **rules)
    run.run()
    return run


@pytest.mark.parametrize("offset", some([0, (1 << 31) - 60, -60]), ids=lambda offset: f"{offset=}")
def test_follows_the_model(simulate, rng, offset):
    for _ in range(3):
        axes = rng.choice((1, 2, 3))
        segments = random_path(rng, axes)
        before = rng.randint(4, 6)
        gap = Gap([])
        dut = Motion(axes=axes)
        bench = Bench(dut, segments, gap, before=before, offset=offset)
        gap.cues = random_cues(rng, bench.end)
        back_limit = rng.choice((-FOREVER, -FOREVER, bench.end // 3))
        back_limit = max(back_limit, bench.borders[0])
        expected = expect(bench, APART, gap.copy(), back_limit=back_limit)

        async def run(ctx, bench=bench, back_limit=back_limit, expected=expected):
            await bench.begin(ctx, APART, back_limit=back_limit, jump_period=1)
            await bench.run(ctx)
            agree(bench.events, expected.events)
            assert bench.position == expected.position
            assert bench.lowest == expected.lowest
            bench.check_axes(ctx)

        simulate(dut, run, apart=True)


def play(simulate, cues, data=DATA, *, segments=LINE, before=1, rules=None, settings=None):
    """Run a scripted gap through gateware and model; return the bench."""
    dut = Motion()
    bench = Bench(dut, segments, Gap(list(cues)), before=before)
    rules = rules or {}
    expected = expect(bench, data, bench.gap.copy(), **rules)

    async def run(ctx):
        await bench.begin(ctx, data, jump_period=1, **rules, **(settings or {}))
        await bench.run(ctx)
        agree(bench.events, expected.events)
        assert bench.lowest == expected.lowest
        bench.check_axes(ctx)

    simulate(dut, run)
    return bench


BURST_OF_3 = [Cue(SHORT, 50, 45), Cue(SHORT, 51, 46), Cue(SHORT, 52, 47), Cue(SHORT, 53, 48)]

CASES = {
    "clears": (
        [Cue(SHORT, 50, 30)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 30), (ADVANCE, HIGH, 30), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "persists to the limit": (
        [Cue(SHORT, 50)], {}, {},
        [(START, SHORT, 50), (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]),
    "clears at the limit": (
        [Cue(SHORT, 50, 10)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 10), (ADVANCE, HIGH, 10), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "clears a pulse beyond the limit": (
        [Cue(SHORT, 50, 9)], {}, {},
        [(START, SHORT, 50), (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]),
    "clears while waiting at the limit": (
        [Cue(SHORT, 50, None, patient=True)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 10), (ADVANCE, HIGH, 10), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "as far as the changeover": (
        [Cue(SHORT, 50, 42)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 42), (ADVANCE, LOW, 42), (RESUME, 0, 50)]),
    "a pulse beyond the changeover": (
        [Cue(SHORT, 50, 41)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 41), (ADVANCE, HIGH, 41), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "without a changeover": (
        [Cue(SHORT, 50, 41)], dict(changeover=0), {},
        [(START, SHORT, 50), (END, CLEARED, 41), (ADVANCE, HIGH, 41), (ADVANCE, LOW, 50),
         (RESUME, 0, 50)]),
    "again on the high re-advance": (
        [Cue(SHORT, 50, 20), Cue(SHORT, 35)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 20), (ADVANCE, HIGH, 20), (START, SHORT, 35),
         (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]),
    "again at the changeover": (
        [Cue(SHORT, 50, 20), Cue(SHORT, 42, 12)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 20), (ADVANCE, HIGH, 20), (START, SHORT, 42),
         (END, CLEARED, 12), (ADVANCE, HIGH, 12), (ADVANCE, LOW, 42), (RESUME, 0, 50)]),
    "again on the low re-advance": (
        [Cue(SHORT, 50, 20), Cue(SHORT, 45)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 20), (ADVANCE, HIGH, 20), (ADVANCE, LOW, 42),
         (START, SHORT, 45), (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]),
    "again where it began": (
        [Cue(SHORT, 50, 45), Cue(SHORT, 50)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 45), (ADVANCE, LOW, 45), (START, SHORT, 50),
         (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]),
    "again before the gain: limit from the first": (
        [Cue(SHORT, 50, 45), Cue(SHORT, 59)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 45), (ADVANCE, LOW, 45), (RESUME, 0, 50),
         (START, SHORT, 59), (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]),
    "again after the gain: limit from there": (
        [Cue(SHORT, 50, 45), Cue(SHORT, 60)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 45), (ADVANCE, LOW, 45), (RESUME, 0, 50),
         (START, SHORT, 60), (END, AT_LIMIT, 20), (HALT, STILL_LIMIT, 20)]),
    "the third return halts": (
        BURST_OF_3, {}, dict(repeats=3),
        [(START, SHORT, 50), (END, CLEARED, 45), (ADVANCE, LOW, 45), (RESUME, 0, 50),
         (START, SHORT, 51), (END, CLEARED, 46), (ADVANCE, LOW, 46), (RESUME, 0, 51),
         (START, SHORT, 52), (END, CLEARED, 47), (ADVANCE, LOW, 47), (RESUME, 0, 52),
         (HALT, BURST, 53)]),
    "the first return halts": (
        BURST_OF_3, {}, dict(repeats=1),
        [(START, SHORT, 50), (END, CLEARED, 45), (ADVANCE, LOW, 45), (RESUME, 0, 50),
         (HALT, BURST, 51)]),
    "a gain of 1 ends every burst": (
        BURST_OF_3, {}, dict(repeats=1, gain=1),
        [(START, SHORT, 50), (END, CLEARED, 45), (ADVANCE, LOW, 45), (RESUME, 0, 50),
         (START, SHORT, 51), (END, CLEARED, 46), (ADVANCE, LOW, 46), (RESUME, 0, 51),
         (START, SHORT, 52), (END, CLEARED, 47), (ADVANCE, LOW, 47), (RESUME, 0, 52),
         (START, SHORT, 53), (END, CLEARED, 48), (ADVANCE, LOW, 48), (RESUME, 0, 53)]),
    "before the first point": (
        [Cue(SHORT, 5)], {}, {},
        [(START, SHORT, 5), (END, AT_LIMIT, -35), (HALT, STILL_LIMIT, -35)]),
    "the back limit comes before the limit": (
        [Cue(SHORT, 50)], {}, dict(back_limit=11),
        [(START, SHORT, 50), (END, AT_BACK_LIMIT, 11), (HALT, STILL_BACK_LIMIT, 11)]),
    "the back limit is at the limit": (
        [Cue(SHORT, 50)], {}, dict(back_limit=10),
        [(START, SHORT, 50), (END, AT_LIMIT, 10), (HALT, STILL_LIMIT, 10)]),
    "below the back limit already": (
        [Cue(SHORT, 50)], {}, dict(back_limit=60),
        [(START, SHORT, 50), (END, AT_BACK_LIMIT, 50), (HALT, STILL_BACK_LIMIT, 50)]),
    "a jump": (
        [Cue(JUMP, 50)], {}, {},
        [(START, JUMP, 50), (END, AT_LIMIT, 25), (ADVANCE, HIGH, 25), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "a jump to the back limit": (
        [Cue(JUMP, 50)], {}, dict(back_limit=30),
        [(START, JUMP, 50), (END, AT_BACK_LIMIT, 30), (ADVANCE, HIGH, 30), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "a jump needs no data": (
        [Cue(JUMP, 50)], dict(valid=False), {},
        [(START, JUMP, 50), (END, AT_LIMIT, 25), (ADVANCE, HIGH, 25), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "a short at the top of a jump": (
        [Cue(JUMP, 50), Cue(SHORT, 25, 15, forward=False)], {}, {},
        [(START, JUMP, 50), (END, AT_LIMIT, 25), (START, SHORT, 25), (END, CLEARED, 15),
         (ADVANCE, HIGH, 15), (ADVANCE, LOW, 42), (RESUME, 0, 50)]),
    "a short on a jump's way up is seen at its top": (
        [Cue(JUMP, 50), Cue(SHORT, 40, forward=False)], {}, {},
        [(START, JUMP, 50), (END, AT_LIMIT, 25), (START, SHORT, 25), (END, AT_LIMIT, 10),
         (HALT, STILL_LIMIT, 10)]),
    "a short at the top of a jump beyond the limit": (
        [Cue(JUMP, 50), Cue(SHORT, 0, forward=False)], dict(jump_distance=50), {},
        [(START, JUMP, 50), (END, AT_LIMIT, 0), (START, SHORT, 0), (END, AT_LIMIT, 0),
         (HALT, STILL_LIMIT, 0)]),
    "a short on a jump's way down": (
        [Cue(JUMP, 50), Cue(SHORT, 30, 20)], {}, {},
        [(START, JUMP, 50), (END, AT_LIMIT, 25), (ADVANCE, HIGH, 25), (START, SHORT, 30),
         (END, CLEARED, 20), (ADVANCE, HIGH, 20), (ADVANCE, LOW, 42), (RESUME, 0, 50)]),
    "the operator": (
        [Cue(OPERATOR, 50)], {}, {},
        [(START, OPERATOR, 50), (END, AT_LIMIT, 10), (ADVANCE, HIGH, 10), (ADVANCE, LOW, 42),
         (RESUME, 0, 50)]),
    "the operator in the fast re-advance": (
        [Cue(SHORT, 50, 20), Cue(OPERATOR, 30)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 20), (ADVANCE, HIGH, 20), (START, OPERATOR, 30),
         (END, AT_LIMIT, 10), (ADVANCE, HIGH, 10), (ADVANCE, LOW, 42), (RESUME, 0, 50)]),
    "the operator in the slow re-advance": (
        [Cue(SHORT, 50, 45), Cue(OPERATOR, 47)], {}, {},
        [(START, SHORT, 50), (END, CLEARED, 45), (ADVANCE, LOW, 45), (START, OPERATOR, 47),
         (END, AT_LIMIT, 10), (ADVANCE, HIGH, 10), (ADVANCE, LOW, 42), (RESUME, 0, 50)]),
    "a short without data": (
        [Cue(SHORT, 50)], dict(valid=False), {}, [(HALT, NO_DATA, 50)]),
    "the operator without data": (
        [Cue(OPERATOR, 50)], dict(valid=False), {}, [(HALT, NO_DATA, 50)]),
}


@pytest.mark.parametrize("name", CASES)
def test_rule(simulate, name):
    cues, changes, rules, expected = CASES[name]
    bench = play(simulate, cues, change(**changes), rules=rules)
    assert outline(bench) == expected


def test_speeds_and_distances_are_reported(simulate):
    bench = play(simulate, [Cue(SHORT, 50, 15), Cue(SHORT, 40, 14), Cue(SHORT, 45, 15),
                            Cue(JUMP, 100), Cue(SHORT, 80, 70)])
    starts = [event[4] for event in bench.events if event[0] == START]
    assert starts == [ONE // 10, DATA.high_rate, DATA.low_rate, ONE // 10, DATA.jump_high_rate]
    advances = [event[3:5] for event in bench.events if event[0] == ADVANCE]
    assert advances == [(35, 8), (36, 8), (8, 0), (35, 8), (8, 0), (25, 8), (30, 8), (8, 0)]
    ends = [event[3:5] for event in bench.events if event[0] == END]
    rates = [DATA.rate] * 3 + [DATA.jump_rate, DATA.rate]
    assert [pulses for pulses, _ in ends] == [34, 25, 29, 24, 9]
    for (pulses, clocks), rate in zip(ends, rates, strict=True):
        assert abs(clocks - pulses * ONE / rate) <= 1
