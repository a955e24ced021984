# SPDX-License-Identifier: Apache-2.0
"""Settings of the drives: gear, direction, backlash and highest speed of each axis."""

import ctypes

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import error_line
from softcore.tables.settings import COARSEST_CODER, LARGEST_GEAR, NO_OFFSET, assign, named
from testbench.firmware import REST, Controller
from testbench.travel import load

CLOCK_HZ = 2_000_000
MM_MIN = CLOCK_HZ * 60 / 10_000 / 2**32     # of a rate
TOP = round(1800 / MM_MIN)                  # the highest speed, as a rate
CAUSE = numbers()
DRIVES = ("gear_steps_x", "gear_pulses_z", "backlash_y", "reversed_drives", "step_axes")


def drive(machine, axis):
    """Mode, steps, pulses and backlash of an axis as the gateware has them."""
    words = (ctypes.c_uint32 * 7)()
    machine.library.gk_drive_words("xyz".index(axis), words)
    return tuple(words[:4])


def lost(machine):
    return "|Lost" in machine.line("?")[-1]


def test_as_built_each_pulse_is_a_step(machine):
    for axis in "xyz":
        assert drive(machine, axis) == (0, 10_000, 10_000, 0)


def test_what_is_set_reaches_the_axis(machine):
    for name, value in {"step_axes": 5, "reversed_encoders": 2, "reversed_drives": 4,
                        "gear_steps_x": 640, "gear_pulses_z": LARGEST_GEAR, "gear_steps_z": 3,
                        "backlash_y": 8191}.items():
        assert machine.line(assign(name, value)) == ["ok"]
    assert drive(machine, "x") == (1, 640, 10_000, 0)
    assert drive(machine, "y") == (2, 10_000, 10_000, 8191)
    assert drive(machine, "z") == (5, 3, LARGEST_GEAR, 0)


def test_offset_and_friction_reach_the_axis(machine):
    def beside(axis):
        words = (ctypes.c_int32 * 7)()
        machine.library.gk_drive_words("xyz".index(axis), words)
        return tuple(words[5:])

    assert [beside(axis) for axis in "xyz"] == [(0, 0)] * 3
    for name, value in {"drive_offset_x": NO_OFFSET + 17, "drive_offset_y": 1,
                        "drive_offset_z": 2 * NO_OFFSET - 1, "drive_friction_y": 127}.items():
        assert machine.line(assign(name, value)) == ["ok"]
    assert [beside(axis) for axis in "xyz"] == [(17, 0), (-255, 127), (255, 0)]
    assert not lost(machine)


@pytest.mark.parametrize(("us", "share"), [(4096, 512), (500, 4194), (8000, 262), (3260, 643)])
def test_the_lag_of_the_model_reaches_the_axis(machine, us, share):
    """Parts of 2**16 that a drive of first order makes up in 32 us."""
    words = (ctypes.c_int32 * 4)()
    assert machine.line(assign("model_lag_y_us", us)) == ["ok"]
    assert machine.line(assign("loop_gain", 60)) == ["ok"]
    found = []
    for axis in range(3):
        machine.library.gk_axis_words(axis, words)
        found.append(words[3])
    assert found == [512, share, 512]


@pytest.mark.parametrize("name", DRIVES)
def test_a_change_loses_the_position_and_the_same_value_does_not(machine, name):
    default = named(name).default
    assert machine.line(assign(name, default)) == ["ok"]
    assert not lost(machine)
    assert machine.line(assign(name, default + 1 if name != "gear_steps_x" else 9999)) == ["ok"]
    assert lost(machine)
    assert machine.line("G91 G94 G01 X1 F60")[-1] == error_line("position_lost")
    assert machine.line("$POSITION=HERE") == ["ok"]
    assert not lost(machine)


@pytest.mark.parametrize(("cause", "renewed"), [("guard", True), ("coder", True),
                                                ("estop", False)])
def test_an_unlock_writes_them_again_if_the_position_is_lost(machine, cause, renewed):
    """A bit of one of them may have flipped; writing them begins gear and backlash anew."""
    words = (ctypes.c_uint32 * 7)()
    machine.library.gk_drive_words(0, words)
    before = words[4]
    machine.library.gk_trip(CAUSE[cause], 1)
    machine.run(CLOCK_HZ // 25_000)
    assert machine.line("$X")[-1] == "ok"
    machine.library.gk_drive_words(0, words)
    assert words[4] - before == renewed
    assert lost(machine) == renewed


def test_other_settings_of_the_axes_leave_gear_and_position(machine):
    words = (ctypes.c_uint32 * 7)()
    machine.library.gk_drive_words(0, words)
    for name in ("window", "step_width_ns", "follow_moving", "highest_speed_x", "loop_gain"):
        assert machine.line(assign(name, 100)) == ["ok"]
    assert machine.line(assign("gear_steps_x", 10_000)) == ["ok"]   # as it was
    again = (ctypes.c_uint32 * 7)()
    machine.library.gk_drive_words(0, again)
    assert list(again) == list(words), "the steps are not counted anew"
    assert not lost(machine)


def test_an_axis_has_step_times_of_its_own_or_those_of_all(machine):
    def times(axis):
        clocks = (ctypes.c_uint32 * 3)()
        machine.library.gk_step_time(axis, clocks)
        return [round(one * 1e9 / CLOCK_HZ) for one in clocks]
    assert [times(axis) for axis in range(3)] == [[1000] * 3] * 3
    for name, value in (("width", 2500), ("space", 3000), ("setup", 3500)):
        assert machine.line(assign(f"step_{name}_ns", value)) == ["ok"]
    for name, value in (("width", 5000), ("space", 6000), ("setup", 7000)):
        assert machine.line(assign(f"step_{name}_y_ns", value)) == ["ok"]
    usual = [2500, 3000, 3500]
    assert [times(axis) for axis in range(3)] == [usual, [5000, 6000, 7000], usual]
    assert machine.line(assign("step_width_y_ns", 0)) == ["ok"]
    assert times(1) == [2500, 6000, 7000]
    assert not lost(machine)


def test_more_steps_than_pulses_are_never_in_force(machine):
    assert machine.line(assign("gear_pulses_y", 640)) == ["ok"]
    assert drive(machine, "y") == (0, 10_000, 10_000, 0)
    assert machine.line("$POSITION=HERE") == [
        "[MSG:the gear of Y has more steps ($521) than pulses ($524).]", error_line("setting")]
    assert machine.line("G91 G94 G01 X1 F60")[-1] == error_line("position_lost")
    # Whichever of the two comes first, the pair is in force when it fits.
    assert machine.line(assign("gear_steps_y", 41)) == ["ok"]
    assert drive(machine, "y") == (0, 41, 640, 0)
    assert machine.line("$POSITION=HERE") == ["ok"]


@pytest.mark.parametrize("name", ["$POSITION=HERE", "$H"])
def test_a_coder_that_is_too_coarse_is_never_in_force(machine, name):
    """An axis by steps may have such a gear."""
    assert machine.line(assign("home_order", 321)) == ["ok"]
    assert machine.line(assign("gear_pulses_y", 10_000)) == ["ok"]
    fits = 10_000 // COARSEST_CODER
    assert machine.line(assign("gear_steps_y", fits - 1)) == ["ok"]
    assert machine.line(name) == [
        f"[MSG:the coder of Y has more than {COARSEST_CODER} pulses ($524) for an edge ($521).]",
        error_line("setting")]
    assert machine.line("G91 G94 G01 X1 F60")[-1] == error_line("position_lost")
    if name == "$H":
        return
    assert machine.line(assign("step_axes", 2)) == ["ok"]
    assert machine.line(name) == ["ok"]
    assert machine.line(assign("step_axes", 0)) == ["ok"]
    assert machine.line(assign("gear_steps_y", fits)) == ["ok"]
    assert machine.line(name) == ["ok"]


def test_senders_read_the_steps_of_a_mm(machine):
    for name, value in {"step_axes": 3, "gear_steps_x": 640, "gear_steps_y": 3200,
                        "gear_pulses_y": 30_000, "gear_steps_z": 2000, "highest_speed_y": 700,
                        "highest_speed_z": 60_000}.items():
        assert machine.line(assign(name, value)) == ["ok"]
    listed = dict(row[1:].split("=") for row in machine.line("$$", passes=2000) if "=" in row)
    assert [listed[number] for number in ("100", "101", "102")] == [
        "640.000", "1066.666", "2000.000"], "Z has a coder"
    assert [listed[number] for number in ("110", "111", "112")] == [
        "1800.000", "700.000", "1800.000"]


OWN = {"x": 600, "y": 0, "z": 300}      # mm/min; Y has no own bound


def fastest(machine, blocks):
    """Of each segment loaded: axes' speeds in mm/min at the highest rate of it, by axis."""
    load(machine, *blocks, "M02")
    slots = [slot for number in range(64) if (slot := machine.slot(number)).length]
    return [(slot, [min(slot.highest or TOP, TOP) * abs(travel) / slot.length * MM_MIN
                    for travel in slot.delta]) for slot in slots]


def test_no_axis_exceeds_its_own_speed_on_a_line(machine, rng):
    for axis, speed in OWN.items():
        assert machine.line(assign(f"highest_speed_{axis}", speed)) == ["ok"]
    blocks = [f"X{rng.uniform(-2, 2):.4f} Y{rng.uniform(-2, 2):.4f} Z{rng.uniform(-2, 2):.4f}"
              for _ in range(40)]
    found = fastest(machine, ["G91 G01 F60", "Y1", "X1", "Z-1", *blocks])
    assert len(found) > 40
    assert len({slot.highest for slot, _ in found}) > 10
    for slot, (x, y, z) in found:
        assert x <= OWN["x"] * 1.0001
        assert z <= OWN["z"] * 1.0001
        if slot.highest:    # no slower than it has to be
            assert max(x / OWN["x"], z / OWN["z"]) == pytest.approx(1, rel=1e-3)
        else:
            assert y == pytest.approx(1800 * abs(slot.delta[1]) / slot.length, rel=1e-3)


@pytest.mark.parametrize(("plane", "slowest"), [("G17", 1500), ("G18", 300), ("G19", 300)])
def test_an_arc_is_limited_by_the_slower_axis_of_its_plane(plane, slowest):
    machine = Controller(clock_hz=50_000_000)
    machine.unlock()
    machine.run(10_000)     # 0.2 s: the axes rest
    for axis, speed in {"x": 1500, "z": 300}.items():
        assert machine.line(assign(f"highest_speed_{axis}", speed)) == ["ok"]
    letters, centre = {"G17": ("XY", "I"), "G18": ("ZX", "K"), "G19": ("YZ", "J")}[plane]
    machine.line(assign("arc_deviation_nm", 0))   # the bound of the lag is lower
    load(machine, f"G91 {plane} G03 {letters[0]}-2 {letters[1]}2 {centre}-2 F60", "M02")
    arcs = [slot.highest for number in range(64) if (slot := machine.slot(number)).arc]
    assert arcs
    assert {round(one * 25 * MM_MIN) for one in arcs} == {slowest}


def test_where_axes_limit_the_speed_junctions_are_corners(machine):
    """Before a slower segment the machine has to be slow, whatever the speed of the way back."""
    blocks = ("G91 G01 F60", "Y1", "X.0001 Y1", "X.01 Y1", "M02")
    assert machine.line(assign("highest_speed_x", 10)) == ["ok"]
    load(machine, *blocks)
    assert [bool(machine.slot(number).highest) for number in range(3)] == [False, False, True]
    assert machine.bound("fast_ahead") == 20_000
    free = Controller()
    free.unlock()
    load(free, *blocks)
    assert free.bound("fast_ahead") == 30_000, "the bends are none"


@pytest.mark.parametrize("name", ["pitch_points_x", "backlash_x", "gear_steps_x"])
def test_what_loses_the_position_waits_until_a_held_motion_has_ended(machine, name):
    machine.library.gk_speed(11)
    machine.line("G91 G94 G01 X1 F60", 100)
    machine.send(b"!")
    machine.run(2 * REST)
    said, answer = machine.line(assign(name, 5))
    assert "M05 and rest come first" in said
    assert answer == "error:8"
    machine.send(b"~")
    machine.run(1500)
    assert machine.line(assign(name, 5))[-1] == "ok"
