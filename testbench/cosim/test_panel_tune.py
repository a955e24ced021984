# SPDX-License-Identifier: Apache-2.0
"""Measuring the drives from the panel, without its page, on a simulated machine."""

import re
import time

import pytest

from host.errors import UsageError
from host.machines import machine as machines
from host.machines.machine import Machine
from host.panel.session import Session
from host.panel.tuning import Tuning
from host.panel.wires import Bench
from softcore.tables.settings import named

SMALL = machines.load("sinker")
GAIN = 1.2
MACHINE = Machine(SMALL.name, SMALL.tables | {"axis": SMALL.tables["axis"] | {
    "full_speed_mm_s": GAIN * SMALL.tables["axis"]["full_speed_mm_s"]}})
LOOP, CORNERS = named("loop_gain"), named("corner_deviation_nm")
DEADLINE_S = 240.0      # 40 s on two idle cores


@pytest.fixture
def session():
    begun = Session(MACHINE, lambda say: Bench(MACHINE, clock_hz=MACHINE.clock_hz, seed=1, say=say))
    begun.start()
    until(lambda: begun.heard.state == "Idle")
    begun.take("page")
    assert begun.order("page", "arm") == ""
    yield begun
    begun.close()


def until(condition, seen=lambda: None):
    end = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end, "it has not happened in time"
        seen()
        time.sleep(0.02)


def test_the_drive_is_measured_and_nothing_is_changed(session):
    def seen():
        session.seen("page")
        session.seen("other")
    tuning = Tuning("Z+", 2.0)
    assert session.order("page", "tune", tuning) == ""
    until(lambda: session.heard.state == "Run", seen)
    refused = "being measured"
    assert refused in session.order("page", "jog", "X", 1, 60.0)
    assert refused in session.order("page", "line", "G00 X1")
    assert refused in session.order("page", "tune", Tuning("X+", 1.0))
    until(lambda: tuning.wanted is not None, seen)
    print("\n".join(tuning.told))
    assert tuning.wanted.values[LOOP.name] == pytest.approx(GAIN * LOOP.default, abs=1)
    told = re.match(r"Z: loop gain ([\d.]+) 1/s", tuning.told[2])
    assert float(told[1]) == pytest.approx(GAIN * LOOP.default, abs=1)
    assert f"${LOOP.number}={tuning.wanted.values[LOOP.name]}" in [line for line, _ in tuning.lines]
    assert "Z: following error" in tuning.picture
    assert session.tuning is tuning
    for setting in (LOOP, CORNERS):
        assert session.heard.settings[setting.number] == str(setting.default)
    # The panel works on, and what is wanted is entered line by line.
    assert session.order("page", "line", tuning.lines[0][0]) == ""
    until(lambda: session.heard.settings[LOOP.number] != str(LOOP.default), seen)
    session.order("page", "line", f"${LOOP.number}={LOOP.default}")
    until(lambda: session.heard.settings[LOOP.number] == str(LOOP.default), seen)


@pytest.mark.parametrize("how", [pytest.param("stop", marks=pytest.mark.soak), "let_go"])
def test_it_ends_with_a_stop_and_with_its_page(session, how):
    def seen():
        session.seen("page")
    tuning = Tuning("X-", 3.0)
    assert session.order("page", "tune", tuning) == ""
    until(lambda: session.heard.state == "Run", seen)
    if how == "stop":
        session.order("page", "stop")
    else:
        session.let_go("page")
    until(lambda: "not been measured to the end" in session.notice
          or tuning.told[-1].startswith("the drives have not"))
    until(lambda: session.heard.state in ("Hold:0", "Idle", "Alarm"))
    time.sleep(0.5)     # the axis comes to rest
    place = session.heard.place
    time.sleep(0.5)
    assert session.heard.place == pytest.approx(place, abs=2e-3)
    assert tuning.wanted is None
    # The panel asks for the settings anew.
    until(lambda: CORNERS.number in session.heard.settings, seen)
    assert session.heard.settings[CORNERS.number] == str(CORNERS.default)


@pytest.mark.parametrize(("ways", "travel", "said"), [
    ("", 3.0, "is no direction"), ("X+", 0.0, "must be above 0 mm")])
def test_what_is_missing_is_said_before_anything_moves(ways, travel, said):
    with pytest.raises(UsageError, match=said):
        Tuning(ways, travel)
