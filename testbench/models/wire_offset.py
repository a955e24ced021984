# SPDX-License-Identifier: Apache-2.0
"""Model of the wire offset (G40, G41, G42): the path beside a programmed one, in floating point.

Points are complex numbers, in pulses; the first axis of the plane is real. A path is a list of
elements. The offset path begins and ends beside the first and last point of the path. It goes round
outer corners in arcs with the offset as radius. Inside a corner it is cut off at the intersection
of the two offset curves; if there are several, at the one nearest to the corner.

Ref: docs/reference/programs.md. Written from the rules, not from the firmware.
"""

import cmath
from dataclasses import dataclass, replace
from math import pi

JOINED = 2      # pulses: greatest distance at which offset ends are joined in the middle
LEAST = 4       # pulses: smallest radius of an offset arc, as its ends are rounded
ALIKE = 16      # pulses: greatest difference of radius at which an arc back counts as the same


class NoOffsetError(Exception):
    """The path has no offset path."""


@dataclass(frozen=True)
class Element:
    """A line (``turn`` 0) or an arc: 1 counter-clockwise, -1 clockwise.

    Ends that are joined in the middle may lie a little off the arc; the radius does not change.
    """

    start: complex
    end: complex
    turn: int = 0
    centre: complex = 0j
    radius: float = 0.0

    @property
    def bend(self) -> float:
        """Curvature to the left, 1/pulse."""
        return self.turn / self.radius if self.turn else 0.0

    @property
    def length(self) -> float:
        """Length of the element."""
        return self.reach(self.end) if self.turn else abs(self.end - self.start)

    def reach(self, point: complex) -> float:
        """Length from the start to a point of the element; negative before the start of a line."""
        if not self.turn:
            unit = (self.end - self.start) / abs(self.end - self.start)
            return ((point - self.start) * unit.conjugate()).real
        turned = (point - self.centre) / (self.start - self.centre)
        angle = cmath.phase(turned) * self.turn % (2 * pi)
        if point == self.end and angle * self.radius < 1e-6:
            angle = 2 * pi
        return angle * self.radius

    def at(self, way: float) -> complex:
        """Point at a length from the start."""
        if not self.turn:
            return self.start + way * (self.end - self.start) / abs(self.end - self.start)
        turned = cmath.exp(1j * self.turn * way / self.radius)
        return self.centre + (self.start - self.centre) * turned

    def tangent(self, point: complex) -> complex:
        """Direction of the motion at a point."""
        if not self.turn:
            return (self.end - self.start) / abs(self.end - self.start)
        radius = point - self.centre
        return 1j * self.turn * radius / abs(radius)

    def distance(self, point: complex) -> float:
        """Distance of a point from the element."""
        ends = min(abs(point - self.start), abs(point - self.end))
        if self.turn:
            if point == self.centre:
                return self.radius
            foot = self.centre + (point - self.centre) / abs(point - self.centre) * self.radius
            return abs(point - foot) if self.reach(foot) <= self.length else ends
        along = self.reach(point)
        return abs(point - self.at(along)) if 0 <= along <= self.length else ends

    def beside(self, offset: float, side: int) -> "Element":
        """The offset element, to the left (``side`` 1) or right (-1)."""
        radius = self.radius - side * self.turn * offset
        if self.turn and radius < (LEAST if offset else 1):
            raise NoOffsetError("radius")
        start, end = (p + 1j * side * offset * self.tangent(p) for p in (self.start, self.end))
        return replace(self, start=start, end=end, radius=radius)


def _crossings(a: Element, b: Element) -> list[complex]:
    """Intersections of the lines or circles of two elements."""
    if not a.turn and not b.turn:
        u, v = a.tangent(a.start), b.tangent(b.start)
        cross = (u.conjugate() * v).imag
        way = ((b.start - a.start).conjugate() * v).imag / cross if cross else None
        return [] if way is None else [a.start + way * u]
    if a.turn and b.turn:
        w = b.centre - a.centre
        if not w:
            return []
        along = (abs(w) ** 2 + a.radius ** 2 - b.radius ** 2) / (2 * abs(w))
        unit = 1j * w / abs(w)
        square, foot = a.radius ** 2 - along ** 2, a.centre - 1j * along * unit
    else:
        line, arc = (b, a) if a.turn else (a, b)
        unit = line.tangent(line.start)
        foot = line.start + unit * ((arc.centre - line.start) * unit.conjugate()).real
        square = arc.radius ** 2 - abs(foot - arc.centre) ** 2
    return [] if square < 0 else [foot + square ** 0.5 * unit, foot - square ** 0.5 * unit]


def beside(path: list[Element], offset: float, side: int) -> list[Element]:
    """The offset path of a path, corners included.

    Raises
    ------
    NoOffsetError
        If the offset does not fit into an arc, two neighbours do not meet, or an element vanishes.
    """
    result = []
    for number, programmed in enumerate(path):
        element = programmed.beside(offset, side)
        if not result:
            result.append(element)
            continue
        before, corner = result[-1], programmed.start
        turn = path[number - 1].tangent(corner).conjugate() * programmed.tangent(corner)
        outside = turn.imag * side <= 0
        if turn.real < 0:
            # At a cusp the curvatures decide on which side it opens, as the angle is mere rounding.
            bows = [e.turn * e.radius for e in (path[number - 1], programmed)]
            bend = path[number - 1].bend + programmed.bend
            if any(bows) and abs(sum(bows)) <= ALIKE:
                outside |= abs(turn.imag * bows[0]) <= ALIKE
            elif turn.imag**2 < 2 * abs(bend):
                outside = bend * side > 0
        gap = element.start - before.end
        if not offset or (max(abs(gap.real), abs(gap.imag)) <= JOINED and turn.real > 0):
            middle = (before.end + element.start) / 2
            result[-1], element = replace(before, end=middle), replace(element, start=middle)
        elif outside:
            turn = -side if offset >= LEAST else 0
            result.append(Element(before.end, element.start, turn, corner, offset))
        else:
            both = [point for point in _crossings(before, element)
                    if 0 <= before.reach(point) <= before.length
                    and 0 <= element.reach(point) <= element.length
                    and not (before.turn and before.length - before.reach(point)
                             > pi * before.radius)
                    and not (element.turn and element.reach(point) > pi * element.radius)]
            if not both:
                raise NoOffsetError("corner")
            point = max(both, key=before.reach)
            result[-1], element = replace(before, end=point), replace(element, start=point)
        result.append(element)
    return result
