# SPDX-License-Identifier: Apache-2.0
"""Reference model of the read-back of the gates: looks back at every clock since reset."""

from dataclasses import dataclass, field


@dataclass
class ReadBack:
    """``live`` and ``stuck`` after each call of ``clock`` are those of the next clock.

    Times are in clocks. Before reset the gap was dead and the short level 0.
    """

    dead: int
    limit: int
    settle: int
    live: bool = False
    stuck: bool = False
    signs: list = field(default_factory=list)   # of life, clock by clock, gates included
    silent: list = field(default_factory=list)  # both gates were off, and live
    levels: list = field(default_factory=lambda: [0])

    def clock(self, *, on, sense, current, short, level):
        # The level of this clock has been there since the clock after its last change.
        trusted = len(self.levels) > self.settle and len(
            {*self.levels[len(self.levels) - self.settle - 1:]}) == 1
        voltage = trusted and not short
        self.levels.append(level)
        self.signs.append(bool(on or sense or current or voltage))
        self.silent.append(not on and not sense and self.live)
        self.live = any(self.signs[-self.dead:])
        self.stuck = len(self.silent) >= self.limit and all(self.silent[-self.limit:])
