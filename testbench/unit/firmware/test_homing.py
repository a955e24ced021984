# SPDX-License-Identifier: Apache-2.0
"""Homing (`$H`): its cycle on the model machine, what ends it, and the frame that it makes."""

import ctypes

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import error_line, named
from softcore.tables.settings import assign
from testbench.firmware import REST, Controller, events

CAUSES = numbers()
X, Y, Z = range(3)
# Ends of the travel as delivered, pulses; the jump axis is Z.
LOW, HIGH = (-2_990_000,) * 3, (2_990_000, 2_990_000, 1_000_000)
PULL_OFF = 10_000
OVERRUN = 40            # pulses that an axis goes on after its switch, with the drives off


class Machine(Controller):
    """A controller whose axes have reference switches at these places of the model's counts."""

    def __init__(self, low=(-20_000, -30_000, None), high=(None, None, 25_000), **options):
        super().__init__(**options)
        self.low, self.high = low, high
        self.stuck = set()      # switches that stay pressed: (axis, end)
        self.library.gk_speed(97)
        self.tripped = []       # places of the trips

    def pressed(self):
        low = sum(1 << k for k in range(3) if self.low[k] is not None
                  and (self.axes[k] <= self.low[k] or (k, "low") in self.stuck))
        high = sum(1 << k for k in range(3) if self.high[k] is not None
                   and (self.axes[k] >= self.high[k] or (k, "high") in self.stuck))
        return low, high

    def go(self, passes=20_000, until=lambda: False):
        """Run; a switch that is pressed trips the interlock, as the gateware does."""
        was = self.pressed()
        for _ in range(passes):
            self.run(1)
            now = self.pressed()
            self.library.gk_switches(*now)
            for end, (before, after) in zip(("low", "high"), zip(was, now, strict=True),
                                            strict=True):
                if new := after & ~before:
                    self.tripped.append(self.axes)
                    self.library.gk_trip(CAUSES[f"limit_{end}"], new)
            was = now
            if until() or (self.lines and self.lines[-1].startswith(("ok", "error"))):
                return
        raise AssertionError(f"it goes on; {self.lines[-3:]}")


def home(machine, **options):
    machine.lines.clear()
    assert machine.line("$H", 5) == []
    machine.go(**options)


def limits(machine, axis):
    """Soft limits as written to the gateware, in its counts."""
    words = (ctypes.c_int32 * 4)()
    machine.library.gk_axis_words(axis, words)
    return words[0], words[1]


def state(machine):
    machine.send(b"?")
    machine.run(30)
    return next(line for line in reversed(machine.lines) if line.startswith("<"))[1:].split("|")


def test_every_axis_ends_at_the_end_of_its_travel():
    machine = Machine()
    home(machine)
    assert machine.lines[-1] == "ok"
    assert not events(machine.lines, "alarm")
    report = state(machine)
    assert report[0] == "Idle"
    assert report[1] == (f"MPos:{LOW[X] / 10_000:.4f},{LOW[Y] / 10_000:.4f},"
                         f"{HIGH[Z] / 10_000:.4f}")
    # The order is Z, X, Y, each axis twice; it stands the pull-off before its second trip.
    assert len(machine.tripped) == 6
    assert machine.axes == (machine.tripped[3][X] + PULL_OFF, machine.tripped[5][Y] + PULL_OFF,
                            machine.tripped[1][Z] - PULL_OFF)
    # Soft limits of the gateware, in its own counts.
    for axis in range(3):
        low, high = limits(machine, axis)
        end = LOW if machine.low[axis] is not None else HIGH
        assert low - machine.axes[axis] == LOW[axis] - end[axis]
        assert high - machine.axes[axis] == HIGH[axis] - end[axis]


def test_the_position_is_known_and_the_program_counts_from_there():
    machine = Machine()
    home(machine)
    assert not any(part.startswith("Lost") for part in state(machine))
    place = machine.axes
    assert machine.line("G53 G00 X-298 Z90", 60)[-1] == "ok"
    machine.run(20 * REST)
    assert machine.axes == (place[X] + 10_000, place[Y], place[Z] - 100_000)
    assert "the travel" in machine.line("G53 G00 X-299.1", 60)[0]


def test_homing_again_changes_nothing():
    machine = Machine()
    home(machine)
    before = state(machine)[1], machine.axes
    machine.run(REST)
    home(machine)
    assert machine.lines[-1] == "ok"
    # The model's axes go 97 pulses in a pass, so a switch is pressed anywhere within them.
    assert state(machine)[1] == before[0]
    assert max(abs(a - b) for a, b in zip(machine.axes, before[1], strict=True)) < 97


def test_an_axis_that_stands_on_its_switch_leaves_it_first():
    machine = Machine(low=(5, -30_000, None))
    assert machine.pressed()[0] == 1
    machine.library.gk_switches(1, 0)
    home(machine)
    assert machine.lines[-1] == "ok"
    assert len(machine.tripped) == 5
    assert state(machine)[1].startswith(f"MPos:{LOW[X] / 10_000:.4f}")


def test_other_axes_and_ends_by_settings():
    machine = Machine(low=(None, None, -8000), high=(None, 9000, None))
    machine.unlock()
    machine.run(REST)
    machine.line(assign("home_order", 23))
    machine.line(assign("home_down", 4))
    home(machine)
    assert machine.lines[-1] == "ok"
    assert state(machine)[1] == (f"MPos:0.0000,{HIGH[Y] / 10_000:.4f},{LOW[Z] / 10_000:.4f}")
    assert [trip[Z] == 0 for trip in machine.tripped] == [True, True, False, False]


@pytest.mark.parametrize("known", [False, True])
def test_homing_of_some_axes_tells_nothing_of_the_others(known):
    machine = Machine()
    machine.unlock() if known else machine.line("$X")
    machine.run(REST)
    machine.line(assign("home_order", 3))
    home(machine)
    assert machine.lines[-1] == "ok"
    assert any(part.startswith("Lost") for part in state(machine)) is not known
    assert (machine.line("G00 X1", 60)[-1] == "ok") is known


@pytest.mark.parametrize("order", [4, 11, 10, 122])
def test_an_order_that_is_none_is_refused(order):
    machine = Machine()
    machine.unlock()
    machine.run(REST)
    machine.line(assign("home_order", order))
    answer = machine.line("$H", 60)
    assert "each at most once" in answer[0]
    assert answer[-1] == error_line("setting")
    assert state(machine)[0] == "Idle"


def test_homing_that_is_off_is_refused():
    machine = Machine()
    machine.unlock()
    machine.run(REST)
    machine.line(assign("home_order", 0))
    answer = machine.line("$H", 60)
    assert answer == ["[MSG:homing is off: $533 names no axis.]", error_line("homing")]


def test_it_needs_a_machine_at_rest():
    machine = Machine()
    machine.unlock()
    machine.run(REST)
    machine.library.gk_speed(1)
    assert machine.line("G00 X1", 20)[-1] == "ok"
    answer = machine.line("$H", 60)
    assert "needs the state Idle or Alarm" in answer[0]


def alarm_of(machine):
    (alarm,) = events(machine.lines, "alarm")
    return alarm


def test_a_switch_that_is_not_found_is_an_alarm():
    machine = Machine(high=(None, None, None))
    machine.library.gk_speed(100_000)
    home(machine)
    assert machine.lines[-1] == error_line("locked")
    machine.run(REST)
    assert f"ALARM:{named('home_not_found').alarm}" in machine.lines
    assert "Z: the reference switch was not found" in alarm_of(machine)[-1]
    # 1.5 of the travel, which ends at $415.
    assert machine.axes == (0, 0, (HIGH[Z] - LOW[Z]) // 2 * 3)
    assert state(machine)[0] == "Alarm"


def test_a_switch_that_sticks_is_an_alarm():
    machine = Machine()
    assert machine.line("$H", 5) == []
    machine.go(until=lambda: machine.tripped)
    machine.stuck.add((Z, "high"))
    machine.go()
    machine.run(REST)
    assert f"ALARM:{named('home_not_left').alarm}" in machine.lines
    assert "Z: the reference switch is still pressed" in alarm_of(machine)[-1]


@pytest.mark.parametrize("gone", [0, 1000], ids=["before it moves", "on the way"])
def test_a_reset_ends_it(gone):
    machine = Machine()
    assert machine.line("$H", 5) == []
    machine.go(until=lambda: machine.axes[Z] >= gone)
    assert state(machine)[0] == "Home"
    machine.send(b"\x18")
    machine.run(REST)
    assert f"ALARM:{named('home_reset').alarm}" in machine.lines
    place = machine.axes
    assert machine.line("$X")[-1] == "ok"
    machine.run(REST)
    assert machine.axes == place
    assert any(part.startswith("Lost") for part in state(machine))
    assert "position is lost" in machine.line("G00 X1", 60)[0]
    home(machine)
    assert machine.lines[-1] == "ok"


def test_a_known_position_is_lost_from_the_beginning_of_the_cycle():
    machine = Machine()
    home(machine)
    assert not any(part.startswith("Lost") for part in state(machine))
    machine.run(REST)
    machine.lines.clear()
    assert machine.line("$H", 5) == []
    place = machine.axes[Z]
    machine.go(until=lambda: machine.axes[Z] != place)
    homing, *parts = state(machine)
    assert homing == "Home"
    assert any(part.startswith("Lost") for part in parts)
    machine.send(b"\x18")
    machine.run(REST)
    assert f"ALARM:{named('home_reset').alarm}" in machine.lines
    assert any(part.startswith("Lost") for part in state(machine))


@pytest.mark.parametrize(("cause", "axes"), [("limit_low", 4), ("limit_high", 1),
                                             ("limit_high", 5), ("estop", 0)])
def test_another_trip_is_an_alarm(cause, axes):
    machine = Machine()
    assert machine.line("$H", 5) == []
    machine.go(until=lambda: machine.axes[Z] > 1000)
    machine.library.gk_trip(CAUSES[cause], axes)
    machine.run(REST)
    assert len(events(machine.lines, "alarm")) == 1
    assert error_line("locked") in machine.lines
    assert state(machine)[0] == "Alarm"


def test_a_hold_stops_it_and_a_resume_goes_on():
    machine = Machine()
    assert machine.line("$H", 5) == []
    machine.go(until=lambda: machine.axes[Z] > 1000)
    machine.send(b"!")
    machine.run(4)
    place = machine.axes
    machine.run(REST)
    assert machine.axes == place
    assert state(machine)[0].startswith("Hold")
    machine.send(b"~")
    machine.lines.clear()
    machine.go()
    assert machine.lines[-1] == "ok"


def test_a_line_waits_until_it_has_ended():
    machine = Machine()
    assert machine.line("$H", 5) == []
    machine.send(b"G91 G00 X1\n")
    machine.run(200)
    assert machine.axes[X] == 0
    machine.lines.clear()
    machine.go()
    machine.run(20 * REST)
    assert machine.lines.count("ok") == 2


def test_no_override_scales_it():
    machine = Machine()
    machine.send(b"\x91\x91")
    machine.run(10)
    machine.library.gk_speed(1)
    assert machine.line("$H", 5) == []
    machine.go(until=lambda: machine.axes[Z] > 10)
    assert machine.slot(0).rate == machine.library.gk_rate(500_000)


def test_switches_guard_the_travel_again_afterwards():
    machine = Machine()
    home(machine)
    machine.library.gk_trip(CAUSES["limit_low"], 1)
    machine.run(REST)
    assert events(machine.lines, "alarm")
