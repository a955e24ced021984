# SPDX-License-Identifier: Apache-2.0
"""Jogging (`$J=`): its words, its end by a byte, a hold or silence, and what it is refused in."""

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import alarm_number, error_line, named
from softcore.tables.settings import assign
from testbench.firmware import REST, Controller, events
from testbench.models import jog as model
from testbench.programs import punched

CANCEL, HOLD, RESUME, RETRACT, RESET = b"\x85", b"!", b"~", b"\xb0", b"\x18"
LONG = "$J=G91 X20 F600"
NEVER = 5000            # the longest silence that can be set, ms
ENDED = error_line("jog_ended")
CONTACT = 6              # detail of the event `halt`


@pytest.fixture
def machine(machine):
    """The unlocked controller, after it has come to rest."""
    machine.run(REST)
    return machine


def jogging(machine, *lines):
    """Begin a jog, and go 10 pulses in a pass."""
    machine.library.gk_speed(10)
    for line in lines or (LONG,):
        assert machine.line(line, 20) == ["ok"], line
    assert machine.reported_state() == "Jog"


def came_to_rest(machine):
    """The machine goes no more, and the place where it stands."""
    machine.run(4)
    place = machine.axes
    machine.run(REST)
    assert machine.axes == place
    return place


# ---- words

LOW, HIGH = [-2_990_000] * 3, [2_990_000, 2_990_000, 1_000_000]    # pulses; the jump axis is Z

PIECES = ("X1", "X-2.5", "x.3", "Y7", "Y-0.1234", "Z-.0001", "Z2", "F100", "F100", "F1800", "f.5",
          "G91", "G90", "G20", "G21", "G53", "N7", "(a word)", "X99", "Y-299", "Z100.1", "F1801",
          "F0", "G00", "G1", "G4", "G38.2", "G92", "M3", "M8", "S1", "T2", "P3", "R1", "I4", "J5",
          "K6", "C100", "D1")
USUAL = (60,) * 17 + (10,) * 4 + (1,) * (len(PIECES) - 21)


def ask(machine, text):
    """Carry out a jog to its end; return grbl's error, 0 for none."""
    answer = machine.line("$J=" + text, 300)[-1]
    machine.run(REST)
    return 0 if answer == "ok" else int(answer.removeprefix("error:"))


def test_words_of_a_jog_mean_what_grbl_says(machine, rng):
    """Random words against the model: one of the errors that they have, or the exact place."""
    highest = 1800
    shadow = model.Jogger([0] * 3, [0] * 3, LOW, HIGH, highest)
    good, met = 0, set()
    for _ in range(1000):
        if rng.random() < 0.1:
            shadow.inch, shadow.incremental = rng.random() < 0.3, rng.random() < 0.5
            zero = [rng.randint(-30_000, 30_000) for _ in range(3)]
            modes = f"G{21 - shadow.inch} G{90 + shadow.incremental}"
            place = " ".join(f"{axis}{value / 10_000:.4f}" for axis, value in zip("XYZ", zero,
                                                                               strict=True))
            for line in ("G21", f"G10 L2 P1 {place}", modes):
                assert machine.line(line)[-1] == "ok", line
            shadow.offset = zero
        pieces = rng.choices(PIECES, USUAL, k=rng.randint(1, 5))
        text = rng.choice(("", " ")).join(pieces + ["F300"] * (rng.random() < 0.6))
        modes = machine.line("$G")
        wrong = shadow.jog(text)
        answer = ask(machine, text)
        met |= wrong
        good += not wrong
        assert answer in (wrong or {0}), (text, wrong)
        assert machine.axes == tuple(shadow.position), text
        assert machine.line("$G") == modes, "a jog changes no mode"
    assert good > 100
    assert {model.TRAVEL, model.WRONG_WORD, model.MODAL, model.NO_FEED, model.UNUSED} <= met


@pytest.mark.parametrize("line", ["$J", "$JX1F10", "$J X1 F10"])
def test_what_is_no_jog_is_an_unknown_command(machine, line):
    assert machine.line(line)[-1] == "error:3"


def test_the_sentence_counts_the_characters_of_the_line(machine):
    told, answer = machine.line("$J=G91 X1 M3 F10")
    assert told == "[MSG:MDI, character 11: a jog has no M codes.]"
    assert answer == "error:16"


def test_a_block_skip_skips_no_jog(machine):
    assert machine.line(assign("block_skip", 1))[-1] == "ok"
    assert ask(machine, "/G91 X1 F100") == 0
    assert machine.axes == (10_000, 0, 0)


# ---- state


def test_jogs_are_answered_when_planned_and_follow_each_other(machine):
    machine.library.gk_speed(10)
    for count in range(5):
        assert machine.line("$J=G91 X.01 F600", 12)[-1:] == ["ok"], count
    assert machine.axes[0] < 500
    assert machine.reported_state() == "Jog"
    machine.run(60)
    assert machine.axes == (500, 0, 0)
    machine.run(REST)
    assert machine.reported_state() == "Idle"


@pytest.mark.parametrize("line", ["G00 X1", "G21", "M03"])
def test_other_lines_wait_for_the_end(machine, line):
    jogging(machine)
    assert machine.line(line)[-1] == "error:9"
    machine.library.gk_speed(1 << 30)
    machine.run(2 * REST)
    assert machine.line("G00 X1")[-1] == "ok"


def test_the_position_cannot_be_taken_meanwhile(machine):
    jogging(machine)
    assert machine.line("$POSITION=HERE")[-1] == error_line("busy")


def locked(machine):
    machine.library.gk_trip(numbers()["estop"], 0)
    machine.run(400)


def moving(machine):
    machine.library.gk_speed(1)
    machine.line("G01 X1 F60", 20)


def holding(machine):
    machine.send(HOLD)
    machine.run(REST)


def machining(machine):
    for line in ("G36 R300 L1 H600 E60 Q0.1", "C130", "M03"):
        assert machine.line(line)[-1] == "ok"
    machine.run(REST)


def machining_at_rest(machine):
    machining(machine)
    machine.send(HOLD)
    machine.run(REST)
    machine.send(b"\x9e")
    machine.run(REST)


def on_tape(machine):
    machine.library.gk_speed(0)
    machine.tape(punched(["G91 G01 X1 F60", "M02"]), passes=600)


@pytest.mark.parametrize("scene", [locked, moving, holding, machining, machining_at_rest, on_tape])
def test_a_jog_needs_idle_or_jog(machine, scene):
    scene(machine)
    machine.library.gk_speed(0)
    place = machine.axes
    assert machine.line("$J=G91 Y1 F600")[-1] == "error:8"
    machine.library.gk_speed(1)
    machine.run(20)
    assert machine.axes[1:] == place[1:]
    assert machine.reported_state() != "Jog"


def test_no_jog_after_a_lost_position():
    machine = Controller()
    assert machine.line("$X")[-1] == "ok"
    machine.run(REST)
    assert machine.line(LONG)[-1] == error_line("position_lost")
    assert machine.axes == (0, 0, 0)


def test_no_jog_beyond_the_soft_limits(machine):
    for line in ("$J=X299.0001 F100", "$J=G91 Z-299.0001 F100", "$J=G53 Y300 F100"):
        assert machine.line(line)[-1] == "error:15", line
    assert machine.axes == (0, 0, 0)
    assert ask(machine, "X299 F100") == 0
    assert machine.axes == (2_990_000, 0, 0)


def test_off_a_limit_switch_only_away_from_it(machine):
    machine.library.gk_switches(0, 1)
    machine.library.gk_trip(numbers()["limit_high"], 1)
    machine.run(400)
    for line in ("$X", "$POSITION=HERE"):
        assert machine.line(line)[-1] == "ok"
    machine.run(REST)
    assert machine.line("$J=G91 X.1 F100")[-1] == "error:15"
    assert ask(machine, "G91 X-.1 F100") == 0


# ---- its end


@pytest.mark.parametrize("byte", [CANCEL, HOLD, b"\x84"])
def test_it_is_cancelled(machine, byte):
    jogging(machine, LONG, "$J=G91 Y20 F600")
    machine.send(byte)
    place = came_to_rest(machine)
    assert 0 < place[0] < 20_000
    assert place[1:] == (0, 0)
    assert machine.reported_state() == "Idle"
    assert not machine.flags & {"hold", "held"}
    machine.send(RESUME)
    machine.run(REST)
    assert machine.axes == place, "what was left of the path is forgotten"
    assert ask(machine, "G91 Y.1 F600") == 0
    assert machine.axes == (place[0], 1000, 0)


def test_it_is_cancelled_while_it_still_comes_to_rest(machine):
    jogging(machine)
    machine.library.gk_moving(1)
    machine.send(CANCEL)
    machine.run(REST)
    place = machine.axes
    for byte in (RESUME, RETRACT, CANCEL):
        machine.send(byte)
        assert machine.run(20) == []
    assert machine.reported_state() == "Jog"
    assert machine.line("$J=G91 X1 F100")[-1] == ENDED
    assert machine.line("$RESUME")[-1] == "ok"
    machine.run(20)
    assert machine.axes == place
    machine.library.gk_moving(0)
    machine.run(REST)
    assert machine.reported_state() == "Idle"
    assert machine.axes == place


def test_jogs_that_wait_are_cancelled_too(machine):
    """Those in the path, the one that waits for room in it, and those in the queue of lines."""
    machine.library.gk_speed(0)
    machine.lines.clear()
    for _ in range(7):
        machine.send(b"$J=G91 X.1 F600\n" * 10)
        machine.run(60)
    planned = machine.lines.count("ok")
    assert 50 < planned < 60
    machine.send(CANCEL)
    machine.library.gk_speed(1)
    machine.run(2000)
    assert machine.lines.count("ok") == planned
    assert machine.lines.count(ENDED) == 70 - planned
    assert machine.axes[0] <= 10
    assert machine.reported_state() == "Idle"


@pytest.mark.parametrize("passes", range(8))
def test_a_cancel_right_behind_a_jog_is_not_lost(machine, passes):
    """The byte overtakes the line: it comes first, and is meant for the jog before it."""
    machine.library.gk_speed(1)
    machine.lines.clear()
    machine.send(b"$J=G91 X9 F600\n$J=G91 Y9 F600\n")
    machine.run(passes)
    machine.send(CANCEL)
    machine.run(2 * REST)
    assert machine.reported_state() == "Idle"
    assert sum(machine.axes) < 20
    assert len([line for line in machine.lines if line in ("ok", ENDED)]) == 2
    assert ask(machine, "G91 Y.1 F600") == 0


def test_a_cancel_without_a_jog_does_nothing(machine):
    machine.library.gk_speed(1)
    assert machine.line("G01 X.02 F60", 20) == ["ok"]
    machine.send(CANCEL)
    machine.run(400)
    assert machine.axes == (200, 0, 0)


def test_silence_ends_it(machine):
    """A pulled cable: nothing comes any more. 100 ms are 200 passes at 2 MHz."""
    assert machine.line(assign("jog_silence_ms", 100))[-1] == "ok"
    jogging(machine, "$J=G91 X200 F1800")
    for _ in range(6):
        before = machine.axes[0]
        machine.send(b"?")
        machine.run(150)
        assert machine.axes[0] == before + 1500, "the host is there"
    before = machine.axes[0]
    machine.run(1000)
    assert before < machine.axes[0] <= before + 2000 + 100
    assert machine.reported_state() == "Idle"


def test_silence_ends_jogs_that_wait_in_the_queue(machine):
    """The path takes 56 jogs. Those behind them have been received before the host fell silent."""
    assert machine.line(assign("jog_silence_ms", 100))[-1] == "ok"
    machine.library.gk_speed(10)
    segment = b"$J=G91X.05F600\n"
    for _ in range(60):
        machine.send(segment)
        machine.run(4)
    machine.send(segment * 20)
    machine.run(40)
    before = machine.axes[0]
    machine.run(3000)
    assert 0 < before < machine.axes[0] <= before + 2000 + 100
    assert machine.reported_state() == "Idle"


@pytest.mark.parametrize("noise", [b"\n", b"G91\n", b"~", b"\x91", b"\x00\xff", b"$\n"])
def test_nothing_but_a_report_or_a_jog_breaks_the_silence(machine, noise):
    assert machine.line(assign("jog_silence_ms", 100))[-1] == "ok"
    jogging(machine, "$J=G91 X200 F1800")
    for _ in range(40):
        machine.send(noise)
        machine.run(20)
    assert machine.axes[0] < 3000


def test_short_jogs_go_on_without_reports(machine):
    """Segments of 0.2 s, as a panel sends them."""
    machine.library.gk_speed(10)
    for _ in range(12):
        assert machine.line("$J=G91 X.4 F120", 400)[-1] == "ok"
    assert machine.axes[0] > 40_000


def test_a_reset_ends_it_with_an_alarm(machine):
    jogging(machine)
    machine.send(RESET)
    machine.run(400)
    assert f"ALARM:{alarm_number('reset')}" in machine.lines
    place = machine.axes
    machine.run(400)
    assert machine.axes == place
    assert machine.reported_state() == "Alarm"
    assert machine.line("$X")[-1] == "ok"
    machine.run(REST)
    assert ask(machine, "G91 Y.1 F600") == 0


def test_contact_ends_it(machine):
    """The guard of the discharge off watches: it halts, and the firmware raises its alarm."""
    jogging(machine)
    machine.state("halted")
    machine.event("halt", CONTACT)
    machine.run(100)
    (alarm,) = events(machine.lines, "alarm")
    assert alarm[1] == str(named("contact").alarm)
    assert machine.reported_state() == "Alarm"
    assert machine.line("$X")[-1] == "ok"
    machine.run(REST)
    assert ask(machine, "G91 X-1 F100") == 0
    assert machine.slot(0).away, "away from the work the guard lets it go"


# ---- speeds


def test_no_override_scales_it(machine):
    machine.send(b"\x91\x91\x97")
    machine.library.gk_speed(10)
    assert machine.line("$J=G91 X1 F120", 30) == ["ok"]
    rate = machine.slot(0).rate
    machine.send(b"\x91")
    machine.run(60)
    assert machine.slot(0).rate == rate == machine.library.gk_rate(120_000)
    machine.library.gk_speed(1 << 30)
    machine.run(2 * REST)
    assert machine.line("G91 G01 X1 F120", 300)[-1] == "ok"
    assert machine.slot(1).rate == pytest.approx(rate * 1.3, abs=2)


# ---- tapes


@pytest.mark.parametrize("byte", [b"", CANCEL, HOLD])
def test_a_tape_waits_for_its_end(machine, byte):
    """Whoever has cancelled the jog lets the tape begin by `~`."""
    machine.line(assign("jog_silence_ms", NEVER))
    jogging(machine, "$J=G91 Y10 F600")
    machine.tape(punched(["G91 G00 X1", "M02"]), passes=20)
    machine.send(byte)
    machine.run(20)
    assert machine.axes[0] == 0
    machine.library.gk_speed(1 << 30)
    machine.run(1500)
    if byte:
        assert machine.axes[0] == 0
        assert machine.reported_state() == "Hold:0"
        machine.send(RESUME)
        machine.run(1500)
    assert machine.axes[0] == 10_000


def test_a_tape_waits_until_the_axes_have_come_to_rest(machine):
    """The path of the jog has ended, but the axes must have stood for 20 ms, some 40 passes."""
    rows = punched(["G91 G00 X1", "M02"])
    machine.library.gk_speed(1 << 30)
    assert machine.line("$J=G91 Y0.001 F600", 14) == ["ok"]
    assert machine.axes[1] == 10
    parts = [b"", *(rows[at:at + 64] for at in range(0, len(rows), 64))]
    for number, part in enumerate(parts):
        machine.send(machine.framed(len(part), number, part))
        machine.run(3)
    machine.run(10)
    assert events(machine.lines, "start") == []
    machine.run(REST)
    assert len(events(machine.lines, "start")) == 1
