# SPDX-License-Identifier: Apache-2.0
"""Reference model of the window of path segments: a list of lengths and a position."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from itertools import accumulate


@dataclass
class Window:
    """Where the machine is. ``lengths`` are those of segment 0 on; it stands at segment ``start``.

    The coordinate is 0 at the start of segment ``start``.
    """

    lengths: list[int]
    start: int = 0
    slots: int = 64
    position: int = 0
    front: int = 0
    moved: bool = False
    entered: list[int] = field(default_factory=list)  # segments, in the order of being entered

    def __post_init__(self):
        ends = list(accumulate(self.lengths, initial=0))
        self.borders = [end - ends[self.start] for end in ends]

    def segment(self, *, more: bool) -> int:
        """Segment the machine is in: at a border the next one, if the path goes on (``more``)."""
        if not self.moved:
            return self.start
        after = bisect_right if more else bisect_left
        return max(after(self.borders, self.position) - 1, 0)

    def slot(self, *, more: bool) -> int:
        return self.segment(more=more) % self.slots

    def pulse(self, step: int) -> tuple[int, int]:
        """Move by a pulse; return the segment it lies in and the place there, counted forwards."""
        low = min(self.position, self.position + step)
        segment = bisect_right(self.borders, low) - 1
        self.position += step
        self.moved = True
        self.front = max(self.front, self.position)
        return segment, low - self.borders[segment]

    def look(self, *, more: bool) -> int | None:
        """Time passes; return the segment that the front enters for the first time, if it does."""
        segment = self.segment(more=more)
        if more and self.position == self.front and segment not in self.entered:
            self.entered.append(segment)
            return segment
        return None
