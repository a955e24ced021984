# SPDX-License-Identifier: Apache-2.0
"""Scenarios: shorts at every kind of place, and the retractions that follow.

A scenario is a function of a session, native or under cocotb; its figures must be the same in both.
"""

import math
from itertools import pairwise

from rtl.states import State
from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign
from testbench.cosim.checks import check_reactions, check_return, check_returns, pulses
from testbench.cosim.job import HEIGHT_MM, MM, Data, Job, program
from testbench.native.station import Session

__all__ = ["above_start_speed", "at_corners", "before_first_point", "by_current",
           "clearing_at_limit", "during_readvance", "from_mdi",
           "limit_between_blocks", "never_clearing", "simple"]

# Before a corner the machine would be slower than programmed: these look at the programmed speeds.
UNBOUND = assign("corner_deviation_nm", 0)


def pace(session: Session, mm_min: float) -> float:
    """Clocks from path pulse to path pulse at a speed."""
    return 60 * session.clock_hz / 10_000 / mm_min


def figures(job: Job) -> dict:
    """Result of a scenario: all lines and events, and the reactions."""
    return {"events": job.events, "reactions": check_reactions(job.record),
            "cycle": job.session.cycle}


def clear_after(job: Job, distance: int, mm_min: float) -> None:
    """Keep the short until the path has gone back by so much, then clear it."""
    job.until(lambda: job.probe("path_status_state") == State.RETRACTING.value, "a retraction")
    job.reach(job.probe("path_front") - distance, pace(job.session, mm_min), backward=True)
    job.short(False)


def at_limit(job: Job) -> None:
    """Run until the way back has reached its bound, with the axes too."""
    job.until(lambda: job.probe("path_status_state") == State.AT_LIMIT.value, "the limit")
    job.run(16)


def simple(session: Session) -> dict:
    """A short below the start/stop speed: back, forward in two steps, and on to the block's end."""
    data = Data()
    job = Job(session)
    job.start(program(data, "G01 Z-0.4 F120"))
    job.reach(2000, pace(session, 120))
    job.short(True)
    clear_after(job, 1000, data.speed)
    job.finish()
    one, = check_returns(job, data)
    assert job.probe("path_position") == 5000
    assert job.probe("axis_z_command") == -5000
    told = job.told("retraction_end")[0]
    assert told["reason"] == "cleared"
    assert pulses(told["distance"]) == one.first - one.lowest
    assert [event["phase"] for event in job.told("readvance")] == ["high", "low"]
    assert pulses(job.told("readvance")[1]["from"]) == pulses(data.changeover)
    start, = job.told("retraction_start")
    assert start["latency_cycles"] == check_reactions(job.record)[0]["last_forward"]
    assert start["speed"] == 120
    return figures(job)


def above_start_speed(session: Session) -> dict:
    """A short while the feed is still accelerating: the deceleration begins at once.

    The start point is the place where the machine came to rest. The retraction too is above the
    start/stop speed, and its braking distance lies within the limit.
    """
    data = Data(speed=1200, high=1500, limit=0.3)
    job = Job(session)
    job.start(program(data, "G01 Z-1.5 F1500"))
    job.reach(600, pace(session, 1500))
    job.short(True)
    at_limit(job)
    job.short(False)
    job.finish()
    one, = check_returns(job, data)
    assert one.lowest == one.first - pulses(data.limit)
    record = job.record
    sample = record.rises("completed")[0] - 1
    earlier = record.changes("ramp_above", sample - 64, sample)
    assert earlier == sorted(earlier), "it was not accelerating"
    assert len(earlier) >= 8
    assert record.at("path_position", sample) < one.front
    assert job.probe("axis_z_command") == -16_000
    return figures(job)


def at_corners(session: Session) -> dict:
    """Shorts around corners, so that the way back begins in one block and ends in another.

    The corners join lines of every kind. At least one short completes at the pulse of a corner.
    """
    data = Data(limit=0.3, changeover=0.02)
    points = ((0, 0, 0), (0.1, 0, -0.1), (0.3, 0, -0.1), (0.3, 0.05, -0.3), (0.4, 0.05, -0.28),
              (0.4, 0.2, -0.28), (0.5, 0.2, -0.4))
    corners = [pulses(HEIGHT_MM)]
    for a, b in pairwise(points):
        corners.append(corners[-1] + pulses(math.dist(a, b)))
    job = Job(session, UNBOUND)
    job.start(program(data, "G01 F60", *(f"X{x} Y{y} Z{z}" for x, y, z in points)))
    beyond = []
    for number, corner in enumerate(corners[:-1]):
        job.reach(corner - number % 3, pace(session, 60))
        job.short(True)
        clear_after(job, 400 + 300 * number, data.speed)
        job.wait("resume", number + 1)
        beyond.append(job.collect().excursions()[-1].front - corner)
    job.finish()
    assert len(check_returns(job, data)) == len(corners) - 1
    assert 0 in beyond, beyond
    assert min(beyond) < 0 < max(beyond), beyond
    assert [job.probe(f"axis_{axis}_command") for axis in "xyz"] == [5000, 2000, -5000]
    return figures(job)


def during_readvance(session: Session, phase: str) -> dict:
    """A short on the way forward: a new retraction, with the limit still from the first BS."""
    data = Data(speed=900, high=900, changeover=0.1)
    job = Job(session)
    job.start(program(data, "G01 Z-0.9 F300"))
    job.reach(6000, pace(session, 300))
    job.short(True)
    clear_after(job, 3000, data.speed)
    state = State[phase.upper()]
    job.until(lambda: job.probe("path_status_state") == state.value, phase)
    job.run(8000)
    assert job.probe("path_status_state") == state.value
    job.short(True)
    at_limit(job)
    job.short(False)
    job.finish()
    one, = check_returns(job, data)
    assert one.lowest == one.first - pulses(data.limit)
    assert one.front == one.first
    assert len(job.told("retraction_start", cause="short")) == 2
    assert pulses(job.told("retraction_end")[1]["distance"]) == pulses(data.limit)
    assert len(job.told("resume")) == 1
    return figures(job)


def before_first_point(session: Session, bound: str) -> dict:
    """A short so early that the way back goes beyond the path's first point, up the jump axis.

    It ends at the limit, at the ceiling or at the soft limit, whichever is lowest.
    """
    ceiling = 0.13 if bound == "ceiling" else None
    data = Data(limit=0.12, changeover=0.02, ceiling=ceiling)
    job = Job(session, UNBOUND, *([assign("soft_limit_um", 50)] if bound == "soft" else []))
    job.start(program(data, "G01 X0.2 F60", "Z0"))
    job.reach(300, pace(session, 60))
    job.short(True)
    at_limit(job)
    lowest = {"limit": job.probe("path_front") - 1200, "ceiling": -300, "soft": -500}[bound]
    assert job.probe("path_command") == job.probe("path_position") == lowest
    assert job.probe("axis_x_command") == 0
    assert job.probe("axis_z_command") == -lowest
    job.short(False)
    job.finish()
    one, = check_returns(job, data)
    assert one.lowest == lowest
    told, = job.told("retraction_end")
    assert pulses(told["distance"]) == one.first - lowest
    return figures(job)


def clearing_at_limit(session: Session) -> dict:
    """A short that clears just when the limit is reached: no alarm, and no pulse further."""
    data = Data(limit=0.2)
    job = Job(session)
    job.start(program(data, "G01 Z-0.4 F120"))
    job.reach(3000, pace(session, 120))
    job.short(True)
    clear_after(job, pulses(data.limit), data.speed)
    assert job.probe("path_position") == job.probe("path_front") - pulses(data.limit)
    assert job.probe("gap_status_shorted") == 1
    job.finish()
    one, = check_returns(job, data)
    assert one.lowest == one.first - pulses(data.limit)
    assert one.entered(State.AT_LIMIT)
    assert job.told("retraction_end")[0]["distance"] == data.limit
    return figures(job)


def never_clearing(session: Session, speed: float) -> dict:
    """A short that stays: the alarm at the limit, not one pulse beyond it, discharge off."""
    data = Data(speed=speed, limit=0.3)
    job = Job(session)
    job.start(program(data, "G01 Z-0.4 F120"))
    job.reach(4000, pace(session, 120))
    job.short(True)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("halt_limit")
    assert alarm["text"] == "Block 7: still short at the retractable limit."
    one, = job.record.excursions()
    limit = one.first - pulses(data.limit)
    assert one.lowest == job.probe("path_position") == limit
    assert job.probe("path_status_state") == State.HALTED.value
    assert job.told("retraction_end")[0]["reason"] == "limit"
    assert not job.probe("power_control_machining")
    job.record.check_path()
    # Nothing has been lost: unlocked, the machine stands where it stood.
    assert job.probe("axis_z_command") == -limit
    job.short(False)
    job.make_ready()
    status = job.link.status()
    assert status["state"] == "Idle"
    assert status["MPos"] == f"0.0000,0.0000,{-limit / MM:.4f}"
    assert job.probe("axis_z_command") == -limit
    return figures(job)


def limit_between_blocks(session: Session) -> dict:
    """The tape changes the limit between two blocks; a way back may cross into the first."""
    first, second = Data(limit=0.1), Data(limit=0.4, speed=900)
    job = Job(session)
    job.start(program(first, "G01 Z-0.2 F120", second, "Z-0.3"))
    for number, coordinate in enumerate((2000, 3200)):
        job.reach(coordinate, pace(session, 120))
        job.short(True)
        at_limit(job)
        job.short(False)
        job.wait("resume", number + 1)
    job.finish()
    job.record.check_path()
    one, two = job.record.excursions()
    check_return(job.record, one, first, session.clock_hz)
    check_return(job.record, two, second, session.clock_hz)
    assert one.lowest == one.first - 1000
    assert two.lowest == two.first - 4000
    assert [event["limit"] for event in job.told("retraction_set")] == [0.1, 0.4]
    return figures(job)


def from_mdi(session: Session) -> dict:
    """Data entered by hand; the tape's data override the words that they name, until G37."""
    by_hand = Data(limit=0.2, speed=900)
    job = Job(session, str(by_hand))
    job.start(program("G01 Z-0.1 F120", "G36 L0.1", "Z-0.3", "G37", "Z-0.5"))
    for number, (coordinate, distance) in enumerate(((1000, 2000), (3000, 1000), (5000, 2000))):
        job.reach(coordinate, pace(session, 120))
        job.short(True)
        at_limit(job)
        assert job.probe("path_front") - job.probe("path_command") == distance
        job.short(False)
        job.wait("resume", number + 1)
    job.finish()
    check_returns(job, by_hand)
    assert [(event["source"], event["limit"], event["speed"])
            for event in job.told("retraction_set")] == [
        ("mdi", 0.2, 900), ("tape", 0.1, 900), ("tape", 0.2, 900)]
    return figures(job)


def by_current(session: Session) -> dict:
    """A short told by the current, as in the first patent: it begins, lasts and ends with that.

    With the level of the wire machine's main pulses, a sensing pulse would not show the contact.
    So the second short seems clear while it lasts, though its voltage is that of a short.
    """
    data = Data(speed=60, limit=0.05, high=120, low=30, changeover=0.02)
    job = Job(session, assign("short_current_ns", 3000))
    assert job.link.status()["Ss"] == "current"
    job.start(program(data, "G01 X0.4 F120", condition=500))
    job.reach(1000, pace(session, 120))
    job.short(True)
    at_limit(job)
    assert job.probe("gap_status_shorted")
    assert not job.told("retraction_end", reason="cleared")
    job.short(False)
    job.wait("resume")

    job.reach(2500, pace(session, 120))
    own = session.get("comparator.sensing_level_a")
    session.set("comparator.sensing_level_a", session.get("comparator.current_level_a"))
    job.short(True)
    job.until(lambda: job.probe("gap_status_shorted"), "the second short")
    job.until(lambda: not job.probe("gap_status_shorted"), "its end in contact")
    job.short(False)
    session.set("comparator.sensing_level_a", own)
    job.finish()
    ends = [event["reason"] for event in job.told("retraction_end")]
    assert ends[1] == "cleared", ends
    assert len(job.told("retraction_start", cause="short")) == len(job.told("retraction_end"))
    return figures(job)
