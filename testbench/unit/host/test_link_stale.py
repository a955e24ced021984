# SPDX-License-Identifier: Apache-2.0
"""Lines that an alarm or a reset overtakes: none of them starts a motion afterwards."""

import pytest

from host.link.framing import numbered
from host.link.link import (
    ALARMED,
    DAMAGED,
    GREETS_S,
    LINE_TIMEOUT_S,
    RESET,
    RESUME,
    Link,
    LinkError,
)

GREETING = b"Grbl 1.1h ['$' for help]\r\n"


class Script:
    """A pipe whose other end says what the test lets it say; its clock is the test's."""

    def __init__(self):
        self.now = 0.0
        self.says, self.sent = b"", b""

    def write(self, data):
        self.sent += data

    def read(self, timeout_s):
        said, self.says = self.says, b""
        return said

    def time_s(self):
        return self.now


@pytest.fixture
def pipe():
    return Script()


@pytest.fixture
def link(pipe):
    return Link(pipe, lambda line: None)


def hear(link, text, later_s=0.0):
    """What the link sends when the controller says this, so much later."""
    link.pipe.now += later_s
    link.pipe.says, link.pipe.sent = text, b""
    link.poll(0)
    return link.pipe.sent


def late(link):
    return hear(link, b"", 1.1 * LINE_TIMEOUT_S)


def test_after_an_alarm_a_line_is_not_sent_again(link):
    """A cable that was pulled: unlocking and a jog were ordered, then the emergency stop came."""
    lines = [link.send_line(line) for line in ("$X", "$J=G91 X1 F600")]
    assert late(link) == b"\n" + numbered(0, "$X") + numbered(1, "$J=G91 X1 F600")
    hear(link, b"ALARM:140\r\n")
    assert late(link) == b"\n" + numbered(0, "") + numbered(1, "")
    hear(link, b"ok @0\r\nok @1\r\n")
    assert [line.answer for line in lines] == [ALARMED] * 2
    assert link.send_line("$X").number == 2
    assert late(link) == b"\n" + numbered(2, "$X"), "what comes after the alarm is another order"


def test_a_line_that_the_controller_had_is_no_bad_link(link):
    """It refuses the empty line: the number is that of a line with another text."""
    line = link.send_line("G91 G01 X1 F60")
    hear(link, b"ALARM:140\r\n")
    late(link)
    for _ in range(DAMAGED):
        assert line.answer is None
        assert hear(link, b"error:108 @0\r\n") in (b"\n" + numbered(0, ""), b"")
    assert line.answer == ALARMED
    assert link.send_line("$X").number == 1


def test_an_answer_that_was_under_way_counts(link):
    line = link.send_line("$X")
    hear(link, b"ALARM:140\r\nok @0\r\n")
    assert line.answer == "ok"


def test_a_bad_link_is_told_without_an_alarm(link):
    link.send_line("$X")
    for _ in range(DAMAGED - 1):
        hear(link, b"error:108 @0\r\n")
    with pytest.raises(LinkError, match="arrived damaged"):
        hear(link, b"error:108 @0\r\n")


def test_what_follows_a_reset_keeps_its_number_when_the_greeting_comes(link):
    """The controller may take it before it greets."""
    before = link.send_line("G90")
    link.realtime(RESET)
    assert before.answer == "the controller has started anew"
    link.press(RESUME)
    assert link.pipe.sent.endswith(numbered(0, RESUME))
    hear(link, b"ok @0\r\n" + GREETING)
    assert link.send_line("$X").number == 1


def test_a_controller_that_starts_by_itself_has_forgotten_all_lines(link):
    link.realtime(RESET)
    hear(link, GREETING)
    line = link.send_line("G90")
    hear(link, GREETING, 1.1 * GREETS_S)
    assert line.answer == "the controller has started anew"
    assert link.send_line("$X").number == 0


@pytest.mark.parametrize("rest", [b"", b"\xff", b"[E:block,1234,5,", b"<Run|MPos:0.0000,", b"o",
                                  b"[MSG:a sentence\xf8\x00", b"~1,2"])
def test_power_that_goes_and_comes_within_a_line_is_a_new_start(rest, pipe):
    """What was on the wire stays in front of the greeting, and noise with it."""
    heard = []
    link = Link(pipe, heard.append)
    line = link.send_line("$X")
    hear(link, rest)
    hear(link, GREETING)
    assert heard == [GREETING.decode().strip()]
    assert line.answer == "the controller has started anew"
    assert late(link) == b"", "it is not sent again"


def test_a_line_that_quotes_the_greeting_is_none(pipe):
    heard = []
    link = Link(pipe, heard.append)
    line = link.send_line("$X")
    hear(link, b"[MSG:Grbl 1.1h ['$' for help] is quoted.]\r\n")
    assert line.answer is None
    assert len(heard) == 1
