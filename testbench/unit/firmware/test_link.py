# SPDX-License-Identifier: Apache-2.0
"""The firmware's end of the link: reports, real-time bytes and tape frames.

Of lines as such see test_firmware_lines.
"""

import re
from binascii import crc_hqx

import pytest

from softcore.image import SOURCES
from softcore.tables.faults import alarm_number, error_line
from softcore.tables.settings import assign
from testbench.firmware import Controller, events
from testbench.programs import punched

ACK, NAK = 0x06, 0x15
LOST = "the position is lost: $H finds it, or $POSITION=HERE accepts the counted one"


frame = Controller.framed
REALTIME = {0x3F, 0x21, 0x7E, 0x18, 0xB0, 0x84, 0x85, *range(0x90, 0xA2)}


def answers(machine, data, passes=60):
    machine.marks.clear()
    machine.send(data)
    machine.run(passes)
    return list(machine.marks)


def test_greeting_and_lock():
    machine = Controller()
    assert machine.lines == ["Grbl 1.1h ['$' for help]"]
    assert machine.line("?")[-1].startswith("<Alarm|")
    assert machine.line("G00 X1")[-1] == error_line("locked")
    assert machine.line("$X") == [f"[MSG:{LOST}.]", "ok"]
    assert machine.line("?")[-1].startswith("<Alarm|")
    assert machine.line("$position=here") == ["ok"]
    assert machine.line("?")[-1].startswith("<Idle|")


def test_what_came_over_the_link_is_told(machine):
    machine.send(b"G77\n\xff(\xff)\n")
    machine.library.gk_send_broken()
    machine.send(b"\n" + frame(3, 0, b"abc")[:-1] + b"\x00" + frame(3, 0, b"abc")[:4])
    machine.run(400)
    damaged = error_line("line")
    assert machine.line("$L")[-1] == damaged, "the frame that stopped may have been its start"
    assert machine.line("$L") == [
        "[LNK:lines 4,refused 3,frames 2,damaged 2,faulty 1,ignored 0]", "ok"]


def test_status_report_has_the_form_of_grbl(machine):
    machine.line("G92 X0 Y0 Z.05")
    assert machine.line("G00 X-1.5")[-1] == "ok"
    machine.send(b"?")
    (report,) = machine.run(100)
    assert re.fullmatch(r"<Idle\|MPos:-1\.5000,0\.0000,0\.0000\|Bf:56,255\|Ln:0\|FS:0\.000,0"
                        r"\|WCO:0\.0000,0\.0000,-0\.0500\|Ov:100,100,100"
                        r"\|Er:0,0,0\|Rt:0,0\|Gap:0,0,0,0\|Armed>", report)


def test_realtime_bytes_inside_a_line(machine):
    machine.send(b"G00?X1\n")
    lines = machine.run(400)
    assert sorted(line[0] for line in lines) == ["<", "o"]
    assert machine.axes[0] == 10_000


def test_a_hold_that_came_with_the_order_to_go_on_stays(machine):
    """It is unknown which came first: the order is refused, and accepted when sent again."""
    machine.send(b"!$RESUME\n")
    assert machine.run(50) == [
        "[MSG:a hold came at the same time, and is in force: resume again.]", error_line("busy")]
    assert machine.line("?")[-1].startswith("<Hold:0|")
    assert machine.line("$RESUME") == ["ok"]
    assert machine.line("?")[-1].startswith("<Idle|")


def test_lines_are_answered_in_turn(machine):
    machine.send(b"G00 X1\r\nG77\r\nG04 P1\r\n\r\n$I\r\n")
    lines = machine.run(3000)
    assert [line for line in lines if line[0] != "["] == ["ok", error_line("unknown"), "ok", "ok",
                                                          "ok"], \
        "a blank line counts, the second half of CR LF does not"


def test_a_blank_line_behind_a_damaged_frame_has_its_answer(machine):
    """A sender may begin with one. With numbered lines it may be a line end that came twice."""
    machine.send(bytes([0x02, 5, 1, 0x41]))
    machine.run(200)    # until the frame is given up
    for line in ("", "G04 P1"):
        code = "error:" if not line else "ok"
        assert machine.line(line)[-1].startswith(code), line
    machine.send(Controller.numbered(0, "G04 P1"))
    machine.run(400)
    assert machine.line("") == []


def test_what_senders_for_grbl_ask_first(machine):
    assert machine.line("$I") == ["[VER:1.1h:Gapkeeper 0.1]", "[OPT:,56,255]",
                                    "[FIRMWARE:0,built-in,0,0,0,323584]", "ok"]
    assert machine.line("$G") == ["[GC:G80 G54 G17 G21 G90 G94 M5 M9 T0 F0.000 S0]", "ok"]
    assert machine.line("G55 G18 G20 G91 G01 F1 M8 S70 T12 C100 M3", passes=3000)[-1] == "ok"
    assert machine.line("$g") == ["[GC:G1 G55 G18 G20 G91 G94 M3 M8 T12 F25.400 S70]", "ok"]
    assert machine.line("$N") == ["$N0=", "ok"]
    assert machine.line("%") == ["ok"]
    assert machine.line("") == ["ok"]


def test_no_sentence_has_a_word_by_which_a_sender_knows_an_answer():
    """Some look for these anywhere in a line. What is said of a tape alone they do not hear."""
    quoted = re.compile(r'"((?:[^"\\]|\\.)*)"')
    found = {text for path in SOURCES.rglob("*.[ch]") if path.parts[-2] != "pc"
             for line in path.read_text().splitlines() if not line.startswith("#include")
             for text in quoted.findall(line) if re.search("ok|error|ALARM|Grbl", text)}
    assert found == {"ok", "ok @%u", "error:%u", "error:%u @%u", "ALARM:%u",
                     "Grbl 1.1h ['$' for help]", "parity error (TH) in the byte %x"}


@pytest.mark.parametrize(("line", "said"), [
    ("$HX", "homing is $H"), ("$J", "a jog begins with $J="),
    ("$C", "gapkeeper tape check"), ("$slp", "$SLP"), ("$N0=G54", "($N)"),
    ("$Q", "this $ command"),
])
def test_what_is_not_in_this_version_is_refused_by_name(machine, line, said):
    told, answer = machine.line(line)
    assert said in told
    assert answer == "error:3"


@pytest.mark.parametrize(("line", "name"), [
    ("$499=1", "setting"), ("$400=0", "setting"), ("$400=33", "setting"),
    ("$400=4.5", "setting"), ("$400=", "setting"), ("$400=99999999999", "setting"),
    ("$=4", "command"), ("$HX", "command"), ("$J=X1", "feed"), ("(open", "comment"),
    ("X1", "mode"), ("G01 X1", "feed"), ("%5", "character"), ("G00 X" + "9" * 20, "overflow"),
])
def test_bad_lines_are_refused_with_a_sentence(machine, line, name):
    lines = machine.line(line)
    assert lines[-1] == error_line(name)
    assert re.fullmatch(r"\[MSG:.+\.\]", lines[-2])


def test_frames_are_acknowledged_in_turn(machine):
    assert answers(machine, frame(0, 0)) == [(ACK, 0)]
    assert answers(machine, frame(3, 1, b"abc")) == [(ACK, 1)]
    assert answers(machine, frame(3, 1, b"abc")) == [(ACK, 1)], "repeated: taken once"
    assert answers(machine, frame(3, 3, b"abc")) == [(NAK, 3)], "one is missing"
    assert answers(machine, frame(3, 2, b"abc")) == [(ACK, 2)]


def test_repeated_frames_are_taken_once(machine):
    rows = punched(["G91 G00 X1", "X1", "M02"])
    machine.frame(0, 0)
    for sequence, start in enumerate(range(0, len(rows), 16), start=1):
        for _ in range(3):
            machine.frame(len(rows[start:start + 16]), sequence, rows[start:start + 16])
    machine.run(1000)
    assert machine.axes[0] == 20_000


def test_frames_before_a_tape_is_begun_are_refused(machine):
    assert answers(machine, frame(3, 0, b"abc")) == [(NAK, 0)]


def test_a_reset_ends_the_tape_and_its_frames(machine):
    assert answers(machine, frame(0, 0)) == [(ACK, 0)]
    assert answers(machine, frame(3, 1, b"abc")) == [(ACK, 1)]
    machine.send(b"\x18")
    machine.run(100)
    for sequence in (1, 2):
        assert answers(machine, frame(3, sequence, b"abc")) == [(NAK, sequence)]
    assert answers(machine, frame(0, 0)) == [(ACK, 0)]


def test_sequence_numbers_wrap(machine):
    rows = bytes(64) * 300 + punched(["G00 X1", "M02"])
    assert events(machine.tape(rows), "end") == [["end"]]


@pytest.mark.parametrize("harm", ["bent", "dropped", "doubled", "broken"])
def test_damaged_frame_is_asked_for_again_and_never_obeyed(machine, harm):
    """Whatever byte is damaged, no part of the frame acts as a real-time byte or a line."""
    machine.frame(0, 0)
    good = frame(6, 1, b"!\x18?\n$I\n"[:6])
    harmed = []
    for at in range(len(good)):
        before, byte, after = good[:at], good[at], good[at + 1:]
        if harm == "bent":
            # One that reads as a real-time byte is one.
            harmed += [before + bytes([byte ^ 1 << bit]) + after for bit in range(8)
                       if byte ^ 1 << bit not in REALTIME]
        elif harm != "doubled":
            harmed.append((before, b"", after))
        elif before and after:  # else it is a whole frame, and a byte beside it
            harmed.append((before, bytes([byte] * 2), after))
    assert len(harmed) > 10
    for bad in harmed:
        machine.marks.clear()
        if harm == "bent":
            machine.send(bad)
        else:
            machine.send(bad[0] + bad[1])
            if harm == "broken":
                machine.library.gk_send_broken()
            machine.send(bad[2])
        lines = machine.run(300)
        assert {mark for mark, _ in machine.marks} == {NAK}, bad
        assert not [line for line in lines if not line.startswith(("[MSG", error_line("line")))]
        assert machine.line("?")[-1].startswith("<Idle|")
    assert answers(machine, good) == [(ACK, 1)]
    assert not any(line.startswith("Grbl ") for line in machine.lines[1:])


def test_an_error_beside_the_bytes_of_a_frame_damages_it(machine):
    """As by a disturbance between two bytes: all of the frame came, and something else."""
    machine.frame(0, 0)
    good = frame(3, 1, b"abc")
    for at in range(1, len(good)):
        machine.marks.clear()
        machine.send(good[:at])
        machine.library.gk_send_broken()
        machine.send(good[at:])
        machine.run(300)
        assert {mark for mark, _ in machine.marks} == {NAK}, at
    assert answers(machine, good) == [(ACK, 1)]


def test_frame_that_ends_too_soon_is_no_frame(machine, rng):
    """Not even if the CRC of the frame before happens to fit the bytes that have come."""
    machine.frame(0, 0)
    check = crc_hqx(b"\x08\x02", 0xFFFF)
    payload = next(data for data in iter(lambda: rng.randbytes(8), None)
                   if crc_hqx(b"\x08\x01" + data, 0xFFFF) == check)
    assert answers(machine, frame(8, 1, payload)) == [(ACK, 1)]
    assert answers(machine, b"\x02\x08\x10\x42\x03") == [(NAK, 2)]
    assert answers(machine, frame(8, 2, bytes(8))) == [(ACK, 2)]


@pytest.mark.parametrize("cut", [1, 2, 3, 5, 8])
def test_frame_begins_anew_wherever_the_one_before_ends(machine, cut):
    """No time has to pass, whatever part of the other has come."""
    machine.frame(0, 0)
    good = frame(3, 1, b"a!c")
    assert answers(machine, good[:cut] + good) == [(ACK, 1)]
    assert answers(machine, (good[:cut] + good) * 3)[-1] == (ACK, 1)


def test_lines_are_heard_again_when_a_tape_is_aborted_half_way(machine):
    rows = punched(["G00 X1", "G77", "M02"])
    machine.frame(0, 0)
    machine.frame(64, 1, rows[:64])
    assert answers(machine, b"$I\n$I\n", passes=400) == [(NAK, 1)], "no plain line belongs here"
    assert machine.lines[-2:] == [
        "[MSG:A line is refused: between the frames of a tape it needs a number and a check.]",
        error_line("line")]
    for sequence, start in enumerate(range(64, len(rows), 64), start=2):
        machine.frame(len(rows[start:start + 64]), sequence, rows[start:start + 64])
    machine.run(1000)
    assert events(machine.lines, "alarm")
    assert machine.line("$X") == ["ok"]
    assert machine.line("$I")[-1] == "ok"


def test_frame_that_stops_half_way_is_given_up(machine):
    machine.frame(0, 0)
    machine.send(frame(5, 1, b"abcde")[:4])
    machine.run(10)
    machine.send(b"?")
    assert machine.run(20)[0].startswith("<Idle|"), "heard in the middle of the frame"
    machine.marks.clear()
    assert machine.run(400) == []
    assert machine.marks == [(NAK, 1)]
    assert machine.line("?")[-1].startswith("<Idle|")


def test_frame_without_room_is_answered_when_there_is(machine):
    machine.library.gk_speed(0)
    machine.frame(0, 0)
    rows = punched(["G91 G01 F60", *(["X.01"] * 400), "M02"])
    sequence = 0
    while answers(machine, frame(64, sequence + 1, rows[:64]), passes=400):
        sequence += 1
        rows = rows[64:]
    assert 10 < sequence < 30
    assert answers(machine, b"", passes=2000) == []
    machine.library.gk_speed(1000)
    assert answers(machine, b"", passes=400) == [(ACK, sequence + 1)]


def test_tape_bytes_are_no_realtime_bytes(machine):
    rows = punched(["(!?" + "A" * 40 + ")", "G00 X1", "M02"])
    assert events(machine.tape(rows), "end") == [["end"]]


def test_lines_are_refused_while_a_tape_runs(machine):
    machine.library.gk_speed(0)
    machine.tape(punched(["G01 X1 F6", "M02"]), passes=400)
    assert machine.line("G00 X5")[-1] == error_line("busy")
    assert machine.line(assign("short_needed", 5))[-1] == error_line("busy")
    free = assign("servo_window", 40)
    assert machine.line(free)[-1] == error_line("busy"), "not even what guards nothing"
    assert machine.line("?")[-1].startswith("<Run|")


def test_no_tape_begins_while_another_runs(machine):
    """Its first frame waits; the tape that runs loses nothing."""
    rows = punched(["G91 G01 F600", *["X.01"] * 60, "M02"])
    machine.library.gk_speed(0)
    machine.frame(0, 0)
    parts = [rows[start:start + 64] for start in range(0, len(rows), 64)]
    for sequence, part in enumerate(parts[:6], 1):
        machine.frame(len(part), sequence, part)
    machine.run(400)
    assert machine.line("?")[-1].startswith("<Run|")
    assert answers(machine, frame(0, 0), passes=400) == []
    machine.library.gk_speed(10)
    for sequence, part in enumerate(parts[6:], 7):
        machine.frame(len(part), sequence, part)
    machine.frame(0xFF, len(parts) + 1)
    machine.run(2000)
    assert events(machine.lines, "end")
    assert machine.axes == (6000, 0, 0)


def test_what_comes_of_an_aborted_tape_is_dropped(machine):
    """However much it is, its sender gets rid of it."""
    rows = punched(["G77", "M02"])
    machine.frame(0, 0)
    for sequence in (1, 2):
        machine.frame(64, sequence, rows[64 * (sequence - 1):64 * sequence])
    machine.run(400)
    assert events(machine.lines, "alarm")
    for sequence in range(3, 40):
        machine.frame(64, sequence, bytes(64))
    machine.frame(0xFF, 40)
    assert machine.line("$X") == ["ok"]
    assert events(machine.tape(punched(["G00 X1", "M02"])), "end") == [["end"]]


def test_tape_that_ends_without_its_end_word(machine):
    machine.frame(0, 0)
    rows = punched(["G00 X1", "M02"])
    rows = rows[:rows.index(0xA5, 62) - 4]
    for sequence, start in enumerate(range(0, len(rows), 64), start=1):
        part = rows[start:start + 64]
        machine.frame(len(part), sequence, part)
    assert not events(machine.run(1000), "alarm")
    machine.frame(0xFF, sequence + 1)
    machine.run(400)
    assert events(machine.lines, "alarm")[0][1] == str(alarm_number("no_end"))


def test_pulses_that_follow_each_other_are_told_in_turn(machine, rng):
    """Everything the gateware reports comes out as a line, in its order, with its own stamp."""
    machine.library.gk_speed(0)
    machine.tape(punched(["G36 R300 L5 H600 E60 Q.1", "G01 Z-1 F6", "M02"]), passes=300)
    machine.library.gk_go(500)
    machine.run(40)
    count = len(machine.lines)
    for _ in range(5):
        machine.event("retraction_start", 1, 3, 357914)
        machine.event("retraction_end", 1, 100, 40_000)
        machine.event("readvance", 1, 2000, 1000)
        machine.event("readvance", 2, 1000, 0)
        machine.event("resume", 0)
        machine.run(200)
    told = events(machine.lines[count:])
    assert told == [
        ["retract", "s", "1000", "3"], ["back", "c", "0", "30000", "7"],
        ["advance", "h", "2000", "1000", "600000"], ["advance", "l", "1000", "0", "60000"],
        ["resume"]] * 5


def test_overshoot_is_waited_for(machine):
    machine.event("retraction_start", 2)
    machine.event("retraction_end", 2, 0, 0)
    assert [event[0] for event in events(machine.run(30))] == ["retract"]
    assert events(machine.run(60)) == [["back", "l", "0", "-", "7"]]


def test_jump_comes_back_at_its_own_speed(machine):
    machine.library.gk_speed(0)
    machine.tape(punched(["G36 R300 L5 H600 E60 Q.1", "G38 P800 L1 R900 H1200", "G01 Z-1 F6",
                          "M02"]), passes=400)
    machine.event("retraction_start", 2)
    machine.event("readvance", 1, 10_000, 1000)
    assert events(machine.run(100), "advance") == [["advance", "h", "10000", "1000", "1200000"]]


def test_more_events_at_once_than_are_taken_are_told_in_turn(machine):
    """Firmware takes eight; the others wait in the gateware, which stops forward motion."""
    for number in range(24):
        machine.event("readvance", 1, number)
    machine.run(400)
    assert [int(event[2]) for event in events(machine.lines, "advance")] == [*range(24)]


def test_what_came_before_an_alarm_is_told_before_it():
    """Events of blocks without motion come one a pass; after the first the others follow."""
    told = set()
    for passes in range(12):
        machine = Controller()
        machine.unlock()
        machine.library.gk_speed(0)
        machine.tape(punched(["G91 G01 X.01 F6", *["G90", "G91"] * 4, "X1", "M02"]), passes=600)
        machine.library.gk_go(101)
        machine.run(passes)
        before = len(events(machine.lines, "block"))
        machine.send(b"\x18")
        machine.run(300)
        names = [event[0] for event in events(machine.lines)]
        assert names.count("alarm") == 1
        if before > 1:
            assert names[-1] == "alarm"
            told.add(names.count("block") - before)
    assert max(told) > 1, "some still waited"


def test_lost_events_are_an_alarm(machine):
    machine.library.gk_speed(0)
    machine.tape(punched(["G01 X1 F6", "M02"]), passes=300)
    for _ in range(100):
        machine.event("resume", 0)
    lines = machine.run(2000)
    assert events(lines, "alarm")[0][1] == str(alarm_number("events"))


@pytest.mark.parametrize("between", [b"", b"\x02\xff"], ids=["a pause", "half a frame"])
def test_a_line_feed_long_behind_a_carriage_return_is_a_line_of_its_own(machine, between):
    """The next client's blank line; behind half a frame it is refused, but answered."""
    machine.send(b"G90\r" + between)
    assert machine.run(200) == ["ok"]
    assert len(machine.line("")) == (2 if between else 1)
    assert machine.line("G90") == ["ok"]
    machine.send(b"G90\r\n")
    assert machine.run(100) == ["ok"]
