# SPDX-License-Identifier: Apache-2.0
"""Lines that a page has entered by hand, when it lets go of the controls or an alarm ends them."""

import time

import pytest

from host.link.link import HOLD
from host.panel.session import CANCEL
from softcore.tables.faults import named
from testbench.unit.host.test_panel import Script, jogs, serve, until

__all__ = ["serve"]     # a fixture

LEAVES = pytest.mark.parametrize("leaves", ["gone", "let_go"])
REPORTS_S = 0.5     # some status reports


class Slow(Script):
    """A controller that answers no line that begins with ``waits``, and tells alarms late."""

    def __init__(self, waits="", alarm=""):
        super().__init__("G38.2" if alarm else "")
        self.waits, self.alarm, self.due = waits, alarm, None

    def say(self, line):
        if line.startswith("ok ") and self.waits and self.lines[-1].startswith(self.waits):
            return
        if line.startswith("[MSG:") and self.alarm:
            line = "[MSG:stopped by an alarm or a reset.]"
        if line.startswith("error:") and self.alarm:
            line = line.replace("error:20", f"error:{named('locked').error}")
            self.due = time.monotonic() + 0.1
        super().say(line)

    def read(self, timeout_s):
        if self.due is not None and time.monotonic() > self.due:
            self.due, self.state = None, "Alarm"
            if self.alarm != "none":
                self.say(f"[E:alarm,1,0,0,0,0,{self.alarm}]")
                self.say(f"ALARM:{self.alarm.partition(',')[0]}")
        return super().read(timeout_s)


def begun(serve, wire, *lines, sent=1):
    """A session whose page has entered lines, of which so many are sent."""
    session = serve(wire)
    session.take("a")
    before = len(wire.lines)
    for line in lines:
        assert session.order("a", "line", line) == ""

    def own():
        return [line for line in wire.lines[before:] if line != "$G"]

    until(lambda: len(own()) == sent, lambda: session.seen("a"))
    return session


def told(session, text):
    return [notice for _, notice in session.notices if text in notice]


@LEAVES
def test_lines_that_wait_are_dropped_with_their_page_and_this_is_told(serve, leaves):
    wire = Slow(waits="G04")
    session = begun(serve, wire, "G04 P4000", "$J=G91 X20 F300", "G00 X20")
    getattr(session, leaves)("a")
    until(lambda: told(session, "Not sent"))
    wire.waits = ""
    wire.say(f"ok @{len(wire.lines) - 1}")
    time.sleep(REPORTS_S)
    assert not jogs(wire)
    assert "G00 X20" not in wire.lines
    assert told(session, "Not sent") == ["Not sent, as the page has let go of the controls: "
                                         "$J=G91 X20 F300; G00 X20"]


def test_lines_that_wait_are_dropped_when_an_alarm_comes_and_this_is_told(serve):
    """Else an unlock among them would let the others move the machine."""
    wire = Slow(waits="G04")
    session = begun(serve, wire, "G04 P4000", "$X", "G00 X20")
    sent = len(wire.lines)
    wire.say("ALARM:140")
    until(lambda: told(session, "Not sent"), lambda: session.seen("a"))
    assert told(session, "Not sent") == ["Not sent, as an alarm came: $X; G00 X20"]
    wire.waits = ""
    wire.say(f"ok @{session._sent.number}")
    assert session.order("a", "line", "G04 P1") == ""
    until(lambda: "G04 P1" in wire.lines, lambda: session.seen("a"))
    assert not {"$X", "G00 X20"}.intersection(wire.lines[sent:])


def test_a_page_that_takes_over_drops_them_too_and_its_own_are_sent(serve):
    wire = Slow(waits="G04")
    session = begun(serve, wire, "G04 P4000", "G00 X20")
    with session.lock:
        session.let_go("a")
        session.take("b")
        session.order("b", "line", "G00 X3")
    until(lambda: told(session, "Not sent"))
    wire.waits = ""
    wire.say(f"ok @{session._sent.number}")
    until(lambda: "G00 X3" in wire.lines, lambda: session.seen("b"))
    assert "G00 X20" not in wire.lines


@pytest.mark.parametrize(("line", "answer", "tells"), [
    ("M08", "ok", "M08: ok"), ("$WALK=9", "error:20", "$WALK=9 is refused")])
def test_a_line_is_on_its_way_until_a_report_tells_what_it_did(serve, line, answer, tells):
    """However long the answer takes: on a slow computer half a second was too short."""
    wire = Slow(waits=line)
    session = begun(serve, wire, line.lower())
    end = time.monotonic() + REPORTS_S
    while time.monotonic() < end:
        session.seen("a")
        assert session.pending(line)
        time.sleep(0.01)
    wire.waits = ""
    wire.say(f"{answer} @{session._sent.number}")
    until(lambda: told(session, tells), lambda: session.seen("a"))
    until(lambda: not session.pending(line), lambda: session.seen("a"))


@LEAVES
@pytest.mark.parametrize(("line", "state", "answered"), [
    ("$H", "Home", False), ("G01 X50 F60", "Run", True), ("g04 p4000", "Run", False)])
def test_what_a_page_moves_by_hand_is_held_with_it(serve, leaves, line, state, answered):
    wire = Slow(waits="" if answered else line.upper())
    session = begun(serve, wire, line)
    wire.state = state
    time.sleep(REPORTS_S)
    session.seen("a")
    assert HOLD not in wire.bytes
    getattr(session, leaves)("a")
    until(lambda: HOLD in wire.bytes)
    assert told(session, "The machine is held: the page that moved it has let go")
    wire.state = "Hold:0"
    time.sleep(REPORTS_S)
    assert wire.bytes.count(HOLD) == 1


@LEAVES
def test_a_line_that_has_just_been_taken_counts_as_motion(serve, leaves):
    wire = Script()
    session = begun(serve, wire, "G01 X50 F60")
    getattr(session, leaves)("a")
    until(lambda: HOLD in wire.bytes)


@LEAVES
@pytest.mark.parametrize("line", ["G01 X1 F600", "$408=12"])
def test_a_machine_at_rest_is_not_held(serve, leaves, line):
    wire = Script()
    session = begun(serve, wire, line)
    end = time.monotonic() + REPORTS_S
    until(lambda: time.monotonic() > end, lambda: session.seen("a"))
    getattr(session, leaves)("a")
    time.sleep(REPORTS_S)
    assert HOLD not in wire.bytes
    assert CANCEL not in wire.bytes


def test_a_tape_goes_on_without_its_page(serve):
    wire = Script()
    session = begun(serve, wire, "M08")
    wire.state = "Run"
    session.running = True
    session.let_go("a")
    time.sleep(REPORTS_S)
    assert HOLD not in wire.bytes


def test_who_resumes_it_has_it(serve):
    wire = Slow(waits="$H")
    session = begun(serve, wire, "$H")
    wire.state = "Home"
    session.let_go("a")
    until(lambda: HOLD in wire.bytes)
    wire.state = "Hold:0"
    session.take("b")
    session.order("b", "resume")
    until(lambda: "$RESUME" in wire.lines, lambda: session.seen("b"))
    wire.state = "Home"
    session.let_go("b")
    until(lambda: wire.bytes.count(HOLD) == 2)


@pytest.mark.parametrize(("alarm", "says"), [
    ("5,no contact was found.", "G38.2 Z-1 F60 was ended by alarm 5: no contact was found."),
    ("none", "G38.2 Z-1 F60 is refused: stopped by an alarm or a reset.")])
def test_an_alarm_that_ends_a_line_is_named(serve, alarm, says):
    wire = Slow(alarm=alarm)
    session = begun(serve, wire, "G38.2 Z-1 F60")
    until(lambda: told(session, "G38.2"), lambda: session.seen("a"))
    assert told(session, "G38.2") == [says]
