# SPDX-License-Identifier: Apache-2.0
"""Reference model of arcs: the gateware's recurrence by pulses, and the curve it must follow."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["FINE", "Curve", "Piece", "Place"]

FINE = 64   # parts of a pulse in which a centre is given


@dataclass
class Place:
    """State of the distributor in a piece.

    ``remainder`` and ``pace`` belong to the major axis, ``error`` to the minor one. ``steps`` are
    the steps of each axis from the start of the piece.
    """

    remainder: int
    pace: int
    error: int
    along: int
    across: int
    steps: list[int]


@dataclass(frozen=True)
class Piece:
    """A segment of the path as written to the gateware.

    ``start`` and ``end`` are pace, error, along and across at its ends.
    """

    length: int
    travel: tuple[int, int, int]
    arc: bool
    outward: bool
    major: int
    minor: int
    shift: int
    change: int
    start: tuple[int, int, int, int]
    end: tuple[int, int, int, int]

    def enter(self, *, back: bool = False) -> Place:
        """Stand at the start, or at the end."""
        steps = list(self.travel) if back else [0, 0, 0]
        return Place(0, *(self.end if back else self.start), steps)

    def _sign(self, axis):
        return -1 if self.travel[axis] < 0 else 1

    def third(self, count: int, axis: int) -> int:
        """Steps of an axis that runs as a line, after ``count`` path pulses."""
        steps = (2 * count * abs(self.travel[axis]) + self.length) // (2 * self.length)
        return self._sign(axis) * steps

    def forward(self, place: Place) -> tuple[bool, bool]:
        """One path pulse; whether the major and the minor axis step."""
        whole = self.length << self.shift
        place.remainder += 2 * place.pace
        place.pace += self.change
        if place.remainder < whole:
            return False, False
        place.remainder -= 2 * whole
        place.error += place.along + FINE
        place.along += 2 * FINE
        middle = place.error + place.across // 2 + FINE // 4
        step = middle < 0 if self.outward else middle >= 0
        place.steps[self.major] += self._sign(self.major)
        if step:
            place.error += place.across + FINE
            place.across += 2 * FINE
            place.steps[self.minor] += self._sign(self.minor)
        return True, step

    def backward(self, place: Place) -> tuple[bool, bool]:
        """One path pulse back."""
        whole = self.length << self.shift
        place.pace -= self.change
        place.remainder -= 2 * place.pace
        if place.remainder >= -whole:
            return False, False
        place.remainder += 2 * whole
        place.error -= place.along - FINE
        place.along -= 2 * FINE
        middle = place.error - place.across // 2 + FINE // 4
        step = middle >= 0 if self.outward else middle < 0
        place.steps[self.major] -= self._sign(self.major)
        if step:
            place.error -= place.across - FINE
            place.across -= 2 * FINE
            place.steps[self.minor] -= self._sign(self.minor)
        return True, step

    def walk(self) -> Iterator[tuple[int, int, int]]:
        """Steps of the axes after every path pulse, from the start."""
        place = self.enter()
        for count in range(1, self.length + 1):
            if self.arc:
                self.forward(place)
            yield tuple(place.steps[axis] if self.arc and axis in (self.major, self.minor)
                        else self.third(count, axis) for axis in range(3))


class Curve:
    """The arc itself, in pulses of its plane: the radius is linear in the angle.

    ``delta`` is its end, ``centre`` the centre in 1/64 pulse, both by axis of the plane. Angles and
    lengths are floats: at the largest radius, 1e7 pulses, they are exact to 1e-8 pulse.
    """

    def __init__(self, delta, centre, *, ccw):
        self.ccw = ccw
        self.turned = 1 if ccw else -1
        self.fine = tuple(centre)
        self.centre = (centre[0] / FINE, self.turned * centre[1] / FINE)
        end = (delta[0], self.turned * delta[1])
        self.start_angle, self.start_radius = self._polar((0, 0))
        angle, self.end_radius = self._polar(end)
        self.sweep = (angle - self.start_angle) % math.tau
        if delta[0] == delta[1] == 0 or self.sweep == 0:
            self.sweep = math.tau
        self.growth = (self.end_radius - self.start_radius) / self.sweep

    def _polar(self, at):
        x, y = at[0] - self.centre[0], at[1] - self.centre[1]
        return math.atan2(y, x), math.hypot(x, y)

    @property
    def length(self) -> float:
        """Length of the arc."""
        return self.length_to(self.sweep)

    def length_to(self, swept: float) -> float:
        """Length from the start: Simpson's rule, plenty for so small a growth."""
        def speed(angle):
            return math.hypot(self.start_radius + self.growth * angle, self.growth)
        return swept * (speed(0) + 4 * speed(swept / 2) + speed(swept)) / 6

    def swept(self, at, near: float) -> float:
        """Angle from the start to a place, of those a turn apart the one next to ``near``."""
        angle, _ = self._polar((at[0], self.turned * at[1]))
        angle -= self.start_angle
        return angle + round((near - angle) / math.tau) * math.tau

    def radius(self, swept: float) -> float:
        """Radius there."""
        return self.start_radius + self.growth * swept

    def point(self, swept: float) -> tuple[float, float]:
        """Place on the curve."""
        angle, radius = self.start_angle + swept, self.radius(swept)
        return (self.centre[0] + radius * math.cos(angle),
                self.turned * (self.centre[1] + radius * math.sin(angle)))

    def tangent(self, swept: float) -> tuple[float, float]:
        """Direction of travel there."""
        angle, radius = self.start_angle + swept, self.radius(swept)
        x = self.growth * math.cos(angle) - radius * math.sin(angle)
        y = self.growth * math.sin(angle) + radius * math.cos(angle)
        size = math.hypot(x, y)
        return x / size, self.turned * y / size

    def distance(self, at, near: float) -> float:
        """Distance of a place from the curve, whose slope against the circle counts."""
        _, radius = self._polar((at[0], self.turned * at[1]))
        swept = min(max(self.swept(at, near), 0), self.sweep)
        off = abs(radius - self.radius(swept))
        return off / math.hypot(1, self.growth / self.radius(swept))

    def at_major(self, axis: int, place: float, near: float) -> float:
        """Angle next to ``near`` at which the curve passes a coordinate of an axis."""
        swept = near
        for _ in range(50):
            tangent = self.tangent(swept)[axis]
            off = place - self.point(swept)[axis]
            step = off / tangent / self.radius(swept)
            swept += step
            if abs(step) < 1e-14:
                break
        return swept

    def bound(self, piece: Piece, axes: tuple[int, int], start, near: float,
              turn: float) -> float:
        """Greatest allowed distance of a piece's places from the curve, by the piece's words.

        On a circle it is half a pulse. If the radius changes, the place is half a pulse off along
        the minor axis: half a pulse times the cosine of the angle to the major axis, plus the
        curvature within it. To this is added the error of the words' radius at the piece's flatter
        end and, in proportion to the angle from there: its further error at the other end, and the
        difference of two squares of the radius, one linear in the major axis, the other of a radius
        linear in the angle. In a chain, below 32 pulses of radius, it is twice the shortfall of a
        step's angle. See ``softcore/firmware/path/arc.h``.

        Parameters
        ----------
        piece, axes
            The piece, and the axes of its plane.
        start
            Its first place, by axis.
        near : float
            Approximate angle of that place.
        turn : float
            Approximate angle of a path pulse.

        Raises
        ------
        AssertionError
            If the error of the words' radius is more than firmware may cause where the axes
            exchange their roles.
        """
        if not self.growth:
            return 0.5
        if not piece.arc:
            return 0.5 + 2 * (0.005 * abs(self.growth) + 1e-4)
        least = min(self.start_radius, self.end_radius)
        major = axes.index(piece.major)
        ends = []
        for steps, (_, error, _, _) in (((0, 0, 0), piece.start), (piece.travel, piece.end)):
            at = [start[axis] + steps[axis] for axis in axes]
            x, y = (FINE * value - centre for value, centre in zip(at, self.fine, strict=True))
            swept = self.at_major(major, at[major], self.swept(at, near))
            tangent = self.tangent(swept)
            ends.append((math.atan2(abs(tangent[not major]), abs(tangent[major])),
                         math.sqrt(x ** 2 + y ** 2 - FINE * error) / FINE - self.radius(swept)))
            near += piece.length * turn
        (flat, off), (steep, other) = sorted(ends)
        angle = steep - flat
        assert max(abs(off), abs(other)) <= 0.02 + 1 / least, (off, other)
        chord = math.sin(steep) - math.sin(flat)
        if not chord:
            return 0.5 + abs(off)
        leans = abs(other - off) / angle + abs(self.growth * (1 - angle * math.cos(flat) / chord))
        worst = min(max(flat, leans / (0.5 - 0.25 / least)), steep)
        return max(0.5, 0.5 * math.cos(worst) + worst ** 2 / (8 * least)
                   + abs(off) + leans * (worst - flat))
