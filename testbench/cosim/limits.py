# SPDX-License-Identifier: Apache-2.0
"""Scenario: firmware has a wrong soft limit, and the gateware keeps the right one."""

from testbench.cosim.job import Job
from testbench.native.station import Session

__all__ = ["soft_limit"]

LIMIT = 12_344  # pulses; with the parity of the limit in force, or its guard would trip


def soft_limit(session: Session) -> dict:
    """The gateware's limit differs from firmware's: a motion that firmware allows stops there."""
    job = Job(session, watched=("safe", "path_position"))
    session.poke("axis_x_high", LIMIT)
    job.press("G90 G00 X5")
    alarm = job.alarm()
    assert ("a command beyond the upper soft limit of axis X; the position is kept"
            in alarm["text"])
    assert job.probe("axis_x_command") == LIMIT
    assert session.positions()["x"] == job.probe("axis_x_position")
    job.link.command("$X")
    assert not job.probe("safety_status_safe")
    job.link.command("G90 G00 X0.5")
    job.until(lambda: not job.probe("path_status_moving"), "rest", step=2000, seconds=20)
    job.run(session.clock_hz // 4)
    assert job.probe("axis_x_command") == 5000, "back is allowed"
    return {"cycle": session.cycle, "events": job.events}
