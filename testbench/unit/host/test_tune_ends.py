# SPDX-License-Identifier: Apache-2.0
"""What ends a measurement of the drives before its end, and how the machine is left then."""

import re

import pytest

from host.link.link import HOLD, RESET, RefusedError
from host.tune.motions import TuneError, measuring, settings_of
from host.tune.tune import measured
from softcore.tables.settings import assign, named
from testbench.unit.host.test_tune import SET, TRAVEL_MM, Machine, Real

CORNERS, WINDOW, DRY = (named(name) for name in ("corner_deviation_nm", "window", "dry_run_mm_min"))
MEANWHILE = [assign(CORNERS.name, 0), assign(WINDOW.name, 63)]
BEFORE = [assign(row.name, row.default) for row in (CORNERS, WINDOW)]


class Script:
    """A controller in a motion of an hour, as a link: a hold stops it, a reset gives it up."""

    def __init__(self, state="Run"):
        self.state, self.done, self.now, self.errors = state, [], 0.0, "0,0,0"
        self.pipe = self

    def time_s(self):
        return self.now

    def command(self, line):
        if self.state == "Run":
            raise RefusedError(line, "M05 and rest come first")
        self.done.append(line)

    def press(self, button):
        self.done.append(button)
        if button == HOLD and self.state == "Run":
            self.state = "Hold:1"
        elif button == RESET:
            assert self.state == "Hold:0", "a reset in motion loses the position"
            self.state = "Idle"

    def await_greeting(self):
        self.done.append("greeting")

    def poll(self, timeout_s):
        self.now += timeout_s
        if self.state == "Hold:1":
            self.state = "Hold:0"

    def status(self):
        state, _, substate = self.state.partition(":")
        return {"state": state, "Er": self.errors} | ({"substate": substate} if substate else {})


@pytest.mark.parametrize("reason", [KeyboardInterrupt, RefusedError("N3 G01 X3", "no")])
def test_whatever_ends_it_stops_the_motion_and_the_settings_are_as_before(reason):
    link = Script("Idle")

    def moves():
        link.state = "Run"
        raise reason

    with pytest.raises((KeyboardInterrupt, RefusedError)), measuring(link, SET):
        moves()
    assert link.done == [*MEANWHILE, HOLD, RESET, "greeting", *BEFORE]


@pytest.mark.parametrize("state", ["Idle", "Alarm"])
def test_at_rest_and_in_an_alarm_nothing_is_reset(state):
    link = Script("Idle")
    with measuring(link, SET):
        link.state = state
    assert link.done == [*MEANWHILE, *BEFORE]


@pytest.mark.parametrize(("errors", "stays"), [("3,-15,0", False), ("0,0,-16", True)])
def test_a_window_that_an_axis_stands_outside_of_stays_and_this_is_told(errors, stays):
    link = Script("Idle")
    with measuring(link, SET) as kept:
        link.errors = errors
    assert link.done == [*MEANWHILE, *(BEFORE[:1] if stays else BEFORE)]
    assert [re.search(r"stands (\d+) pulses .* Enter (\S+) once", one).groups()
            for one in kept] == ([("16", BEFORE[1])] if stays else [])


def test_a_window_that_is_wide_enough_and_a_bound_that_is_off_stay():
    link = Script("Idle")
    with measuring(link, SET | {WINDOW.name: 100}):
        pass
    with measuring(link, SET | {WINDOW.name: 63, CORNERS.name: 0}):
        pass
    assert link.done == [MEANWHILE[0], BEFORE[0]]


@pytest.mark.parametrize(("reason", "back"), [
    (RefusedError("$421=63", "no"), BEFORE[:1]), (KeyboardInterrupt, BEFORE)])
def test_a_setting_that_is_not_taken_moves_nothing_and_leaves_none(reason, back):
    class Refusing(Script):
        def command(self, line):
            super().command(line)
            if line == MEANWHILE[1]:
                raise reason

    link = Refusing("Idle")
    with pytest.raises((KeyboardInterrupt, RefusedError)), measuring(link, SET):
        raise AssertionError("it moves")
    assert link.done == [*MEANWHILE, *back], "no hold: what is in motion is another's"


def test_settings_that_cannot_be_put_back_is_told():
    link = Script("Idle")

    def falls_silent():
        raise TuneError("the controller has fallen silent.")

    with pytest.raises(TuneError, match=re.escape(
            f"settings are still those of the measurement: enter {BEFORE[0]} and {BEFORE[1]}. "
            "The controller has fallen silent.")), measuring(link, SET):
        link.status = falls_silent


@pytest.mark.parametrize(("changed", "complaint"), [
    ({"state": "Hold", "substate": "1"}, "axis Y: it was held while it moved"),
    ({"Ov": "50,100,100"}, "axis Y: the override of the feed is 50 %"),
    ({"state": "Alarm"}, "axis Y: an alarm came while it moved")])
def test_what_changes_the_speed_ends_the_measurement(changed, complaint):
    class Disturbed(Machine):
        def status(self):
            told = super().status()
            return told | {"Ov": "100,100,100"} | (changed if self.command_mm > 1 else {})

    machine = Disturbed(Real(), SET)
    with pytest.raises(TuneError, match=complaint):
        measured(machine, settings_of(machine), "Y", 1, TRAVEL_MM, time_s=lambda: machine.time_s)


def test_no_drive_is_measured_in_a_dry_run():
    """A dry run replaces the feed of every cut, also of a line by hand."""
    machine = Machine(Real(), SET | {DRY.name: 100})
    with pytest.raises(TuneError, match=f".{DRY.number}=0"):
        measured(machine, settings_of(machine), "Y", 1, TRAVEL_MM, time_s=lambda: machine.time_s)
    assert not any(machine.furthest), "it has moved"
