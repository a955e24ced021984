# SPDX-License-Identifier: Apache-2.0
"""Reference model of the small queue."""

from collections import deque
from dataclasses import dataclass, field


@dataclass
class EventQueue:
    """A bounded queue that refuses the newest."""

    depth: int
    entries: deque = field(default_factory=deque)

    def clock(self, *, push, data, pop):
        """Return ``(head or None, full, lost)`` of this clock, and go to the next."""
        head = self.entries[0] if self.entries else None
        full = len(self.entries) == self.depth
        lost = bool(push and full and not pop)
        if pop and self.entries:
            self.entries.popleft()
        if push and not lost:
            self.entries.append(data)
        return head, full, lost
