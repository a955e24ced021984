# SPDX-License-Identifier: Apache-2.0
"""Reference model of a piece of an arc, in exact integers: closed forms of the path pulse."""

import math
from dataclasses import dataclass
from functools import lru_cache

FINE = 64  # parts of a pulse in which a piece lies about its centre


@dataclass(frozen=True)
class State:
    """State with which a piece is entered: pace, error and its slopes along and across."""

    pace: int
    error: int
    along: int
    across: int


@dataclass(frozen=True)
class Piece:
    """A piece of an arc: ``major`` steps in ``length`` path pulses, ``minor`` steps across."""

    length: int
    divisor: int
    change: int
    outward: bool
    start: State
    major: int
    minor: int
    radius: float = 0.0   # in pulses, and the start about the centre: for geometry only
    centre: tuple = (0.0, 0.0)
    signs: tuple = (1, 1)

    def pace(self, pulses: int) -> int:
        """Major steps owed after so many path pulses, times the divisor."""
        return pulses * self.start.pace + self.change * (pulses * (pulses - 1) // 2)

    def steps(self, pulses: int) -> tuple[int, int]:
        """Steps on the major and the minor axis after so many path pulses."""
        major = (2 * self.pace(pulses) + self.divisor) // (2 * self.divisor)
        return major, self.across(major)

    def error(self, major: int, minor) -> int:
        """Times 4: how far outside the curve a place is; ``minor`` may be a half."""
        twice = round(2 * minor)
        start = self.start
        return (4 * (start.error + major * start.along + FINE * major * major)
                + 2 * twice * start.across + FINE * twice * twice)

    def across(self, major: int) -> int:
        """The outer of two neighbours if the curve passes beyond their midpoint, else the inner."""
        return _across(self, major)

    def state(self, pulses: int) -> State:
        """State after so many path pulses."""
        major, minor = self.steps(pulses)
        error = self.error(major, minor)
        assert error % 4 == 0
        return State(self.start.pace + pulses * self.change, error // 4,
                     self.start.along + 2 * FINE * major, self.start.across + 2 * FINE * minor)


@lru_cache(maxsize=100_000)
def _across(piece, major):
    minor = 0
    if major > 0:
        minor = _across(piece, major - 1) if major < 500 or major % 500 else 0
    while True:
        beyond = piece.error(major, minor + 0.5)
        if (beyond < 0) != piece.outward:
            return minor
        minor += 1


def circle_piece(rng, radius: float, *, longest: int = 10**9) -> Piece:
    """A random piece of a circle of so many pulses' radius, within one octant.

    The pace at its start and end is the cosine of the slope there; between them it is linear.
    """
    fine = [rng.randrange(FINE) for _ in range(2)]
    r = round(radius * FINE)
    edge = radius / math.sqrt(2)
    while True:
        a, b = sorted(rng.uniform(-edge, edge) for _ in range(2))
        if a * b < 0:
            a, b = (0, b) if rng.random() < 0.5 else (a, 0)
        first, last = (a, b) if rng.random() < 0.5 else (b, a)
        x0, x1 = (round(first - fine[0] / FINE), round(last - fine[0] / FINE))
        if abs(x1 - x0) > longest:
            x1 = x0 + longest * (1 if x1 > x0 else -1)
        # All of it lies on one side of the middle, and within the octant.
        xs = [FINE * x + fine[0] for x in (x0, x1)]
        if xs[0] * xs[1] >= 0 and max(map(abs, xs)) * math.sqrt(2) <= r and x0 != x1:
            break
        if radius < 9:
            fine = [rng.randrange(FINE) for _ in range(2)]

    def height(x):
        """Nearest y to the circle above x: the outer if the curve passes beyond the midpoint."""
        y = (math.isqrt(r * r - x * x) - fine[1]) // FINE - 1
        while (FINE * y + FINE // 2 + fine[1]) ** 2 + x * x < r * r:
            y += 1
        return y

    y0, y1 = height(xs[0]), height(xs[1])
    ys = [FINE * y + fine[1] for y in (y0, y1)]
    sx, sy = (1 if x1 > x0 else -1), (1 if y1 > y0 else -1)
    if y0 == y1:
        sy = 1 if abs(xs[1]) < abs(xs[0]) else -1
    side = rng.choice((1, -1))  # the same below the centre
    major, minor = abs(x1 - x0), abs(y1 - y0)
    slopes = [math.asin(min(1, abs(x) / r)) for x in xs]
    length = max(major, round(radius * abs(slopes[1] - slopes[0])))
    shift = min(15, 29 - length.bit_length())
    divisor = length << shift
    change = round(divisor * (math.cos(slopes[1]) - math.cos(slopes[0])) / length)
    if length % 2 == 0:
        change -= change % 2
    pace = (major << shift) - change * (length - 1) // 2
    over = max(pace, pace + length * change) - divisor
    under = -min(pace, pace + length * change)
    if over > 0 or under > 0:  # a few pulses only: evenly
        change, pace = 0, major << shift
    error = round((xs[0] ** 2 + ys[0] ** 2 - r * r) / FINE)
    start = State(pace, error, 2 * sx * xs[0], 2 * sy * ys[0])
    return Piece(length, divisor, change, sy > 0, start, major, minor, r / FINE,
                 (xs[0] / FINE, ys[0] / FINE), (sx, sy * side))
