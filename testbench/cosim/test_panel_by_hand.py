# SPDX-License-Identifier: Apache-2.0
"""Homing, lines by hand and touching from the panel, without its page, on a simulated machine."""

import time

import pytest

from host.machines import machine as machines
from host.panel.session import Session
from host.panel.touching import Touching
from host.panel.wires import Bench
from host.touch.cycles import Probe

SINKER = machines.load("sinker")
PROBE = Probe(reach=1.5, back=0.3, near=0.04, clear=0.4, offset=0.002)
DEADLINE_S = 240.0
STANDS_MM = 2e-3    # by the coders, between two looks
ZERO_MM = 2.01e-4   # two pulses of the reports, and the line's rounding


@pytest.fixture
def session():
    begun = Session(SINKER, lambda say: Bench(SINKER, clock_hz=SINKER.clock_hz, seed=1, say=say))
    begun.start()
    until(lambda: begun.heard.state == "Idle")
    assert begun.take("a")
    yield begun
    begun.close()


def until(condition, seen=lambda: None):
    end = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end, "it has not happened in time"
        seen()
        time.sleep(0.02)


def place(session):
    return session.heard.numbers("MPos")


def stands(session):
    """It is held, and stays where it is for some reports."""
    until(lambda: session.heard.state == "Hold:0")
    at, reports = place(session), len(session.heard.samples)
    until(lambda: len(session.heard.samples) > reports + 5)
    assert session.heard.state == "Hold:0"
    assert place(session) == pytest.approx(at, abs=STANDS_MM)
    return at


def test_homing_is_held_with_its_page_and_resumed_or_ended_by_the_next(session):
    session.order("a", "line", "$H")
    until(lambda: session.heard.state == "Home", lambda: session.seen("a"))
    session.gone("a")
    at = stands(session)
    assert session.take("b")
    session.order("b", "resume")
    until(lambda: session.heard.state == "Home" and abs(place(session)[2] - at[2]) > 0.1,
          lambda: session.seen("b"))
    session.order("b", "stop")
    until(lambda: session.heard.state == "Alarm", lambda: session.seen("b"))
    assert session.heard.fields.get("Lost") is not None, "the position is not known"
    assert session.order("b", "line", "$POSITION=HERE") == ""


def test_lines_by_hand_are_held_or_dropped_with_their_page(session):
    for line in ("G91 G01 Z3 F120", "G04 P10", "G00 X20", "$J=G91 X20 F300"):
        session.order("a", "line", line)
    until(lambda: session.heard.state == "Run", lambda: session.seen("a"))
    session.let_go("a")
    at = stands(session)
    assert at[2] < 2.5, "it goes on"
    assert at[0] == pytest.approx(0, abs=STANDS_MM)


def test_a_touched_surface_reads_zero_with_an_offset_of_g92(session):
    session.order("a", "line", "G92 Z7.5")
    session.order("a", "line", "G55")
    until(lambda: session.notice == "G55: ok", lambda: session.seen("a"))
    reports = len(session.heard.samples)
    until(lambda: len(session.heard.samples) > reports + 2 and session.heard.state == "Idle",
          lambda: session.seen("a"))
    touching = Touching("edge", PROBE, toward="Z-", system=2)
    assert session.order("a", "touch", touching) == ""
    for disturbs in (("jog", "X", 1, 300.0), ("retract",)):
        assert "Touching is under way" in session.order("a", *disturbs)
    until(lambda: session.notice.startswith("G10 L20") or "refused" in session.notice,
          lambda: session.seen("a"))
    assert session.notice.endswith(": ok")
    reports = len(session.heard.samples)
    until(lambda: len(session.heard.samples) > reports + 2, lambda: session.seen("a"))
    zero = session.heard.numbers("WCO")[2]
    assert touching.found.places["Z"] - zero == pytest.approx(0, abs=ZERO_MM)
