# SPDX-License-Identifier: Apache-2.0
"""Planned programs on the simulated sinker: each current begins at its depth, whatever happens.

The planner on the host, or on the controller itself, makes the staircases.
"""

from collections import Counter
from dataclasses import dataclass

import pytest

from host.experiments.roughing import machine_for
from host.roughing.basic import read_all
from host.roughing.roughing import JUMP, condition, program
from host.roughing.staircase import Job, neighbours, plan
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode
from testbench.cosim.job import HEIGHT_MM, MM
from testbench.cosim.planning import WATCHED, check_currents, check_switches, plan_on, steep
from testbench.cosim.record import Record
from testbench.native.simulation import Simulation

LONGEST_STEP = 7500     # clocks of the firmware's main loop, of the watchdog's 10 000 at 2 MHz
AT_REST = 1         # pulses from the end of a block within which the electrode has arrived
OVERSHOOT = 3       # pulses by which the electrode may be deeper than its block's end meanwhile


def planned(data, job):
    """The planner's staircase, inferred by networks that could be trusted."""
    found = plan(data, job)
    assert not any("interpolated" in note for note in found.notes), found.notes
    return found


@dataclass
class Forced:
    """A short that begins at a depth and clears above a smaller one; both in mm, upwards."""

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
    """Run a tape with one forced short; return the run and the recorded signals."""
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
    """Check that each step has one event, in order, at its depth; and that there were jumps."""
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


def run_and_check(machine, found, data, *, series, forced, jump=JUMP):
    """Run the program of a staircase in one of its two forms, with all checks."""
    tape = encode(program(found, data, depth_series=series, jumps=True).replace(JUMP, jump))
    done, record = machined(machine, tape, *forced)
    origin = round(machine.initial_gap_mm * MM)
    check_events(done.events, found.steps, "series" if series else "program")
    if series:
        check_switches(record, found.steps, origin)
    else:
        assert record.rises("condition_switched") == []
    check_currents(record, found.steps, origin, 1000 * machine.tables["source"]["step_a"],
                   margin=1 if series else OVERSHOOT)


@pytest.mark.soak
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
    run_and_check(machine_for(), found, neighbours(data, 70), series=series,
                  forced=(first - 0.2, first + 0.1))


def planned_on_the_controller(data, roughing, feed):
    """Let the controller plan and machine by its plan; compare both with the host's plan."""
    found, machine = planned(data, roughing), machine_for()
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=False) as session:
        job, told = plan_on(session, data, roughing)
        job.start("\n".join(["%", "G21 G90 G94", "G39 P1", "M03",
                             f"G01 Z-{roughing.depth_mm:g} F{feed}", "M05", "M02", "%", ""]))
        job.finish()
    assert told["steps"] == found.steps
    assert (told["needs_um"], told["has_um"]) == (round(found.beta_um, 1), roughing.undersize_um)
    assert told["longest"] < LONGEST_STEP
    conditions = job.told("condition")
    assert [(event["number"], event["ip"]) for event in conditions] == [
        (condition(int(step.ip))[0], step.ip) for step in found.steps]
    assert [event["depth"] for event in conditions[1:]] == [
        -step.depth_um / 1000 for step in found.steps[:-1]]
    origin = round(HEIGHT_MM * MM)
    check_switches(job.record, found.steps, origin)
    check_currents(job.record, found.steps, origin, 1000 * machine.tables["source"]["step_a"],
                   margin=1)


@pytest.mark.soak
def test_the_controller_plans_what_the_host_does_and_switches_by_it():
    planned_on_the_controller([steep(70.0)], Job(70, 150, 0.8), feed=240)


@pytest.mark.soak
@pytest.mark.parametrize("undersize_um", [110, 150])
def test_the_controller_plans_the_reference_job(undersize_um):
    data = read_all("copper", "steel")[1:3]
    planned_on_the_controller(data, Job(70, undersize_um, 15), feed=1200)
