# SPDX-License-Identifier: Apache-2.0
"""Lines that wait in the controller when an alarm comes: none of them is carried out."""

import pytest

from host.link.framing import numbered
from softcore.tables.causes import numbers
from softcore.tables.faults import error_line
from testbench.firmware import Controller

ESTOP = numbers()["estop"]
WAITS = "G91 G94 G04 P400"      # dwells while the others wait
LOCKED = error_line("locked")


def tripped(machine, passes=4000):
    """An emergency stop that is let go at once; what the controller says then."""
    machine.lines.clear()
    machine.library.gk_trip(ESTOP, 1)
    machine.run(passes)
    return [line for line in machine.lines if line.startswith(("ok", "error"))]


@pytest.mark.parametrize("guarded", [False, True])
def test_an_unlock_that_waited_unlocks_nothing(guarded):
    machine = Controller()
    machine.unlock()
    lines = [WAITS, "$X", "$458=1000", "G01 X1 F600", "$J=G91 X1 F600"]
    for number, line in enumerate(lines):
        machine.send(numbered(number, line) if guarded else line.encode() + b"\n")
    machine.run(50)
    assert machine.reported_state() == "Run"
    answers = [f"{LOCKED} @{number}" if guarded else LOCKED for number in range(len(lines))]
    assert tripped(machine) == answers
    assert machine.reported_state() == "Alarm"
    assert machine.axes == (0, 0, 0)
    machine.send(numbered(len(lines), "$X") if guarded else b"$X\n")
    assert machine.run(400)[-1].startswith("ok"), "what comes after the alarm counts"
    assert machine.reported_state() == "Idle"


def test_a_line_that_has_begun_came_before_the_alarm():
    machine = Controller()
    machine.unlock()
    machine.send(WAITS.encode() + b"\n$")
    machine.run(50)
    assert tripped(machine) == [LOCKED]
    assert machine.line("X") == ["[MSG:stopped by an alarm or a reset.]", LOCKED]
    assert machine.reported_state() == "Alarm"
    assert machine.line("$X")[-1] == "ok"


@pytest.mark.parametrize("last", ["damaged", "order", "again"])
def test_lines_after_an_alarm_count_whatever_came_of_the_one_before(last):
    """The alarm comes in a line that is not kept: damaged, an order, or one that comes again."""
    machine = Controller()
    machine.unlock()
    machine.send(numbered(0, "G91 G94"))
    machine.run(200)
    line = {"damaged": numbered(1, "G94 G91 G21 G17")[:-2] + b"?\n"[1:],
            "order": numbered(1, "$RETRACT"), "again": numbered(0, "G91 G94")}[last]
    machine.send(line[:-1])
    machine.run(20)
    tripped(machine, 200)
    machine.send(line[-1:])
    machine.run(200)
    machine.send(numbered(2 if last == "order" else 1, "$X"))
    assert machine.run(400)[-1].startswith("ok @"), "it came after the alarm"
    assert machine.reported_state() == "Idle"


def test_lines_that_waited_for_a_line_are_carried_out(machine):
    for line in ("G91 G94 G04 P40", "G04 P40", "G01 X1 F600"):
        machine.send(line.encode() + b"\n")
    machine.run(8000)
    assert machine.axes == (10_000, 0, 0)
