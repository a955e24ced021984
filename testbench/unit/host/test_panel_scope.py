# SPDX-License-Identifier: Apache-2.0
"""The gap oscilloscope of the panel: its session with the firmware, and its picture."""

import ctypes
import random
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from host.panel.scoping import Scoping
from host.panel.trace import LANES, trace
from host.scope.acquire import Trigger
from host.scope.record import LEVELS, PULSES, Record
from testbench.firmware import Scope
from testbench.unit.host.test_panel import Board, Script, serve, until

__all__ = ["serve"]     # a fixture

DEPTH, FULL = 64, 3


class Scoped(Board):
    """A board whose oscilloscope is full as soon as it is asked after arming."""

    def fill(self, seed):
        rng, words = random.Random(seed), Scope()
        self.library.gk_scope_read(ctypes.byref(words))
        assert words.recording == 1, "it is armed"
        words.entries[:] = [rng.randrange(6 << 33) for _ in range(DEPTH)]
        words.recording, words.count, words.time = FULL, DEPTH, seed
        self.library.gk_scope_write(ctypes.byref(words))
        return list(words.entries)


def test_a_record_comes_to_all_pages_and_a_run_goes_on(serve):
    wire = Scoped()
    session = serve(wire)
    assert session.order("b", "scope", Trigger("arc"), False)     # it only watches
    assert session.take("a")
    for number, again in ((1, False), (2, True), (3, True)):
        if number < 3:
            assert session.order("a", "scope", Trigger("arc", before=25), again) == ""
        until(lambda: session.scope.state == "armed" and wire_armed(wire))
        with session.lock:
            words = wire.fill(number)
        until(lambda number=number: session.scope.number == number)
        record = session.scope.record
        assert record.cycle == number
        assert record.trigger == DEPTH * 25 // 100
        wanted = Record.of(words, clock_hz=wire.clock_hz, trigger=record.trigger, cycle=number)
        assert (record.clock == wanted.clock).all()
        assert (record.code == wanted.code).all()
        assert (record.state == wanted.state).all()
    assert session.order("a", "scope_stop") == ""
    until(lambda: session.scope.state == "idle" and not wire_armed(wire))
    assert session.scope.number == 3


def wire_armed(wire):
    words = Scope()
    wire.library.gk_scope_read(ctypes.byref(words))
    return words.recording == 1


def test_a_refusal_is_told_and_nothing_more_is_asked(serve):
    wire = Script(refuses="$SCOPE=")
    session = serve(wire)
    session.take("a")
    session.order("a", "scope", Trigger("now"), True)
    until(lambda: session.scope.failed)
    assert "this controller does not jog" in session.scope.failed
    assert session.scope.state == "idle"
    assert [line for line in wire.lines if line.startswith("$SCOPE")] == ["$SCOPE=NOW,50"]


def test_a_line_that_will_not_be_answered_begins_its_record_anew():
    scope = Scoping()
    scope.arm(Trigger("short"), again=False)
    assert scope.line(0.0) == "$SCOPE=SHORT,50"
    assert scope.line(1.0) is None
    scope.lost()
    assert scope.line(2.0) == "$SCOPE=SHORT,50"
    scope.stop()
    scope.answered("ok", "", 3.0)
    assert scope.line(3.0) == "$SCOPE=STOP"
    scope.answered("ok", "", 4.0)
    assert scope.line(9.0) is None


# ---- the picture

def record_of(**levels):
    """100 entries, 10 clocks apart, with a pulse from entry 20 to 39, OK, and a sample each."""
    count = 100
    pulse = np.zeros(count, dtype=np.int64)
    pulse[40] = PULSES.index("ok")
    on = np.zeros(count, dtype=bool)
    on[20:40] = True
    volts = np.where(on, 80.0, 0.0)
    columns = {name: np.zeros(count, dtype=bool) for name in LEVELS} | {"on": on} | levels
    clock = (np.arange(count) - 50) * 10
    return Record(1_000_000, 50, 0, clock, volts, np.zeros(count, dtype=np.int64), columns, pulse,
                  np.where(np.arange(count) >= 80, 2, 0))


def paths(svg, kind):
    """From and to of every box of a path, in pixels."""
    tree = ElementTree.fromstring(svg)
    one, = (item for item in tree.iter() if item.get("class", "").endswith(kind))
    return [tuple(map(float, box)) for box in re.findall(r"M([\d.]+) [\d.]+H([\d.]+)", one.get("d"))]


def test_a_trace_shows_pulses_levels_retraction_and_trigger_to_one_scale():
    svg = trace(record_of())
    (begin, end), = paths(svg, "class-good")
    (on, off), = paths(svg, "lane-on")
    assert (on, off) == pytest.approx((begin, end))
    tree = ElementTree.fromstring(svg)
    zero = float(next(item for item in tree.iter() if item.get("class") == "trigger").get("x1"))
    back = next(item for item in tree.iter() if item.get("class") == "back")
    # 20 entries of 10 us are 200 us; the trigger is 100 us after the end of the pulse.
    scale = (off - on) / 200
    assert zero - off == pytest.approx(100 * scale, abs=0.2)
    assert float(back.get("x")) - zero == pytest.approx(300 * scale, abs=0.2)
    assert not paths(svg, "lane-current")
    assert len(list(tree.iter("text"))) > len(LANES)


def test_a_part_of_a_record_is_that_around_the_trigger():
    whole, part = (ElementTree.fromstring(trace(record_of(), share)) for share in (1.0, 0.8))
    place = [float(next(item for item in one.iter() if item.get("class") == "trigger").get("x1"))
             for one in (whole, part)]
    assert place[0] == pytest.approx(place[1], abs=0.2)
    (on, off), = paths(trace(record_of(), 0.8), "lane-on")
    (on_whole, off_whole), = paths(trace(record_of()), "lane-on")
    assert off - on == pytest.approx(1.25 * (off_whole - on_whole), abs=0.5)
    assert place[1] - off == pytest.approx(1.25 * (place[0] - off_whole), abs=0.5)


def test_a_record_without_samples_or_changes_can_be_drawn():
    empty = Record.of([0], clock_hz=2_000_000, trigger=0, cycle=0)
    assert "no sample of the voltage" in trace(empty)
    dense = Record.of([1 | 1 << 21 | (n % 2) << 22 for n in range(4096)], clock_hz=50_000_000,
                      trigger=7, cycle=0)
    svg = trace(dense)
    assert ElementTree.fromstring(svg).tag == "svg"
    assert len(svg) < 120_000
