# SPDX-License-Identifier: Apache-2.0
"""The firmware on the limits of travel, the way off a limit switch, and the messages of a trip."""

import ctypes

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import alarm_number, error_line
from softcore.tables.settings import assign
from softcore.tables.states import CHECKS
from testbench.firmware import Controller, events
from testbench.programs import punched

NUMBER = numbers()
X, Y, Z = 1, 2, 4


def words(machine, axis):
    """Soft limits and gain of an axis, as written to the gateware."""
    row = (ctypes.c_int32 * 4)()
    machine.library.gk_axis_words(axis, row)
    return tuple(row[:3])


def alarm(machine, cause, axes=0):
    machine.library.gk_trip(NUMBER[cause], axes)
    found, = events(machine.run(300), "alarm")
    return int(found[1]), ",".join(found[2:])


def test_limits_and_gain_are_written_as_delivered():
    machine = Controller()
    assert words(machine, 0) == words(machine, 1) == (-2_990_000, 2_990_000, 1678)
    assert words(machine, 2) == (-2_990_000, 1_000_000, 1678), "the jump axis, by setting 415 too"
    assert words(Controller(jump_axis=15), 2) == (-2_990_000, 2_990_000, 1678)


def test_settings_of_the_limits(machine):
    for line in (assign("low_x_um", 1000), assign("low_y_um", 0), assign("low_z_um", 70_000),
                 assign("high_x_um", 3000), assign("high_y_um", 4000), assign("high_z_um", 5000),
                 assign("loop_gain", 400)):
        assert machine.line(line) == ["ok"]
    assert [words(machine, axis) for axis in range(3)] == [
        (-10_000, 30_000, 13_422), (0, 40_000, 13_422), (-700_000, 50_000, 13_422)]
    assert machine.line(assign("soft_limit_um", 2000)) == ["ok"]
    assert words(machine, 2)[1] == 20_000, "the lower of the two bounds the jump axis"
    refused = error_line("setting")
    assert machine.line("$456=401")[-1] == refused, "more than the gateware can express"
    assert machine.line("$456=9")[-1] == refused, "a lost coder would be seen too late"


@pytest.mark.parametrize(("line", "sentence"), [
    ("G00 X2.01", "X is beyond the travel"), ("G00 X-1.01", "X is beyond the travel"),
    ("G00 Y-3.1", "Y is beyond the travel"), ("G00 Z-5.001", "Z is beyond the travel"),
    ("G02 J-2.2 F60", "the arc goes beyond the travel of X"),
    ("G03 X-0.9 Y0 R0.45 F60", "the arc goes beyond the travel of Y"),
    ("G91 G00 X-0.6 Y-2.2 Z-5.2", "Z is beyond the travel"),
])
def test_a_block_beyond_the_limits_is_refused(machine, line, sentence):
    for setting in (assign("low_x_um", 1000), assign("high_x_um", 2000), assign("low_y_um", 3000),
                    assign("high_y_um", 100), assign("low_z_um", 5000)):
        machine.line(setting)
    said = machine.line(line)
    assert said[-1] == error_line("travel")
    assert sentence in said[-2]
    assert machine.axes == (0, 0, 0)


def test_the_limits_themselves_can_be_reached_and_left(machine):
    for setting in (assign("low_x_um", 1000), assign("high_x_um", 2000)):
        machine.line(setting)
    assert machine.line("G00 X2") == machine.line("G00 X-1") == ["ok"]
    assert machine.axes[0] == -10_000
    assert machine.line(assign("low_x_um", 500)) == ["ok"]
    assert machine.line("G00 X-1.2")[-1] == error_line("travel")
    assert machine.line("G00 X-0.8") == ["ok"], "from outside it may come back"
    assert machine.line("G00 X-0.9")[-1] == error_line("travel")
    assert machine.axes[0] == -8000


@pytest.mark.parametrize(("low", "high", "way", "end"), [(0, Z, 1, "upper"), (Z, 0, -1, "lower")])
def test_the_way_off_a_limit_switch(machine, low, high, way, end):
    machine.library.gk_switches(low, high)
    assert alarm(machine, f"limit_{'high' if high else 'low'}", Z) == (
        alarm_number("limit"),
        f"interlock: an axis is on its {end} limit switch (axis Z); the position is kept.")
    said = machine.line("$X")
    assert said == [f"[MSG:On the {end} limit switch of axis Z: only away from it, slowly, without "
                    "discharge.]", "ok"]
    said = machine.line(f"G00 Z{way}")
    assert said == [f"[MSG:MDI, character 5: Z leads further onto its {end} limit switch.]",
                    error_line("travel")]
    assert machine.line("C100 M03")[-2:] == [
        "[MSG:M03 has to wait until the limit switch is left.]", error_line("locked")]
    assert "only a line leads off a limit switch" in machine.line("G18 G02 X1 R1 F60")[-2]
    assert machine.line(f"G00 Z{-way}") == machine.line("G00 X3") == ["ok"]
    assert machine.axes == (30_000, 0, -way * 10_000)
    machine.library.gk_switches(0, 0)
    assert machine.line(f"G00 Z{way}") == ["ok"], "it was left"
    machine.library.gk_arm()
    assert machine.line("C100 M03")[-1] == "ok"


def test_a_limit_switch_is_not_left_while_something_else_is_wrong(machine):
    machine.library.gk_switches(0, X)
    machine.library.gk_live(1 << NUMBER["estop"])
    alarm(machine, "estop")
    said = machine.line("$X")
    assert said == ["[MSG:the interlock stays open: emergency stop.]", error_line("trip")]


def test_a_program_does_not_discharge_on_a_limit_switch(machine):
    machine.library.gk_switches(0, Z)
    alarm(machine, "limit_high", Z)
    machine.line("$X")
    lines = machine.tape(punched(["G36 R300 L.5 H600 E60 Q.1", "C100", "G00 Z-1", "M03", "M02"]))
    assert events(lines, "alarm")[-1][1:] == [
        str(alarm_number("locked")), "Block 5: M03 has to wait until the limit switch is left."]
    assert "discharge" not in machine.flags


@pytest.mark.parametrize("check", range(1, 8))
@pytest.mark.parametrize("axis", range(3))
def test_a_trip_by_a_coder_names_axis_and_check(machine, axis, check):
    machine.library.gk_check_found(axis, check)
    assert alarm(machine, "coder", 1 << axis) == (
        alarm_number("trip"),
        f"interlock: coder of axis {'XYZ'[axis]}: {CHECKS[check].text}; the position is lost.")


@pytest.mark.parametrize(("cause", "axes", "sentence"), [
    ("estop", 0, "emergency stop; the position is kept"),
    ("drive_fault", Y, "a drive reports a fault (axis Y); the position is kept"),
    ("limit_low", X | Z, "an axis is on its lower limit switch (axes X and Z); the position is "
                         "kept"),
    ("error_saturated", X, "a deviation counter reached its limit (axis X); the position is lost"),
    ("encoder", Z, "an encoder made an illegal transition (axis Z); the position is lost"),
    ("following_moving", X | Y | Z, "position deviation in motion above its limit "
                                    "(axes X, Y and Z); the position is lost"),
    ("travel", Y, "a command beyond the upper soft limit of axis Y; the position is kept"),
    ("guard", 5, "a guarded register of the gateware is damaged (axes X and Z); the position is "
                 "lost"),
    ("guard", 8, "a guarded register of the gateware is damaged (a word of the path); the position "
                 "is lost"),
    ("guard", 16, "a guarded register of the gateware is damaged (the segment at work); the "
                  "position is lost"),
    ("guard", 32, "a guarded register of the gateware is damaged (the place on the path); the "
                  "position is lost"),
    ("guard", 64, "a guarded register of the gateware is damaged (path pulses on their way); the "
                  "position is lost"),
    ("guard", 2048, "a guarded register of the gateware is damaged (the rate of the ramp); the "
                    "position is lost"),
    ("guard", 4096, "a guarded register of the gateware is damaged (the latch of the interlock); "
                    "the position is lost"),
])
def test_a_trip_names_its_axes(machine, cause, axes, sentence):
    code = alarm_number("limit" if cause.startswith("limit") else "trip")
    assert alarm(machine, cause, axes) == (code, f"interlock: {sentence}.")


@pytest.mark.parametrize("axis", range(3))
def test_an_axis_that_is_not_where_the_path_ends_is_an_alarm(machine, axis):
    machine.library.gk_speed(100)
    assert machine.line("G00 X1 Y1 Z-1", passes=20) == ["ok"]
    machine.library.gk_lose(axis, 3)
    assert not events(machine.run(5), "alarm"), "on the way nobody can know"
    found, = events(machine.run(400), "alarm")
    assert found[1:] == [
        str(alarm_number("guard")),
        f"the command of axis {'XYZ'[axis]} is -0.0003 mm from where the path ends."]
    assert machine.line("G00 X0")[-1] == error_line("locked")
    assert "the position is lost" in machine.line("$X")[0]


def test_a_machine_that_stands_where_it_should_move_is_an_alarm(machine):
    machine.library.gk_speed(100)
    assert machine.line("G01 X1 F60", passes=20) == ["ok"]
    machine.library.gk_speed(0)
    machine.library.gk_stuck(1)
    assert not events(machine.run(350), "alarm"), "200 ms, and four pulses"
    found, = events(machine.run(100), "alarm")
    assert found[1:] == [str(alarm_number("stuck")), "nothing moves", " although the path goes on."]


def test_the_slower_the_feed_the_longer_it_may_take(machine):
    machine.library.gk_speed(1)
    assert machine.line("G01 X1 F0.01", passes=20) == ["ok"]
    machine.library.gk_speed(0)
    machine.library.gk_stuck(1)
    # A pulse in 1.2 million clocks: a pass is 1000.
    assert not events(machine.run(4700), "alarm")
    assert events(machine.run(1000), "alarm")[0][1] == str(alarm_number("stuck"))


@pytest.mark.parametrize("reason", ["hold", "end", "events"])
def test_a_machine_may_stand(machine, reason):
    machine.library.gk_speed(100 if reason != "end" else 1 << 30)
    assert machine.line("G01 X1 F60", passes=20) == ["ok"]
    if reason == "hold":
        machine.send(b"!")
    machine.run(10)
    machine.library.gk_speed(0)
    machine.library.gk_stuck(reason != "events")
    assert not events(machine.run(3000), "alarm")
