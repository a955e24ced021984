# SPDX-License-Identifier: Apache-2.0
"""Single block and dry run: the operator tries a program, block by block or without discharges."""

import pytest

from softcore.tables.faults import error_line
from softcore.tables.settings import SETTINGS, assign
from testbench.firmware import Controller, events
from testbench.programs import punched

DATA = "G36 R300 L.5 H600 E60 Q.1"
CUTS = ("G91 G01 X.1 F60", "(a comment)", "X.1", "/X.1", "G04 P1", "M02")


@pytest.fixture
def machine():
    ready = Controller()
    ready.unlock()
    return ready


def names(lines):
    return [event[0] for event in events(lines)]


def run(machine, *blocks, passes=4000):
    return machine.tape(punched(list(blocks)), passes=passes)


def resumed(machine, passes=4000):
    machine.send(b"~")
    return machine.run(passes)


def test_a_tape_stops_after_each_block(machine):
    """After the motion, not before it; a comment and a skipped block are none."""
    assert machine.line(assign("single_block", 1)) == ["ok"]
    stops = []
    lines = run(machine, *CUTS)
    while names(lines)[-1] == "pause":
        stops.append(machine.axes[0])
        assert machine.line("?")[-1].startswith("<Hold:0|")
        assert not names(machine.run(2000)), "it waits for the operator"
        lines = resumed(machine)
    assert stops == [1000, 2000, 2000]
    assert names(lines) == ["block", "end"], "the program's end is no stop"


@pytest.mark.parametrize("stop", ["M00", "M01"])
def test_a_stop_stops_once(machine, stop):
    machine.line(assign("single_block", 1))
    assert names(run(machine, stop, "M02"))[-1] == "pause"
    assert names(resumed(machine)) == ["block", "end"]


def test_the_discharge_is_off_at_the_stop_and_returns(machine):
    machine.line(assign("single_block", 1))
    run(machine, "C100", "M03", "G04 P500", "M02")
    resumed(machine)
    assert "discharge" not in machine.flags, "the machine stands after the block with M03"
    machine.send(b"~")
    machine.run(100)
    assert "discharge" in machine.flags
    machine.run(4000)
    assert "discharge" not in machine.flags


def test_the_switch_acts_while_a_program_runs(machine):
    """Off: the program goes on to its end. On: it stops after a block that is not planned yet."""
    machine.line(assign("single_block", 1))
    assert names(run(machine, *CUTS))[-1] == "pause"
    assert machine.line(assign("single_block", 0)) == ["ok"]
    assert names(resumed(machine))[-1] == "end"
    assert names(run(machine, "G04 P600", "G91 G01 X.1 F60", "X.1", "M02", passes=400)) == [
        "start", "block"]
    assert machine.line(assign("single_block", 1)) == ["ok"]
    assert names(machine.run(4000))[-1] == "pause"
    assert machine.axes[0] == 2000, "the dwell was under way: the machine stands after it"


def test_only_switches_change_while_a_program_runs(machine):
    run(machine, "M00", "M02")
    taken = [setting.name for setting in SETTINGS
             if machine.line(f"${setting.number}={setting.default}")[-1:] == ["ok"]]
    assert taken == ["block_skip", "optional_stop", "single_block"]
    assert machine.line(assign("tv", 0))[-1] == error_line("busy")


def test_a_line_by_hand_is_no_single_block(machine):
    machine.line(assign("single_block", 1))
    assert machine.line("G91 G01 X.1 F60", passes=4000) == ["ok"]
    assert machine.line("?")[-1].startswith("<Idle|")


def test_a_dry_run_has_no_discharge_and_its_own_feed(machine):
    """Conditions, functions and modes are those of the program."""
    assert machine.line(assign("dry_run_mm_min", 900)) == ["ok"]
    machine.library.gk_speed(10)
    lines = run(machine, DATA, "C130 M08", "G00 X.1", "M03", "G95 P1 G01 X-.1 F6",
                "G94 X-.2 F1500", "G00 X0", "M05", "M30", passes=1)
    assert machine.axes[0] < 1000, "M03 is still to come"
    seen = set()
    for _ in range(3000):
        lines += machine.run(1)
        assert "discharge" not in machine.flags
        seen.add(machine.gap["servo"])
    assert "[MSG:dry run: no discharge, cuts at F900]" in lines
    assert seen == {0}, "G95 does not serve"
    assert events(lines, "aux") == [["aux", "M", "8"], ["aux", "M", "5"]], "no M03 is told"
    assert events(lines, "condition") == [["condition", "130", "6000"]]
    assert names(lines)[-1] == "end"
    rate = machine.library.gk_rate
    rapid = rate(30 * 60_000)
    assert [machine.slot(slot).rate for slot in range(4)] == [
        rapid, rate(900_000), rate(900_000), rapid]


def test_a_dry_run_needs_no_arming_but_a_position(machine):
    machine.line(assign("dry_run_mm_min", 900))
    machine.line(assign("reversed_drives", 1))    # the position is lost
    assert machine.line("G01 X1 F60")[-1] == error_line("position_lost")
    fresh = Controller()
    fresh.run(fresh.clock_hz // 25_000)
    fresh.line("$X")
    fresh.line("$POSITION=HERE")
    assert fresh.line(assign("dry_run_mm_min", 900)) == ["ok"]
    fresh.line("C100")
    assert fresh.line("M03") == ["ok"]
    fresh.line("M05")
    fresh.line(assign("dry_run_mm_min", 0))
    assert fresh.line("M03")[-1] == error_line("not_armed")


def test_a_dry_run_goes_no_faster_than_the_machine(machine):
    machine.line(assign("dry_run_mm_min", 60_000))
    machine.line("G91 G01 X.1 F60", passes=2000)
    assert machine.slot(0).rate == machine.library.gk_rate(30 * 60_000)


def test_with_the_discharge_on_no_dry_run_begins(machine):
    machine.line("C100")
    machine.line("M03")
    assert machine.line(assign("dry_run_mm_min", 900))[-1] == error_line("busy")


def test_a_jog_keeps_its_speed(machine):
    machine.line(assign("dry_run_mm_min", 900))
    machine.line("$J=G91 X1 F300", passes=20)
    assert machine.slot(0).rate == machine.library.gk_rate(300_000)
