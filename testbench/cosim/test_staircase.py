# SPDX-License-Identifier: Apache-2.0
"""The tape ``sink_staircase`` on the simulated sinker: every step at its depth, and its current."""

from collections import Counter
from itertools import pairwise

import pytest

from host.link.link import RefusedError
from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from softcore.tables.settings import assign
from testbench.cosim.job import MM, Job, program
from testbench.cosim.record import Record
from testbench.cosim.staircase import IP
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

MACHINE = machines.load("sinker")
FIRST, STEPS = 150, [(-0.2, 140), (-0.4, 130), (-0.6, 120)]     # of the tape
DEPTH_MM = 0.8
WATCHED = ("condition_switched", "axis_z_position", "gap_ma", "gap_on", "path_status_reverse")


def test_every_step_comes_at_its_depth_and_with_its_current():
    record = Record()
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1) as session:
        session.watch(WATCHED)
        done = Run(MACHINE, load(TAPES / "sink_staircase.nc"), Piped(session),
                   watch=lambda _: record.extend(session.changes()))
        done.execute()
        record.extend(session.changes())
    assert (done.outcome, done.alarm) == ("end", None)
    check_events(done.events)
    clocks = check_depths(record)
    check_currents(record, clocks)


@pytest.mark.soak
def test_a_supply_of_finer_steps_gives_the_current_that_is_said():
    tables = MACHINE.tables | {"source": MACHINE.tables["source"] | {"step_a": 0.5}}
    with Simulation(machine=tables, clock_hz=MACHINE.clock_hz, seed=1, trace=False) as session:
        job = Job(session, assign("current_step_ma", 500), "G10 C900 I5.33 P40 Q40",
                  watched=("gap_ma", "gap_level"))
        job.start(program("G39 Z0.05 C900", "G01 Z0 F300", condition=120))
        job.finish()
    assert [event["ip"] for event in job.told("condition")] == [4, 5.333]
    assert {level for _, level in job.record.changes("gap_level")} == {0, 12, 16}
    currents = {current for _, current in job.record.changes("gap_ma")}
    assert {current for current in currents if current > 1000} == {6000, 8000}


@pytest.mark.soak
def test_the_full_current_comes_in_steps_of_half_an_ampere_and_no_more():
    half = machines.load("half")
    # One controller is built for this and for ``test_dac.py``.
    tables = half.tables | {"axis": half.tables["axis"] | {"dac": "pwm"}}
    with Simulation(machine=tables, clock_hz=half.clock_hz, seed=1, trace=False) as session:
        refused = r"the current I must be 0 to 60 steps of the power supply, 500 mA each"
        job = Job(session, assign("current_step_ma", 500), "G10 C900 I20 P300 Q150",
                  watched=("gap_ma", "gap_level"))
        with pytest.raises(RefusedError, match=refused):
            job.link.command("G10 C901 P300 Q150 I20.4")
        job.start(program("G39 Z0.05 C900", "G01 Z0 F300", condition=120))
        job.finish()
    assert [event["ip"] for event in job.told("condition")] == [4, 20]
    assert {level for _, level in job.record.changes("gap_level")} == {0, 12, 60}
    currents = {current for _, current in job.record.changes("gap_ma")}
    assert {current for current in currents if current > 1000} == {6000, 30_000}


def check_events(events):
    """The events come in order, within one block, with jumps and natural shorts around."""
    told = [event for event in events if event["event"] == "condition"]
    assert [(event["number"], event["ip"], event["by"]) for event in told] == [
        (FIRST, IP[FIRST], "program"), *((number, IP[number], "series") for _, number in STEPS)]
    assert [(event["depth"], event["pos"]["z"]) for event in told[1:]] == [
        (depth, depth) for depth, _ in STEPS]
    assert len({event["line"] for event in told[1:]}) == 1
    causes = Counter(event["cause"] for event in events if event["event"] == "retraction_start"
                     and told[1]["t"] < event["t"])
    assert causes["jump"] >= 3
    assert causes["short"] >= 1


def check_depths(record):
    """The switch comes exactly at the encoder's pulse, never before."""
    clocks = record.rises("condition_switched")
    origin = round(MACHINE.initial_gap_mm * MM)
    for clock, (depth, _) in zip(clocks, STEPS, strict=True):
        reached = round(depth * MM) - origin
        assert record.at("axis_z_position", clock - 2) == reached
        assert record.lowest("axis_z_position", 0, clock - 2) == reached + 1
    return clocks


def check_currents(record, clocks):
    """A pulse has the current of the condition that was in force at its start."""
    step_ma = 1000 * MACHINE.tables["source"]["step_a"]
    wanted = [step_ma * IP[number] for number in (FIRST, *(number for _, number in STEPS))]
    flows = record.changes("gap_ma")
    begins = [(clock, on) for clock, on in record.changes("gap_on") if on]
    seen = [set() for _ in wanted]
    at = 0
    for (begin, _), (until, _) in pairwise(begins):
        number = sum(clock < begin for clock in clocks)
        close = any(abs(clock - begin) < 4 for clock in clocks)
        while at < len(flows) and flows[at][0] < until:
            clock, current = flows[at]
            at += 1
            if clock > begin and current > 1000 and not close:   # sensing pulses have 0.2 A
                seen[number].add(current)
    assert seen == [{current} for current in wanted]
