# SPDX-License-Identifier: Apache-2.0
"""Scenarios: the homing cycle (`$H`) on a simulated machine, against the places of its axes."""

import math

from testbench.cosim.job import MM, Job
from testbench.cosim.record import WATCHDOG
from testbench.native.station import Session

__all__ = ["PULL_OFF_MM", "SETTINGS", "begin", "cycle"]

PULL_OFF_MM = 0.1
# Settings by name. The pull-off is short, so that a run is; the rest is as delivered.
SETTINGS = {"home_pull_off_um": round(PULL_OFF_MM * 1000)}


def begin(session: Session, *lines: str) -> Job:
    """A controller that is about to home, with the gap of the simulated machine."""
    job = Job(session, *lines, watched=("safe", "gap_on", *WATCHDOG))
    session.set("force.short", -1)
    session.set("force.gap_um", math.nan)
    return job


def cycle(session: Session, *lines: str, times: int = 1) -> list[dict[str, float]]:
    """Home several times; for each, by axis in mm, how much its machine place exceeds the true one.

    The true place is that of the motor, counted from the start of the simulation.
    """
    job = begin(session, *lines)
    found = []
    for _ in range(times):
        job.link.command("$H")
        job.run(session.clock_hz // 20)     # `Idle` needs 20 ms of rest in the new frame
        status = job.link.status()
        assert status["state"] == "Idle", status
        assert not job.told("alarm")
        assert not job.probe("safety_status_safe")
        places = dict(zip("xyz", map(float, status["MPos"].split(",")), strict=True))
        found.append({axis: place - session.get(f"read.{axis}_pulses") / MM
                      for axis, place in places.items()})
    return found
