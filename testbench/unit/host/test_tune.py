# SPDX-License-Identifier: Apache-2.0
"""Tuning against drives that are simulated here, with friction and limits that the fit lacks."""

import math
import random
import re
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from host.errors import UsageError
from host.tune.command import tune
from host.tune.drive import (
    MODEL_LAG_S,
    Drive,
    Fit,
    Loop,
    Sample,
    overshoot,
    phase_margin,
    response,
)
from host.tune.tune import Measured, TuneError, loop_of, measured, proposal, settings_of, speed_of
from softcore.tables.settings import SETTINGS
from testbench.some import some

TICK_S = 5e-5
SET = {row.name: row.default for row in SETTINGS}
GAIN = SET["loop_gain"]
TRAVEL_MM = 3.0
HEARD_S = 0.02


@dataclass
class Real:
    """A drive: speed loop and filter, dead time, Coulomb friction, limit of acceleration."""

    gain: float = 1.0
    offset: float = 0.0
    dead_s: float = 0.0
    friction: float = 0.0       # mm/s that the speed loop falls short of by it
    acceleration: float = 5000.0


class Machine:
    """One axis in its loop, as a link that answers: commands of motion, and status reports."""

    def __init__(self, real, settings, seed=1):
        self.real, self.loop, self.settings = real, loop_of(settings), settings
        self.rng = random.Random(seed)
        self.time_s = 0.0
        self.command_mm = self.place = self.filtered = self.speed = self.model = 0.0
        self.goals, self.goal, self.line, self.feed = [], 0.0, 0, 0.0
        self.line_before, self.line_s = 0, 0.0
        self.late = [0.0] * max(1, round(real.dead_s / TICK_S))
        self.on_line, self.pipe = print, SimpleNamespace(time_s=lambda: self.time_s)
        self.furthest, self.pressed = [], b""
        self.run(0.5)

    def run(self, seconds):
        for _ in range(round(seconds / TICK_S)):
            self.time_s += TICK_S
            if self.goals and self.command_mm == self.goal:
                self.line_before, self.line_s = self.line, self.time_s
                self.line, self.goal = self.goals.pop(0)
            left = self.goal - self.command_mm
            way = math.copysign(min(abs(left), self.feed * TICK_S), left)
            self.command_mm += way
            moving = way / TICK_S if abs(left) > self.feed * TICK_S else 0.0
            error = round((self.command_mm - self.place) * 10_000) / 10_000
            told = (self.loop.gain * error - self.loop.lead * self.model + self.loop.share * moving)
            self.model += (told - self.model) * TICK_S / MODEL_LAG_S
            self.late.append(told)
            real = self.real
            self.filtered += (real.gain * self.late.pop(0) + real.offset
                              - self.filtered) * TICK_S / 1e-3
            wanted = self.filtered - math.copysign(real.friction, self.speed)
            most = real.acceleration * TICK_S
            self.speed += max(-most, min(most, (wanted - self.speed) * TICK_S / 3e-3))
            self.place += self.speed * TICK_S
            self.furthest.append(self.place)

    def status(self):
        self.run(self.rng.uniform(0.002, 0.008))
        error = self.command_mm - self.place
        rests = (self.command_mm == self.goal and not self.goals
                 and abs(self.speed) < 0.05)
        told = {"state": "Idle" if rests else "Run", "MPos": f"0.0000,{self.place:.4f},0.0000",
                "Er": f"0,{round(error * 10_000)},0"}
        self.run(self.rng.uniform(0, 0.001))
        # The firmware may hear late of a block that has begun.
        heard = self.time_s - self.line_s >= self.rng.choice((0.0, HEARD_S))
        return told | {"Ln": str(self.line if heard else self.line_before)}

    def press(self, button):
        self.pressed = button

    def poll(self, timeout_s):
        self.run(max(timeout_s, TICK_S))

    def send_line(self, line):
        assert line == "$$"
        for row in SETTINGS:
            self.on_line(f"${row.number}={self.settings[row.name]}")
        return SimpleNamespace(answer="ok")

    def command(self, line):
        number, axis, way, feed = re.fullmatch(
            r"(?:N(\d+) )?G21 G91 G94 G01 ([XYZ])(-?[\d.]+) F([\d.]+)", line).groups()
        assert axis == "Y"
        end = self.goals[-1][1] if self.goals else self.goal
        self.goals.append((int(number or 0), end + float(way)))
        self.feed = float(feed) / 60


def found_on(real, settings=SET):
    machine = Machine(real, settings)
    return measured(machine, settings_of(machine), "Y", 1, TRAVEL_MM,
                    time_s=lambda: machine.time_s)


# Drives, and whether a turn from 10 to -10 mm/s shows their limit; None if it cannot be told.
LIMITS = [(Real(acceleration=2000), True), (Real(acceleration=20_000), False),
          (Real(1.28, 0.045, 2e-3, 0.1, 3500), None), (Real(acceleration=200), None),
          (Real(1.25, -0.08, 2e-3, 0.3, 300), None), (Real(acceleration=1000), True),
          (Real(0.8, 0.05, 2e-3, 0.0, 3000), True), (Real(acceleration=4000), False)]
DRIVES = [Real(), Real(0.7, 0.05, 2e-3, 0.1), Real(1.3, -0.05, 2e-3, 0.1), Real(0.7, -0.05),
          Real(1.3, 0.05, acceleration=3000)]


@pytest.mark.parametrize(("real", "share"), some(
    [*((one, 100) for one in DRIVES), (DRIVES[1], 0)], (DRIVES[1], 100), (DRIVES[2], 100)))
def test_a_drive_is_found_and_stable_with_what_is_proposed(real, share):
    settings = SET | {"feed_forward": share}
    one = found_on(real, settings)
    # Friction takes a share of the speed that is taken for a lack of gain.
    lost = real.friction / speed_of(settings, "Y")
    assert one.drive.gain == pytest.approx(real.gain * (1 - lost), rel=0.02)
    assert one.drive.offset == pytest.approx(real.offset, abs=0.02)
    assert one.drive.late_s == pytest.approx(4e-3 + real.dead_s, abs=0.6e-3)

    wanted = proposal(settings, [one])
    assert wanted.values["loop_gain"] == pytest.approx(GAIN * one.drive.gain, abs=0.51)
    assert 1.0 < wanted.values["drive_lag_us"] / (4000 + 1e6 * real.dead_s) < 1.35
    machine = Machine(real, settings | wanted.values)
    # The amplifier has not changed: its scale is what the setting now says.
    machine.real = Real(**{**vars(real), "gain": real.gain * GAIN / wanted.values["loop_gain"]})
    machine.run(0.5)
    machine.furthest.clear()
    end = machine.place + 2.0
    machine.command("G21 G91 G94 G01 Y2.0000 F600")
    most = 0.0
    for _ in range(400):
        machine.run(0.001)
        most = max(most, abs(machine.command_mm - machine.place))
    assert max(machine.furthest) - end <= 10 * (4e-3 + real.dead_s)
    assert abs(machine.speed) < 0.02, "it swings"
    assert most * 10_000 <= wanted.values["follow_moving"]
    assert abs(machine.command_mm - machine.place) * 10_000 <= wanted.values["follow_stopped"]


@pytest.mark.parametrize(("real", "seen"), some(LIMITS, *LIMITS[:3]))
def test_the_greatest_acceleration_is_found_or_bounded_or_not_told(real, seen):
    one = found_on(real)
    print(one.fit)
    settings = SET | {"step_axes": 5}   # Y alone has a position loop
    wanted = proposal(settings, [one])
    if one.fit.least is None:
        assert seen is None
        assert "back_acceleration_mm_s2" not in wanted.values
        assert "hides the acceleration of Y" in " ".join(wanted.notes)
        return
    assert 0.7 * min(real.acceleration, 2 * 10 / 4e-3) <= one.fit.least <= real.acceleration
    assert math.isinf(one.fit.most) != seen
    assert not seen or one.fit.most >= real.acceleration
    assert wanted.values["back_acceleration_mm_s2"] == int(0.8 * one.fit.least)


def test_what_keeps_the_way_back_from_a_proposal_is_told():
    free, limited = (Measured("Y", (Sample(0.0, 0.0, 10.0),), Fit(Drive(), 1e-4, 3500.0, most))
                     for most in (math.inf, 3900.0))
    alone = SET | {"step_axes": 5}
    for settings, one, note in (
            (SET, free, "$470 is not proposed: it is for all axes, so measure X, Z, too."),
            (alone | {"back_acceleration_mm_s2": 5000}, free, "it may stay"),
            (alone | {"acceleration_mm_s2": 9000}, limited, "$411=9000 mm/s2 is more than 2800")):
        found = proposal(settings, [one])
        assert note in " ".join(found.notes)
        assert ("back_acceleration_mm_s2" in found.values) == (one is limited)


def test_turns_that_a_slow_link_interrupts_are_left_out():
    class Slow(Machine):
        def command(self, line):
            self.run(0.08)
            super().command(line)

    machine = Slow(Real(acceleration=1000), SET)
    one = measured(machine, settings_of(machine), "Y", 1, 0.5, time_s=lambda: machine.time_s)
    assert len(one.samples) > 20
    assert not any(sample.before for sample in one.samples)


def test_the_response_is_that_of_the_formula():
    """The plain loop, and a drive as the controller models it with feed-forward: its lag alone."""
    times = np.linspace(0, 0.1, 50)
    exact = Drive(lag_s=MODEL_LAG_S)
    assert response(exact, Loop(50, 1), 10, times) == pytest.approx(
        10 * MODEL_LAG_S * (1 - np.exp(-times / MODEL_LAG_S)), abs=2e-3)
    assert overshoot(exact, Loop(50, 1), 10) < 1e-3
    quick = Drive(lag_s=1e-4)
    assert response(quick, Loop(50, 0), 10, times) == pytest.approx(
        10 / 50 * (1 - np.exp(-50 * times)), abs=2e-3)
    assert phase_margin(quick, Loop(50, 0)) == pytest.approx(90, abs=1)
    assert phase_margin(Drive(lag_s=1e-4, dead_s=10e-3), Loop(50, 0)) == pytest.approx(
        90 - math.degrees(0.5), abs=1)


def test_axes_that_differ_are_told():
    drives = [found_on(Real(gain)) for gain in (0.8, 1.2)]
    found = [replace(one, axis=axis) for axis, one in zip("XY", drives, strict=True)]
    notes = " ".join(proposal(SET, found).notes)
    assert re.search(r"X has (40\.\d|39\.\d) 1/s, not 50: \$456 is for all axes", notes), notes
    assert re.search(r"Y has (60\.\d|59\.\d) 1/s, not 50", notes), notes


@pytest.mark.parametrize(("real", "settings", "travel", "complaint"), [
    (Real(), {"step_axes": 2}, 3.0, "axis Y is driven by steps: it has no position loop to tune."),
    (Real(), {}, 0.1, "axis Y: 0.1 mm are too short for the reports that come; give more "
     "travel."),
    (Real(gain=0.0), {}, 3.0, "axis Y: its motion has not ended within 11 s, and is held now"),
])
def test_what_cannot_be_measured_is_told(real, settings, travel, complaint):
    machine = Machine(real, SET | settings)
    if not real.gain:
        machine.status = lambda: (machine.run(0.05), {
            "state": "Run", "MPos": "0.0,0.0,0.0", "Er": f"0,{machine.command_mm * 10_000:.0f},0"
        })[1]
    with pytest.raises(TuneError, match=re.escape(complaint)):
        measured(machine, settings_of(machine), "Y", 1, travel, time_s=lambda: machine.time_s)
    assert machine.pressed == (b"!" if "is held now" in complaint else b"")


def test_a_drive_that_goes_against_its_command_is_told():
    class Swapped(Machine):
        def status(self):
            self.run(0.004)
            # Er falls with the speed: the coder runs ahead of the command.
            speed = math.copysign(self.feed, self.goal - self.command_mm) * (
                self.command_mm != self.goal)
            error = -0.6 * speed
            return {"state": "Run" if speed else "Idle", "Ln": str(self.line),
                    "MPos": f"0,{self.command_mm - error},0", "Er": f"0,{round(error * 10_000)},0"}
    machine = Swapped(Real(), SET)
    with pytest.raises(TuneError, match="axis Y: the drive goes against its command"):
        measured(machine, settings_of(machine), "Y", 1, TRAVEL_MM, time_s=lambda: machine.time_s)


def test_settings_that_are_not_listed_are_told():
    machine = Machine(Real(), SET)
    machine.send_line = lambda line: SimpleNamespace(answer="error:3")
    with pytest.raises(TuneError, match="does not list its settings loop_gain"):
        settings_of(machine)


@pytest.mark.parametrize(("gain", "complaint"), [
    (0.1, "a gain of 5 1/s; $456 takes 10 at least. Raise"),
    (9.0, "a gain of 450 1/s; $456 takes 400 at most. Lower")])
def test_a_gain_that_cannot_be_set_is_told(gain, complaint):
    with pytest.raises(TuneError, match=re.escape(complaint)):
        proposal(SET, [Measured("X", (), Fit(Drive(gain), 0.0, 1000.0, math.inf))])


def test_speed_is_one_that_the_machine_reaches_at_once():
    assert speed_of(SET, "X") == 10
    assert speed_of(SET | {"start_speed_um_s": 4000}, "X") == 4
    assert speed_of(SET | {"highest_speed_z": 300}, "Z") == 5


@pytest.mark.parametrize(("ways", "travel", "complaint"), [
    ("Z", 1, '"Z" is no direction; write an axis and a sign, such as X+.'),
    ("Z+", 0, "the travel must be above 0 mm, and finite, not 0."),
    ("Z+", math.nan, "the travel must be above 0 mm, and finite, not nan."),
])
def test_arguments_that_mean_nothing_are_told(ways, travel, complaint):
    with pytest.raises(UsageError, match=re.escape(complaint)):
        tune("x", ways, travel_mm=travel, baud=1, machine="sinker", picture=None, console=None)




@pytest.mark.parametrize("bound", [0, 5000])
def test_a_bound_of_corners_that_is_off_is_told(bound):
    rest = Sample(0.0, 0.0, 10.0)
    axes = [Measured("Y", (rest,), Fit(Drive(), 0.0, None, None))]
    told = [note for note in proposal(SET | {"corner_deviation_nm": bound}, axes).notes
            if note.startswith("$540 is 0")]
    assert len(told) == (not bound)
