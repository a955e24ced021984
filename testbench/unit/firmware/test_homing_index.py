# SPDX-License-Identifier: Apache-2.0
"""Homing on a coder's index: its part of the cycle on the model machine."""

import pytest

from softcore.tables.causes import numbers
from softcore.tables.events import named as event
from softcore.tables.faults import error_line, named
from softcore.tables.settings import assign
from testbench.firmware import REST, events
from testbench.unit.firmware.test_homing import HIGH, LOW, PULL_OFF, Machine, X, Z, limits, state

TURN, FIRST = 20_000, 5000      # pulses between two indices; from the pull-off to the first
WAY_UM = 3000
CAUSES = numbers()


class Indexed(Machine):
    """A machine whose X and Z have indices; ``places`` are those that came as events."""

    def __init__(self, at=None, **settings):
        # Of the model's counts, if the switch were pressed exactly at its place.
        usual = {X: -20_000 + PULL_OFF + FIRST, Z: 25_000 - PULL_OFF - FIRST}
        self.at = usual if at is None else at
        super().__init__()
        self.places = []
        self.unlock()
        self.run(REST)
        for row in ({"home_order": 1, "home_index": 1, "home_index_um": WAY_UM} | settings).items():
            self.line(assign(*row))
        self.library.gk_speed(31)

    def run(self, passes=200):
        """A single pass, as ``go`` runs them, shows the coders' indices that it passes."""
        before = self.axes
        lines = super().run(passes)
        for axis, at in self.at.items() if passes == 1 else ():
            low, high = sorted((before[axis], self.axes[axis]))
            if (low - at) // TURN != (high - at) // TURN:
                armed = self.library.gk_index_armed()
                self.library.gk_index(1 << axis)
                if armed >> axis & 1:
                    self.places.append((axis, self.axes[axis]))
        return lines


def begin(machine):
    machine.lines.clear()
    assert machine.line("$H", 5) == []


def home(machine):
    begin(machine)
    machine.go(60_000)


def searching(machine):
    """Go on until the axis looks for its index."""
    begin(machine)
    machine.go(60_000, until=lambda: len(machine.tripped) == 2
               and machine.axes[X] > machine.tripped[-1][X] + PULL_OFF + 1000)
    assert len(machine.tripped) == 2


@pytest.mark.parametrize(("axis", "order", "end"), [(X, 1, LOW), (Z, 3, HIGH)], ids="XZ")
def test_the_axis_stands_on_its_index_at_the_end_of_its_travel(axis, order, end):
    machine = Indexed(home_order=order, home_index=1 << axis)
    home(machine)
    assert machine.lines[-1] == "ok"
    ((found, place),) = machine.places
    assert (found, place) == (axis, machine.axes[axis]), "it went back onto it"
    assert state(machine)[1].split(":")[1].split(",")[axis] == f"{end[axis] / 10_000:.4f}"
    low, high = limits(machine, axis)
    assert (low - place, high - place) == (LOW[axis] - end[axis], HIGH[axis] - end[axis])
    (said,) = (line for line in machine.lines if "index" in line)
    away = abs(place - machine.tripped[-1][axis]) - PULL_OFF
    assert said == f"[MSG:{'XYZ'[axis]}: the index is {away / 10_000:.4f} mm behind the pull-off.]"
    assert not machine.library.gk_index_armed()


def test_an_axis_without_it_is_homed_on_its_switch():
    machine = Indexed(home_index=4)
    home(machine)
    assert machine.lines[-1] == "ok"
    assert machine.places == []
    assert machine.axes[X] == machine.tripped[-1][X] + PULL_OFF
    assert not any("index" in line for line in machine.lines)


@pytest.mark.parametrize("away", [-900, 900], ids=["before it", "behind it"])
def test_an_index_near_the_pull_off_is_told(away):
    machine = Indexed(at={X: -20_000 + PULL_OFF + away})
    home(machine)
    assert machine.lines[-1] == "ok"
    # One that came on the way off the switch is not the reference, but too near.
    assert len(machine.places) == 1 + (away < 0)
    assert machine.axes[X] == machine.places[-1][1]
    (said,) = (line for line in machine.lines if "index" in line)
    near = abs(machine.places[0][1] - machine.tripped[-1][X] - PULL_OFF) / 10_000
    assert f"X: an index is {near:.4f} mm from the pull-off" in said
    assert "Change $537" in said


@pytest.mark.parametrize(("travel_um", "way_um"), [(500_000, WAY_UM), (2000, 2000)])
def test_an_index_that_does_not_come_is_an_alarm(travel_um, way_um):
    """Within the travel, too, where that is shorter than the search."""
    machine = Indexed(at={}, low_x_um=travel_um // 2, high_x_um=travel_um // 2)
    home(machine)
    machine.run(REST)
    assert error_line("locked") in machine.lines
    assert f"ALARM:{named('home_not_found').alarm}" in machine.lines
    (alarm,) = events(machine.lines, "alarm")
    assert "X: the index of the coder did not come" in alarm[-1]
    assert machine.axes[X] == machine.tripped[-1][X] + PULL_OFF + way_um * 10
    assert state(machine)[0] == "Alarm"
    assert any(part.startswith("Lost") for part in state(machine))


@pytest.mark.parametrize("phase", ["idle", "seek", "other axis"])
def test_an_index_that_nobody_looks_for_does_nothing(phase):
    """As if a bit of the gateware had flipped: the event comes, and was not asked for."""
    machine = Indexed(at={})
    if phase == "idle":
        machine.library.gk_event(event("index").number, 0, 7, 0)
        machine.run(REST)
        assert state(machine)[0] == "Idle"
        return
    if phase == "seek":
        begin(machine)
        machine.go(until=lambda: machine.axes[X] < -5000)
        assert not machine.tripped
        machine.library.gk_event(event("index").number, 0, 1, 0)
        machine.go(until=lambda: machine.tripped)
    else:
        searching(machine)
        place = machine.axes[X]
        machine.library.gk_event(event("index").number, 0, 6, 0)
        machine.go(until=lambda: machine.axes[X] > place + 5000)
        assert machine.axes[X] > place + 5000
    assert not events(machine.lines, "alarm")
    assert state(machine)[0] == "Home"


def test_a_hold_stops_the_search_and_a_resume_goes_on():
    machine = Indexed()
    searching(machine)
    machine.send(b"!")
    machine.run(4)
    place = machine.axes
    machine.run(REST)
    assert machine.axes == place
    assert state(machine)[0].startswith("Hold")
    machine.send(b"~")
    machine.lines.clear()
    machine.go(60_000)
    assert machine.lines[-1] == "ok"
    assert machine.axes[X] == machine.places[-1][1]


def test_a_reset_ends_the_search():
    machine = Indexed()
    searching(machine)
    machine.send(b"\x18")
    machine.run(REST)
    assert f"ALARM:{named('home_reset').alarm}" in machine.lines
    assert any(part.startswith("Lost") for part in state(machine))


def test_any_switch_that_is_pressed_in_the_search_is_an_alarm():
    machine = Indexed()
    searching(machine)
    machine.library.gk_trip(CAUSES["limit_high"], 1)
    machine.run(REST)
    assert len(events(machine.lines, "alarm")) == 1
    assert state(machine)[0] == "Alarm"
