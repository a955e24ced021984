# SPDX-License-Identifier: Apache-2.0
"""Touch-off (G38.2 to G38.5): its words, its end by contact or without, and what follows it."""

import pytest

from softcore.tables.faults import alarm_number, error_line, named
from testbench.firmware import REST, Checker, Controller, Fault, events
from testbench.programs import punched

CONTACT, LIMIT = 6, 1   # details of the event `halt`


@pytest.fixture
def machine(machine):
    """The unlocked controller, after it has come to rest."""
    machine.run(REST)
    return machine


def told(machine):
    """The places that touch-offs have told: x, y, z and whether there was contact."""
    return [line for line in machine.lines if line.startswith("[PRB:")]


def looking(machine, line="G38.2 Z-1 F60", pulses=500):
    """Begin a touch-off, and go some pulses."""
    machine.library.gk_speed(10)
    assert machine.line(line, 20) == []
    goes(machine, pulses)


def goes(machine, pulses=500):
    """Wait until it has gone some pulses."""
    for _ in range(10_000):
        machine.run(1)
        if abs(sum(machine.axes)) >= pulses:
            return
    raise AssertionError("it does not move")


def touches(machine):
    """Contact, as the gateware tells it; then rest."""
    machine.state("halted")
    machine.event("halt", CONTACT)
    place = machine.axes
    machine.library.gk_speed(0)
    machine.run(3 * REST)
    assert told(machine)[-1].endswith(":1]") == (place != (0, 0, 0))
    machine.library.gk_speed(10)
    return place


@pytest.mark.parametrize(("line", "fault", "said"), [
    ("G38.2 Z-1", "feed", "G38.2 without a feed F"),
    ("G38.2 F10", "missing", "G38.2 needs X, Y or Z"),
    ("G38.3 Z0 F10", "missing", "G38.3 needs a way to go"),
    ("G38.3 Z-1 F601", "feed", "the feed F of G38.3 must be at most the start/stop speed ($410), "
                               "600 mm/min"),
    ("G38.2 G01 Z-1 F10", "conflict", "G1 and G38 exclude each other"),
    ("G38.2 G53 Z-1 F10", "conflict", "G53 and G38 exclude each other"),
    ("G38.2 Z-1 F10 C130", "place", "the word C has no meaning in this block"),
    ("G38.2 Z-1 F10 R1", "place", "the word R has no meaning in this block"),
    ("G38.2 Z-3000 F10", "travel", "Z is beyond the travel"),
    ("G38.5 Z1", "feed", "G38.5 without a feed F"),
    ("G38.1 Z1 F10", "refused", "the touch-off is G38.2 to G38.5"),
])
def test_refusals_are_one_sentence_and_nothing_moves(machine, line, fault, said):
    answer = machine.line(line, 60)
    assert answer[-1] == error_line(fault)
    assert said in answer[0]
    machine.run(REST)
    assert (machine.axes, told(machine), machine.reported_state()) == ((0, 0, 0), [], "Idle")


@pytest.mark.parametrize("blocks", [("C130", "M03", "G38.2 Z-1 F10"), ("C130", "G38.2 Z-1 F10 M03"),
                                    ("C130", "M03", "G38.3 Z-1 F10 M05")])
def test_it_needs_the_discharge_off(blocks):
    found = Checker().check(punched([*blocks, "M02"]))
    assert isinstance(found, Fault)
    assert (found.name, found.line) == ("mode", len(blocks) + 1)
    assert "needs the discharge off (M05) before it" in found.sentence


def test_a_wire_offset_is_refused():
    found = Checker().check(punched(["G10 D1 R.1", "G41 D1 G00 X5", "G38.2 X6 F10", "M02"]))
    assert "G38.2 needs G40" in found.sentence


def test_a_tape_goes_on_from_the_contact(machine):
    """The blocks behind it count from the place of contact, however early they were read."""
    machine.library.gk_speed(0)
    machine.tape(punched(["G38.2 Z-1 F60", "G10 L20 P1 Z0", "G91 G01 Z.5 F600", "G90 Z.25", "M02"]),
                 passes=2 * REST)
    machine.library.gk_speed(10)
    goes(machine)
    z = touches(machine)[2]
    machine.run(40 * REST)
    assert machine.axes == (0, 0, z + 2500)
    assert events(machine.lines, "end")
    assert not events(machine.lines, "alarm")


def test_contact_ends_it_where_the_axes_are(machine):
    looking(machine)
    place = touches(machine)
    assert told(machine) == [f"[PRB:0.0000,0.0000,{place[2] / 10_000:.4f}:1]"]
    assert machine.lines[-1] == "ok"
    assert machine.reported_state() == "Idle"
    assert not events(machine.lines, "alarm")


def test_what_was_found_is_forgotten_at_power_off(machine):
    looking(machine)
    touches(machine)
    again = Controller()
    again.line("$#")
    assert told(again) == ["[PRB:0.0000,0.0000,0.0000:0]"]


def test_what_follows_counts_from_there(machine):
    looking(machine)
    place = touches(machine)
    assert machine.line("G91 G01 Z.2 F600", 60)[-1] == "ok"
    machine.run(4 * REST)
    assert machine.axes == (0, 0, place[2] + 2000)
    assert machine.line("G10 L20 P1 Z5", 60)[-1] == "ok"
    assert machine.line("G90", 60)[-1] == "ok"
    assert machine.line("G00 Z6", 60)[-1] == "ok"
    machine.run(40 * REST)
    assert machine.axes == (0, 0, place[2] + 12_000)


def test_the_way_away_is_noted(machine):
    """After contact the electrode touches: the guard lets it go away from the work only."""
    looking(machine, "G38.2 X1 F60")
    touches(machine)
    machine.library.gk_speed(0)
    assert machine.line("G91 G01 X-.1 F60", 60)[-1] == "ok"
    assert machine.slot(0).away


def test_the_other_side_of_a_hole_is_left_again(machine):
    """The way there leads away from the first side; the touch makes it the way to the work."""
    looking(machine, "G38.2 X1 F60")
    touches(machine)
    assert machine.line("G91 G38.2 X-3 F60", 20) == []
    for _ in range(10_000):
        machine.run(1)
        if machine.axes[0] < 0:
            break
    assert machine.slot(0).away
    touches(machine)
    machine.library.gk_speed(0)
    assert machine.line("G01 X.1 F60", 60)[-1] == "ok"
    assert machine.slot(0).away


@pytest.mark.parametrize(("code", "alarm"), [("G38.2", True), ("G38.3", False)])
def test_the_end_without_contact(machine, code, alarm):
    machine.library.gk_speed(100)
    machine.line(f"{code} X.1 Y-.2 F60", 5 * REST)
    assert machine.axes == (1000, -2000, 0)
    assert told(machine) == ["[PRB:0.1000,-0.2000,0.0000:0]"]
    assert (f"ALARM:{named('no_touch').alarm}" in machine.lines) == alarm
    assert machine.reported_state() == ("Alarm" if alarm else "Idle")


def test_contact_before_the_first_pulse_is_an_alarm(machine):
    machine.library.gk_speed(0)
    assert machine.line("G38.3 Z-1 F60", 60) == []
    machine.run(2 * REST)
    touches(machine)
    assert f"ALARM:{alarm_number('touches')}" in machine.lines
    assert told(machine) == ["[PRB:0.0000,0.0000,0.0000:0]"]
    assert machine.axes == (0, 0, 0)


def test_another_halt_is_an_alarm(machine):
    looking(machine)
    machine.state("halted")
    machine.event("halt", LIMIT)
    machine.run(REST)
    (alarm,) = events(machine.lines, "alarm")
    assert alarm[1] == str(named("halt_limit").alarm)
    assert not told(machine)


def test_contact_is_an_alarm_again_afterwards(machine):
    looking(machine)
    touches(machine)
    assert machine.line("G91 G01 Z-1 F60", 60)[-1] == "ok"
    machine.run(20)
    machine.state("halted")
    machine.event("halt", CONTACT)
    machine.run(REST)
    (alarm,) = events(machine.lines, "alarm")
    assert alarm[1] == str(named("contact").alarm)


def test_a_reset_ends_it_for_good(machine):
    looking(machine)
    machine.send(b"\x18")
    machine.run(REST)
    assert f"ALARM:{alarm_number('reset')}" in machine.lines
    assert machine.line("$X")[-1] == "ok"
    assert machine.line("G91 G01 Z1 F60", 60)[-1] == "ok"
    machine.state("halted")
    machine.event("halt", CONTACT)
    machine.run(REST)
    assert events(machine.lines, "alarm")[-1][1] == str(named("contact").alarm)
    assert not told(machine)


def test_no_override_scales_it(machine):
    machine.send(b"\x91\x91")
    machine.library.gk_speed(10)
    assert machine.line("G38.2 Z-1 F60", 20) == []
    machine.run(2 * REST)
    rate = machine.slot(0).rate
    assert rate == machine.library.gk_rate(60_000)
    machine.send(b"\x91")
    machine.run(60)
    assert machine.slot(0).rate == rate


def opening(machine, line="G38.4 Z1 F60"):
    """Begin a touch-off away from the work, in contact, and go until Ss is fresh."""
    machine.library.gk_shorted(True)
    machine.library.gk_speed(1)
    assert machine.line(line, 20) == []
    goes(machine, 50)


@pytest.mark.parametrize("code", ["G38.4", "G38.5"])
def test_the_end_of_contact_ends_a_way_out(machine, code):
    opening(machine, f"{code} Z1 F60")
    machine.library.gk_shorted(False)
    before = machine.axes[2]
    machine.run(5)
    machine.library.gk_speed(0)
    machine.run(3 * REST)
    (place,) = told(machine)
    z = float(place.split(",")[2].split(":")[0]) * 10_000
    assert place.endswith(":1]")
    assert before <= z <= machine.axes[2] < 10_000
    assert machine.lines[-1] == "ok"
    assert not events(machine.lines, "alarm")
    assert machine.line("$#", 60)[10] == place, "as grbl lists it"
    # What was left of the way is forgotten.
    machine.library.gk_speed(100)
    stands = machine.axes
    machine.run(2 * REST)
    assert machine.axes == stands


@pytest.mark.parametrize(("code", "alarm"), [("G38.4", True), ("G38.5", False)])
def test_a_way_out_that_never_opens(machine, code, alarm):
    opening(machine, f"{code} Z.1 F60")
    machine.library.gk_speed(100)
    machine.run(5 * REST)
    assert told(machine) == ["[PRB:0.0000,0.0000,0.1000:0]"]
    assert (f"ALARM:{named('no_touch').alarm}" in machine.lines) == alarm


def test_a_way_out_without_contact_is_an_alarm(machine):
    machine.library.gk_speed(1)
    machine.line("G38.5 Z1 F60", 400)
    machine.library.gk_speed(0)
    machine.run(3 * REST)
    assert f"ALARM:{alarm_number('touches')}" in machine.lines
    assert told(machine)[0].endswith(":0]")
    (alarm,) = events(machine.lines, "alarm")
    assert "does not touch the work before" in alarm[-1]


def test_contact_before_the_gap_is_known_is_no_end_of_contact(machine):
    """As when the way leads into the work: the gateware halts it at once."""
    machine.library.gk_shorted(True)
    machine.library.gk_speed(1)
    machine.line("G38.4 X1 F60", 20)
    while "run" not in machine.flags:
        machine.run(1)
    machine.state("halted")
    machine.event("halt", CONTACT)
    machine.library.gk_speed(0)
    machine.run(3 * REST)
    (alarm,) = events(machine.lines, "alarm")
    assert alarm[1] == str(named("contact").alarm)
    assert not told(machine)


def test_a_new_contact_ends_a_way_out_that_was_open(machine):
    opening(machine)
    touches(machine)
    assert told(machine)[-1].endswith(":1]")
    assert not events(machine.lines, "alarm")
