# SPDX-License-Identifier: Apache-2.0
"""The retraction memory: two layers; data is checked when read and in force when executed."""

from fractions import Fraction

import pytest

from softcore.tables.faults import error_line
from testbench.firmware import Controller, events
from testbench.programs import punched

CLOCK_HZ, PULSES_PER_MM = 2_000_000, 10_000


def rate(mm_per_min):
    """2**-32 pulse/clock of a speed, to the nearest."""
    return round(Fraction(str(mm_per_min)) * PULSES_PER_MM * (1 << 32) / (60 * CLOCK_HZ))


def in_force(machine):
    data = machine.data
    return tuple(data[name] for name in ("rate", "limit", "high_rate", "low_rate", "changeover"))


def expected(speed, limit, high, low, changeover):
    return (rate(speed), round(limit * PULSES_PER_MM), rate(high), rate(low),
            round(changeover * PULSES_PER_MM))


def test_without_data_none_are_in_force(machine):
    machine.tape(punched(["G00 X1", "M02"]), passes=400)
    assert "data" not in machine.flags


def test_data_by_hand_are_the_default(machine):
    machine.line("G36 R300 L.5 H600 E60 Q.1")
    assert in_force(machine) == expected(300, .5, 600, 60, .1)
    machine.tape(punched(["G00 X1", "M02"]), passes=400)
    assert "data" in machine.flags
    assert in_force(machine) == expected(300, .5, 600, 60, .1)


def test_data_by_hand_may_come_in_parts(machine):
    machine.line("G36 R300 L.5")
    assert "data" not in machine.flags
    machine.line("G36 H600 E60 Q.1")
    assert "data" in machine.flags


def test_tape_wins_word_by_word_and_g37_goes_back(machine):
    machine.line("G36 R300 L.5 H600 E60 Q.1")
    machine.library.gk_speed(0)
    machine.tape(punched(["G36 L2 R900", "G91 G01 X.01 F6", "G36 Q.2", "X.01", "G37", "X.01",
                          "M02"]), passes=400)
    assert in_force(machine) == expected(900, 2, 600, 60, .1)
    machine.library.gk_go(50)
    machine.run(400)
    assert in_force(machine) == expected(900, 2, 600, 60, .1), "read, but not yet carried out"
    machine.library.gk_go(50)
    machine.run(400)
    assert in_force(machine) == expected(900, 2, 600, 60, .2)
    machine.library.gk_go(100)
    machine.run(400)
    assert in_force(machine) == expected(300, .5, 600, 60, .1)
    machine.library.gk_go(100)
    lines = machine.run(400)
    assert events(lines, "end")
    assert [event[7] for event in events(machine.lines, "set")] == ["m", "t", "t", "t"]


def test_new_tape_begins_with_the_defaults(machine):
    machine.line("G36 R300 L.5 H600 E60 Q.1")
    machine.tape(punched(["G36 L2 R900", "M02"]), passes=400)
    machine.tape(punched(["G00 X1", "M02"]), passes=400)
    assert in_force(machine) == expected(300, .5, 600, 60, .1)


def test_bad_data_leave_the_memory_as_it_was(machine):
    machine.line("G36 R300 L.5 H600 E60 Q.1")
    for line in ("G36 Q.6", "G36 R0", "G36 E3001", "G36 L0", "G36 R5 F5", "G36 H"):
        assert machine.line(line)[-1].startswith("error:"), line
        assert in_force(machine) == expected(300, .5, 600, 60, .1)


def test_inch_data(machine):
    machine.line("G20")
    machine.line("G36 R10 L.1 H20 E1.5 Q.02")
    assert in_force(machine) == expected(254, 2.54, 508, Fraction("38.1"), Fraction("0.508"))


def test_ceiling_is_kept_in_the_machine_frame(machine):
    machine.line("G92 Z1")
    machine.line("G36 R300 L5 H600 E60 Q.1 Z.5")
    assert events(machine.lines, "set")[-1][6] == "5000"
    machine.line("G92 Z0")
    machine.library.gk_speed(0)
    machine.tape(punched(["G01 Z-2 F6", "M02"]), passes=400)
    machine.library.gk_go(6000)
    machine.run(100)
    assert machine.bound("back_limit") == 5000, "half a millimetre below where the tape began"


@pytest.mark.parametrize("letter", "RHE")
def test_a_speed_may_be_the_highest_and_no_more(machine, letter):
    speeds = {"R": 300, "H": 600, "E": 60}
    words = [f"{name}{value}" for name, value in (speeds | {letter: 1800}).items()]
    assert machine.line(f"G36 {' '.join(words)} L5 Q.5")[-1] == "ok"
    assert machine.line(f"G36 {letter}1800.001") == [
        f"[MSG:MDI, character 5: the speed {letter} is above the machine's 1800 mm/min.]",
        error_line("retraction")]


def test_low_speed_above_the_start_stop_speed_gets_its_braking_distance(machine):
    machine.line("G36 R300 L5 H1200 E900 Q.5")
    # (15**2 - 10**2) mm2/s2 / (2 * 1000 mm/s2) = 0.0625 mm
    assert machine.data["low_lead"] == pytest.approx(625, abs=3)
    machine.line("G36 E600")
    assert machine.data["low_lead"] == 0


def test_jump(machine):
    machine.library.gk_speed(0)
    machine.tape(punched(["G36 R300 L5 H600 E60 Q.1", "G38 P800 L1.5 R900 H1200",
                          "G91 G01 X.01 F6", "G38 P0", "M02"]), passes=400)
    data = machine.data
    assert data["jump_period"] == 1_600_000
    assert data["jump_distance"] == 15_000
    assert (data["jump_rate"], data["jump_high_rate"]) == (rate(900), rate(1200))
    machine.library.gk_go(100)
    machine.run(400)
    assert machine.data["jump_period"] == 0


def test_jump_ends_with_its_tape(machine):
    machine.tape(punched(["G36 R300 L5 H600 E60 Q.1", "G38 P800 L1.5 R900 H1200", "M02"]),
                 passes=400)
    assert events(machine.lines, "end")
    assert machine.data["jump_period"] == 0


def test_a_machine_without_a_jump_axis_has_no_ceiling():
    wire = Controller(jump_axis=15)
    wire.unlock()
    lines = wire.line("G36 R300 L1 H600 E60 Q.1 Z5")
    assert lines[-1] == error_line("refused")
    assert "character 26: the ceiling Z is for machines with a jump axis (sinkers)" in lines[0]
    assert wire.line("G36 R300 L1 H600 E60 Q.1")[-1] == "ok"
    wire.tape(punched(["G36 L.5", "G36 Z1", "M02"]), passes=400)
    assert in_force(wire) == expected(300, 0.5, 600, 60, 0.1)
    assert "the ceiling Z is" in events(wire.lines, "alarm")[0][-1]
