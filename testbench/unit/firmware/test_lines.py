# SPDX-License-Identifier: Apache-2.0
"""Lines of the link: whole or not at all, in turn, one answer each."""

import re

import pytest

from host.link.framing import LONGEST_LINE
from softcore.tables.faults import error_line
from testbench.firmware import Controller, events
from testbench.programs import punched

DAMAGED = error_line("line")
LOCKED = "[MSG:the machine is locked; unlock it with $X first.]"
REALTIME = {0x3F, 0x21, 0x7E, 0x18, 0xB0, 0x84, 0x85, *range(0x90, 0xA2)}
STALE = "what came before it was damaged, and a part of it may be missing"


class Sender:
    """Numbered lines, one after the other."""

    def __init__(self, machine):
        self.machine, self.number = machine, 0

    def bytes(self, text):
        return Controller.numbered(self.number, text)

    def __call__(self, text, passes=200):
        """Send the next line; return the lines that came, the last one without its number."""
        self.machine.send(self.bytes(text))
        lines = self.machine.run(passes)
        suffix = f" @{self.number}"
        if any(line.endswith(suffix) and not line.startswith("[") for line in lines):
            self.number = (self.number + 1) % 65536
        return [line.removesuffix(suffix) for line in lines]


@pytest.fixture
def sender(machine):
    return Sender(machine)


def answers(lines):
    return [line for line in lines if line.startswith(("ok", "error"))]


def named(lines):
    """The reason given for the only refused line."""
    told, answer = lines
    assert answer.startswith(DAMAGED)
    return re.fullmatch(r"\[MSG:(?:A line|Line @\d+) is refused: (.+)\.\]", told)[1]


# ---- numbers

def test_numbered_lines_are_answered_by_their_number(machine, sender):
    lines = {"G91 G00 X1": "ok", "G77": error_line("unknown"), "$I": "ok",
             "$499=1": error_line("setting"), "": "ok", "(*12AB) G04 P1": "ok"}
    for sender.number, (line, answer) in enumerate(lines.items()):
        machine.send(sender.bytes(line))
        assert machine.run(200)[-1] == f"{answer} @{sender.number}"
    assert machine.axes[0] == 10_000


def test_a_line_that_comes_again_is_answered_again_and_not_carried_out(machine, sender):
    for line, answer in (("G91 G00 X1", "ok"), ("G77", error_line("unknown")), ("$RESUME", "ok")):
        sent = sender.bytes(line)
        assert sender(line)[-1] == answer
        for _ in range(3):
            machine.send(sent + sent)
            assert machine.run(200) == [f"{answer} @{sender.number - 1}"] * 2
    assert machine.axes[0] == 10_000


def test_a_line_that_comes_again_while_it_waits_or_works_is_answered_once(machine, sender):
    sent = sender.bytes("G04 X1")
    machine.send(sent * 3)
    assert machine.run(400) == []
    machine.send(sent)
    assert machine.run(4000) == ["ok @0"]
    machine.send(sent)
    assert machine.run(50) == ["ok @0"]


def test_a_line_at_work_is_known_again_behind_an_order(machine, sender):
    first = sender.bytes("M00")
    assert not answers(sender("M00"))
    sender.number = 1
    order = sender.bytes("$RETRACT")
    assert sender("$RETRACT")[-1] == "ok"
    machine.send(first + order)
    assert answers(machine.run(200)) == ["ok @1"], "the other one is at work"
    assert sender("$RESUME")[0] == "ok"
    machine.send(first)
    assert machine.run(200) == ["ok @0"]


def test_another_line_of_the_same_number_is_refused(machine, sender):
    sender("G91 G00 X1")
    machine.send(Controller.numbered(0, "G91 G00 X2"))
    assert named(machine.run(200)) == "its number is not the next"
    assert machine.axes[0] == 10_000


@pytest.mark.parametrize("number", [1, 3, 65535, 0])
def test_a_line_out_of_sequence_is_refused(machine, sender, number):
    sender("G91")
    sender("G00 X1")
    machine.send(Controller.numbered(number, "G00 X2"))
    lines = machine.run(200)
    assert named(lines) == "its number is not the next"
    assert lines[-1] == f"error:108 @{number}"
    assert sender("G00 X3")[-1] == "ok"
    assert machine.axes[0] == 40_000


def test_numbers_go_round(machine, sender):
    for _ in range(65535 // 15):
        machine.send(b"".join(Controller.numbered(sender.number + n, "") for n in range(15)))
        sender.number += 15
        machine.run(80)
    assert machine.lines[-1] == "ok @65534"
    for number in (65535, 0):
        assert sender.number == number
        assert sender("", 20)[-1] == "ok"
    assert sender("G00 X1")[-1] == "ok"
    assert machine.axes[0] == 10_000


def test_numbers_begin_anew_after_a_reset(machine, sender):
    sender("G91")
    machine.send(b"\x18" + sender.bytes("G00 X1"))
    lines = machine.run(200)
    assert lines[0].startswith("Grbl ")
    assert named(lines[1:]) == "its number is not the next"
    sender.number = 0
    assert sender("G00 X2")[-1] == "ok"


@pytest.mark.parametrize("line", [
    b"@5\n", b"@ G00 X1*1234\n", b"@0G00 X1*1234\n", b"@0 G00 X1\n", b"@0 G00 X1*12345\n",
    b"@0 G00 X1*123\n", b"@0 G00 X1*12G4\n", b"@000000 G00 X1*1234\n", b"@x G00 X1*1234\n",
    b"@65536 G00 X1*1234\n", b"@0 $X*bb94\n", b"@0*1234\n", b"@@0 G00 X1*1234\n",
    b"@0@1 G00 X1*1234\n"])
def test_a_line_of_wrong_form_is_refused(machine, line):
    machine.send(line)
    assert named(machine.run(200)) == "number and check are not of the form @17 text*5A3C"
    assert machine.axes == (0, 0, 0)
    assert machine.line("G04 P1") == ["ok"]


# ---- damage

def test_whatever_bit_is_bent_nothing_else_is_carried_out(machine, sender):
    """With any one bit of a line or its end inverted it is refused, or has its meaning still."""
    sender("G91")
    became_realtime, place = 0, 0
    for at in range(len(sender.bytes("G00 X.01 (8)"))):
        for bit in range(8):
            line = bytearray(sender.bytes("G00 X.01 (8)"))
            line[at] ^= 1 << bit
            if line[at] in REALTIME:
                became_realtime += 1
                continue
            machine.send(line)
            lines = machine.run(80)
            assert machine.axes == (place, 0, 0), (line, lines)
            # Without its end, the line goes on.
            machine.send(b"\n")
            lines += machine.run(80)
            # The line's own end: now it has come whole.
            if machine.axes != (place, 0, 0):
                place += 100
                assert at == len(line) - 1
                assert machine.axes == (place, 0, 0)
                sender.number += 1
                continue
            assert {DAMAGED} <= {line.split(" ")[0] for line in answers(lines)}, (line, lines)
    assert became_realtime > 5
    assert sender("G00 X.01")[-1] == "ok"


@pytest.mark.parametrize("harm", ["dropped", "doubled", "broken"])
def test_whatever_byte_is_lost_or_doubled_nothing_else_is_carried_out(machine, sender, harm):
    sender("G91")
    place = 0
    for at in range(len(sender.bytes("G00 X.0100"))):
        line = sender.bytes("G00 X.0100")
        machine.send(line[:at])
        if harm == "doubled":
            machine.send(line[at:at + 1] * 2)
        elif harm == "broken":
            machine.library.gk_send_broken()
        machine.send(line[at + 1:])
        lines = machine.run(80)
        machine.send(b"\n")
        lines += machine.run(80)
        if machine.axes != (place, 0, 0):
            place += 100
            assert machine.axes == (place, 0, 0)
            # The end of a line may come late or twice; a check tells that there was no more.
            assert at == len(line) - 1
            sender.number += 1
            assert len(answers(lines)) == 1
        else:
            assert {DAMAGED} <= {line.split(" ")[0] for line in answers(lines)}, (line, lines)
    assert sender("G00 X.01")[-1] == "ok"


@pytest.mark.parametrize("at", range(10))
def test_a_plain_line_with_a_broken_character_is_refused(machine, at):
    """At any place, the end and the place before the line included."""
    line = b"G00 Z-0.5\n"
    machine.send(line[:at])
    machine.library.gk_send_broken()
    machine.send(line[at + 1:] or b"\n")
    assert named(machine.run(300)) == "a character came without its stop bit"
    assert machine.axes == (0, 0, 0)
    assert machine.line("G00 Z-0.5") == ["ok"]


def test_what_the_queue_has_lost_refuses_its_line(machine):
    machine.library.gk_queue(32)
    machine.send(b"G91\n(" + b"a" * 40 + b") G00 Z1\nG00 X1\n")
    assert machine.run(300) == ["ok"], "the end of the line was lost, too"
    assert named(machine.line("G00 X1")) == "characters came faster than they were taken"
    assert machine.axes == (0, 0, 0)
    assert machine.line("G00 X1") == ["ok"]


@pytest.mark.parametrize("byte", [0x90, 0x92, 0x99, 0x9E, 0xA0, 0xA1])
def test_overrides_of_grbl_do_nothing_wherever_they_come(machine, byte):
    """Not even a retraction, which one of them once was."""
    override = bytes([byte])
    machine.send(override + b"G0" + override + b"0 X1\n" + override)
    assert machine.run(400) == ["ok"]
    assert machine.axes == (10_000, 0, 0)
    assert machine.line("?")[-1].startswith("<Idle|")


def test_the_safety_door_of_grbl_is_a_hold(machine):
    machine.send(b"\x84")
    machine.run(20)
    assert machine.line("?")[-1].startswith("<Hold:0|")
    machine.send(b"~")
    machine.run(20)
    assert machine.line("?")[-1].startswith("<Idle|")


@pytest.mark.parametrize("byte", [0x80, 0xA5, 0xC3, 0xFF])
def test_a_strange_byte_refuses_its_line_and_is_dropped_between_lines(machine, byte):
    strange = bytes([byte])
    machine.send(strange * 3 + b"G91\n" + strange + b"\n")
    assert machine.run(300) == ["ok", "ok"], "G91, and a line with nothing in it"
    machine.send(b"G00" + strange + b" X1\n" + strange)
    assert named(machine.run(300)) == "it has a character that no line has"
    assert machine.line("G00 X2") == ["ok"]
    assert machine.axes[0] == 20_000


@pytest.mark.parametrize("length", [LONGEST_LINE, LONGEST_LINE + 1, 600, 5000])
def test_an_over_long_line_is_refused_whole_also_when_its_end_comes_late(machine, sender, length):
    line = "(" + "x" * (length - 9) + ") G00 X1"
    for piece in range(0, length, 100):
        machine.send(line[piece:piece + 100].encode())
        machine.run(100)
    machine.send(b"\n")
    lines = machine.run(300)
    fits = length <= LONGEST_LINE
    assert lines[-1] == ("ok" if fits else error_line("too_long"))
    assert machine.axes[0] == (10_000 if fits else 0)
    machine.send(sender.bytes(line))
    lines = machine.run(300)
    assert lines[-1] == ("ok @0" if fits else "error:108 @0")
    assert fits or lines[-2] == "[MSG:Line @0 is refused: it has too many characters.]"


# ---- what follows damage

def test_after_a_damaged_frame_a_plain_line_is_not_trusted_until_a_pause(machine):
    """Bytes taken for a frame may have been the start of a line."""
    machine.send(b"\x02G00 Z1\nG00 X1\n")  # G is no length of a frame
    lines = machine.run(100)
    assert [named(lines[:2]), named(lines[2:])] == [STALE] * 2
    assert machine.axes == (0, 0, 0)
    assert machine.line("G00 X1") == ["ok"]


def test_a_pause_alone_does_not_make_the_rest_of_a_line_whole(machine):
    machine.send(b"\x02G")
    machine.run(100)
    assert named(machine.line("00 Z1")) == STALE
    assert machine.line("G00 X1") == ["ok"]


def test_a_frame_that_stops_may_have_taken_the_start_of_a_line(machine):
    machine.send(b"\x02/G00 X1")
    machine.run(200)
    assert machine.marks[-1][0] == 0x15
    assert named(machine.line(" Z1")) == STALE
    assert machine.line("G00 X1") == ["ok"]


def test_a_line_that_a_frame_cuts_is_refused(machine, sender):
    machine.send(b"G00 X1" + Controller.framed(0, 0) + b"\n")
    assert named(machine.run(200)) == "a frame begins or ends in it"
    assert machine.marks == [(6, 0)]
    machine.send(sender.bytes("G00 X1")[:-1] + Controller.framed(0, 0))
    assert named(machine.run(200)) == "a frame begins or ends in it"
    assert machine.axes == (0, 0, 0)


def test_the_rest_of_a_line_in_which_a_reset_came_is_refused(machine):
    """The reset may have been a character of it."""
    machine.send(b"@0 G00 X\x18F12\nG01 X1\n")
    lines = machine.run(100)
    assert lines[0].startswith("Grbl "), "when the line is quiet"
    assert [named(lines[1:3]), named(lines[3:])] == [STALE] * 2
    assert machine.line("G91") == ["ok"]


# ---- the guarded link

def guard(sender):
    assert sender("G91") == ["ok"]


def test_the_guarded_link_takes_no_plain_line(machine, sender):
    guard(sender)
    for line in ("G00 X1", "$I", "$RESUME", "x"):
        machine.send(line.encode() + b"\n")
        assert named(machine.run(100)) == "until a reset it needs a number and a check"
    assert machine.axes == (0, 0, 0)
    machine.send(b"\x18")
    machine.run(100)
    assert machine.line("G00 X1") == ["ok"]


def test_the_guarded_link_obeys_no_single_byte_that_moves(machine, sender):
    guard(sender)
    machine.tape(punched(["G36 R300 L1 H600 E60 Q.1", "M00", "G00 X1", "M02"]), passes=400)
    assert events(machine.lines, "pause")
    machine.send(b"~~\xb0~")
    assert machine.run(200) == []
    assert machine.axes == (0, 0, 0)
    assert sender("$L")[-2].endswith("ignored 2]"), "bytes of a kind that come at once count once"
    assert sender("$RESUME")[0] == "ok"
    assert machine.axes == (10_000, 0, 0)


def test_hold_and_reset_are_obeyed_by_a_guarded_link(machine, sender):
    guard(sender)
    machine.library.gk_speed(10)
    sender("G00 X1", passes=20)
    machine.send(b"!")
    machine.run(10)
    held = machine.axes
    assert {"hold", "held"} <= machine.flags
    assert sender("$I", 500)[-1] == "ok"
    assert machine.axes == held
    assert sender("$RESUME")[-1] == "ok"
    assert not {"hold", "held"} & machine.flags
    machine.run(2000)
    assert machine.axes == (10_000, 0, 0)
    machine.send(b"\x18")
    assert machine.run(100)[-1].startswith("Grbl ")
    assert "held" not in machine.flags


def test_a_reset_ends_a_hold(machine):
    machine.library.gk_speed(10)
    machine.line("G00 X1", passes=20)
    machine.send(b"!")
    machine.run(10)
    assert "held" in machine.flags
    machine.send(b"\x18")
    machine.run(100)
    assert "held" not in machine.flags
    machine.unlock()
    machine.library.gk_speed(1000)
    before = machine.axes[0]
    machine.line("G91 G00 X1")
    assert machine.axes[0] == before + 10_000


def test_orders_are_heard_between_the_frames_of_a_tape(machine, sender):
    guard(sender)
    rows = punched(["M00", "G00 X1", *["(" + "a" * 50 + ")"] * 30, "M02"])
    machine.frame(0, 0)
    for sequence in range(1, 4):
        machine.frame(64, sequence, rows[(sequence - 1) * 64:sequence * 64])
    machine.run(100)
    assert events(machine.lines, "pause")
    assert sender("$I")[-1] == "ok"
    assert sender("$RESUME")[0] == "ok"
    machine.run(100)
    assert machine.axes[0] == 10_000
    machine.send(b"!")
    machine.run(10)
    assert "ok" in sender("$RETRACT")
    assert sender("G00 X1")[-1] == error_line("busy")


def test_an_order_goes_before_lines_that_wait(machine, sender):
    """The first line waits in M00, and the others fill the queue."""
    for number in range(40):
        machine.send(Controller.numbered(number, "G04 P1 (it waits)" if number else "M00"))
        machine.run(10)
    # Only the first answer shows how many have found room: one of these comes next.
    for number in range(1, 41):
        machine.send(Controller.numbered(number, "$RESUME"))
        machine.run(10)
    machine.run(4000)
    first, then, *_ = [line for line in machine.lines if line.startswith("ok @")]
    assert 5 < int(first.removeprefix("ok @")) < 40
    assert then == "ok @0"


def test_an_order_is_refused_of_a_locked_machine():
    machine = Controller()
    sender = Sender(machine)
    for order in ("$RESUME", "$RETRACT", "$resume"):
        assert sender(order) == [LOCKED, error_line("locked")]
    machine.send(b"!")
    machine.run(20)
    sender("$RESUME")
    assert "hold" in machine.flags, "not even the hold is released"
    assert sender("$X")[-1] == "ok"
    for order in ("$RESUME", "$RETRACT", "$resume"):
        assert sender(order) == ["ok"]
    assert "hold" not in machine.flags
    assert sender("$RESUM")[-1] == error_line("command")
    assert sender("$RESUMED")[-1] == error_line("command")


# ---- the flood

def test_lines_without_room_are_refused_and_answered_in_turn(machine):
    """After a missing line none is carried out until all have been answered."""
    machine.line("G91")
    machine.send(b"".join(b"G00 X.01\n" for _ in range(300)))
    lines = machine.run(8000)
    count = answers(lines).index(DAMAGED)
    assert 40 < count < 300
    assert answers(lines) == ["ok"] * count + [DAMAGED] * (300 - count)
    assert machine.axes[0] == 100 * count
    assert sum("came faster than they were answered" in line for line in lines) == 1
    assert machine.line("G00 X.01") == ["ok"]


def test_a_line_for_which_there_is_room_again_waits_for_what_was_refused(machine):
    machine.line("G91")
    machine.send(b"".join(b"G00 X.01\n" for _ in range(100)))
    machine.run(200)
    assert 0 < machine.axes[0] < 5000, "some have been taken"
    machine.send(b"G00 Y1\n")
    lines = machine.run(8000)
    assert answers(lines)[-1] == DAMAGED
    assert machine.axes[1] == 0
    assert machine.line("G00 Y1") == ["ok"]


def test_what_is_refused_for_want_of_room_may_be_sent_again(machine, sender):
    machine.send(b"".join(Controller.numbered(number, "G91 G00 X.01") for number in range(60)))
    lines = machine.run(3000)
    count = answers(lines).index(DAMAGED)
    assert 10 < count < 60
    assert answers(lines) == [f"ok @{number}" for number in range(count)] + [DAMAGED] * (
        60 - count)
    sender.number = count
    assert sender("G91 G00 X.01")[-1] == "ok"
    assert machine.axes[0] == 100 * (count + 1)


def test_a_number_that_found_no_room_is_not_told(machine):
    """A line that begins while the queue is full, and ends when it is not."""
    machine.send(b"G04 X1\n")
    machine.run(100)
    waiting = [b"G04 P1 (a)\n"] * 46
    assert 512 - len(b"".join(waiting)) == 6
    machine.send(b"".join(waiting) + b"@12345 G")
    machine.run(4000)
    machine.send(b"00*1234\n")
    assert named(machine.run(100)) == "its check is wrong"
    assert machine.lines[-1] == DAMAGED


def test_status_is_told_whatever_waits(machine):
    machine.send(b"G04 X2\n" + b"G04 P1\n" * 500 + b"?" * 2000)
    assert [line[0] for line in machine.run(100)] == ["<"]
    machine.send(b"!")
    machine.run(2)
    assert "held" in machine.flags
