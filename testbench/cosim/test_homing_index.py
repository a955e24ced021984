# SPDX-License-Identifier: Apache-2.0
"""Homing on the coders' indices: the machine's frame to the pulse, and what may go wrong."""

import re
from dataclasses import dataclass

import pytest

from host.link.link import HOLD, RESET, RESUME, RefusedError
from host.machines import machine as machines
from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign
from testbench.cosim import homing
from testbench.cosim.job import MM, Job
from testbench.native.simulation import Simulation

SINKER = machines.load("sinker")
SWITCH_MM = 0.5         # from the start of the axes, in the way of each one's reference
SCATTER_UM = SINKER.tables["side"]["limit_scatter_um"]
TURN_MM = 0.2           # between two indices; as delivered a run would be long
WAY_UM = 300            # longest way to one
# Of the way back from the switch, as the indices lie: from the pull-off to the first of them.
FIRST_MM = {"x": 0.05, "y": 0.1, "z": 0.07}
ENDS_MM = {"x": -299.0, "y": -299.0, "z": 100.0}    # of the travel as delivered
UP = {"x": 1, "y": 1, "z": -1}                      # away from the switch
PULSE_MM = 1 / MM
SETTINGS = {**homing.SETTINGS, "home_index": 7, "home_index_um": WAY_UM}


def index_mm(axis, first_mm=None):
    """True place of the index that comes first behind the pull-off."""
    first = FIRST_MM[axis] if first_mm is None else first_mm
    return UP[axis] * (homing.PULL_OFF_MM + first - SWITCH_MM)


def machine(seed=1, scatter_um=SCATTER_UM, turn_mm=TURN_MM, first_mm=None):
    """A simulation of the sinker with its switches near, and indices at places of their own."""
    side = {**SINKER.tables["side"], "limit_low_mm": -SWITCH_MM, "limit_high_mm": SWITCH_MM,
            "limit_scatter_um": scatter_um}
    axes = {axis: {**SINKER.tables[axis], "index_mm": turn_mm,
                   "index_at_mm": index_mm(axis, first_mm)} for axis in UP}
    return Simulation(machine={**SINKER.tables, "side": side, **axes},
                      clock_hz=SINKER.clock_hz, seed=seed, trace=False)


def lines(**changed):
    return [assign(*one) for one in (SETTINGS | changed).items()]


@dataclass
class Found:
    """Of an axis: its machine place less the true one, and its true place, in mm."""

    frame: float
    place: float


def places(job: Job) -> dict[str, Found]:
    job.run(job.session.clock_hz // 20)
    status = job.link.status()
    assert status["state"] == "Idle", status
    told = dict(zip("xyz", map(float, status["MPos"].split(",")), strict=True))
    true = {axis: job.session.get(f"read.{axis}_pulses") / MM for axis in told}
    return {axis: Found(told[axis] - true[axis], true[axis]) for axis in told}


def check(found, axis, first_mm=None):
    """The frame is that of the index to the pulse, and the axis stands on it."""
    index = index_mm(axis, first_mm)
    # The coder counts whole pulses, and goes down a fifth of one later.
    assert abs(found[axis].frame - (ENDS_MM[axis] - index)) <= PULSE_MM + 1e-9, (axis, found)
    assert abs(found[axis].place - index) <= 2 * PULSE_MM, (axis, found)


@pytest.mark.parametrize("seed", [1, 2, *(pytest.param(seed, marks=pytest.mark.soak)
                                          for seed in range(3, 41))])
def test_every_axis_stands_on_its_index_whatever_the_switch_does(seed):
    with machine(seed) as session:
        job = homing.begin(session, *lines())
        for _ in range(2):
            job.link.command("$H")
            found = places(job)
            for axis in "xyz":
                check(found, axis)
        assert not job.told("alarm")
        said = [line for line in job.said if "the index is" in line]
        assert len(said) == 6
        for line in said:
            axis, way = re.fullmatch(r"\[MSG:([XYZ]): the index is ([\d.]+) mm behind the "
                                     r"pull-off\.\]", line).groups()
            assert abs(float(way) - FIRST_MM[axis.lower()]) * 1000 <= SCATTER_UM / 2 + 0.2


def test_each_axis_may_have_another_reference():
    """Y by its index, X by its switch: their frames show it."""
    with machine() as session:
        job = homing.begin(session, *lines(home_order=12, home_index=2))
        job.link.command("$H")
        found = places(job)
        check(found, "y")
        wanted = ENDS_MM["x"] + SWITCH_MM - homing.PULL_OFF_MM
        assert abs(found["x"].frame - wanted) * 1000 <= SCATTER_UM / 2 + 0.2
        assert abs(found["x"].place - (homing.PULL_OFF_MM - SWITCH_MM)) * 1000 <= SCATTER_UM


@pytest.mark.parametrize("first_mm", [0.004, TURN_MM - 0.004], ids=["behind it", "before it"])
def test_an_index_that_the_scatter_may_miss_is_told(first_mm):
    with machine(scatter_um=0, first_mm=first_mm) as session:
        job = homing.begin(session, *lines(home_order=1))
        job.link.command("$H")
        check(places(job), "x", first_mm)
        (line,) = (line for line in job.said if line.startswith("[MSG:X:"))
        assert "an index is 0.0040 mm from the pull-off" in line
        assert "Change $537" in line


@pytest.mark.parametrize("damage", ["no index", "broken", "stuck"])
def test_an_index_that_does_not_come_is_an_alarm(damage):
    with machine(turn_mm=0 if damage == "no index" else TURN_MM) as session:
        if damage != "no index":
            session.set(f"force.index_{'cut' if damage == 'broken' else 'high'}", 7)
        job = homing.begin(session, *lines(home_order=1))
        with pytest.raises(RefusedError):
            job.link.command("$H")
        alarm = job.alarm()
        assert alarm["code"] == alarm_number("home_not_found")
        assert "X: the index of the coder did not come" in alarm["text"]
        assert job.link.status()["state"] == "Alarm"
        # It has gone the whole way: behind the pull-off, and to a pulse.
        way = session.get("read.x_pulses") / MM + SWITCH_MM - homing.PULL_OFF_MM
        assert abs(way * 1000 - WAY_UM) <= SCATTER_UM / 2 + 1


def test_a_hold_in_the_search_stops_it_and_a_resume_goes_on():
    with machine() as session:
        job = homing.begin(session, *lines(home_order=1))
        job.link.send_line("$H")
        edge = index_mm("x")
        job.until(lambda: session.get("read.x_speed_mm_s") > 0 and
                  session.get("read.x_pulses") / MM > edge - FIRST_MM["x"] / 2, "the search",
                  step=500, seconds=10)
        job.press(HOLD)
        job.run(session.clock_hz // 10)
        assert job.link.status()["state"].startswith("Hold")
        stood = session.get("read.x_pulses")
        assert stood / MM < edge
        job.run(session.clock_hz // 10)
        assert abs(session.get("read.x_pulses") - stood) < 2
        job.press(RESUME)
        job.until(lambda: job.link.status()["state"] == "Idle", "the end", step=20_000, seconds=10)
        check(places(job), "x")


def test_a_reset_in_the_search_loses_the_position():
    with machine() as session:
        job = homing.begin(session, *lines(home_order=1))
        job.link.send_line("$H")
        job.until(lambda: session.get("read.x_speed_mm_s") > 0 and
                  session.get("read.x_pulses") / MM > index_mm("x") - FIRST_MM["x"] / 2,
                  "the search", step=500, seconds=10)
        job.press(RESET)
        job.run(session.clock_hz // 10)
        assert any(one["code"] == alarm_number("home_reset") for one in job.told("alarm"))
        assert session.get("read.x_pulses") / MM < index_mm("x")


def test_an_index_is_nothing_unless_it_is_asked_for():
    """The axis passes its indices in a jog, and it is homed on the switch alone."""
    with machine() as session:
        job = homing.begin(session, *lines(home_order=1, home_index=0))
        session.watch(("enc_index", "index_found"))
        job.link.command("$J=G91 X0.5 F600")
        job.run(session.clock_hz // 5)
        assert session.get("read.x_pulses") / MM > 0.49
        job.link.command("$H")
        found = places(job)["x"]
        wanted = ENDS_MM["x"] + SWITCH_MM - homing.PULL_OFF_MM
        assert abs(found.frame - wanted) * 1000 <= SCATTER_UM / 2 + 0.2
        seen = [probe for _, probe, value in session.changes() if value]
        assert seen.count("enc_index") > 4
        assert "index_found" not in seen
        assert not any("index" in line for line in job.said)
