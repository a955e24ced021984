# SPDX-License-Identifier: Apache-2.0
"""Reference model of the conduction of a pulse: keeps the currents of the whole pulse."""

from dataclasses import dataclass, field


@dataclass
class Conduction:
    """One call of ``clock`` a clock."""

    source: str = ""
    currents: list = field(default_factory=list)
    last: bool = False  # as of the clock before the last call

    def clock(self, *, on, sense, current, delay):
        """Return whether the pulse conducts in this clock, and go to the next."""
        source = "main" if on else "sense" if sense else ""
        if source != self.source:
            self.source, self.currents = source, []
        self.currents.append(bool(current))
        return bool(source and current and all(self.currents[delay:]))
