# SPDX-License-Identifier: Apache-2.0
"""Reference model of the velocity feed-forward, in exact integers."""

from dataclasses import dataclass, field

LEAD_BITS = 27
TURN = 19               # clocks of an axis
FIRST = 1 + LEAD_BITS   # clock of a round in which the first axis is read
FULL_SCALE = 32767
FASTEST = (1 << 17) - 1  # quarters of a pulse


@dataclass(frozen=True)
class Words:
    """The segment and the place on it; ``travel`` is signed."""

    length: int = 1
    travel: tuple[int, ...] = (0, 0, 0)
    arc: bool = False
    major: int = 0
    minor: int = 1
    divisor: int = 1
    pace: int = 0
    along: int = 0
    across: int = 0


def magnitude(slope: int) -> int:
    """Size of a slope, one less below 0."""
    return slope if slope >= 0 else -slope - 1


def shared(speed: int, part: int, whole: int) -> int:
    """2**16 times a share of a speed; a share is a number of 2**-16, and at most 1."""
    if whole == 0:
        return speed * ((1 << 17) - 1)
    return speed * (min(part, whole) * (1 << 16) // whole)


def path_speed(rate: int, lead: int) -> int:
    """Speed along the path, in quarters of a pulse of Er."""
    return min(rate * lead * 4 // (1 << 32), FASTEST)


@dataclass
class FeedForward:
    """Call ``tick`` for every clock; ``speed`` is then that of the axes."""

    axes: int = 3
    speed: list[int] = field(default_factory=lambda: [0, 0, 0])
    lead: int = 0
    clock: int = 0       # of the round under way
    fetched: int = 0     # clocks since the segment has been ready
    rate: int = 0
    back: bool = False
    major: int = 0       # speed of the axis that came first, in quarters
    turn: tuple = (0, 0)

    def tick(self, words: Words, *, rate=0, reverse=False, lead=0, ready=True) -> None:
        """Go on by one clock."""
        self.fetched = self.fetched + 1 if ready else 0
        if self.clock == 0:
            self.rate, self.back = rate, reverse
        index, phase = divmod(self.clock - FIRST, TURN)
        if index >= 0 and phase == 0:
            self.turn = self._read(words, index)
        elif index >= 0 and phase == TURN - 1:
            self._put(words, index)
        going = self.clock + 1 < FIRST + 3 * TURN
        self.clock = self.clock + 1 if going and self.fetched > 2 and rate else 0
        if rate == 0:
            self.speed = [0, 0, 0]
            self.lead = lead

    def _read(self, words, index):
        """Axis, and 2**16 times its speed."""
        path = path_speed(self.rate, self.lead)
        axis = index
        if words.arc:
            axis = (words.major, words.minor, (3 - words.major - words.minor) % 4)[index]
            if index == 0:
                return axis, shared(path, words.pace, words.divisor)
            if index == 1:
                return axis, shared(self.major, magnitude(words.along), magnitude(words.across))
        travel = words.travel[axis] if axis < self.axes else 0
        return axis, shared(path, abs(travel), words.length)

    def _put(self, words, index):
        axis, total = self.turn
        if index == 0:
            self.major = min(total >> 16, FASTEST)
        size = min((total + (1 << 17)) >> 18, FULL_SCALE)
        if axis < self.axes:
            down = words.travel[axis] < 0
            self.speed[axis] = -size if down != self.back else size
