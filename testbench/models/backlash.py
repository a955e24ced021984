# SPDX-License-Identifier: Apache-2.0
"""Reference model of the compensation of backlash and pitch, in exact integers."""

from dataclasses import dataclass


@dataclass
class Backlash:
    """Offset between drive and axis, the direction of the last command, and a pulse to be made."""

    taken_up: int = 0
    down: bool = False
    due: int = 0    # what the pulse adds to the offset: -1 or +1; 0 for none

    def goal(self, size: int, pitch: int = 0) -> int:
        return pitch + (size if self.down else 0)

    def pulse(self, moved: int) -> int:
        """FP of this clock, in which the drive has made the pulse ``moved``: -1, 0 or +1."""
        return moved or self.due

    def tick(self, *, size: int, tick: bool, pi: int, moved: int, safe: bool, clear: bool,
             pitch: int = 0) -> None:
        """Go on by one clock."""
        goal = self.goal(size, pitch)
        if self.due and not moved:
            self.taken_up += self.due
            self.due = 0
        elif tick and self.taken_up != goal:
            self.due = 1 if goal > self.taken_up else -1
        if safe:
            self.due = 0
        if pi:
            self.down = pi < 0
        if clear:
            self.taken_up, self.down, self.due = 0, False, 0
