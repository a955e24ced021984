# SPDX-License-Identifier: Apache-2.0
"""The host's end of the link, against a model of the controller and over a bad cable."""

import pytest

from host.errors import ALARM, UsageError
from host.link.framing import (
    LONGEST_LINE,
    PAYLOAD,
    check_line,
    crc,
    frame,
    frames,
    numbered,
    stuffed,
)
from host.link.link import (
    HOLD,
    NUMBERS,
    RESET,
    RESUME,
    RETRACT,
    HeldError,
    Link,
    LinkError,
    RefusedError,
)
from softcore.linkmap import REALTIME, STUFFED
from softcore.tables.faults import error_line
from softcore.tables.settings import assign
from testbench.models.controller import Controller, Pipe, crc16, unstuffed


def never():
    return False


def talk(controller, **options):
    """A link that has got its greeting, and the lines that come from then on."""
    heard = []
    link = Link(Pipe(controller, **options), heard.append)
    if controller.out:
        link.await_greeting()
    return link, heard


def test_crc_is_ccitt_false(rng):
    assert crc(b"123456789") == 0x29B1
    for length in (0, 1, 2, 66):
        data = rng.randbytes(length)
        assert crc(data) == crc16(data)


def test_frame_is_length_sequence_payload_and_crc():
    assert frame(3, 7, b"abc") == (
        b"\x02\x10\x43\x07abc" + stuffed(crc16(b"\x03\x07abc").to_bytes(2)) + b"\x03")
    assert frame(2, 2, b"!\xb1") == b"\x02\x10\x42\x10\x42\x10\x61\x10\xf1" + stuffed(
        crc16(b"\x02\x02!\xb1").to_bytes(2)) + b"\x03"


def test_stuffed_bytes_are_never_what_means_something_by_itself():
    """All bytes come through, and no byte is sent that begins a frame or acts at once."""
    data = bytes(range(256))
    sent = stuffed(data)
    assert unstuffed(sent) == data
    assert not set(sent) & (STUFFED - {0x10})
    assert {realtime.byte for realtime in REALTIME} < STUFFED
    assert len(sent) == 256 + 7 + 64


def test_numbered_line():
    assert numbered(17, "G00 X1") == b"@17 G00 X1*%04X\n" % crc16(b"@17 G00 X1")


@pytest.mark.parametrize("length", [0, 1, PAYLOAD - 1, PAYLOAD, PAYLOAD + 1, 300 * PAYLOAD + 5])
def test_frames_cover_the_tape_in_sequence(rng, length):
    rows = rng.randbytes(length)
    cut = list(frames(rows))
    assert cut[0] == (255, frame(0, 255))
    assert cut[-1][1][1] == 0xFF
    assert [number for number, _ in cut[1:]] == [n % 256 for n in range(len(cut) - 1)]
    assert b"".join(unstuffed(data[1:-1])[2:-2] for _, data in cut[1:-1]) == rows


@pytest.mark.parametrize("line", ["G36 R300", assign("repeats", 19), '(SAYS "A")',
                                  "Y" * LONGEST_LINE])
def test_a_line_that_can_be_entered_by_hand(line):
    check_line(line)


@pytest.mark.parametrize(("line", "message"), [
    ("",            "an empty line cannot be entered by hand."),
    ("  ",          "an empty line cannot be entered by hand."),
    ("?",           'the line "?" cannot be entered by hand: "?" is no character'),
    ("G00 X1!",     'the line "G00 X1!" cannot be entered by hand: "!" is no character'),
    ("~",           'the line "~" cannot be entered by hand: "~" is no character'),
    ("\x18",        r'the line "\u0018" cannot be entered by hand: "\u0018" is no character'),
    ("G90\nG00 X1", r'the line "G90\nG00 X1" cannot be entered by hand: "\n" is no character'),
    ("GÄ",          'the line "GÄ" cannot be entered by hand: "Ä" is no character'),
    ("Y" * 256,     'the line "YYYYYYYYYYYYYYYYYYYY…" cannot be entered by hand: it has 256 '
                    "characters, and the controller takes 255."),
])
def test_what_is_no_line_is_refused(line, message):
    with pytest.raises(UsageError) as caught:
        check_line(line)
    assert str(caught.value).removesuffix(" of a block.") == message


def test_greeting_is_awaited():
    link = Link(Pipe(Controller()), [].append)
    link.await_greeting()
    silent = Controller()
    silent.out.clear()
    link, _ = talk(silent)
    with pytest.raises(LinkError, match="no greeting"):
        link.await_greeting()


@pytest.mark.parametrize(("answer", "said"), [(error_line("locked"), r"The machine is locked\."),
                                              ("error:999", "error:999")])
def test_a_refusal_without_its_sentence_is_told_by_its_number(answer, said):
    link, _ = talk(Controller(script=lambda controller, line: answer))
    with pytest.raises(RefusedError, match=f'^the controller refuses "G00 X1": {said}$'):
        link.command("G00 X1")


def test_lines_are_answered_and_the_rest_is_heard():
    def script(controller, line):
        controller.say("[MSG:Speed is too high]" if "R0" in line else "[MSG:Fine]")
        return error_line("feed") if "R0" in line else "ok"

    controller = Controller(script=script)
    link, heard = talk(controller)
    link.command("G36 R300")
    assert controller.lines == ["G36 R300"]
    assert heard == ["[MSG:Fine]"]
    with pytest.raises(RefusedError, match=r'^the controller refuses "G36 R0": Speed is too high$'):
        link.command("G36 R0")
    link.command("G36 R200")
    assert controller.number == 3


def test_what_is_no_line_is_not_sent():
    """Not even with a replacement: a `?` in place of a letter would ask for a status."""
    controller = Controller()
    link, _ = talk(controller)
    for line in ("GÄ", "G00 X1?", "X1\nX2", ""):
        with pytest.raises(UsageError):
            link.command(line)
    assert not controller.lines
    assert not controller.realtime


def test_no_answer_is_an_error():
    controller = Controller()
    link, _ = talk(controller, noise=lambda direction, data: (
        b"" if direction == "out" and controller.number == 0 else data))
    with pytest.raises(LinkError, match=r"^the controller has fallen silent\.$"):
        link.command("G90")


def test_a_line_may_take_as_long_as_the_machine_is_at_it():
    """The line is sent again meanwhile, without effect."""
    def script(controller, line):
        controller.due = link.pipe.now + 7
        return ""

    class Busy(Controller):
        def _realtime(self, byte):
            super()._realtime(byte)
            self.out = type(self.out)(bytes(self.out).replace(b"Idle", b"Run"))

        def drain(self, count):
            if self.answer == "" and link.pipe.now > self.due:
                self.answer = "ok @0"
                self.say("ok @0")

    controller = Busy(script=script)
    link, _ = talk(controller)
    link.command("G04 X7")
    assert controller.lines == ["G04 X7"]
    assert link.pipe.now > 7


@pytest.mark.parametrize("share", [0.0, 0.002, 0.01])
def test_no_line_is_lost_or_carried_out_twice_over_a_bad_cable(rng, share):
    """Bytes flip, get lost and come twice on their way, and answers get lost."""
    def noise(direction, data):
        if direction == "in":
            lost = rng.random() < 10 * share and not data.startswith(b"Grbl")
            return b"" if lost else data
        sent = bytearray()
        for byte in data:
            kind = rng.random() / share if share else 9
            sent += (b"" if kind < 0.3 else bytes([byte, byte]) if kind < 0.6
                     else bytes([byte ^ 1 << rng.randrange(8)]) if kind < 1 else bytes([byte]))
        return bytes(byte for byte in sent if byte != 0x18)

    controller = Controller()
    link, _ = talk(controller, noise=noise)
    lines = [f"G01 X{count}" for count in range(500)]
    for line in lines:
        link.command(line)
    assert controller.lines == lines


def test_a_line_whose_end_is_lost_is_taken_when_it_comes_again():
    """The repetition begins with a line end, which ends the damaged line."""
    written = []

    def noise(direction, data):
        if direction == "out":
            written.append(data)
            return data[:-1] if len(written) == 1 else data
        return data

    controller = Controller()
    link, _ = talk(controller, noise=noise)
    link.command("G90")
    assert controller.lines == ["G90"]
    assert len(written) == 2


def test_numbers_go_round_and_begin_anew_with_the_controller():
    controller = Controller()
    link, _ = talk(controller)
    link._number = controller.number = NUMBERS - 1
    controller.answer = "ok"
    link.command("G90")
    link.command("G91")
    assert controller.number == 1
    link.press(RESET)
    link.await_greeting()
    link.command("G92 X0")
    assert controller.number == 1


def test_a_controller_that_starts_anew_answers_nothing():
    def script(controller, line):
        controller._realtime(0x18)
        return ""

    link, _ = talk(Controller(script=script))
    with pytest.raises(LinkError, match="the controller has started anew"):
        link.command("G04 X1")


def test_no_line_from_before_a_reset_is_sent_after_it():
    """It would have the number of the first line that the controller takes after its start."""
    sent = bytearray()

    def no_answer(direction, data):
        if direction == "out":
            sent.extend(data)
        return b"" if direction == "in" and sent else data

    link, _ = talk(Controller(), noise=no_answer)
    line = link.send_line("G00 X1")
    while link.pipe.now < 0.25:
        link.poll(0.01)
    link.press(RESET)
    while link.pipe.now < 2:
        link.poll(0.01)
    assert sent == numbered(0, "G00 X1") + RESET
    assert line.answer == "the controller has started anew"


def test_several_answers_that_are_lost_come_again():
    """The cable was pulled while lines were under way, one of which is refused."""
    controller = Controller(script=lambda _, line: "error:20" if line == "G77" else None)
    link, _ = talk(controller, noise=lambda direction, data: (
        b"" if direction == "in" and controller.number and link.pipe.now < 1 else data))
    lines = [link.send_line(text) for text in ("G91 G00 X1", "G77", "G00 X2")]
    while link.pipe.now < 2:
        link.poll(0.01)
    assert [line.answer for line in lines] == ["ok", "error:20", "ok"]
    assert controller.lines == ["G91 G00 X1", "G77", "G00 X2"]


def test_an_order_is_looked_after_while_something_else_is_waited_for():
    """A line that is sent from within ``on_line``: damaged at first, and then heard."""
    lost = []

    def noise(direction, data):
        if direction == "out" and b"$RESUME" in data and len(lost) < 3:
            lost.append(data)
            return data.replace(b"R", b"T")
        return data

    def script(controller, line):
        if line == "M00":
            controller.say("[E:pause,4,3,0,0,0]")
            return ""
        controller.say("ok @0")
        return "ok"

    controller = Controller(script=script)
    link, _ = talk(controller, noise=noise)
    link.on_line = lambda line: link.press(RESUME) if line.startswith("[E:pause") else None
    link.command("M00")
    assert controller.lines == ["M00", "$RESUME"]
    assert len(lost) == 3


@pytest.mark.parametrize(("within_s", "answered"), [(2.0, False), (60.0, True)])
def test_an_answer_at_rest_is_awaited_for_as_long_as_the_caller_says(within_s, answered):
    """The controller reads firmware back for seconds, and its state stays Idle."""
    controller = Controller(script=lambda _, line: "")

    def late(direction, data):
        if controller.lines and link.pipe.now > 9 and not controller.out:
            controller.say("ok @0")
        return data

    link, _ = talk(controller, noise=late)
    if answered:
        link.command("$FIRMWARE=E", within_s=within_s)
        assert 9 < link.pipe.now < 12
    else:
        with pytest.raises(LinkError, match="does not answer"):
            link.command("$FIRMWARE=E", within_s=within_s)


@pytest.mark.parametrize(("every_s", "answered"), [(1.5, True), (2.5, False)])
def test_lines_that_come_are_no_silence(every_s, answered):
    """A long list over a slow line takes longer than an answer may."""
    controller = Controller(script=lambda _, line: "")
    said = []

    def listing(direction, data):
        if controller.lines and link.pipe.now > every_s * (len(said) + 1):
            said.append("ok @0" if len(said) == 4 else "[MSG:a line.]")
            controller.say(said[-1])
        return data

    link, _ = talk(controller, noise=listing)
    if answered:
        link.command("$BL")
        assert 5 * every_s < link.pipe.now < 6 * every_s
    else:
        with pytest.raises(LinkError, match="does not answer"):
            link.command("$BL")


def test_an_order_that_nobody_hears_is_an_error():
    controller = Controller()
    link, _ = talk(controller, noise=lambda direction, data: (
        b"" if direction == "out" and controller.number else data))
    link.command("G90")
    link.press(RETRACT)

    def wait():
        while link.pipe.now < 5:
            link.poll(1)

    with pytest.raises(LinkError, match=r'^the controller does not answer to "\$RETRACT"\.$'):
        wait()


@pytest.mark.parametrize("length", [0, 1, 64, 65, 20_000])
def test_tape_arrives_whole_through_a_small_buffer(rng, length):
    controller = Controller(room=100)
    link, _ = talk(controller)
    rows = rng.randbytes(length)
    assert link.send_tape(rows, never)
    assert controller.finished
    assert controller.tape == rows


@pytest.mark.parametrize("share", [0.02, 0.1])
def test_no_byte_is_lost_or_doubled_over_a_bad_cable(rng, share):
    """Bytes flip, and answers get lost, so that frames the machine has taken are sent again."""
    def noise(direction, data):
        if direction == "in" and len(data) == 2 and rng.random() < share:
            return b""
        if direction == "out" and rng.random() < share:
            place = rng.randrange(2, len(data))  # a flip of the head is a frame that never was
            bent = data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1:]
            return bent.replace(b"\x18", b"")
        return data

    controller = Controller()
    link, _ = talk(controller, noise=noise)
    rows = rng.randbytes(10_000)
    assert link.send_tape(rows, never)
    assert controller.tape == rows


def test_a_late_answer_is_not_taken_for_the_next(rng):
    """Answers take 150 ms, so each frame is sent twice and answered twice; one frame gets lost."""
    under_way, lost = [], []

    def noise(direction, data):
        if direction == "in":
            under_way.append(data)
            return under_way.pop(0) if len(under_way) > 150 else b""
        if data[:3] == b"\x02\x40\x01" and not lost:
            lost.append(data)
            return b""
        return data

    controller = Controller()
    link, _ = talk(controller, noise=noise)
    rows = rng.randbytes(5 * PAYLOAD)
    assert link.send_tape(rows, lambda: link.pipe.now > 10)
    assert controller.tape == rows


def test_answers_are_told_from_lines(rng):
    """Sequence numbers take every value, line feed and question mark among them."""
    controller = Controller()
    link, heard = talk(controller)
    inner = controller._accept

    def chatty(length, sequence, payload):
        inner(length, sequence, payload)
        controller.say(f"[E:block,{sequence}]")

    controller._accept = chatty
    assert link.send_tape(rng.randbytes(256 * PAYLOAD), never)
    assert heard == [f"[E:block,{n % 256}]" for n in [255, *range(257)]]


def test_sending_stops_when_asked(rng):
    controller = Controller(room=PAYLOAD)
    link, _ = talk(controller, per_ms=0)
    rows = rng.randbytes(1000)
    assert not link.send_tape(rows, lambda: link.pipe.now > 0.5)
    assert controller.tape == rows[:PAYLOAD]


def test_full_buffer_is_waited_for_but_silence_is_not(rng):
    controller = Controller(room=PAYLOAD)
    link, _ = talk(controller, per_ms=0)
    assert not link.send_tape(rng.randbytes(1000), lambda: link.pipe.now > 60)
    assert controller.realtime.count(ord("?")) >= 20, "the machine is asked whether it lives"
    link = Link(Pipe(controller, per_ms=0, noise=lambda *_: b""), [].append)
    with pytest.raises(LinkError, match="fallen silent"):
        link.send_tape(rng.randbytes(1000), never)


def test_a_line_that_only_damages_is_given_up(rng):
    def noise(direction, data):
        at = len(data) - 4
        return data if direction == "in" else data[:at] + bytes([data[at] ^ 1]) + data[at + 1:]

    link, _ = talk(Controller(), noise=noise)
    with pytest.raises(LinkError, match="a frame of the tape arrived damaged 10 times"):
        link.send_tape(b"abc", never)
    link, _ = talk(Controller(), noise=noise)
    with pytest.raises(LinkError, match='"G90" arrived damaged 10 times'):
        link.command("G90")


def test_status_report_is_taken_apart():
    link, _ = talk(Controller())
    assert link.status() == {"state": "Idle", "MPos": "0.000,0.000,0.000",
                             "WCO": "0.0000,0.0000,0.0000"}


def test_realtime_bytes_are_sent_alone():
    controller = Controller()
    link, _ = talk(controller)
    link.press(HOLD)
    assert controller.realtime == [0x21]


@pytest.mark.parametrize("cut", [b"", b"ok @", b"[E:block,135", b"[B5:Zd9", b"<Idle|MPos:0",
                                 b"\x06"])
@pytest.mark.parametrize("waiting", ["command", "status", "await_greeting", "send_tape"])
def test_a_held_processor_is_told_by_all_that_waits_for_it(waiting, cut):
    """It ends the run at once, within any line, with the exit status of an alarm."""
    calls = {"command": ("G90",), "send_tape": (b"rows", never)}
    controller = Controller()
    link, heard = talk(controller)
    controller.hold(0x12340, cut)
    with pytest.raises(HeldError) as caught:
        getattr(link, waiting)(*calls.get(waiting, ()))
    assert str(caught.value) == ("memory parity at 0x00012340: the processor is held until the "
                                 "controller is switched off and on.")
    assert caught.value.status == ALARM
    assert link.pipe.now < 0.1
    assert not [line for line in heard if line.startswith("[")]


def test_a_controller_that_was_held_is_heard_again_when_it_has_started():
    controller = Controller()
    link, _ = talk(controller)
    controller.hold(0)
    with pytest.raises(HeldError):
        link.status()
    controller.held = False
    controller.feed(b"\x18")
    link.poll(0.1)
    link.command("G90")
    assert controller.lines == ["G90"]
