# SPDX-License-Identifier: Apache-2.0
"""The status report: states and fields of grbl 1.1, with true values."""

import re

import pytest

from host.link.link import fields_of
from softcore.tables.faults import error_line
from testbench.firmware import Controller, events
from testbench.programs import punched

DATA = "G36 R300 L.5 H600 E60 Q.1"
STATE = re.compile(r"Idle|Run|Hold:[01]|Alarm")
GRBL = ("MPos", "Bf", "Ln", "FS", "Pn", "WCO", "Ov", "A")   # in its order; ours follow
OURS = ("Er", "Rt", "Gap", "Armed", "Lost", "Off")
REST = 60               # passes in which the machine is taken to rest
WORK = ("M03", "G01 X1 F60")


@pytest.fixture
def machine(machine):
    """The unlocked controller, after it has come to rest."""
    machine.run(REST)
    return machine


def report(machine, passes=30):
    """The fields of one report; their form and order are grbl's."""
    (line,) = (line for line in machine.line("?", passes) if line.startswith("<"))
    state, *fields = line[1:-1].split("|")
    assert STATE.fullmatch(state), line
    names = [field.partition(":")[0] for field in fields]
    assert names == sorted(names, key=(GRBL + OURS).index), line
    assert set(GRBL) - {"Pn", "A"} <= set(names)
    return fields_of(line) | {"state": state}


def state(machine):
    return report(machine)["state"]


# ---- states

@pytest.mark.parametrize("what", ["gk_moving", "gk_lags"])
def test_never_idle_while_something_moves(machine, what):
    """The ramp or the axes are still moving; this needs no program."""
    assert state(machine) == "Idle"
    getattr(machine.library, what)(1)
    assert state(machine) == "Run"
    machine.send(b"!")
    assert state(machine) == "Hold:1"
    getattr(machine.library, what)(0)
    machine.run(1)
    machine.send(b"~")
    assert state(machine) == "Run", "an axis that swings passes through its place faster"
    machine.run(REST)
    assert state(machine) == "Idle"


def test_never_idle_while_it_burns(machine):
    assert machine.line("C100 M03", 2000)[-1] == "ok"
    assert "discharge" in machine.flags
    assert (state(machine), report(machine)["A"]) == ("Run", "S")
    assert machine.line("M05", 2000)[-1] == "ok"
    machine.run(REST)
    assert state(machine) == "Idle"
    assert "A" not in report(machine)


def test_a_hold_at_rest_is_complete_and_a_retraction_in_it_is_not(machine):
    machine.library.gk_speed(10)
    machine.tape(punched([DATA, "C100 M03", "G01 X1 F60", "M02"]), passes=10)
    machine.send(b"!")
    machine.run(REST)
    assert state(machine) == "Hold:0"
    machine.state("retracting")
    machine.library.gk_moving(1)
    assert state(machine) == "Hold:1"
    machine.library.gk_moving(0)
    machine.run(REST)
    assert state(machine) == "Hold:0"


def test_a_stop_of_the_program_is_a_hold(machine):
    machine.tape(punched(["M00", "M02"]), passes=400)
    assert state(machine) == "Hold:0"
    machine.send(b"~")
    machine.run(400)
    assert state(machine) == "Idle"


def test_locked_or_lost_is_alarm():
    machine = Controller()
    assert state(machine) == "Alarm"
    machine.line("$X")
    assert state(machine) == "Alarm"
    assert "Lost" in report(machine)


@pytest.mark.parametrize("line", ["G00 X1", "M00", "G04 X9"])
def test_a_reset_in_a_hold_at_rest_drops_what_was_entered_by_hand(machine, line):
    """As in grbl no alarm: senders that stop so wait for Idle."""
    machine.library.gk_speed(10)
    machine.line("G91", passes=20)
    machine.line(line, passes=20)
    machine.send(b"!")
    machine.run(100)
    assert "<Hold:0|" in machine.line("?")[-1]
    held = machine.axes
    machine.send(b"\x18")
    machine.run(100)
    assert not events(machine.lines, "alarm")
    assert machine.line("?")[-1].startswith("<Idle|")
    machine.library.gk_speed(1000)
    assert machine.line("G91 G00 X1 Y.5")[-1] == "ok"
    assert machine.axes == (held[0] + 10_000, 5000, 0)


def test_a_reset_before_rest_and_of_a_held_tape_is_an_alarm(machine):
    machine.library.gk_speed(10)
    machine.line("G00 X1", passes=20)
    machine.library.gk_moving(1)
    machine.send(b"!")
    machine.run(100)
    assert "<Hold:1|" in machine.line("?")[-1]
    machine.send(b"\x18")
    machine.run(100)
    machine.library.gk_moving(0)
    machine.unlock()
    machine.tape(punched(["M00", "M02"]), passes=400)
    assert "<Hold:0|" in machine.line("?")[-1]
    machine.send(b"\x18")
    machine.run(100)
    assert len(events(machine.lines, "alarm")) == 2
    assert machine.line("?")[-1].startswith("<Alarm|")


# ---- fields

def test_the_feed_is_what_the_machine_goes(machine):
    """By the path coordinate: 20 pulses a pass of a thousand clocks, plus the firmware's own."""
    machine.line("G91", 200)
    machine.library.gk_speed(20)
    machine.line("G01 X100 F60", 10)
    machine.library.gk_moving(1)
    machine.run(2500)
    at, clock = machine.library.gk_position(), machine.library.hal_cycle_low()
    machine.run(500)
    pulses = machine.library.gk_position() - at
    seconds = (machine.library.hal_cycle_low() - clock) / 2e6
    feed, spindle = report(machine)["FS"].split(",")
    assert float(feed) == pytest.approx(pulses / 10_000 / seconds * 60, rel=0.02)
    assert spindle == "0"
    machine.library.gk_speed(0)
    machine.library.gk_moving(0)
    machine.run(REST)
    assert report(machine)["FS"] == "0.000,0"


def test_a_path_that_begins_anew_is_no_way(machine):
    machine.line("G01 X50 F60", 4000)
    assert machine.library.gk_position() == 500_000
    machine.tape(punched([DATA, "G04 P5000", "M02"]), passes=50)
    assert machine.library.gk_position() == 0, "begun"
    machine.library.gk_moving(1)    # or it would be told to rest, whatever its feed
    assert report(machine)["FS"] == "0.000,0"
    assert state(machine) == "Run"


def test_blocks_that_are_free_are_taken(machine):
    """Each ``ok`` takes one; with none left there is no further ``ok``."""
    machine.library.gk_speed(0)
    most = int(report(machine)["Bf"].split(",")[0])
    assert machine.line("$I")[1] == f"[OPT:,{most},255]"
    machine.line("G91 G01 F60", 200)
    taken = 0
    while "ok" in machine.line("X.01", 60):
        taken += 1
        free = int(report(machine)["Bf"].split(",")[0])
        # The first is entered at once: it takes no place.
        assert free == most - max(0, taken - 1)
    assert (free, taken) == (0, most + 1)


def test_a_sender_that_counts_characters_may_fill_the_queue(machine):
    """255 bytes while the firmware reads none: none is lost, but one more would be."""
    machine.library.gk_queue(256)
    lines = b"G4P0\n" * 50 + b"$I\n\n\n"
    assert len(lines) == 255
    machine.send(lines)
    assert machine.library.hal_waiting() == 255
    assert [line for line in machine.run(6000) if line[0] != "["] == ["ok"] * 53
    machine.send(b"G4P00\n" + b"G4P0\n" * 50)
    assert machine.run(6000) == ["ok"] * 50
    assert machine.line("", 400)[-1] == error_line("line"), "the last one came without its end"


@pytest.mark.parametrize("line", [b"G04 P1\n", b"\n", b"$I\r\n"])
def test_as_many_bytes_as_are_free_are_taken(machine, line):
    """While a line takes long, the reported free bytes are free, to the last one."""
    machine.library.gk_queue(256)
    assert report(machine)["Bf"] == "56,255"
    machine.send(b"G04 X3\n")
    sent, told = 0, []
    while free := int(report(machine)["Bf"].split(",")[1]):
        told.append(free)
        piece = line * 9 if free > 9 * len(line) else b"\n" * free
        machine.send(piece)
        sent += piece.count(b"\n")
    assert (told[0], told[-1] < 20) == (255, True)
    came = [text for text in machine.run(9000) if text[0] not in "[<"]
    assert came == ["ok"] * (1 + sent)


def test_the_line_told_is_the_one_under_way(machine):
    """Of lines by hand the N word, when the machine comes to it, not when it is read."""
    machine.library.gk_speed(1)
    machine.line("G91 G01 F60", 400)
    for line in ("N10 X.01", "N20 X.01", "X.01", "N30 G04 P100", "N99999999 X.01"):
        machine.send(line.encode() + b"\n")
    machine.run(30)
    seen = [report(machine)["Ln"]]
    while report(machine)["state"] != "Idle":
        seen += [told] if (told := report(machine)["Ln"]) != seen[-1] else []
    assert seen == ["10", "20", "0", "30", "99999999"]
    machine.line("N40 (only a comment)", 400)
    machine.line("N50 M08", 400)
    assert report(machine)["Ln"] == "50"
    machine.line("M09", 400)
    assert report(machine)["Ln"] == "0"


def test_what_is_entered_by_hand_has_no_source_line(machine):
    """Of its events and its alarms, whatever its N word and the tape before it."""
    machine.tape(punched(["", "N7 G01 X.01 F60", "M02"]), passes=2000)
    assert report(machine)["Ln"] == "4"
    before = len(machine.lines)
    machine.line("N8 M08", 400)
    assert report(machine)["Ln"] == "8"
    machine.library.gk_speed(10)
    machine.line("N9 G01 X5 F60", 20)
    machine.send(b"\x18")
    machine.run(400)
    told = [line for line in machine.lines[before:] if line.startswith("[E:")]
    assert [line.split(",")[0] for line in told] == ["[E:aux", "[E:alarm"]
    assert {line.split(",")[2] for line in told} == {"0"}


def test_pins_are_told_where_they_are_true(machine):
    assert "Pn" not in report(machine)
    machine.library.gk_shorted(1)
    assert "Pn" not in report(machine), "without the discharge nobody looks"
    machine.library.gk_switches(0b001, 0b100)
    assert report(machine)["Pn"] == "XZ"
    machine.library.gk_switches(0, 0)
    machine.line("C100 M03", 2000)
    assert report(machine)["Pn"] == "P"
    machine.library.gk_shorted(0)
    assert "Pn" not in report(machine)


def test_the_fluid_is_told(machine):
    machine.line("M08", 400)
    assert report(machine)["A"] == "F"
    machine.line("M09", 400)
    assert "A" not in report(machine)
