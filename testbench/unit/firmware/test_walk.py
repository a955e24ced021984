# SPDX-License-Identifier: Apache-2.0
"""The operator's walk (``$WALK``), on the firmware alone: what it orders and refuses.

The model machine takes the order and does not walk: the state is set by hand.
"""

import pytest

from softcore.tables.faults import FAULTS
from testbench.firmware import Controller, events
from testbench.programs import punched

DATA = "G36 R300 L.5 H600 E60 Q.1"
NO_AXIS = 15     # a wire machine has no jump axis
REMEMBERED = 8190    # lines of the path
ERRORS = {fault.name: fault.error for fault in FAULTS}


@pytest.fixture
def machine():
    ready = Controller()
    ready.unlock()
    ready.line(DATA)
    return ready


def begun(machine):
    """A line under way, and then on hold."""
    machine.line("G91 G01 X2 F60", 20)
    machine.library.gk_speed(0)
    assert machine.library.gk_position() > 0
    machine.send(b"!")
    machine.run(100)
    assert machine.reported_state() == "Hold:0"


@pytest.fixture
def held(machine):
    machine.library.gk_speed(200)
    begun(machine)
    return machine


def walk(machine):
    return machine.library.gk_walk()


def refused(machine, line, name, sentence):
    said = machine.line(line)
    assert said[-1] == f"error:{ERRORS[name]}", said
    assert sentence in " ".join(said), said
    return said


def orders(lines):
    """How often the machine was ordered back."""
    return [event[0] for event in events(lines)].count("retract")


def test_a_walk_goes_back_from_the_front_and_lifts_the_hold_only_behind_it(held):
    assert held.line("$WALK=.05")[0] == "ok"
    assert walk(held) == 500
    assert {"run", "hold", "held"} <= held.flags, "at the front nothing lifts the hold"
    held.state("retracting")
    held.run()
    assert "hold" in held.flags
    held.state("high")
    held.run()
    assert not {"hold", "held"} & held.flags
    assert held.reported_state() == "Hold:0"
    (report,) = (line for line in held.line("?", 30) if line.startswith("<"))
    assert "|Wk:0.0500,0.0000|Er:" in report


def test_the_report_is_as_long_as_ever_without_a_walk(held):
    assert not any("Wk" in line for line in held.line("?", 30))


def test_a_hold_stays_until_the_next_walk(held):
    held.line("$WALK=.05")
    held.state("low")
    held.run()
    assert "hold" not in held.flags
    held.send(b"!")
    held.run()
    assert {"hold", "held"} <= held.flags
    assert walk(held) == 500
    assert held.line("$WALK=.04")[0] == "ok"
    held.run()
    assert not {"hold", "held"} & held.flags
    assert walk(held) == 400


def test_a_hold_on_the_way_back_stays_where_it_ends(held):
    held.line("$WALK=.05")
    held.state("retracting")
    held.send(b"!")
    held.run()
    held.state("high")
    held.run()
    assert {"hold", "held"} <= held.flags


def test_it_is_ordered_back_once(held):
    assert orders(held.line("$WALK=.05")) == 1
    held.state("high")
    assert not orders(held.run())
    held.library.gk_moving(1)
    assert not orders(held.line("$WALK=.06")), "not in motion"
    held.library.gk_moving(0)
    assert orders(held.run()) == 1


def test_a_resume_ends_it_where_the_machine_may_go_forward(held):
    held.line("$WALK=.05")
    held.state("retracting")
    held.send(b"~")
    held.run()
    assert walk(held) == 500, "on the way back the place stays"
    held.state("high")
    held.run()
    assert walk(held) == 0
    assert not {"hold", "held"} & held.flags
    assert not any("Wk" in line for line in held.line("?", 30))


@pytest.mark.parametrize("what", ["alarm", "reset"])
def test_nothing_of_it_is_left(held, what):
    held.line("$WALK=.05")
    held.state("high")
    held.run()
    if what == "alarm":
        held.library.gk_trip(1, 0)
    else:
        held.send(b"\x18")
    held.run()
    assert walk(held) == 0
    held.line("$X")
    assert not any("Wk" in line for line in held.line("?", 30))


def test_a_program_that_pauses_may_walk_and_goes_on_only_at_the_front(machine):
    tape = punched([DATA, "C100", "M03", "G91 G01 X.1 F60", "M00", "X.1", "M02"])
    assert [one[0] for one in events(machine.tape(tape, passes=2000))][-1] == "pause"
    assert machine.line("$WALK=.05")[0] == "ok"
    machine.state("high")
    machine.run()
    assert "hold" not in machine.flags
    machine.send(b"~")
    machine.run(2000)
    assert "hold" not in machine.flags, "it comes forward"
    assert "discharge" not in machine.flags, "and carries out nothing before it is there"
    machine.state("front")
    lines = machine.run(4000)
    assert [one[0] for one in events(lines)][-1] == "end"
    assert machine.axes[0] == 2000


@pytest.mark.parametrize("word", ["", "x", "-1", "1.2.3", ".", "1 ", "1e3", "12345678901",
                                  "+1"])
def test_a_wrong_number_is_refused(held, word):
    refused(held, f"$WALK={word}", "command", "takes a distance before the front in mm")
    assert walk(held) == 0


def test_the_front_is_no_walk(held):
    refused(held, "$WALK=0.0", "walk", "that is what ~ does")
    assert walk(held) == 0


def test_no_further_than_is_remembered():
    """A wire machine's path begins at its first point."""
    machine = Controller(jump_axis=NO_AXIS)
    machine.unlock()
    machine.line(DATA)
    machine.library.gk_speed(200)
    begun(machine)
    way = machine.library.gk_position()
    refused(machine, f"$WALK={(way + 1) / 10_000:.4f}", "walk",
            f"the way back along the path is {way / 10_000:.4f} mm here, no more")
    assert machine.line(f"$WALK={way / 10_000:.4f}")[0] == "ok"
    assert walk(machine) == way


def test_beyond_what_the_servo_has_drawn_back(held):
    held.library.gk_drawn(300)
    refused(held, "$WALK=.03", "walk", "a walk is longer than 0.0300 mm here")
    assert walk(held) == 0
    assert held.line("$WALK=0.0301")[0] == "ok"


def test_a_locked_machine_does_not_walk():
    machine = Controller()
    refused(machine, "$WALK=1", "locked", "unlock it with $X")


def test_only_on_hold(machine):
    refused(machine, "$WALK=1", "busy", "send ! first")


def test_only_at_rest(held):
    held.library.gk_moving(1)
    refused(held, "$WALK=.05", "busy", "still coming to rest")
    held.library.gk_moving(0)
    held.library.gk_lags(1)
    held.run()
    refused(held, "$WALK=.05", "busy", "still coming to rest")
    held.library.gk_lags(0)
    held.state("at_limit")
    held.run()
    refused(held, "$WALK=.05", "busy", "still coming to rest")
    assert walk(held) == 0


def test_in_a_walk_a_new_place_is_taken_in_motion_too(held):
    held.line("$WALK=.05")
    held.library.gk_moving(1)
    assert held.line("$WALK=.04")[0] == "ok"
    assert walk(held) == 400


def test_not_without_retraction_data():
    machine = Controller()
    machine.unlock()
    machine.library.gk_speed(200)
    begun(machine)
    refused(machine, "$WALK=.05", "retraction", "needs retraction data (G36)")


def test_not_in_a_function_of_the_program(machine):
    """The program would go on with the machine away from the front."""
    machine.library.gk_fin(50_000)
    machine.tape(punched([DATA, "G91 G01 X.1 F60", "M07", "M02"]), passes=2000)
    machine.send(b"!")
    machine.run(100)
    refused(machine, "$WALK=.05", "busy", "carries out a function")


def test_not_in_a_touch_off(machine):
    machine.library.gk_speed(1)
    machine.tape(punched([DATA, "G91 G38.3 X2 F60", "M02"]), passes=1000)
    machine.library.gk_speed(0)
    machine.send(b"!")
    machine.run(100)
    refused(machine, "$WALK=.01", "busy", "no walk in a jog, a homing cycle or a touch-off")


def test_the_path_of_a_walk_is_kept():
    """It is not dropped for lines that come meanwhile: they wait."""
    machine = Controller(jump_axis=NO_AXIS)
    machine.unlock()
    lines = ["G21 G91 G94 F600", DATA, *["G01 X.001"] * (REMEMBERED - 10), "M02"]
    machine.tape(punched(lines), passes=4000)
    machine.send(b"!")
    machine.run(100)
    assert machine.reported_state() == "Hold:0"
    way = machine.library.path_remembered()
    assert way == 10 * (REMEMBERED - 10)
    machine.line(f"$WALK={way / 10_000:.4f}")
    machine.state("high")
    machine.run()
    for _ in range(20):
        machine.line("G01 X.001", 20)
    machine.run(1000)
    assert machine.library.path_remembered() == way
