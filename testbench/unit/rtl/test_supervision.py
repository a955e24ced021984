# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.supervision``, against the exact model and around a small drive.

``testbench/cosim/test_coder.py`` shows the deviation of an axis with a failed coder on the machine.
"""

import math

import numpy as np
import pytest

from rtl.motion.supervision import TICK_S, Supervision, tick_clocks
from rtl.states import Check
from testbench.models.encoder import CYCLE
from testbench.models.supervision import CHECKS
from testbench.models.supervision import Supervision as Model
from testbench.native.supervision import INPUTS, compiled
from testbench.refusal import refuses
from testbench.simulators.benches import settle

GAIN = 1678     # 50 1/s
TICK = 24       # clocks; on a machine there are more, which changes nothing


class Drive:
    """A coder on a drive of first order that follows Er, and their faults.

    ``share`` is its gain as a share of 50 1/s, ``lag`` is in ticks. An edge of the coder is so many
    pulses, which come one in each clock.
    """

    def __init__(self, share=1.0, lag=128, pulses=1):
        self.share, self.lag, self.pulses = share, lag, pulses
        self.due = 0
        self.speed = self.way = 0.0
        self.place = 0
        self.stuck = {}         # phase: level
        self.swapped = False
        self.levels = CYCLE[0]

    def clock(self, er):
        """Go on; the feedback pulse, of one phase that has changed."""
        told = self.share * er * GAIN / 2**20 / TICK
        self.speed += (told - self.speed) / (self.lag * TICK)
        self.way += self.speed
        if self.way >= (self.place + 1) * self.pulses:
            self.place += 1
        elif self.way < self.place * self.pulses - 0.2:
            self.place -= 1
        before = self.levels
        a, b = CYCLE[self.place % 4][::-1 if self.swapped else 1]
        self.levels = self.stuck.get("a", a), self.stuck.get("b", b)
        moved = (CYCLE.index(self.levels) - CYCLE.index(before)) % 4
        self.due += self.pulses * {0: 0, 1: 1, 2: 0, 3: -1}[moved]
        pulse = (self.due > 0) - (self.due < 0)
        self.due -= pulse
        return pulse


class Run:
    """Clocks of the compiled block and of the model, side by side."""

    def __init__(self, tick=TICK, *, coarse=False):
        self.model, self.tick, self.coarse = Model(), tick, coarse
        self.rows, self.expected = [], []

    @property
    def found(self):
        return self.model.check

    def clock(self, *, er=0, gain=GAIN, standing=False, resting=False, fp=0, levels=(0, 0), on=True,
              clear=False):
        tick = len(self.rows) % self.tick == 0
        self.expected.append(CHECKS.index(self.model.check))
        self.rows.append((tick, gain, min(abs(er), 32767), er < 0, standing, resting, abs(fp),
                          fp < 0, *levels, self.coarse, on, clear))
        self.model.clock(tick=tick, gain=gain, er=er, standing=standing, resting=resting, fp=fp,
                         a=levels[0], b=levels[1], coarse=self.coarse, on=on, clear=clear)

    def compare(self):
        """Compare the block with the model in every clock; return the names of all findings."""
        self.clock()  # what the last one has found
        found = compiled(self.rows)
        differ = np.nonzero(found != np.array(self.expected))[0]
        assert not len(differ), f"clock {differ[0]}: {found[differ[0]]}"
        return {CHECKS[number] for number in found}


class Loop:
    """The position loop around a drive, with the supervision.

    ``window`` and ``offset`` of the drive are in pulses of Er.
    """

    window, offset = 1, 0

    def __init__(self, drive=None, gain=GAIN, ahead=False):
        self.drive, self.gain = drive or Drive(), gain
        self.run = Run(coarse=self.drive.pulses > 1)
        self.ahead = ahead      # with velocity feed-forward
        self.command = 0.0
        self.count = self.fp = 0

    def go(self, ticks, rate):
        """Run at a rate, pulses a tick; ``rate`` may be a function of the tick.

        Returns the clocks until a finding, or None.
        """
        for clock in range(ticks * TICK):
            pace = rate(clock // TICK) if callable(rate) else rate
            self.command += pace / TICK
            er = math.floor(self.command) - self.count
            told = er + round(pace * 2**20 / GAIN) if self.ahead else er
            self.run.clock(er=told, gain=self.gain, standing=abs(er) <= self.window,
                           resting=not pace, fp=self.fp, levels=self.drive.levels)
            self.fp = self.drive.clock(told + self.offset)
            self.count += self.fp
            if self.run.found != "none":
                self.run.clock(levels=self.drive.levels)
                return clock
        return None


def test_checks_have_the_numbers_of_the_model():
    assert [check.name.lower().replace("_", " ") for check in Check] == list(CHECKS)


def walk(rng, clocks, longest, *, coarse=False):
    """A run at random: commands, drives, and faults of the coder, each for ``longest`` at most."""
    run, drive = Run(coarse=coarse), Drive()
    till = er = 0
    noise, on = False, True
    for clock in range(clocks):
        if clock >= till:
            till = clock + rng.randrange(200, longest)
            er = rng.choice((0, rng.randint(-20, 20), rng.randint(-300, 300),
                             rng.randint(-5000, 5000), rng.randint(-40_000, 40_000)))
            drive.share = rng.choice((1, 1, 1, 0.9, 0.6, 1.4, 0.3, 0.1, 3, 9, 0, -1))
            drive.stuck = {phase: rng.randrange(2) for phase in rng.choice(
                ("", "", "", "", "a", "b", "ab"))}
            noise, on = rng.random() < 0.25, rng.random() < 0.95
            resting = rng.random() < 0.5
        on = on != (rng.random() < 1e-4)
        if noise and rng.random() < 0.1:
            drive.stuck["a"] = rng.randrange(2)
        fp = drive.clock(max(-32767, min(32767, er)))
        run.clock(er=er, standing=abs(er) <= 9 + 60 * resting, resting=resting, fp=fp,
                  levels=drive.levels, on=on,
                  clear=run.found != "none" and rng.random() < 0.002)
    return run


@pytest.mark.parametrize(("clocks", "longest", "coarse"), [
    (200_000, 20_000, False), (600_000, 60_000, True)])
def test_follows_the_model(rng, clocks, longest, coarse):
    assert len(walk(rng, clocks, longest, coarse=coarse).compare()) > 3 - coarse


def test_a_span_goes_on_over_the_end_of_a_stretch():
    """A phase gets stuck just before the end, in a span that has hardly begun."""
    run, drive = Run(), Drive(lag=1)
    er = round(0.4 * 2**20 / GAIN)      # pulses a tick: the stretch ends after 221
    while run.found == "none":
        if run.model.stretch.pulses >= 215 and not drive.stuck:
            drive.stuck = {"a": drive.levels[0]}
            stuck = len(run.rows)
        run.clock(er=er, fp=drive.clock(er), levels=drive.levels)
    # It has had an edge in the span that ends after 64 more pulses, and none in the next one.
    assert (64 + 64) / 0.4 < (len(run.rows) - stuck) / TICK < (64 + 64 + 32) / 0.4
    assert run.compare() == {"none", "phase a"}


def leads_to(check):
    """A run that ends with this finding, as soon as it can be made."""
    run, drive = Run(100 if check == "rate" else TICK), Drive()
    while run.found == "none":
        clock = len(run.rows)
        assert clock < 20_000
        if check == "rate":
            run.clock(fp=(-1) ** clock, levels=CYCLE[clock % 2])
            continue
        if clock == 2000:
            drive.stuck = {phase: level for phase, level in zip("ab", drive.levels, strict=True)
                           if check in ("silent", f"phase {phase}")}
        drive.share = {"against": -1, "share": 0.1, "model": 9}.get(check, 1)
        er = 150 if check == "share" else 2000
        run.clock(er=er, fp=drive.clock(er), levels=drive.levels)
    run.clock()
    return run


@pytest.mark.parametrize("check", CHECKS[1:])
def test_each_finding_is_the_models_in_a_simulator(simulate, check):
    """On the Verilog; the longer tests of this file run as compiled code of the netlist."""
    run, dut = leads_to(check), Supervision()
    assert run.found == check
    seen = set()

    async def bench(ctx):
        before = None
        for row, expected in zip(run.rows, run.expected, strict=True):
            for place, name in enumerate(INPUTS):
                if before is None or row[place] != before[place]:
                    ctx.set(getattr(dut, name), row[place])
            before = row
            await settle(ctx)
            assert ctx.get(dut.check).value == expected
            seen.add(expected)
            await ctx.tick()

    simulate(dut, bench)
    assert max(seen) == CHECKS.index(check)


@pytest.mark.parametrize(("share", "lag"), [(0.7, 64), (0.7, 190), (1, 128), (1.3, 64), (1.3, 190)])
def test_a_sound_drive_never_trips(share, lag):
    """Commanded 10 mm/s one way and 15 the other, in turn; gains off by 0.3, lags of 2 to 6 ms."""
    loop = Loop(Drive(share, lag))
    assert loop.go(6000, lambda tick: 3.2 if tick % 4000 < 2000 else -4.8) is None
    assert loop.run.compare() == {"none"}


@pytest.mark.parametrize("pulses", [5, 20])
@pytest.mark.parametrize("ahead", [False, True])
def test_a_coarse_coder_never_trips(pulses, ahead):
    """Fast ways with ends, and slow ones: at an end the model goes on by some edges."""
    loop = Loop(Drive(1, 105, pulses), ahead=ahead)
    loop.window = 15
    assert loop.go(4000, lambda tick: (6.4, 0, -6.4, 0, 0.5, -0.064)[tick // 400 % 6]) is None
    assert loop.run.compare() == {"none"}


# Pulses a tick.
FEEDS = {"F0.1": 0.0005, "F0.15": 0.0008, "F1": 0.0053, "F12": 0.064, "F300": 1.6, "F1800": 9.6}
AWAY = 800      # pulses by which the true place may differ from where it would have been


@pytest.mark.parametrize(("fault", "feed"), [
    ("a", "F12"), ("a", "F300"), ("b", "F12"), ("b", "F1800"), ("ab", "F0.1"), ("ab", "F1800"),
    ("swap", "F12"), ("swap", "F1800")])
def test_a_failing_coder_is_found_in_time(fault, feed):
    loop, rate = Loop(), FEEDS[feed]
    drive = loop.drive
    assert loop.go(1500, rate) is None
    drive.swapped = fault == "swap"
    if not drive.swapped:
        drive.stuck = {phase: level for phase, level in zip("ab", drive.levels, strict=True)
                       if phase in fault}
    begun = drive.way
    clocks = loop.go(25_000, rate)
    assert loop.run.found in {"a": {"phase a"}, "b": {"phase b"}, "ab": {"silent"}}.get(
        fault, {"against", "model", "share"})
    assert abs(drive.way - begun - rate * clocks / TICK) < AWAY
    assert loop.run.compare() == {"none", loop.run.found}


@pytest.mark.parametrize("fault", ["a", "b", "ab", "swap"])
@pytest.mark.parametrize("feed", ["F12", "F300"])
def test_a_failing_coarse_coder_is_found_in_time(fault, feed):
    loop, rate = Loop(Drive(pulses=20)), FEEDS[feed]
    loop.window = 15
    drive = loop.drive
    assert loop.go(3000, rate) is None
    drive.swapped = fault == "swap"
    if not drive.swapped:
        drive.stuck = {phase: level for phase, level in zip("ab", drive.levels, strict=True)
                       if phase in fault}
    begun = drive.way
    clocks = loop.go(25_000, rate)
    assert loop.run.found != "none"
    assert abs(drive.way - begun - rate * clocks / TICK) < AWAY
    assert loop.run.compare() == {"none", loop.run.found}


@pytest.mark.parametrize(("ahead", "further"), [
    (True, 0), (True, 1000), (False, 1000),
    *(pytest.param(ahead, further, marks=pytest.mark.soak)
      for ahead in (False, True) for further in range(100, 2000, 200))])
def test_a_cut_coder_is_found_wherever_the_stretch_is(further, ahead):
    """At F12 a stretch lasts 2000 ticks. The first edge that is missed can be any of it."""
    loop = Loop(ahead=ahead)
    assert loop.go(1100 + further, FEEDS["F12"]) is None
    loop.drive.stuck = dict(zip("ab", loop.drive.levels, strict=True))
    clocks = loop.go(2000, FEEDS["F12"])
    assert clocks is not None
    assert clocks / TICK * TICK_S < 0.042
    assert loop.run.compare() == {"none", "silent"}


@pytest.mark.parametrize(("ahead", "lag", "rate"), [
    (True, 64, 3.2), *(pytest.param(*one, marks=pytest.mark.soak) for one in (
        (True, 190, 3.2), (False, 190, 3.2), (False, 64, 9.6)))])
def test_a_drive_that_starts_and_stops_all_the_time_never_trips(ahead, lag, rate):
    """With feed-forward at once, without a ramp: the model goes on when the drive stands."""
    loop = Loop(Drive(1, lag), ahead=ahead)
    assert loop.go(3000, lambda tick: rate * (tick % 620 < 310)) is None
    assert loop.run.compare() == {"none"}


@pytest.mark.parametrize(("feed", "offset"), [("F1", -9), *(
    pytest.param(feed, offset, marks=pytest.mark.soak)
    for feed in ("F0.15", "F1") for offset in (-9, 9))])
def test_a_slow_axis_may_start_as_late_as_its_offset_makes_it(feed, offset):
    loop = Loop(ahead=True)
    loop.window, loop.offset = 10, offset
    assert loop.go(round(13 / FEEDS[feed]), FEEDS[feed]) is None
    assert loop.count > 2
    assert loop.run.compare() == {"none"}


@pytest.mark.parametrize("factor", [9, 1 / 9])
@pytest.mark.parametrize("feed", ["F12", "F300"])
def test_a_gain_that_is_set_wrong_trips_in_motion(factor, feed):
    loop = Loop(gain=round(GAIN * factor))
    assert loop.go(12_000, FEEDS[feed]) is not None
    assert loop.run.found in ("share", "model")
    loop.run.compare()


def test_a_drive_that_runs_by_itself_is_found():
    run, drive = Run(), Drive()
    for _ in range(200 * TICK):
        run.clock(fp=drive.clock(0), levels=drive.levels, standing=True)
    while run.found == "none":
        run.clock(fp=drive.clock(3000), levels=drive.levels, standing=True)
        assert drive.way < 250, "20 um, and what is forgotten"
    assert run.found == "model"
    run.compare()


def test_a_drive_that_coasts_when_it_is_enabled_is_known_to():
    loop = Loop()
    loop.drive.speed = 6.4 / TICK       # 20 mm/s
    for _ in range(600 * TICK):
        loop.drive.speed = 6.4 / TICK
        loop.run.clock(fp=loop.drive.clock(0), levels=loop.drive.levels, on=False)
    assert loop.go(2000, 0) is None
    assert loop.run.compare() == {"none"}


@pytest.mark.parametrize(("er", "standing", "resting", "found"), [
    (1, True, False, "none"), (15, True, False, "none"), (16, True, False, "silent"),
    (12, False, False, "silent"), (12, False, True, "silent"), (63, True, True, "none"),
    (64, True, True, "silent"), (63, True, False, "silent")])
def test_a_drive_may_have_offset_and_friction_within_its_window(er, standing, resting, found):
    run = Run()
    for _ in range(170_000):        # a pulse of Er is a pulse told in 625 ticks
        run.clock(er=er, standing=standing, resting=resting)
        if run.found != "none":
            break
    assert run.found == found
    run.compare()


def test_pulses_faster_than_any_drive():
    """Noise: as many pulses up as down, so that the axis is at its place."""
    run = Run(tick=100)
    for clock in range(3000):
        run.clock(fp=(-1) ** clock, levels=CYCLE[clock % 2])
        if run.found != "none":
            break
    # The first clocks, to the first tick, are not judged.
    assert run.found == "rate"
    assert clock == 2459
    run.compare()


def test_what_was_found_stays_until_it_is_cleared():
    loop = Loop()
    loop.drive.stuck = {"a": 0, "b": 0}
    assert loop.go(2000, 1.6) is not None
    for on in (True, False, True):
        for _ in range(40):
            loop.run.clock(on=on)
    loop.run.clock(on=False, clear=True)
    assert loop.run.compare() == {"none", "silent"}
    assert loop.run.found == "none"


def test_refuses_what_cannot_be():
    refuses(Supervision, r"the allowance must be at least 1 pulse, not 0", allowance=0)
    refuses(Supervision, r"the highest rate must be at least 1 pulse, not 0", fastest=0)
    assert tick_clocks(2_000_000) == 64
    with pytest.raises(ValueError, match=r"a clock of 500000 Hz has 16 clocks in a tick of 32 us"):
        tick_clocks(500_000)
