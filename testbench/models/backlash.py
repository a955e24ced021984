# SPDX-License-Identifier: Apache-2.0
"""Reference model of the compensation of backlash, in exact integers."""

from dataclasses import dataclass


@dataclass
class Backlash:
    """Offset between drive and axis, and the direction of the last command."""

    taken_up: int = 0
    down: bool = False
    due: bool = False

    def goal(self, size: int) -> int:
        return size if self.down else 0

    def pulse(self, moved: int) -> int:
        """FP of this clock, in which the drive has made the pulse ``moved``: -1, 0 or +1."""
        if moved or not self.due:
            return moved
        return 1 if self.down else -1

    def tick(self, *, size: int, tick: bool, pi: int, moved: int, safe: bool, clear: bool) -> None:
        """Go on by one clock."""
        was, goal = self.due, self.goal(size)
        if was and not moved:
            self.due = False
            self.taken_up += 1 if self.down else -1
        elif tick and self.taken_up != goal:
            self.due = True
        if safe or (pi and (pi < 0) != self.down):
            self.due = False
        if pi:
            self.down = pi < 0
        if clear:
            self.taken_up, self.down, self.due = 0, False, False
