# SPDX-License-Identifier: Apache-2.0
"""Homing and touching from the panel, without its page: the controller is a script of answers."""

import time

import pytest

from host.errors import UsageError
from host.link.link import HOLD, RESET
from host.panel.touching import Touching
from host.touch.cycles import Probe
from testbench.unit.host.test_panel import Script, jogs, serve, until

__all__ = ["serve"]     # a fixture

BUSY = "Touching is under way: Stop ends it."
PROBE = Probe(radius=0.5, offset=0.001, reach=3)


class Toucher(Script):
    """A controller that tells a place at each touch-off: the next of those given."""

    def __init__(self, *places, refuses=""):
        super().__init__(refuses)
        self.places = list(places)
        self.slow = False       # it takes its time over a line

    def write(self, data):
        before = len(self.lines)
        told, self.answers = self.answers, b""
        super().write(data)
        if any("G38.2" in line for line in self.lines[before:]) and self.places:
            told += b"[PRB:%s:1]\r\n" % self.places.pop(0).encode()
        self.answers = told + self.answers


def touched(wire):
    return [line for line in wire.lines if line.startswith("G") and not line.startswith("G92")]


def test_home_is_a_line(serve):
    wire = Script()
    session = serve(wire)
    session.take("a")
    assert session.order("a", "line", "$H") == ""
    until(lambda: "$H" in wire.lines, lambda: session.seen("a"))


def test_an_edge_is_touched_and_its_zero_set(serve):
    wire = Toucher("1.0,0,0", "1.0005,0,0")
    session = serve(wire)
    session.take("a")
    assert session.order("a", "touch", Touching("edge", PROBE, toward="X+", system=2)) == ""
    until(lambda: any(line.startswith("G10") for line in wire.lines),
          lambda: session.seen("a"))
    assert touched(wire) == [
        "G21 G91 G94 G38.2 X3.0000 F60", "G21 G91 G94 G01 X-0.4000 F300", "G04 P20",
        "G21 G91 G94 G01 X0.3400 F300", "G38.2 X0.1200 F2", "G21 G91 G94 G01 X-0.4000 F300",
        "G04 P20",
        # The axes rest at X 1, where the reports of this controller have them.
        "G21", "G10 L20 P2 X-0.5015"]
    assert any(text == "Edge found: X 1.5015 mm in the machine frame."
               for _, text in session.notices)


def test_a_zero_waits_for_rest_and_an_alarm_ends_it(serve):
    wire = Toucher("1.0,0,0", "1.0005,0,0")
    session = serve(wire)
    session.take("a")
    session.order("a", "touch", Touching("edge", PROBE, toward="X+", system=2))
    until(lambda: touched(wire), lambda: session.seen("a"))
    wire.state = "Run"      # the last motion of the cycle takes its time
    until(lambda: len(touched(wire)) == 7, lambda: session.seen("a"))
    time.sleep(0.5)
    assert len(touched(wire)) == 7
    assert session.order("a", "line", "G00 X1") == BUSY
    wire.state = "Alarm"
    until(lambda: "the zero is not set" in session.notice.lower(), lambda: session.seen("a"))
    assert session.order("a", "line", "$X") == ""


@pytest.mark.parametrize("order", [
    ("line", "G00 X5"), ("line", "$H"), ("jog", "X", 1, 60.0), ("run",),
    ("touch", Touching("hole", PROBE)), ("tune", None)])
def test_nothing_else_moves_the_machine_in_a_cycle(serve, order):
    wire = Toucher(*["1,0,0"] * 100)
    session = serve(wire)
    session.take("a")
    with session.lock:      # the thread has not begun the cycle yet
        assert session.order("a", "touch", Touching("hole", PROBE)) == ""
        assert session.order("a", *order) in (BUSY, "Something else is about to begin.")
    until(lambda: touched(wire), lambda: session.seen("a"))
    assert session.order("a", *order) == BUSY
    session.order("a", "stop")
    wire.state = "Hold:0"
    until(lambda: RESET in wire.bytes, lambda: session.seen("a"))
    assert session.order("a", *order) != BUSY


def test_a_finger_that_was_on_a_jog_button_in_a_cycle_moves_nothing_after_it(serve):
    wire = Toucher("1.0,0,0", "1.0005,0,0")
    session = serve(wire)
    session.take("a")
    session.order("a", "touch", Touching("edge", PROBE, toward="X+"))

    def pressed():
        session.seen("a")
        return session.order("a", "jog", "X", 1, 60.0)

    until(lambda: any("Edge found" in text for _, text in session.notices), pressed)
    end = time.monotonic() + 1
    until(lambda: time.monotonic() > end, pressed)
    assert pressed() == "Release the button, and press it again."
    assert not jogs(wire)
    session.order("a", "jog_end")
    assert pressed() == ""
    until(lambda: jogs(wire), pressed)


def test_a_hole_of_known_diameter_tells_the_offset(serve):
    places = [f"{x},{y},0" for x, y in ((2, 0), (2, 0), (-2, 0), (-2, 0), (0, 2), (0, 2),
                                        (0, -2), (0, -2))]
    wire = Toucher(*places)
    session = serve(wire)
    session.take("a")
    session.order("a", "touch", Touching("hole", PROBE, known=5.006))
    until(lambda: session.offset is not None, lambda: session.seen("a"))
    assert session.offset == pytest.approx(0.003)
    assert "diameter 5.0020 mm; contact offset 0.0030 mm" in session.notices[-1][1]


def test_a_refused_line_ends_it(serve):
    wire = Toucher(refuses="G21")
    session = serve(wire)
    session.take("a")
    session.order("a", "touch", Touching("edge", PROBE, toward="Z-", system=1))
    until(lambda: "refused" in session.notice, lambda: session.seen("a"))
    time.sleep(0.3)
    assert len(touched(wire)) == 1


@pytest.mark.parametrize("how", ["gone", "let_go", "stop"])
def test_it_ends_with_its_page_and_with_a_stop(serve, how):
    wire = Toucher(*["1,0,0"] * 100)
    session = serve(wire)
    session.take("a")
    session.order("a", "touch", Touching("hole", PROBE))
    until(lambda: touched(wire), lambda: session.seen("a"))
    if how == "stop":
        wire.state = "Hold:0"
        session.order("a", "stop")
        until(lambda: RESET in wire.bytes, lambda: session.seen("a"))
    else:
        getattr(session, how)("a")
        until(lambda: HOLD in wire.bytes)
    sent = len(touched(wire))
    time.sleep(0.3)
    assert len(touched(wire)) == sent
    assert not any(text.startswith("Hole found") for _, text in session.notices)


def test_it_starts_from_idle_only(serve):
    wire = Toucher()
    session = serve(wire)
    session.take("a")
    wire.state = "Run"
    until(lambda: session.heard.state == "Run")
    assert "from Idle" in session.order("a", "touch", Touching("hole", PROBE))
    assert not touched(wire)


@pytest.mark.parametrize(("words", "said"), [
    ({"shape": "edge", "known": 5.0}, "calibrated by a hole or a boss"),
    ({"shape": "hole", "known": -3.0}, "the true diameter must be above 0"),
    ({"shape": "boss"}, "a boss needs a size"),
    ({"shape": "corner", "toward": "X+"}, "a corner needs"),
])
def test_what_is_missing_is_said_before_anything_moves(words, said):
    with pytest.raises(UsageError, match=said):
        Touching(words.pop("shape"), PROBE, **words)
