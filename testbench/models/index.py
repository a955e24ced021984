# SPDX-License-Identifier: Apache-2.0
"""Reference model of the coders' index: one place for each order."""

from collections import deque
from dataclasses import dataclass, field

__all__ = ["Index"]


@dataclass
class Index:
    """The last levels of one line, and whether a rise is asked for."""

    samples: int = 3
    level: int = 0
    wanted: bool = False
    seen: deque = field(default_factory=deque)

    def __post_init__(self):
        self.seen = deque([0] * self.samples, maxlen=self.samples)

    def tick(self, line: int, order: bool | None = None, safe: bool = False) -> bool:
        """Sample the line; True if the index has come.

        ``order`` is None, or whether the axis is in the order of this clock.
        """
        before = self.level
        self.seen.append(line)
        if len(set(self.seen)) == 1:
            self.level = line
        found = self.wanted and not safe and self.level > before
        if safe:
            self.wanted = False
        elif order is not None:
            self.wanted = order
        elif found:
            self.wanted = False
        return found
