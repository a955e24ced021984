# SPDX-License-Identifier: Apache-2.0
"""Measuring the drives from the panel, without its page: what may begin, and what ends it."""

import time

import pytest

from host.errors import UserError
from host.panel import tuning as panel_tuning
from host.panel.job import Job
from host.panel.tuning import Tuning
from softcore.tables.settings import assign
from testbench.punch import TAPES
from testbench.unit.host.test_panel import Script, serve, until

__all__ = ["serve"]     # a fixture

BEGUN = assign("corner_deviation_nm", 0)


class Slow(Script):
    """A controller that does not answer one line for a while."""

    waits = "$450=1"

    def say(self, line):
        if not (line.startswith("ok") and self.lines[-1:] == [self.waits]):
            super().say(line)


@pytest.mark.parametrize("orders", [("run", "tune"), ("tune", "run"), ("touch", "tune")])
def test_of_two_orders_at_once_only_one_begins(serve, orders):
    session = serve(Script())
    session.take("a")
    session.job = Job.of(TAPES / "sink_blocks.nc")
    words = {"tune": Tuning("X+", 1.0), "run": 1, "touch": None}
    with session.lock:      # the thread has not carried out the first before the second comes
        assert session.order("a", orders[0], words[orders[0]]) == ""
        assert "is about to begin" in session.order("a", orders[1], words[orders[1]])
        session._forget()


def test_a_measurement_that_waits_is_not_begun_after_a_stop(serve):
    wire = Slow()
    session = serve(wire)
    session.take("a")
    session.order("a", "line", wire.waits)
    until(lambda: wire.waits in wire.lines, lambda: session.seen("a"))
    assert session.order("a", "tune", Tuning("X+", 1.0)) == ""
    until(lambda: session.tuning is not None, lambda: session.seen("a"))
    session.order("a", "stop")
    end = time.monotonic() + 1.5
    until(lambda: time.monotonic() > end, lambda: session.seen("a"))
    assert BEGUN not in wire.lines
    assert len(session.tuning.told) == 0


def test_after_a_measurement_that_broke_off_the_settings_are_asked_for(serve):
    """A setting that it could not put back is shown as it is."""
    class Broken(Tuning):
        def run(self, link, tend):
            raise UserError("this drive is not measured.")

    wire = Script()
    session = serve(wire)
    session.take("a")
    with session.lock:
        session.heard.settings = {1: "5"}
    before = wire.lines.count("$$")
    assert session.order("a", "tune", Broken("X+", 1.0)) == ""
    until(lambda: wire.lines.count("$$") > before, lambda: session.seen("a"))
    assert session.heard.settings == {}
    assert "This drive is not measured." in [text for _, text in session.notices]


def test_a_fault_in_the_calculation_is_told(monkeypatch):
    def fails(*_):
        raise ValueError("no number")

    monkeypatch.setattr(panel_tuning, "explained", fails)
    tuning = Tuning("X+", 1.0)
    tuning._find({}, {"X": []})
    assert tuning.told == ["unexpected failure, ValueError: no number"]
