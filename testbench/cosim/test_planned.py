# SPDX-License-Identifier: Apache-2.0
"""Planned programs on the simulated sinker: every current from its depth on, by jumps and shorts.

The staircases are the planner's. The short job has basic data of its own, whose undersize rises
within 0.8 mm as that of the synthetic data does within 15: so a shallow cavity has several steps,
of currents that are built in and of ones that are not.
"""

from bisect import bisect_left, bisect_right
from collections import Counter
from dataclasses import dataclass
from itertools import accumulate, pairwise

import pytest

from host.basic import BasicData, read_all
from host.experiment_roughing import JUMP, machine_for
from host.roughing import condition, program
from host.run import Run
from host.simulation import Simulation as Piped
from host.staircase import Job, neighbours, plan
from host.synthetic import undersize_um
from host.tape import encode
from testbench.cosim.job import MM
from testbench.cosim.record import Record
from testbench.native.simulation import Simulation

STEEPER = 18.75     # 15 mm of the synthetic data are 0.8 mm of the made-up ones
DEPTHS_MM = (0.0, 0.1, 0.2, 0.4, 0.8, 1.2)
CURRENTS = (4.0, 6.0, 8.0, 10.0, 12.0, 14.0)
WATCHED = ("condition_switched", "axis_z_position", "gap_ma", "gap_on")
SENSING_MA = 1000   # more than this flows in main pulses only
AT_REST = 1         # pulses from the end of a block at which the electrode is taken to be there
OVERSHOOT = 3       # pulses that the electrode may be deeper than the end of its block meanwhile


def steep(area_mm2):
    """Basic data of an area, made up."""
    stock = tuple(3 * ip for ip in CURRENTS)
    return BasicData(
        name=f"steep_{area_mm2:g}", electrode="copper", workpiece="steel", area_mm2=area_mm2,
        source="made up", depth_mm=DEPTHS_MM, ip=CURRENTS, bottom_um=stock, side_um=stock,
        undersize_um=tuple(tuple(round(undersize_um(area_mm2, ip, STEEPER * depth), 1)
                                 for depth in DEPTHS_MM) for ip in CURRENTS),
        finish_um=((1.0, 0.0),))


def planned(data, job):
    """The planner's staircase, inferred by networks that could be trusted."""
    found = plan(data, job)
    assert not any("interpolated" in note for note in found.notes), found.notes
    return found


def jumping(text, jump):
    """The program with periodic jumps while it machines."""
    lines = text.splitlines()
    begin = next(at for at, line in enumerate(lines) if line.endswith(" M03")) + 1
    end = next(at for at, line in enumerate(lines) if line.endswith(" M05"))
    return encode("\n".join([*lines[:begin], jump, *lines[begin:end], "G38 P0", *lines[end:], ""]))


@dataclass
class Forced:
    """A short from a depth on, left above a lesser one; both in mm, counted upwards."""

    session: Simulation
    origin: int
    begin_mm: float
    end_mm: float
    state: str = "waits"

    def __call__(self):
        z_mm = (self.session.positions()["z"] + self.origin) / MM
        if self.state == "waits" and z_mm < self.begin_mm:
            self.session.set("force.short", 1)
            self.state = "short"
        elif self.state == "short" and z_mm > self.end_mm:
            self.session.set("force.short", -1)
            self.state = "over"


def machined(machine, tape, begin_mm, end_mm):
    """Run a tape with one forced short; return the run and what was watched."""
    record = Record()
    origin = round(machine.initial_gap_mm * MM)
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=False) as session:
        session.watch(WATCHED)
        forced = Forced(session, origin, begin_mm, end_mm)

        def watch(_):
            forced()
            record.extend(session.changes())
        done = Run(machine, tape, Piped(session), watch=watch)
        done.execute()
        watch(done)
    assert (done.outcome, done.alarm) == ("end", None)
    assert forced.state == "over"
    return done, record


def check_events(events, steps, by):
    """Each step is told once, in order, from its depth on; and there were jumps and shorts."""
    told = [event for event in events if event["event"] == "condition"]
    wanted = [(condition(int(step.ip))[0], step.ip) for step in steps]
    assert [(event["number"], event["ip"]) for event in told] == wanted
    assert [event["by"] for event in told] == ["program", *[by] * (len(steps) - 1)]
    for event, step in zip(told[1:], steps, strict=False):
        if by == "series":
            assert event["depth"] == event["pos"]["z"] == -step.depth_um / 1000
        else:
            assert abs(event["pos"]["z"] * MM + step.depth_um * MM / 1000) <= AT_REST
    causes = Counter(event["cause"] for event in events if event["event"] == "retraction_start"
                     and told[1]["t"] < event["t"])
    assert causes["jump"] >= 3
    assert causes["short"] >= 1


def check_switches(record, steps, origin):
    """The gateware's switches, to the pulse of the encoder and never before."""
    clocks = record.rises("condition_switched")
    assert len(clocks) == len(steps) - 1
    for clock, step in zip(clocks, steps, strict=False):
        reached = -step.depth_um * MM // 1000 - origin
        assert record.at("axis_z_position", clock - 2) == reached
        assert record.lowest("axis_z_position", 0, clock - 2) == reached + 1


def check_currents(record, steps, origin, step_ma, margin):
    """What flows in the gap is the planned current of the furthest depth reached so far.

    Pulses that begin within ``margin`` pulses of a border may have the current of either side.
    """
    clocks, places = record.signals["axis_z_position"]
    lowest = list(accumulate(places, min))
    borders = [-step.depth_um * MM // 1000 - origin for step in steps[:-1]]
    begins = [clock for clock, on in record.changes("gap_on") if on]
    flow_clocks, flows = record.signals["gap_ma"]
    seen = [set() for _ in steps]
    for begin, until in pairwise(begins):
        deepest = lowest[max(0, bisect_right(clocks, begin) - 1)]
        if any(abs(deepest - border) <= margin for border in borders):
            continue
        number = sum(deepest < border for border in borders)
        main = flows[bisect_right(flow_clocks, begin):bisect_left(flow_clocks, until)]
        seen[number].update(current for current in main if current > SENSING_MA)
    assert seen == [{step_ma * step.ip} for step in steps]


def run_and_check(machine, found, data, *, series, jump, forced):
    """Run the program of a staircase in one of its two forms and check it all."""
    tape = jumping(program(found, data, series=series), jump)
    done, record = machined(machine, tape, *forced)
    origin = round(machine.initial_gap_mm * MM)
    check_events(done.events, found.steps, "series" if series else "program")
    if series:
        check_switches(record, found.steps, origin)
    else:
        assert record.rises("condition_switched") == []
    check_currents(record, found.steps, origin, 1000 * machine.tables["source"]["step_a"],
                   margin=1 if series else OVERSHOOT)


@pytest.mark.parametrize("series", [True, False], ids=["series", "blocks"])
def test_a_short_job_has_each_current_from_its_depth_on(series):
    data = [steep(50.0), steep(100.0)]
    found = planned(data, Job(70, 150, 0.8))
    assert len(found.steps) >= 4
    assert {bool(condition(int(step.ip))[1]) for step in found.steps} == {True, False}
    # From behind the second border up to above the first.
    first, second = (-step.depth_um / 1000 for step in found.steps[:2])
    run_and_check(machine_for(), found, data, series=series, jump="G38 P600 L0.3 R900 H900",
                  forced=(second - 0.05, first + 0.02))


@pytest.mark.soak
@pytest.mark.parametrize("series", [True, False], ids=["series", "blocks"])
def test_the_reference_job_has_each_current_from_its_depth_on(series):
    data = read_all("copper", "steel")
    found = planned(data, Job(70, 110, 15))
    first = -found.steps[0].depth_um / 1000
    run_and_check(machine_for(), found, neighbours(data, 70), series=series, jump=JUMP,
                  forced=(first - 0.2, first + 0.1))
