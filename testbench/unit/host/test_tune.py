# SPDX-License-Identifier: Apache-2.0
"""Tuning against drives that are simulated here, with friction and limits that the fit lacks."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from host.errors import UsageError
from host.tune.command import told_of, tune
from host.tune.drive import (
    Drive,
    Fit,
    Loop,
    Sample,
    best_model_s,
    overshoot,
    phase_margin,
    response,
)
from host.tune.motions import TuneError, measuring, settings_of, speed_of
from host.tune.tune import Measured, measured, proposal
from softcore.tables.settings import NO_OFFSET, PULSES_PER_MM
from testbench.driven import MODEL_LAG_S, SET, Machine, Real
from testbench.some import some

GAIN = SET["loop_gain"]
TRAVEL_MM = 3.0
BESIDE = 15         # pulses from its place, at rest or slowly, with what is proposed


def found_on(real, settings=SET):
    machine = Machine(real, settings)
    with measuring(machine, settings) as kept:
        one = measured(machine, settings_of(machine), "Y", 1, TRAVEL_MM,
                       time_s=lambda: machine.time_s)
    assert machine.settings == settings | ({"window": 63} if kept else {})
    return one


# Drives, and whether a turn from 10 to -10 mm/s shows their limit; None if it cannot be told.
LIMITS = [(Real(acceleration=2000), True), (Real(acceleration=20_000), False),
          (Real(1.28, 0.045, 2e-3, 0.1, 3500), None), (Real(acceleration=200), None),
          (Real(1.25, -0.08, 2e-3, 0.3, 300), None), (Real(acceleration=1000), True),
          (Real(0.8, 0.05, 2e-3, 0.0, 2600), True), (Real(acceleration=4000), False)]
DRIVES = [Real(), Real(0.7, 0.05, 2e-3, 0.1), Real(1.3, -0.05, 2e-3, 0.1), Real(0.7, -0.05),
          Real(1.3, 0.05, acceleration=3000)]


STEPS = ("drive_offset_y", "drive_friction_y")


@pytest.mark.parametrize(("real", "share"), some(
    [*((one, 100) for one in DRIVES), (DRIVES[1], 0)], (DRIVES[1], 100)))
def test_a_drive_is_found_and_stable_with_what_is_proposed(real, share):
    settings = SET | {"feed_forward": share}
    one = found_on(real, settings)
    assert one.drive.gain == pytest.approx(real.gain, rel=0.01)
    assert one.drive.offset == pytest.approx(real.offset, abs=0.003)
    assert one.drive.friction == pytest.approx(real.friction, abs=0.006)
    assert one.drive.late_s == pytest.approx(4e-3 + real.dead_s, abs=0.3e-3)

    wanted = proposal(settings, [one])
    assert wanted.values["loop_gain"] == pytest.approx(GAIN * one.drive.gain, abs=0.51)
    # The firmware allows for a tenth more.
    assert 0.93 < wanted.values["drive_lag_us"] / (4000 + 1e6 * real.dead_s) < 1.05
    step = real.gain * GAIN / PULSES_PER_MM     # mm/s
    for name, has in zip(STEPS, (NO_OFFSET - real.offset / step, real.friction / step),
                         strict=True):
        assert wanted.values[name] == pytest.approx(has, abs=1.0)

    # The amplifier has not changed: its scale is what the setting now says.
    right = replace(real, gain=real.gain * GAIN / wanted.values["loop_gain"])
    machine = Machine(right, settings | wanted.values)
    machine.furthest.clear()
    end = machine.place + 2.0
    most = goes(machine, 2.0, 600, 0.4)
    assert max(machine.furthest) - end <= 10 * (4e-3 + real.dead_s)
    assert abs(machine.speed) < 0.02, "it swings"
    assert most <= wanted.values["follow_moving"]
    for way in 0.2, -0.2:
        assert goes(machine, way, 10, 0.5) <= wanted.values["follow_moving"]    # it begins
        assert goes(machine, 0.0, 10, 0.5) <= BESIDE, "in even slow motion"
        goes(machine, 0.0, 10, 0.7)
        assert machine.command_mm == machine.goal
        assert goes(machine, 0.0, 10, 0.1) <= BESIDE < wanted.values["follow_stopped"], "at rest"
    anew = proposal(machine.settings, [found_on(right, machine.settings)])
    again = anew.values
    assert "may rest" not in " ".join(anew.notes)
    assert again["loop_gain"] == pytest.approx(wanted.values["loop_gain"], abs=1)
    for name in STEPS:
        assert again[name] == pytest.approx(wanted.values[name], abs=1)


def goes(machine, way, feed, seconds):
    """The greatest following error in pulses while a motion begins, or goes on."""
    if way:
        machine.command(f"G21 G91 G94 G01 Y{way:.4f} F{feed}")
    most = 0.0
    for _ in range(round(seconds * 1000)):
        machine.run(0.001)
        most = max(most, abs(machine.command_mm - machine.place) * PULSES_PER_MM)
    return most


@pytest.mark.parametrize(("real", "seen"), some(LIMITS, *LIMITS[:2]))
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


def inside(drive, loop, w):
    """By which part of its radius a circle of so many rad/s is left to the inside."""
    s = 1j * w
    moved = drive.gain * np.exp(-s * drive.dead_s) / ((1 + s * drive.lag_s)
                                                      * (1 + s * drive.filter_s))
    model = loop.lead / (1 + s * loop.model_s)
    return 1 - abs((loop.gain + loop.share * s) * moved / (s * (1 + model) + loop.gain * moved))


LOOP = Loop(50, 1.0)


@pytest.mark.parametrize("drive", [
    Drive(filter_s=0.5e-3), Drive(dead_s=2e-3), Drive(lag_s=2e-3, filter_s=1e-3)])
def test_with_the_lag_proposed_a_circle_is_kept_to_and_an_end(drive):
    proposed = replace(LOOP, model_s=best_model_s(drive, LOOP))
    assert overshoot(drive, proposed, 10) < 0.3e-3
    for w in 2, 10:
        assert abs(inside(drive, proposed, w)) < 0.1 * abs(inside(drive, Loop(50, 0), w))


@pytest.mark.parametrize("gain", [0.9, 1.0, 1.05])
def test_it_lies_beyond_the_lag_that_would_be_best_for_circles(gain):
    drive = Drive(gain, filter_s=0.5e-3)
    best = (3 * best_model_s(drive, LOOP) - drive.late_s) / 2
    assert best > 1e-3
    assert abs(inside(drive, replace(LOOP, model_s=best), 2)) < 0.01 * inside(drive, Loop(50, 0), 2)


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
        tune("x", ways, travel_mm=travel, baud=1, machine="sinker", picture=None, unlock=False,
             console=None)



@pytest.mark.parametrize("bound", [0, 5000])
def test_a_bound_of_corners_that_is_off_is_told(bound):
    rest = Sample(0.0, 0.0, 10.0)
    axes = [Measured("Y", (rest,), Fit(Drive(), 0.0, None, None))]
    told = [note for note in proposal(SET | {"corner_deviation_nm": bound}, axes).notes
            if note.startswith("$540 is 0")]
    assert len(told) == (not bound)


def by_hand(axis="Y", scatter=0.001, **drive):
    return Measured(axis, (Sample(0.0, 0.0, 10.0),), Fit(
        Drive(**drive), 0.0, None, None, scatter))


# By settings in force and drive as found beside them: offset and its sign, friction of Y. A step of
# the DAC is 0.005 mm/s at 50 1/s.
@pytest.mark.parametrize(("now", "drive", "offset", "friction", "note"), [
    ((0, 0), {"offset": 0.05, "friction": 0.1}, -10, 20, ""),
    ((0, 0), {"offset": -0.05, "friction": 0.1, "gain": 0.5}, 20, 40, ""),
    ((-10, 20), {"offset": 0.01, "friction": 0.02}, -12, 24, ""),
    ((-10, 20), {"offset": -0.1, "friction": -0.05}, 10, 10, ""),
    ((10, 20), {"offset": 0.05, "friction": 0.014}, 0, 20, "friction of +0.014 mm/s beside"),
    ((10, 0), {"friction": 0.1, "scatter": 0.04}, 10, 0, "told from none (up to 0.120)"),
    ((0, 5), {"friction": -0.05}, 0, 0, "Y: slow motion is faster than the gain says, by 0.050"),
    ((0, 0), {"offset": 11.0, "friction": 2.0}, -255, 127, "Y: 2200 steps are needed for $552, "
     "which takes 255 at most"),
    ((0, 0), {"friction": 2.0}, 0, 127, "Y: 400 steps are needed for $555"),
])
def test_offset_and_friction_are_proposed_beside_what_is_made_up_for(now, drive, offset, friction,
                                                                     note):
    settings = SET | {"drive_offset_x": 7, "drive_friction_z": 9,
                      STEPS[0]: NO_OFFSET + now[0], STEPS[1]: now[1]}
    found = proposal(settings, [by_hand(**drive)])
    assert (found.values[STEPS[0]] - NO_OFFSET, found.values[STEPS[1]]) == (offset, friction)
    assert not {"drive_offset_x", "drive_friction_z"} & found.values.keys()
    told = " ".join(found.notes)
    assert note in told
    assert note or not re.search("friction of|steps are|no friction", told)


def test_the_bounds_are_those_of_what_is_left():
    """Offset and friction that are made up for leave a quarter of the friction, and the window."""
    usual, made_up, beyond = (
        proposal(SET, [by_hand(**drive)]).values
        for drive in ({}, {"offset": 0.1, "friction": 0.2}, {"friction": 127 * 0.005 + 0.2}))
    assert usual["follow_stopped"] == math.ceil(1.5 * 15) + 20
    for found, friction in (made_up, 0.05), (beyond, (127 * 0.005 + 0.2) / 4 + 0.2):
        lead = 1 + GAIN * found["model_lag_y_us"] / 1e6
        left = friction * lead / GAIN * PULSES_PER_MM
        assert found["follow_stopped"] == pytest.approx(1.5 * (15 + left) + 20, abs=1)
        assert usual["follow_moving"] < found["follow_moving"]
        assert found["loop_gain"] == usual["loop_gain"]
        assert found["feed_forward"] == usual["feed_forward"]


def test_an_axis_that_may_rest_beside_its_place_is_told():
    one = by_hand(gain=0.7, offset=0.05, friction=0.1)
    told = " ".join(proposal(SET, [one]).notes)
    assert "Y: it may rest up to 43 pulses from its place. With $421=15 the supervision" in told
    assert "may rest" not in " ".join(proposal(SET, [by_hand(offset=0.05)]).notes)
    wide = " ".join(proposal(SET | {"window": 63}, [one]).notes)
    assert "may rest" not in wide
    assert "$421 is 63, as while an axis is measured" in wide
    assert "as delivered it is 15" in wide


def test_what_was_found_is_told_with_what_is_made_up_for():
    one = by_hand(offset=-0.05, friction=0.1)
    assert "offset -0.050 mm/s, friction 0.100 mm/s, lags" in told_of(one, SET)
    assert ("friction 0.100 mm/s beside what $552 and $555 make up for, lags"
            in told_of(one, SET | dict.fromkeys(STEPS, 1)))


def test_friction_holds_a_simulated_drive_and_takes_its_share_of_the_speed():
    times, loop = np.linspace(0, 1, 200), Loop(50, 1, window=63e-4)
    held, free = (response(Drive(friction=friction), loop, 10, times, 0.5)
                  for friction in (0.1, 0.0))
    # 0.1 mm/s more of the command, from Er; the model of the drive takes its part.
    assert held[90] - free[90] == pytest.approx(0.1 * (1 + loop.lead) / 50, rel=0.02)
    assert held[-1] == pytest.approx(0.1 / 50, rel=1e-3), "it stands short of its place"
    assert free[-1] == pytest.approx(0, abs=1e-5)
    made_up = response(Drive(), replace(loop, friction=0.1), 10, times, 0.5)
    assert made_up[90] == pytest.approx(free[90], abs=1e-6)
    turned = response(Drive(friction=0.1), loop, -10, times, before=10)
    assert turned[0] == pytest.approx(held[90], abs=1e-5)
    assert turned[-1] == pytest.approx(-held[90], abs=1e-5)


@pytest.mark.parametrize("share", some([100, 0], 100))
def test_a_slow_loop_is_not_even_when_it_is_read_and_its_friction_is_found(share):
    settings = SET | {"loop_gain": 20, "feed_forward": share}
    drive = found_on(Real(0.7, 0.05, 0.0, 0.1), settings).drive
    assert drive.gain == pytest.approx(0.7, rel=0.01)
    assert drive.offset == pytest.approx(0.05, abs=0.003)
    assert drive.friction == pytest.approx(0.1, abs=0.006)
