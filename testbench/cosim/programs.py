# SPDX-License-Identifier: Apache-2.0
"""Scenarios: tapes as they run on each kind of machine, and roughing planned on the controller."""

from host.machines import machine as machines
from host.roughing.staircase import Job as Roughing
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from testbench.cosim.planning import plan_on, steep
from testbench.native.station import Session
from testbench.punch import TAPES

__all__ = ["begins", "planned_series"]


def begins(session: Session, on: str, tape: str, until_s: float) -> dict:
    """The first seconds of a tape on a machine: every event, and the places of the axes."""
    run = Run(machines.load(on), load(TAPES / f"{tape}.nc"), Piped(session), until_s=until_s)
    assert run.execute() == "stopped", run.alarm
    assert session.discharges()["ok"] > 0
    return {"events": run.events, "places": session.positions()}


def planned_series(session: Session) -> dict:
    """The controller plans two steps, and switches the current at their depth."""
    roughing = Roughing(70, 95, 0.4)
    job, told = plan_on(session, [steep(70.0)], roughing, watched=("condition_switched",))
    assert len(told["steps"]) >= 2
    job.start("\n".join(["%", "G21 G90 G94", "G39 P1", "M03",
                         f"G01 Z-{roughing.depth_mm:g} F1200", "M05", "M02", "%", ""]))
    job.finish()
    conditions = job.told("condition")
    assert [event["ip"] for event in conditions] == [step.ip for step in told["steps"]]
    assert [event["depth"] for event in conditions[1:]] == [
        -step.depth_um / 1000 for step in told["steps"][:-1]]
    return {"clocks": told["clocks"], "conditions": conditions}
