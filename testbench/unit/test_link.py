# SPDX-License-Identifier: Apache-2.0
"""The host's end of the link, against a model of the controller and over a bad cable."""

import pytest

from host.errors import UsageError
from host.link import (
    LONGEST_LINE,
    PAYLOAD,
    RETRACT,
    Link,
    LinkError,
    RefusedError,
    check_line,
    crc,
    frame,
    frames,
)
from testbench.models.controller import GREETING, Controller, Pipe, crc16


def never():
    return False


def talk(controller, **options):
    heard = []
    return Link(Pipe(controller, **options), heard.append), heard


def test_crc_is_ccitt_false(rng):
    assert crc(b"123456789") == 0x29B1
    for length in (0, 1, 2, 66):
        data = rng.randbytes(length)
        assert crc(data) == crc16(data)


def test_frame_is_length_sequence_payload_and_crc():
    assert frame(3, 7, b"abc") == b"\x02\x03\x07abc" + crc16(b"\x03\x07abc").to_bytes(2)


@pytest.mark.parametrize("length", [0, 1, PAYLOAD - 1, PAYLOAD, PAYLOAD + 1, 300 * PAYLOAD + 5])
def test_frames_cover_the_tape_in_sequence(rng, length):
    rows = rng.randbytes(length)
    cut = list(frames(rows))
    assert cut[0] == (255, frame(0, 255))
    assert cut[-1][1][1] == 0xFF
    assert [number for number, _ in cut[1:]] == [n % 256 for n in range(len(cut) - 1)]
    assert b"".join(data[3:-2] for _, data in cut[1:-1]) == rows


@pytest.mark.parametrize("line", ["G36 R300", "$8=19", '(SAYS "A")', "Y" * LONGEST_LINE])
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
    link, _ = talk(Controller())
    link.await_greeting()
    silent = Controller()
    silent.out.clear()
    link, _ = talk(silent)
    with pytest.raises(LinkError, match="no greeting"):
        link.await_greeting()


def test_lines_are_answered_and_the_rest_is_heard():
    def script(controller, line):
        controller.say("[MSG:Speed is too high]" if "R0" in line else "[MSG:Fine]")
        return "error:22" if "R0" in line else "ok"

    controller = Controller(script=script)
    link, heard = talk(controller)
    link.command("G36 R300")
    assert controller.lines == ["G36 R300"]
    assert heard == [GREETING, "[MSG:Fine]"]
    with pytest.raises(RefusedError, match=r'^the controller refuses "G36 R0": Speed is too high$'):
        link.command("G36 R0")


def test_no_answer_is_an_error():
    controller = Controller()
    link, _ = talk(controller, noise=lambda direction, data: b"" if direction == "out" else data)
    with pytest.raises(LinkError, match=r"^the controller has fallen silent\.$"):
        link.command("G90")


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
        if direction == "out" and len(data) > 6 and rng.random() < share:
            place = rng.randrange(2, len(data))  # a flip of the head is a frame that never was
            return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1:]
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
    assert heard == [GREETING] + [f"[E:block,{n % 256}]" for n in [255, *range(257)]]


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
    link, _ = talk(controller, per_ms=0, noise=lambda *_: b"")
    with pytest.raises(LinkError, match="fallen silent"):
        link.send_tape(rng.randbytes(1000), never)


def test_a_line_that_only_damages_is_given_up(rng):
    def noise(direction, data):
        return data[:-1] + bytes([data[-1] ^ 1]) if direction == "out" else data

    link, _ = talk(Controller(), noise=noise)
    with pytest.raises(LinkError, match="damaged 10 times"):
        link.send_tape(b"abc", never)


def test_status_report_is_taken_apart():
    link, _ = talk(Controller())
    assert link.status() == {"state": "Idle", "MPos": "0.000,0.000,0.000",
                             "WCO": "0.0000,0.0000,0.0000"}


def test_realtime_bytes_are_sent_alone():
    controller = Controller()
    link, _ = talk(controller)
    link.realtime(RETRACT)
    assert controller.realtime == [0x92]
