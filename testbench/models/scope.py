# SPDX-License-Identifier: Apache-2.0
"""Reference model of the gap oscilloscope: keeps every clock since it was armed, and cuts it."""

from dataclasses import dataclass, field

LONGEST = 511           # clocks between two entries
LEVELS = ("high", "arc", "short", "current", "noise", "on", "sense", "shorted", "state")
PULSES = (None, "open", "ok", "dame", "short", "sensed open", "sensed short")
BACK = (1, 2)           # states of a retraction: stopping, retracting


@dataclass
class Entry:
    """An entry: the inputs of a clock, and the clocks since the entry before."""

    stamp: int
    clock: dict

    def word(self) -> int:
        """The 36 bits of the ring."""
        at, value = 0, 0
        for name, bits in (("stamp", 9), ("voltage", 12), ("sampled", 1),
                           *((name, 1) for name in LEVELS[:7]), ("pulse", 3), ("shorted", 1),
                           ("state", 3)):
            value |= int(self.stamp if name == "stamp" else self.clock[name]) << at
            at += bits
        return value


@dataclass
class Scope:
    """``state`` and ``entries`` after the clocks that were given to ``look``.

    A clock is a mapping of the levels, ``voltage``, ``sampled``, ``pulse`` (a number, 0 for none),
    ``force`` and ``cycle``.
    """

    depth: int
    source: str = "now"
    classes: frozenset = frozenset()
    level: int = 0
    after: int = 0
    state: str = "idle"
    entries: list = field(default_factory=list)
    time: int = 0               # cycle of the trigger's clock
    samples: list = field(default_factory=list)
    before: dict | None = None
    since: int = 0              # clocks since the last entry
    rest: int = 0               # entries to come

    def arm(self) -> None:
        """Begin anew."""
        self.state, self.entries, self.before, self.samples = "armed", [], None, []

    def stop(self) -> None:
        """End."""
        self.state = "idle"

    def look(self, clock: dict) -> None:
        """Take the inputs of one clock."""
        if self.state not in ("armed", "triggered"):
            return
        before, self.before = self.before, clock
        self.since = 0 if before is None else self.since + 1
        triggers = self.state == "armed" and (clock["force"] or self._happens(clock, before))
        if clock["sampled"]:
            self.samples.append(clock["voltage"])
        if not (triggers or before is None or clock["sampled"] or clock["pulse"]
                or self.since == LONGEST
                or any(clock[name] != before[name] for name in LEVELS)):
            return
        self.entries = [*self.entries, Entry(self.since, clock)][-self.depth:]
        self.since = 0
        if triggers:
            self.state, self.time, self.rest = "triggered", clock["cycle"], self.after + 1
        if self.state == "triggered":
            self.rest -= 1
            if self.rest == 0:
                self.state = "full"

    def _happens(self, clock, before):
        if self.source == "now":
            return True
        if self.source == "class":
            return PULSES[clock["pulse"]] in self.classes
        if self.source in ("rise", "fall"):
            if not clock["sampled"] or not self.samples:
                return False
            low, was_low = (code < self.level for code in (clock["voltage"], self.samples[-1]))
            return (was_low, low) == ((True, False) if self.source == "rise" else (False, True))
        if before is None:
            return False
        if self.source == "short":
            return clock["shorted"] and not before["shorted"]
        return clock["state"] in BACK and before["state"] not in BACK
