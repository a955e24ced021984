# SPDX-License-Identifier: Apache-2.0
"""Rules for every retraction, and the controller's reaction times to a short."""

from dataclasses import asdict, dataclass
from itertools import pairwise

from rtl.states import State
from testbench.cosim.job import MM, Data, Job
from testbench.cosim.record import Excursion, Record

__all__ = ["Reaction", "check_reactions", "check_return", "check_returns", "pulses", "reactions"]

SPEED_TOLERANCE = 0.02


def pulses(mm: float) -> int:
    """Path pulses of a distance."""
    return round(mm * MM)


@dataclass(frozen=True)
class Reaction:
    """Reactions to the sample that completed a short, in clocks after it.

    ``last_forward``: the last forward path pulse; 0 if there was none. ``slowed``: the first step
    of the deceleration; 0 at or below the start/stop speed. ``reversed``: the reversed command at
    the ramp; if it had to come to rest first, after the last forward pulse. ``taken``: firmware has
    taken the event; if the machine had to come to rest, after the event.
    """

    last_forward: int
    slowed: int
    reversed: int
    taken: int


def reactions(record: Record) -> list[Reaction]:
    """Reactions to every short of a record for which the machine retracted.

    Raises
    ------
    AssertionError
        If the machine did not retract although it was neither going back nor halted, and the record
        goes on.
    """
    found = []
    stops = record.rises("completed")
    for completed, until in pairwise([*stops, record.last + 1]):
        sample = completed - 1
        turned = next(iter(record.rises("path_status_reverse", completed, until)), None)
        go = turned and next(iter(record.rises("go", turned, until)), None)
        if record.at("path_status_reverse", completed):
            continue  # it went back already
        if go is None:
            halted = record.at("path_status_state", until - 1) == State.HALTED
            assert halted or until > record.last, f"no retraction for the short at {completed}"
            continue
        forward = record.rises("pp", sample, turned)
        fast = record.at("ramp_above", sample) > 0
        slowing = [clock for clock, value in record.changes("ramp_above", sample, turned)
                   if value < record.at("ramp_above", clock - 1)]
        # An event that still waits is taken first, in the same interrupt.
        told = turned if record.at("event_head_valid", turned) else (
            record.rises("event_head_valid", turned)[0])
        taken = next(clock for clock, value in record.changes("event_head_valid", told)
                     if not value)
        found.append(Reaction(
            last_forward=forward[-1] - sample if forward else 0,
            slowed=slowing[0] - sample if fast else 0,
            reversed=go - (forward[-1] if fast and forward else sample),
            taken=taken - (told if fast else sample)))
    return found


def check_reactions(record: Record) -> list[dict]:
    """Check the reaction to every short of a record; return the figures.

    Raises
    ------
    AssertionError
        If a reaction is slower than promised: 8 clocks, 16 clocks, 2000 clocks.
    """
    found = reactions(record)
    for one in found:
        assert one.slowed <= 8, one
        assert one.slowed or one.last_forward <= 8, one
        assert one.reversed <= 16, one
        assert one.taken <= 2000, one
    return [asdict(one) for one in found]


def check_return(record: Record, one: Excursion, data: Data, clock_hz: int) -> None:
    """Check an excursion that ended, of a retraction for a short or for the operator.

    Raises
    ------
    AssertionError
        If path pulses are lost or too many, a bound or the changeover is missed by a pulse, or a
        speed is not the programmed one.
    """
    assert one.end is not None, "the machine has not come back"
    limit = one.first - pulses(data.limit)
    assert one.lowest >= limit, f"commanded {limit - one.lowest} pulses beyond the limit"
    before, after = (record.at("path_position", clock) for clock in (one.begin, one.end))
    steps = [value for _, value in record.changes("path_position", one.begin, one.end)]
    assert after == max([before, *steps]) == one.front, "it does not stop at the start point"

    changeover = one.front - pulses(data.changeover)
    edges = [*one.states, (one.end, State.FRONT)]
    for (clock, state), (until, following) in pairwise(edges):
        if state is State.HIGH and following is State.LOW:
            assert record.at("path_position", until) == changeover
        if state is State.HIGH:
            assert record.at("path_position", clock) < changeover
        if state is State.LOW:
            assert record.at("path_position", clock) >= changeover
    _check_speeds(record, edges, data, clock_hz)


def _check_speeds(record, edges, data, clock_hz):
    wanted = {State.RETRACTING: data.speed, State.HIGH: data.high, State.LOW: data.low}
    for (clock, state), (until, _) in pairwise(edges):
        measured = record.speed(clock, until) if state in wanted else None
        if measured is None:
            continue
        mm_min = measured * clock_hz * 60 / MM
        assert abs(mm_min - wanted[state]) <= SPEED_TOLERANCE * wanted[state], (
            f"{mm_min:.1f} mm/min in {state}, and {wanted[state]} is programmed")


def check_returns(job: Job, data: Data) -> list[Excursion]:
    """Check every excursion of a job: its path, its reactions and the speeds in its events.

    Returns the excursions.
    """
    record = job.collect()
    record.check_path()
    found = record.excursions()
    for one in found:
        check_return(record, one, data, job.session.clock_hz)
    check_reactions(record)
    speeds = [speed for one in found for speed in _retractions(record, one)]
    for told, measured in zip(job.told("retraction_end"), speeds, strict=True):
        assert told["speed"] or not measured, f"{told} does not tell of a plateau"
        assert abs((told["speed"] or data.speed) - data.speed) <= SPEED_TOLERANCE * data.speed, told
    return found


def _retractions(record, one):
    """Speed of every retraction of an excursion, None for one without a plateau."""
    found = []
    for (clock, state), (until, _) in pairwise([*one.states, (one.end, State.FRONT)]):
        if state is State.STOPPING:
            found.append(None)
        elif state is State.RETRACTING:
            found[-1] = found[-1] or record.speed(clock, until)
    return found
