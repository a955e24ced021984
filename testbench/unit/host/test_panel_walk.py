# SPDX-License-Identifier: Apache-2.0
"""Walking along the path from the panel, without its page: the steps, and who may take them."""

import pytest

from host.panel.heard import Heard
from host.panel.job import Job
from host.panel.walking import Walking
from host.run.events import Scale
from testbench.unit.host.test_panel import CLOCK_HZ, PULSES_PER_MM, Board, serve, until

__all__ = ["serve"]     # a fixture


def heard(state, walk=None):
    """What the controller has said: its state, and the field of a walk."""
    told = Heard(Scale(CLOCK_HZ, PULSES_PER_MM))
    told.hear(f"<{state}|MPos:0.0000,0.0000,0.0000|FS:0.000,0|WCO:0.0000,0.0000,0.0000"
              f"{f'|Wk:{walk}' if walk else ''}|Er:0,0,0|Rt:4,0|Gap:0,0,0,0>", 0.0)
    return told


@pytest.mark.parametrize(("state", "walk", "offered"), [
    ("Hold:0", None, True), ("Hold:0", "1.0000,1.0000", True), ("Hold:1", "1.0000,0.2000", True),
    ("Hold:1", None, False), ("Hold:1", "0.0000,0.2000", False), ("Run", None, False),
    ("Idle", None, False), ("Alarm", None, False)])
def test_a_walk_is_offered_on_hold(state, walk, offered):
    assert Walking.offered(heard(state, walk)) == offered


def test_the_motion_is_told_in_words():
    assert Walking.motion(heard("Hold:0")) == ""
    assert Walking.motion(heard("Hold:0", "0.0000,0.2000")) == ""
    assert Walking.motion(heard("Hold:0", "1.0000,1.0000")) == "stands on a walk"
    assert Walking.motion(heard("Hold:1", "1.0000,0.5000")) == "walks along the path"


@pytest.mark.parametrize(("state", "walk", "step", "place"), [
    ("Hold:0", None, 0.1, 0.1),
    ("Hold:0", None, -0.1, None),
    ("Hold:0", "0.0000,0.4321", 1.0, 1.4321),       # in a re-advance
    ("Hold:0", "0.5000,0.3000", -0.1, 0.2),         # a hold has stopped it on the way forward
    ("Hold:1", "0.5000,0.8000", -0.1, 0.4),         # it goes to 0.5
    ("Hold:0", "0.1000,0.1000", -0.1, None),        # the front
    ("Hold:0", "0.1001,0.1001", -0.1, 0.0001),
    ("Hold:0", "0.9000,0.9000", -1.0, None)])
def test_a_step_leads_on_from_where_the_machine_is_or_goes(state, walk, step, place):
    assert Walking(lambda line: False).place(heard(state, walk), step) == place


def test_steps_may_follow_faster_than_reports():
    way: set[str] = set()       # lines on their way
    walking, told = Walking(way.__contains__), heard("Hold:0")

    def step():
        line = walking.order(walking.place(told, 0.1))
        way.add(line)
        return line

    assert [step(), step(), step()] == ["$WALK=0.1000", "$WALK=0.2000", "$WALK=0.3000"]
    told = heard("Hold:1", "0.1000,0.0500")     # only the first line is carried out so far
    assert step() == "$WALK=0.4000"
    way.clear()                                 # the others were refused
    assert step() == "$WALK=0.2000"


def test_a_page_with_the_controls_walks(serve, tmp_path):
    path = tmp_path / "long.nc"
    path.write_text("%\nG21 G91 G94\nG36 R60 L0.1 H60 E60 Q0.01\nG01 X5 F60\nM02\n%\n")
    session = serve(Board(pulses_per_pass=20))
    session.take("a")
    session.order("a", "choose", Job.of(path))
    session.order("a", "arm")
    until(lambda: "Armed" in session.heard.fields, lambda: session.seen("a"))
    session.order("a", "run")
    until(lambda: session.heard.place and session.heard.place[0] > 0.02, lambda: session.seen("a"))
    session.order("a", "hold")
    until(lambda: session.heard.state == "Hold:0", lambda: session.seen("a"))
    walking = Walking(session.pending)
    line = walking.order(walking.place(session.heard, 0.01))
    assert "only watches" in session.order("b", "line", line)
    assert session.order("a", "line", line) == ""
    until(lambda: session.heard.numbers("Wk"), lambda: session.seen("a"))
    assert session.heard.numbers("Wk")[0] == 0.01
    session.order("a", "line", "$WALK=900")
    until(lambda: "$WALK=900 is refused: the way back along the path is" in session.notice,
          lambda: session.seen("a"))
