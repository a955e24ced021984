# SPDX-License-Identifier: Apache-2.0
"""Scenarios: short bursts, ceilings, jumps, and what the operator does in between."""

from itertools import pairwise

from host.link.link import HOLD, RESUME, RETRACT
from rtl.states import State
from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign
from testbench.cosim.checks import check_return, check_returns, pulses
from testbench.cosim.job import MM, Data, Job, program
from testbench.cosim.retractions import at_limit, clear_after, figures, pace
from testbench.native.station import Session

__all__ = [
    "burst",
    "ceiling_wins",
    "hold_and_resume",
    "jump",
    "jump_into_short",
    "no_data",
    "operator_retracts",
    "rapid",
]



def _state(job, state, what=""):
    job.until(lambda: job.probe("path_status_state") == state.value, what or state.name)


def _hold(job):
    job.press(HOLD)
    job.until(lambda: job.probe("retraction_control_hold"), "hold")


def burst(session: Session) -> dict:
    """Shorts that return are one short burst until 1 um of new depth is gained; then the alarm."""
    data = Data(changeover=0.02, limit=0.2)
    job = Job(session, assign("repeats", 3))
    job.start(program(data, "G01 Z-0.4 F60"))
    coordinate, firsts = 1000, []
    # Depth gained after each: within the burst, then just enough to end it, then within again.
    for gain in (4, 2, 15, 3, 0, 0):
        job.reach(coordinate, pace(session, 60))
        job.short(True)
        if gain == 15:
            # The limit is still that of the burst, though its front is deeper by now.
            at_limit(job)
            assert job.probe("path_command") == firsts[0] - pulses(data.limit)
            assert job.probe("path_front") > firsts[0]
            job.short(False)
        else:
            clear_after(job, 100, data.speed)
        firsts.append(job.probe("retraction_first"))
        coordinate = job.probe("path_front") + gain
        _state(job, State.FRONT)
    assert len(set(firsts[:3])) == len(set(firsts[3:])) == 1, firsts
    assert firsts[3] - firsts[0] >= 10
    job.short(True)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("halt_burst")
    assert "too many shorts in a burst" in alarm["text"]
    assert len(job.told("retraction_start")) == len(firsts)
    assert job.probe("path_position") == job.probe("path_front")
    job.record.check_path()
    return figures(job)


def rapid(session: Session) -> dict:
    """Shorts that return at once: firmware keeps up, and the burst ends in its alarm."""
    data = Data(speed=600, limit=0.2, high=600, low=600, changeover=0)
    job = Job(session, watched=("safety_pet_strobe", "safety_pet"))
    job.start(program(data, "G01 Z-0.4 F1"))
    job.reach(5, pace(session, 1))
    begun = session.cycle

    def left():
        return job.probe("path_status_state") != State.FRONT.value

    while job.probe("path_status_state") != State.HALTED.value:
        job.short(True)
        job.until(left, "the short", step=16)
        job.short(False)
        job.until(lambda: not left() or job.probe("path_status_state") == State.HALTED.value,
                  "the front", step=16)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("halt_burst"), alarm
    assert len(job.told("retraction_start")) == 20
    assert len(job.told("resume")) == 20
    longest = job.record.watched_well(session.clock_hz, begun)
    return {"longest": longest, "events": job.events, "cycle": session.cycle}


def ceiling_wins(session: Session) -> dict:
    """A ceiling below the limit, on a slope: the axis stops at it, and the alarm comes there."""
    data = Data(limit=0.5, ceiling=-0.05)
    job = Job(session)
    job.start(program(data, "G01 X0.3 Z-0.25 F120"))
    job.reach(3600, pace(session, 120))
    job.short(True)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("halt_back_limit")
    assert job.probe("axis_z_command") == -pulses(0.1 + 0.05)
    highest = max(value for _, value in job.record.changes(
        "axis_z_command", job.record.excursions()[0].begin))
    assert highest == -1500
    told = job.told("retraction_end")[0]
    assert told["reason"] == "limit"
    assert told["distance"] < data.limit
    job.record.check_path()
    return figures(job)


def jump(session: Session) -> dict:
    """Jumps without a short: with their own period, distance and speeds."""
    data = Data(speed=300, high=300, changeover=0.05)
    job = Job(session)
    job.start(program(data, "G38 P40 L0.3 R900 H1200", "G01 Z-0.1 F60"))
    job.finish()
    record = job.collect()
    record.check_path()
    found = record.excursions()
    assert len(found) >= 3
    for one in found:
        assert one.lowest == one.front - pulses(0.3)
        one.first = one.front
        check_return(record, one, Data(speed=900, limit=0.3, high=1200, low=data.low),
                     session.clock_hz)
    period = session.clock_hz * 40 // 1000
    waits = [after.begin - before.end for before, after in pairwise(found)]
    assert all(abs(wait - period) <= 4 for wait in waits), waits
    assert {event["cause"] for event in job.told("retraction_start")} == {"jump"}
    assert {event["reason"] for event in job.told("retraction_end")} == {"limit"}
    assert {event["distance"] for event in job.told("retraction_end")} == {0.3}
    assert {event["speed"] for event in job.told("readvance", phase="high")} == {1200}
    return figures(job)


def jump_into_short(session: Session) -> dict:
    """A short at the top of a jump: a retraction follows, with its own limit."""
    data = Data(limit=0.4)
    job = Job(session)
    job.start(program(data, "G38 P60 L0.2 R600 H600", "G01 Z-0.2 F60"))
    _state(job, State.RETRACTING, "a jump")
    front = job.probe("path_front")
    job.reach(front - 1900, pace(session, 600), backward=True)
    job.short(True)
    at_limit(job)
    assert job.probe("path_command") == front - pulses(data.limit)
    job.short(False)
    job.wait("resume")
    job.finish()
    one, *_ = job.record.excursions()
    assert one.first == one.front == front
    check_return(job.record, one, data, session.clock_hz)
    assert [event["cause"] for event in job.told("retraction_start")][:2] == ["jump", "short"]
    job.record.check_path()
    return figures(job)


def operator_retracts(session: Session) -> dict:
    """The operator's byte: up to the limit and back, without an alarm, also during a hold."""
    data = Data(limit=0.25)
    job = Job(session)
    job.start(program(data, "G01 Z-0.4 F120"))
    job.reach(3000, pace(session, 120))
    job.press(RETRACT)
    job.wait("resume")
    _hold(job)
    job.press(RETRACT)
    job.wait("retraction_end", 2)
    job.run(session.clock_hz // 20)
    held = job.probe("path_position")
    assert held == job.probe("path_front") - pulses(data.limit)
    job.press(RESUME)
    job.finish()
    found = check_returns(job, data)
    assert [one.front - one.lowest for one in found] == [2500, 2500]
    assert [event["cause"] for event in job.told("retraction_start")] == ["operator"] * 2
    assert [event["reason"] for event in job.told("retraction_end")] == ["limit"] * 2
    assert job.probe("axis_z_command") == -5000
    return figures(job)


def hold_and_resume(session: Session) -> dict:
    """Feed hold at the front, on the way back and on the way forward: no pulse is lost or made."""
    data = Data(limit=0.4, high=900)
    job = Job(session)
    job.start(program(data, "G01 Z-0.4 F120"))
    job.reach(2000, pace(session, 120))
    _hold(job)
    held = job.probe("path_position")
    job.run(session.clock_hz // 20)
    assert job.probe("path_position") == held
    assert job.link.status()["state"] == "Hold"
    job.press(RESUME)
    job.reach(3000, pace(session, 120))
    job.short(True)
    _state(job, State.RETRACTING)
    _hold(job)
    # The retraction goes on; the hold stops only the way forward.
    clear_after(job, 3000, data.speed)
    job.wait("retraction_end")
    job.run(session.clock_hz // 20)
    assert job.probe("path_front") - job.probe("path_position") > 3000
    assert job.probe("path_status_state") == State.HIGH.value
    job.press(RESUME)
    job.reach(job.probe("path_front") - 1500, pace(session, 900))
    _hold(job)
    job.run(session.clock_hz // 20)
    stopped = job.probe("path_position")
    job.run(session.clock_hz // 40)
    assert job.probe("path_position") == stopped
    job.press(RESUME)
    job.finish()
    job.collect().check_path()
    one, = job.record.excursions()
    assert one.end is not None
    assert job.record.at("path_position", one.end) == one.front
    assert job.probe("path_position") == MM // 2
    assert job.probe("axis_z_command") == -5000
    return figures(job)


def no_data(session: Session) -> dict:
    """A short without retraction data anywhere: the machine halts where it is."""
    job = Job(session)
    job.start(program("G01 Z-0.4 F120"))
    job.reach(1000, pace(session, 120))
    job.short(True)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("halt_no_data")
    assert "retraction without data (G36)" in alarm["text"]
    assert not job.told("retraction_start")
    assert job.probe("path_position") == job.probe("path_command") == job.probe("path_front")
    assert not job.probe("power_control_machining")
    return figures(job)
