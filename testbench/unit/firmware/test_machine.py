# SPDX-License-Identifier: Apache-2.0
"""State of the machine as a whole: unlocked, armed, position known; its guards stay in force."""

import ctypes

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import alarm_number, error_line
from softcore.tables.settings import assign
from testbench.firmware import Controller, events
from testbench.programs import punched

CAUSE = numbers()
LOST = "the position is lost; $POSITION=HERE accepts the counted position"
REST = 200              # passes of the main loop after which axes that stand count as at rest
BURNS = ("G36 R300 L1 H600 E60 Q0.1", "C130", "M03")


def enter(machine, *lines):
    """Enter lines that must all be accepted."""
    for line in lines:
        assert machine.line(line)[-1] == "ok", line


# ---- position


@pytest.mark.parametrize("block", ["G00 X1", "G01 X1 F60", "G02 I1 F60", "M03"])
def test_out_of_reset_nothing_moves_before_the_position_is_taken(block):
    machine = Controller()
    assert machine.line("$X")[-1] == "ok"
    machine.library.gk_arm()
    enter(machine, "G36 R300 L1 H600 E60 Q0.1", "C130", "G92 X5")
    assert machine.line(block)[-1] == error_line("position_lost")
    assert LOST in machine.lines[-2]
    assert machine.axes == (0, 0, 0)
    assert "|Lost" in machine.line("?")[-1]
    enter(machine, "$POSITION=HERE", block)


@pytest.mark.parametrize("block", ["G28.1", "G30.1", "G10 L20 P1 X0"])
def test_out_of_reset_no_place_is_stored_before_the_position_is_taken(block):
    """These outlive power-off; `G28` would go there in rapid motion."""
    machine = Controller()
    assert machine.line("$X")[-1] == "ok"
    assert machine.line(block)[-1] == error_line("position_lost")
    enter(machine, "G10 L2 P1 X5", "$POSITION=HERE", block)


def test_a_tape_is_rejected_where_it_would_move():
    machine = Controller()
    machine.line("$X")
    machine.tape(punched(["G21 G90", "G00 X1", "M02"]), passes=2000)
    (alarm,) = events(machine.lines, "alarm")
    assert alarm[1] == str(alarm_number("position_lost"))
    assert alarm[2].startswith("Block 3: the position is lost")
    assert machine.axes == (0, 0, 0)


@pytest.mark.parametrize("line", ["$POSITION", "$POSITION=", "$POSITION=THERE", "$POSITION=HERE "])
def test_only_the_whole_word_takes_the_position(line):
    machine = Controller()
    machine.line("$X")
    assert machine.line(line)[-1].startswith("error:")
    assert machine.line("G00 X1")[-1] == error_line("position_lost")


def test_a_locked_machine_does_not_take_it():
    machine = Controller()
    assert machine.line("$POSITION=HERE")[-1] == error_line("locked")


def test_a_machine_that_moves_does_not_take_it(machine):
    machine.library.gk_speed(0)
    enter(machine, "G01 X1 F60")
    assert machine.line("$POSITION=HERE") == [
        "[MSG:the machine moves, or a program runs.]", error_line("busy")]
    machine.library.gk_speed(50)
    machine.run(2000)
    enter(machine, "$POSITION=HERE")


def test_pulses_on_their_way_are_motion_too(machine):
    """The ramp still holds pulses although the path has been commanded to its end."""
    machine.library.gk_moving(1)
    assert machine.line("$POSITION=HERE")[-1] == error_line("busy")
    assert machine.line("?")[-1].startswith("<Run|")
    machine.library.gk_moving(0)
    machine.state("stopping")
    assert machine.line("?")[-1].startswith("<Run|")
    machine.state("front")
    enter(machine, "$POSITION=HERE")
    assert machine.line("?")[-1].startswith("<Idle|")


def test_a_locked_machine_comes_to_rest_before_it_is_unlocked(machine):
    machine.state("halted")
    machine.library.gk_moving(1)
    machine.event("halt", 1)
    machine.run(300)
    assert machine.line("$X") == ["[MSG:the machine is still coming to rest.]",
                                  error_line("locked")]
    machine.library.gk_moving(0)
    enter(machine, "$X")


@pytest.mark.parametrize("state", ["stopping", "retracting", "at_limit", "high", "low"])
def test_a_retraction_that_stands_at_the_front_is_none_of_rest(machine, state):
    enter(machine, "G01 X.1 F60")
    machine.run(2000)
    assert machine.reported_state() == "Idle"
    machine.state(state)
    machine.run(10)
    assert machine.reported_state() != "Idle"
    machine.state("front")
    machine.run(10)
    assert machine.reported_state() == "Idle"


def test_events_that_wait_at_an_unlock_are_not_told_after_it(machine):
    machine.state("halted")
    machine.event("halt", 1)
    machine.run(300)
    machine.send(b"$X\n")
    for number in range(32):
        machine.event("readvance", 1, number)
        machine.run(1)
    machine.run(400)
    assert "ok" in machine.lines
    told = [int(event[2]) for event in events(machine.lines, "advance")]
    missing = sorted({*range(32)} - {*told})
    assert 1 <= len(missing) <= 4, "the events' turn is in every fourth pass"
    assert missing == [*range(missing[0], missing[-1] + 1)]


def test_the_first_of_two_alarms_is_told(machine):
    """A reset in motion and lost events come before either can be reported."""
    machine.library.gk_speed(0)
    machine.tape(punched(["G01 X1 F6", "M02"]), passes=300)
    for _ in range(100):
        machine.event("resume", 0)
    machine.send(b"\x18")
    lines = machine.run(2000)
    (alarm,) = events(lines, "alarm")
    assert alarm[1:] == [str(alarm_number("reset")), "reset by the operator during motion."]
    assert not [line for line in lines if line.startswith("[MSG")]


LOSES = {"error_saturated", "encoder", "following_stopped", "following_moving", "coder", "guard"}


@pytest.mark.parametrize("cause", [name for name in CAUSE if name != "power_on"])
def test_what_a_trip_does_to_the_position(machine, cause):
    machine.library.gk_trip(CAUSE[cause], 0)
    (alarm,) = events(machine.run(200), "alarm")
    lost = cause in LOSES
    assert alarm[2].endswith(f"the position is {'lost' if lost else 'kept'}.")
    assert machine.line("$X")[-1] == "ok"
    assert machine.line("G00 X1")[-1] == (error_line("position_lost") if lost else "ok")


def test_axes_driven_by_steps_lose_it_at_any_trip(machine):
    enter(machine, assign("step_axes", 1), "$POSITION=HERE", "G00 X0")
    machine.library.gk_trip(CAUSE["estop"], 0)
    assert events(machine.run(200), "alarm")[0][2].endswith("the position is lost.")


def test_a_miscount_that_comes_later_than_the_trip_loses_it_too(machine):
    machine.library.gk_trip(CAUSE["estop"], 0)
    machine.run(200)
    machine.library.gk_live(1 << CAUSE["encoder"])
    assert machine.line("$X")[-1] == error_line("trip")
    machine.library.gk_live(0)
    assert machine.line("$X")[-1] == "ok"
    assert machine.line("G00 X1")[-1] == error_line("position_lost")


# ---- arming


def test_the_discharge_needs_a_hand_at_the_machine():
    machine = Controller()
    enter(machine, "$X", "$POSITION=HERE", *BURNS[:2])
    assert machine.line("M03") == [
        "[MSG:the discharge is not armed: press the button ARM at the machine.]",
        error_line("not_armed")]
    machine.library.gk_arm()
    enter(machine, "M03")
    assert "discharge" in machine.flags


def test_a_tape_that_is_not_armed_ends_at_its_m03():
    machine = Controller()
    enter(machine, "$X", "$POSITION=HERE")
    machine.tape(punched([*BURNS, "G01 X1 F60", "M02"]), passes=2000)
    (alarm,) = events(machine.lines, "alarm")
    assert alarm[1] == str(alarm_number("not_armed"))
    assert alarm[2].startswith("Block 4: the discharge is not armed")
    assert machine.axes == (0, 0, 0)


@pytest.mark.parametrize("how", ["reset", "trip"])
def test_after_a_stop_only_a_line_that_moves_allows_motion_anew(machine, how):
    machine.library.gk_speed(0)
    enter(machine, "G01 X1 F60")
    assert "run" in machine.flags
    if how == "trip":
        machine.library.gk_trip(CAUSE["estop"], 0)
    else:
        machine.send(b"\x18")
    machine.run(300)
    machine.unlock()
    for command in (b"", b"!", b"~"):
        machine.send(command)
        machine.run(300)
        assert "run" not in machine.flags, command
    machine.library.gk_speed(100)
    enter(machine, "G00 X2")
    assert "run" in machine.flags
    machine.run(2000)
    assert machine.axes == (20_000, 0, 0)


@pytest.mark.parametrize("how", ["alarm", "reset", "trip"])
def test_alarms_resets_and_trips_disarm(machine, how):
    enter(machine, *BURNS)
    if how == "alarm":
        machine.state("halted")
        machine.event("halt", 1)
    elif how == "trip":
        machine.library.gk_trip(CAUSE["estop"], 0)
    else:
        machine.send(b"\x18")
    machine.run(300)
    assert "discharge" not in machine.flags
    assert "|Armed" not in machine.line("?")[-1]
    enter(machine, "$X")
    assert machine.line("M03")[-1] == error_line("not_armed")


# ---- what guards the machine


@pytest.mark.parametrize("setting", [assign("short_needed", 32), assign("blanking_ns", 50_000),
                                     assign("repeats", 0), assign("start_speed_um_s", 1_000_000),
                                     assign("follow_stopped", 2000),
                                     assign("step_axes", 4), assign("reversed_encoders", 4),
                                     assign("fluid_required", 0), assign("no_discharge_um", 0),
                                     assign("no_progress_s", 0), assign("loop_gain", 60)])
def test_what_guards_the_machine_stays_while_it_machines(machine, setting):
    enter(machine, *BURNS)
    number = setting[1:].partition("=")[0]
    assert machine.line(setting) == [
        f"[MSG:setting {number} guards the machine: M05 and rest come first.]", error_line("busy")]
    enter(machine, assign("servo_window", 40), "M05", setting)


def test_what_guards_the_machine_stays_while_it_moves(machine):
    machine.library.gk_moving(1)
    assert machine.line(assign("reversed_encoders", 4))[-1] == error_line("busy")
    enter(machine, assign("servo_window", 40))
    machine.library.gk_moving(0)
    machine.run(REST)
    enter(machine, assign("reversed_encoders", 4))


def test_what_guards_the_machine_reaches_the_gateware(machine):
    words = (ctypes.c_uint32 * 7)()
    enter(machine, assign("follow_stopped", 300), assign("follow_moving", 4000))
    machine.library.gk_guards(words)
    assert [*words] == [1, *[300, 4000] * 3]
    enter(machine, assign("fluid_required", 0))
    machine.library.gk_guards(words)
    assert words[0] == 0
    enter(machine, assign("fluid_required", 1))
    machine.library.gk_guards(words)
    assert words[0] == 1


def test_what_tells_a_short_is_told_in_every_report(machine):
    assert "|Ss" not in machine.line("?")[-1]
    enter(machine, assign("short_current_ns", 3000))
    assert machine.line("?")[-1].endswith("|Ss:current>")
    enter(machine, assign("short_mean_mv", 5000))
    assert machine.line("?")[-1].endswith("|Ss:mean,current>")
    enter(machine, assign("short_current_ns", 0), assign("fluid_required", 0))
    assert machine.line("?")[-1].endswith("|Off:fluid|Ss:mean>")


def test_what_is_masked_is_told_in_every_report(machine):
    assert "|Off" not in machine.line("?")[-1]
    enter(machine, assign("fluid_required", 0), assign("no_progress_s", 0), assign("step_axes", 5))
    assert machine.line("?")[-1].endswith("|Off:fluid,no progress,coder X,coder Z>")
    enter(machine, assign("repeats", 0), assign("no_discharge_um", 0), assign("step_axes", 7))
    assert machine.line("?")[-1].endswith(
        "|Off:repeats,fluid,no discharge,no progress,coder X,coder Y,coder Z>")
