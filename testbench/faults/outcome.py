# SPDX-License-Identifier: Apache-2.0
"""The outcome of a fault, by one rule for all of them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from host.link.link import GREETING
from testbench.cosim.record import Record
from testbench.faults.pins import PINS, safe_from
from testbench.faults.witness import Told, Witness

__all__ = ["AWAY_UM", "LIED", "MISPLACED", "SLACK", "Found", "Outcome", "Seen", "away", "judge",
           "look", "misplaced"]

SLACK = 1.5         # pulses between true and reported place: the place of an edge varies
REST = 3            # pulses between two ways of coming to rest at one place
AWAY_UM = 300       # greatest allowed deviation of an axis from its way
ANEW = "it has started anew, and calls its position lost"
LIED = "an output was on while it told that all were safe"
MISPLACED = "at rest at another place than it tells"
# Forms of a reason, the best first: the sentence of an alarm, a message, a bare number.
REASONS = (re.compile(r"\[E:alarm,(?:[^,\]]*,){6}([^\]]*)\]"), re.compile(r"\[MSG:([^\]]+)\]"),
           re.compile(r"(ALARM:\d+[^\r\n]*|error:\d+)"))
NOTICE_S = 0.5      # time in which firmware notices that nothing moves
START_S = 0.25      # from power-on until a controller answers
CLOCKS_AFTER = 2    # from `safe` to the last output behind it


class Outcome(Enum):
    """The four outcomes of the report, from best to worst."""

    NO_EFFECT = "no effect"
    SAFE_TOLD = "safe with reason"
    SAFE_UNTOLD = "safe without reason"
    WRONG = "wrong"


@dataclass(frozen=True)
class Seen:
    """Observations of a machine at the end of a trial and on the way.

    ``clocks`` count from the fault to all outputs safe, None if they are not. ``burns`` and
    ``moves`` are the state at the end. ``lied``: the machine reported that it was safe while a pin
    was not. ``said`` has all its lines since the fault. ``away_um`` is the greatest deviation of an
    axis from its way.
    """

    clocks: int | None
    burns: bool
    moves: bool
    lied: bool
    true: list[float]
    told: Told | None
    said: str
    away_um: float = 0.0

    @property
    def reasons(self) -> list[str]:
        """Reasons that the machine has given, the best first."""
        found = [reason for kind in REASONS for reason in kind.findall(self.said)]
        if GREETING in self.said and self.told is not None and self.told.lost:
            found.append(ANEW)
        return found


@dataclass(frozen=True)
class Found:
    """An outcome, the clocks to safe outputs if they became safe, and the sentence for it."""

    outcome: Outcome
    clocks: int | None
    why: str


def _lied(record: Record, begun: int, end: int) -> bool:
    """Whether `safe` was reported while an output was on."""
    told = [begun] * record.at("safe", begun) + record.rises("safe", begun + 1)
    for since in told:
        until = next((clock for clock, level in record.changes("safe", since) if not level), end)
        for pin, level in PINS.items():
            begin = since + CLOCKS_AFTER
            if begin < until and (record.at(pin, begin) != level
                                  or record.changes(pin, begin + 1, until)):
                return True
    return False


def _apart(places: Sequence[float], others: Sequence[float], pulses: float) -> bool:
    return any(abs(a - b) > pulses for a, b in zip(places, others, strict=True))


def look(session: Witness, begun: int, rest_s: float = 0.1, away_um: float = 0.0) -> Seen:
    """Let a machine come to rest, and observe its state."""
    session.changes()
    session.run(round(rest_s * session.clock_hz))
    quiet = session.cycle
    places = session.true_places()
    told = session.told()
    if told is None:  # it may be starting anew
        session.run(round(START_S * session.clock_hz))
        told = session.told()
    session.changes()
    if session.pins.rises("gap_on", quiet) and not _apart(places, session.true_places(), SLACK):
        # It burns in one place: it has its time to notice that.
        session.run(round(NOTICE_S * session.clock_hz))
        quiet, places = session.cycle, session.true_places()
        told = session.told()
        session.changes()
    record, end = session.pins, session.cycle
    true = session.true_places()
    safe = safe_from(record, begun, end)
    return Seen(clocks=None if safe is None else safe - begun,
                burns=bool(record.rises("gap_on", quiet)),
                moves=_apart(places, true, SLACK),
                lied=_lied(record, begun, end), true=true, told=told, said=session.said(begun),
                away_um=away_um)


def misplaced(seen: Seen) -> bool:
    """Whether it is at rest and reports a wrong place without calling it lost."""
    return (seen.told is not None and not seen.told.lost and not seen.moves
            and _apart(seen.true, seen.told.places, SLACK))


def judge(seen: Seen, deadline: int | None, target: list[float] | None = None,
          away_um: float = AWAY_UM) -> Found:
    """Judge the observations.

    ``deadline`` for safe outputs is in clocks, or None. ``target`` is the place of the axes at the
    end of a run without the fault; a machine that stands elsewhere without a message has stopped
    without a reason.
    """
    def found(outcome, why):
        return Found(outcome, seen.clocks, why)

    reason = next(iter(seen.reasons), "")
    if seen.lied:
        return found(Outcome.WRONG, LIED)
    if seen.away_um > away_um:
        return found(Outcome.WRONG, f"{seen.away_um:.0f} um from its way")
    if misplaced(seen) and not (seen.burns and seen.clocks is None):
        return found(Outcome.WRONG, f"{MISPLACED}: it tells {seen.told.places} and is at "
                                    f"{[round(place) for place in seen.true]}, in pulses")
    if seen.clocks is not None:
        if deadline is not None and seen.clocks > deadline:
            return found(Outcome.WRONG, f"safe after {seen.clocks} clocks, {deadline} allowed")
        return found(Outcome.SAFE_TOLD if reason else Outcome.SAFE_UNTOLD, reason or "not a word")
    if seen.told is None:
        return found(Outcome.WRONG, "it does not answer, and its outputs are on")
    if seen.moves and not seen.burns:
        return found(Outcome.WRONG, "it moves on, and its outputs are on")
    there = target is None or not _apart(seen.true, target, REST)
    if there and seen.told.state == "Idle" and not seen.burns:
        return found(Outcome.NO_EFFECT, reason or "as without the fault")
    if seen.burns:
        return found(Outcome.WRONG, "it burns on, and gets nowhere")
    return found(Outcome.SAFE_TOLD if reason else Outcome.SAFE_UNTOLD,
                 reason or "it stands, without a word")


def away(places: list[list[float]], way: list[list[float]]) -> float:
    """Greatest deviation, um, of a machine from the way of one without the fault.

    Both arguments are places of the axes in pulses, at the same looks; for the machine with the
    fault the last ``len(places)`` of them. A lag on the way is no deviation; a lead is.
    """
    worst = 0.0
    for index, place in enumerate(places, start=len(way) - len(places) + 1):
        worst = max(worst, min(max(abs(a - b) for a, b in zip(place, one, strict=True))
                               for one in way[:index]))
    return worst / 10
