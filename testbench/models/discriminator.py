# SPDX-License-Identifier: Apache-2.0
"""Reference model of the pulse discriminator: keeps a whole pulse and classifies it at its end."""

from collections import Counter
from dataclasses import dataclass, field

OPEN, OK, DAME, SHORT = range(4)


@dataclass(frozen=True)
class Sample:
    """What a pulse was."""

    kind: int
    sensing: bool


@dataclass
class Discriminator:
    """One call of ``clock`` a clock; ``blanking`` may change between pulses only."""

    main: Counter = field(default_factory=Counter)
    last: int = OPEN
    source: str = ""
    pulse: list = field(default_factory=list)  # (arc, short, current) of each clock so far

    def clock(self, *, on, sense, arc, short, current, blanking):
        """Return ``(sample or None, shorted_now)`` of this clock, and go to the next."""
        source = "main" if on else "sense" if sense else ""
        sample = None
        if source != self.source:
            sample = self._classify(blanking)
            self.source, self.pulse = source, []
        if source:
            self.pulse.append((arc, short, current))
        shorted_now = bool(source and len(self.pulse) > blanking and short)
        if sample and not sample.sensing:
            self.main[sample.kind] += 1
            self.last = sample.kind
        return sample, shorted_now

    def _classify(self, blanking):
        seen = self.pulse[blanking:]
        if not seen:
            return None
        arc, short, _ = seen[-1]
        sensing = self.source == "sense"
        if short:
            return Sample(SHORT, sensing)
        if sensing or not any(current for _, _, current in seen):
            return Sample(OPEN, sensing)
        return Sample(DAME if arc else OK, sensing)
