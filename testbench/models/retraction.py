# SPDX-License-Identifier: Apache-2.0
"""Reference model of the retraction: the events, pulse by pulse, on a scripted gap.

The model has no time: at and below the start/stop speed the machine answers within a pulse, so that
the events of a run and their places depend on the path alone.
"""

from dataclasses import dataclass, field, replace

from softcore.tables.events import CAUSES, HALTS, PHASES, REASONS, Choice, named

START, END, ADVANCE, RESUME, HALT = (named(name).number for name in (
    "retraction_start", "retraction_end", "readvance", "resume", "halt"))


def _numbers(choices: tuple[Choice, ...], *names: str) -> list[int]:
    found = {choice.name: choice.number for choice in choices}
    return [found[name] for name in names]


SHORT, JUMP, OPERATOR = _numbers(CAUSES, "short", "jump", "operator")
CLEARED, AT_LIMIT, AT_BACK_LIMIT = _numbers(REASONS, "cleared", "limit", "path_start")
STILL_LIMIT, STILL_BACK_LIMIT, BURST, NO_DATA, SERVO, CONTACT = _numbers(
    HALTS, "limit", "back_limit", "burst", "no_data", "servo", "contact")
HIGH, LOW = _numbers(PHASES, "high", "low")


@dataclass(frozen=True)
class Data:
    """Retraction data in force. Distances in pulses, rates in 2**-32 pulse/clock."""

    rate: int = 0
    limit: int = 0
    high_rate: int = 0
    low_rate: int = 0
    changeover: int = 0
    low_lead: int = 0
    jump_distance: int = 0
    jump_rate: int = 0
    jump_high_rate: int = 0
    valid: bool = True


@dataclass(frozen=True)
class Cue:
    """An incident when the position comes to ``at`` in one direction.

    A short clears when the electrode has gone back to ``clear``. If it never gets there, the short
    may still clear while the machine waits at its limit (``patient``).
    """

    cause: int
    at: int
    clear: int | None = None
    forward: bool = True
    patient: bool = False


@dataclass
class Gap:
    """The signal Ss, the operator and the jump timer by a list of cues, one after the other."""

    cues: list[Cue]
    short: Cue | None = None
    order: int = 0  # JUMP or OPERATOR, until it is taken

    @property
    def shorted(self) -> bool:
        return self.short is not None

    def see(self, position: int, forward: bool) -> None:
        """Look at a new position."""
        if self.shorted:
            if self.short.clear is not None and position <= self.short.clear:
                self.short = None
        elif self.cues and self.cues[0].at == position and self.cues[0].forward == forward:
            cue = self.cues.pop(0)
            if cue.cause == SHORT:
                self.short = cue
            else:
                self.order = cue.cause

    def wait(self) -> None:
        """Let time pass at the limit."""
        if self.shorted and self.short.patient:
            self.short = None

    def copy(self) -> "Gap":
        return replace(self, cues=list(self.cues))


class HaltedError(Exception):
    """The machine has halted."""


@dataclass
class Retraction:
    """A run from ``position`` to ``end``, with its events.

    ``feed`` is the feed at the front by position. An event is ``(kind, detail, position, first,
    second)``; values that depend on time are None.
    """

    data: Data
    gap: Gap
    end: int
    feed: object
    back_limit: int = -10**9
    gain: int = 10
    repeats: int = 0
    position: int = 0
    front: int = 0
    first: int = 0
    burst: int = 0
    returning: bool = False
    lowest: int = 0  # position ever
    events: list = field(default_factory=list)

    def report(self, kind, detail=0, first=0, second=0):
        self.events.append((kind, detail, self.position, first, second))

    def pulse(self, step):
        self.position += step
        self.front = max(self.front, self.position)
        self.lowest = min(self.lowest, self.position)
        self.gap.see(self.position, step > 0)

    def halt(self, why):
        self.report(HALT, why)
        raise HaltedError

    def run(self):
        """Run to the end, or to a halt."""
        try:
            while True:
                if self.returning and self.front - self.first >= self.gain:
                    self.returning, self.burst = False, 0
                if self.gap.shorted or self.gap.order:
                    cause = SHORT if self.gap.shorted else self.gap.order
                    self.gap.order = 0
                    self.retract(cause, self.feed(self.position))
                elif self.position == self.end:
                    break
                else:
                    self.pulse(+1)
        except HaltedError:
            pass
        return self.events

    def retract(self, cause, before):
        """Go back, and come forward again to the front."""
        data = self.data
        again = self.returning
        if cause == SHORT:
            if again:
                self.burst += 1
            else:
                self.returning, self.first, self.burst = True, self.front, 0
        if cause != JUMP and not data.valid:
            self.halt(NO_DATA)
        if cause == SHORT and again and 0 < self.repeats <= self.burst:
            self.halt(BURST)
        self.report(START, cause, 0, before)

        origin = self.first if cause == SHORT else self.front
        limit = origin - (data.jump_distance if cause == JUMP else data.limit)
        lowest = max(limit, self.back_limit)
        begin = self.position
        while self.position > lowest and (cause != SHORT or self.gap.shorted):
            self.pulse(-1)
        reason = AT_BACK_LIMIT if self.back_limit > limit else AT_LIMIT
        if cause == SHORT:
            if self.gap.shorted:
                self.gap.wait()
            if not self.gap.shorted:
                reason = CLEARED
        self.report(END, reason, max(0, begin - self.position - 1), None)
        if self.gap.shorted:
            if cause == SHORT:
                self.halt(STILL_BACK_LIMIT if reason == AT_BACK_LIMIT else STILL_LIMIT)
            self.retract(SHORT, data.jump_rate if cause == JUMP else data.rate)
        else:
            self.advance(data.jump_high_rate if cause == JUMP else data.high_rate)

    def advance(self, high_rate):
        """Come forward: fast, then slow."""
        change = self.front - self.data.changeover
        phases = [(LOW, self.front, self.data.low_rate)]
        if self.position < change:
            phases.insert(0, (HIGH, change, high_rate))
        for phase, target, rate in phases:
            self.report(ADVANCE, phase, self.front - self.position, self.front - target)
            while self.position < target:
                self.pulse(+1)
                if self.gap.shorted or self.gap.order == OPERATOR:
                    cause = SHORT if self.gap.shorted else OPERATOR
                    self.gap.order = 0 if cause == OPERATOR else self.gap.order
                    self.retract(cause, rate)
                    return
        self.report(RESUME)
