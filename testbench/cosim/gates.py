# SPDX-License-Identifier: Apache-2.0
"""Scenarios: a stuck gate, a shorted transistor, the wire of a comparator."""

from host.link.link import RefusedError
from softcore.tables.causes import numbers
from softcore.tables.faults import alarm_number
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.native.station import Session

__all__ = ["KINDS", "WIRES", "later", "phases", "stuck"]

WATCHED = ("gap_on", "gap_sense", "safe", "drive_enable", "power_control_machining")
GATE_BIT = numbers()["gate"]
SAID = "current or voltage with both sources off"
LIMIT_S = 1e-3      # from the end of the pause to safe
KINDS = {"main": 1, "sensing": 2, "shorted": 3}     # force.gate_stuck
BEHIND = ("main", "shorted")    # faults of the main source, which the main contactor switches
# Force of a comparator's wire: one that is broken must not hide a gate.
WIRES = {"short_dead": ("force.comparator_dead", 1), "current_cut": ("force.comparator_cut", 2)}


def _begin(session, when):
    """A controller that idles, or cuts; it cuts across a gap that is narrow, wide or short."""
    job = Job(session, watched=WATCHED)
    if when == "idle":
        job.run(session.clock_hz // 100)
        return job
    job.start(program(Data(), "G01 Z-0.9 F300", condition=130))
    job.reach(2000, pace(session, 300))
    if when == "open":
        session.set("force.gap_um", 500)
    elif when == "short":
        job.short(True)
    return job


def _refused(job, line):
    """Enter a line that is refused; return the controller's sentence."""
    try:
        job.link.command(line)
    except RefusedError as error:
        return error.reason
    raise AssertionError(f"{line} was taken")


def _tripped(job, begun):
    """Run to the trip; return the clocks to it from when both gates had been off last."""
    session = job.session
    job.until(lambda: job.probe("safety_status_safe"), "the trip", seconds=0.05)
    job.run(session.clock_hz // 100)
    record = job.collect()
    safe = record.rises("safe", begun)[0]
    off = max([begun, *(clock for pin in ("gap_on", "gap_sense")
                        for clock, level in record.changes(pin, 0, safe) if not level)])
    clocks = safe - off
    assert clocks <= LIMIT_S * session.clock_hz, clocks
    assert job.probe("safety_latched") == 1 << GATE_BIT
    for pin in ("gap_on", "gap_sense", "drive_enable"):
        assert not record.at(pin, safe)
        assert not record.changes(pin, safe + 1)
    return clocks


def _trips_again(job):
    """Unlock, which the open contactor allows, and press: the cause is there with the voltage."""
    job.run(job.session.clock_hz // 20)
    job.link.command("$X")
    assert not job.probe("safety_status_safe")
    alarms = len(job.told("alarm"))
    job.session.press_arm()
    job.wait("alarm", alarms + 1)
    assert SAID in job.told("alarm")[-1]["text"]
    assert job.probe("safety_latched") == 1 << GATE_BIT
    assert not job.probe("contactor")


def stuck(session: Session, kind: str, when: str, delay: int = 0) -> dict:
    """A gate, a transistor or a comparator's wire, at any time: safe in time, named, not cleared.

    The fault is also found while the machine stands. A stuck sensing source on a short is found
    when the short opens.
    """
    job = _begin(session, when)
    job.run(delay)
    begun = session.cycle
    force, value = WIRES[kind] if kind in WIRES else ("force.gate_stuck", KINDS[kind])
    session.set(force, value)
    clocks = _tripped(job, begun)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("trip")
    assert SAID in alarm["text"]
    assert "the position is kept" in alarm["text"]
    assert job.probe("axis_z_position") == session.positions()["z"]
    # It stays as long as it lasts, and no longer; the open contactor ends it, until it is closed.
    if kind in BEHIND:
        _trips_again(job)
    else:
        assert SAID in _refused(job, "$X")
    session.set(force, 0)
    job.run(session.clock_hz // 100)
    job.link.command("$X")
    assert not job.probe("safety_status_safe")
    return {"clocks": clocks, "events": job.events}


def later(session: Session) -> dict:
    """The gate sticks after the emergency stop: it is named as well."""
    job = _begin(session, "cut")
    session.set("force.gate_stuck", KINDS["main"])
    session.set("force.estop", 1)
    alarm = job.alarm()
    assert "emergency stop" in alarm["text"]
    assert sum(SAID in line for line in job.said) == 1
    assert job.said[-1].startswith("[MSG:")
    session.set("force.estop", 0)
    job.run(session.clock_hz // 100)
    _trips_again(job)
    return {"events": job.events, "said": job.said}


def phases(session: Session, count: int) -> dict:
    """Worst time to safe with the main gate stuck at different phases of pulses and discharge."""
    job = Job(session, watched=WATCHED)
    job.link.command("C130")
    found = []
    for number in range(count):
        job.link.command("M03")
        session.set("force.gap_um", (30, 30, 500)[number % 3])
        job.run(session.clock_hz // 2000 + number * session.clock_hz // 500_000)
        begun = session.cycle
        session.set("force.gate_stuck", KINDS["main"])
        found.append(_tripped(job, begun))
        session.set("force.gate_stuck", 0)
        job.run(session.clock_hz // 200)
        job.link.command("$X")
        session.press_arm()
    return {"worst": max(found), "least": min(found)}
