# SPDX-License-Identifier: Apache-2.0
"""The table of a screw's pitch: what the gateware is told of it, and when."""

from fractions import Fraction

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import error_line
from softcore.tables.settings import NO_PITCH_ERROR, PITCH_POINTS, STEEPEST_PITCH, assign
from testbench.unit.firmware.test_bookmark import (
    SECOND,
    alarmed,
    booted,
    cut_in,
    resumed,
    switched_on,
)
from testbench.unit.firmware.test_homing import Machine, home

CLOCK_HZ = 2_000_000
CAUSE = numbers()


def pitch(machine, axis="x"):
    """The error of an axis, as the gateware has it; pulses."""
    return machine.library.gk_pitch("xyz".index(axis))


def enter(machine, axis, errors, *, first, step):
    """A table, in pulses; the position is then lost."""
    for name, value in (("points", len(errors)), ("first", first), ("step", step)):
        assert machine.line(assign(f"pitch_{name}_{axis}", value)) == ["ok"]
    for point, error in enumerate(errors, 1):
        assert machine.line(assign(f"pitch_{axis}_{point}", NO_PITCH_ERROR + error)) == ["ok"]


def wanted(errors, first, step, place):
    """The straight line between the points about a place, rounded upwards from a half."""
    at = Fraction(place + first, step)
    at = min(max(at, Fraction(0)), Fraction(len(errors) - 1))
    point = min(int(at), len(errors) - 2)
    return errors[point] + (errors[point + 1] - errors[point]) * (at - point)


def there(machine, *places):
    """Go to places of X, in pulses of the machine frame; yield each and what is made up for."""
    machine.library.gk_speed(4999)
    for place in places:
        assert machine.line(f"G90 G53 G00 X{place / 10_000:.4f}", 20) == ["ok"]
        for _ in range(2000):
            if machine.axes[0] == place:
                break
            machine.run(20)
        machine.run(50)
        assert machine.axes[0] == place
        yield place, pitch(machine)


def test_as_built_nothing_is_made_up_for(machine):
    assert [found for _, found in there(machine, 5000, -5000)] == [0, 0]


@pytest.mark.parametrize(("errors", "first", "step"), [
    ([0, 100, 0, -60, -60, 40], 20_000, 10_000),
    ([-2000, 2095], 0, 1_000_000),
    ([12, 3, 5, 1, 4, 9, 2, 6, 5, 3, 5, 8, 9, 7, 9, 3], 75_000, 10_000)])
def test_a_place_has_the_error_of_the_line_between_its_points(machine, rng, errors, first, step):
    """Less that of the place where the position became known, both rounded to pulses."""
    enter(machine, "x", errors, first=first, step=step)
    assert pitch(machine) == 0, "not while the position is lost"
    assert machine.line("$POSITION=HERE") == ["ok"]
    last = (len(errors) - 1) * step - first
    places = [-first, last, *(rng.randint(-first - 9000, last + 9000) for _ in range(20))]
    found = dict(there(machine, *places))
    here = wanted(errors, first, step, 0)
    assert all(abs(error - (wanted(errors, first, step, place) - here)) <= 1 + Fraction(1, 250)
               for place, error in found.items())
    assert found[last] - found[-first] == errors[-1] - errors[0]
    assert dict(there(machine, *reversed(places))) == found, "from the other side as well"
    assert [pitch(machine, axis) for axis in "yz"] == [0, 0]


def ramp(machine):
    """A table that rises by 1 pulse in 1000 about the place where the position becomes known."""
    enter(machine, "x", [0, 10, 20], first=10_000, step=10_000)
    assert machine.line("$POSITION=HERE") == ["ok"]
    machine.run(50)
    assert pitch(machine) == 0, "no axis moves when its position becomes known"
    assert dict(there(machine, 5000)) == {5000: 5}


def test_a_change_of_the_table_moves_nothing(machine):
    ramp(machine)
    assert machine.line(assign("pitch_x_3", NO_PITCH_ERROR + 40)) == ["ok"]
    assert "|Lost" in machine.line("?")[-1]
    assert pitch(machine) == 0, "the drive's offset begins anew at 0"
    assert machine.line("G91 G94 G01 X1 F60")[-1] == error_line("position_lost")
    assert machine.line("$POSITION=HERE") == ["ok"]
    machine.run(50)
    assert pitch(machine) == 0
    assert dict(there(machine, 6000)) == {6000: 3}
    # Without a table nothing is made up for.
    assert machine.line(assign("pitch_points_x", 0)) == ["ok"]
    assert machine.line("$POSITION=HERE") == ["ok"]
    assert dict(there(machine, 9000, -15_000)) == {9000: 0, -15_000: 0}


def test_what_is_said_twice_changes_nothing(machine):
    """Neither the position that is known nor the value that a setting has."""
    ramp(machine)
    assert machine.line("$POSITION=HERE") == ["ok"]
    assert machine.line(assign("pitch_x_3", NO_PITCH_ERROR + 20)) == ["ok"]
    machine.run(50)
    assert pitch(machine) == 5
    assert dict(there(machine, 0)) == {0: 0}


def test_it_stays_when_a_lost_position_is_accepted(machine):
    """A reset ends homing before an axis has moved; the position is lost all the same."""
    ramp(machine)
    assert machine.line("$H", 5) == []
    machine.send(b"\x18")
    machine.run(400)
    assert pitch(machine) == 5
    assert machine.line("$X")[-1] == "ok"
    assert "|Lost" in machine.line("?")[-1]
    assert machine.line("$POSITION=HERE") == ["ok"]
    machine.run(50)
    assert pitch(machine) == 5
    assert dict(there(machine, 0)) == {0: 0}


@pytest.mark.parametrize(("cause", "kept"), [("estop", True), ("guard", False)])
def test_a_trip_leaves_it_and_a_count_that_begins_anew_forgets_it(machine, cause, kept):
    ramp(machine)
    machine.library.gk_trip(CAUSE[cause], 1)
    machine.run(CLOCK_HZ // 25_000)
    assert pitch(machine) == 5, "locked: nothing moves"
    assert machine.line("$X")[-1] == "ok"
    assert pitch(machine) == (5 if kept else 0)
    if not kept:
        assert machine.line("$POSITION=HERE") == ["ok"]
    machine.run(50)
    assert pitch(machine) == (5 if kept else 0)
    assert dict(there(machine, 0)) == {0: 0 if kept else -5}


def test_a_setting_of_the_drives_forgets_it(machine):
    ramp(machine)
    assert machine.line(assign("backlash_x", 7)) == ["ok"]
    assert pitch(machine) == 0, "the offset of the drive begins anew at 0"
    machine.run(50)
    assert pitch(machine) == 0


def test_homing_leaves_it_and_what_is_made_up_for_does_not_add_up():
    """Each time there is none at the reference, at -299 mm."""
    machine = Machine()
    machine.unlock()
    enter(machine, "x", [30, 20], first=3_000_000, step=1_000_000)
    for _ in range(3):
        machine.lines.clear()
        home(machine)
        assert machine.lines == ["ok"]
        machine.run(50)
        assert pitch(machine) == 0, "X stands at its lower end"
        place = machine.axes[0]
        assert machine.line("G53 G00 X-250", 20) == ["ok"]
        machine.run(8000)
        assert machine.axes[0] == place + 490_000
        assert pitch(machine) == 25 - 30


@pytest.mark.parametrize("steep", [True, False])
def test_a_table_that_is_too_steep_is_refused(steep):
    machine = Machine()
    machine.unlock()
    error = 20_000 // STEEPEST_PITCH + steep
    enter(machine, "z", [0, 5, 5 - error], first=0, step=20_000)
    # A table's points behind its end do not count.
    assert machine.line(assign("pitch_z_5", NO_PITCH_ERROR + 4000)) == ["ok"]
    said = ["[MSG:the pitch of Z in $605 differs from that before by more than 1/100 of the way.]",
            error_line("setting")]
    assert machine.line("$POSITION=HERE") == (said if steep else ["ok"])
    machine.lines.clear()
    if steep:
        assert machine.line("$H") == said
    else:
        home(machine)
        assert machine.lines == ["ok"]


@pytest.mark.parametrize("wide", [True, False])
def test_errors_that_are_further_apart_than_can_be_made_up_for_are_refused(machine, wide):
    enter(machine, "z", [2000, 2095, -1999, -2000 - wide], first=0, step=1_000_000)
    said = ["[MSG:the pitch table of Z ($603 and on) is more than 4095 pulses wide.]",
            error_line("setting")]
    assert machine.line("$POSITION=HERE") == (said if wide else ["ok"])


@pytest.mark.parametrize(("name", "value"), [("points_y", PITCH_POINTS + 1), ("step_y", 9999),
                                            ("y_16", 9096), ("y_1", 904)])
def test_out_of_range_is_refused(machine, name, value):
    with pytest.raises(ValueError, match="must be"):
        assign(f"pitch_{name}", value)
    number = int(assign(f"pitch_{name}", 10_000 if name == "step_y" else
                        16 if name == "points_y" else 5000)[1:].partition("=")[0])
    assert machine.line(f"${number}={value}") == [
        f"[MSG:setting {number} does not exist or is out of range.]", error_line("setting")]


def test_the_table_is_listed(machine):
    enter(machine, "y", [0, 7, -3], first=100, step=20_000)
    listed = dict(row[1:].split("=") for row in machine.line("$$", passes=3000) if "=" in row)
    rows = [listed[str(int(assign(f"pitch_{name}", 5000 if name != "points_y" else 3)[1:].split(
        "=")[0]))] for name in ("points_y", "first_y", "y_1", "y_2", "y_3", "y_4")]
    assert rows == ["3", "100", "5000", "5007", "4997", "5000"]


@pytest.mark.parametrize("other", [False, True])
def test_a_tape_is_not_resumed_with_the_error_at_another_point(memory, other):
    machine = booted(memory)
    machine.unlock()
    enter(machine, "x", (100, 0), first=0, step=200_000)
    machine.run(SECOND)
    machine = switched_on(memory, cut_in(memory, 5))
    machine.ready()
    if other:
        enter(machine, "x", (0, 100), first=0, step=200_000)
    assert alarmed(resumed(machine)) is other
