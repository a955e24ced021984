# SPDX-License-Identifier: Apache-2.0
"""Model of the wire offset (G40, G41, G42): the path beside a programmed one, in floating point.

Points are complex numbers, in pulses, the first axis of the plane being real. A path is a list of
elements; the one beside it begins and ends beside its first and last point, goes round outer
corners in arcs of the offset, and is cut off where two offset curves meet inside a corner: where
they do so more than once, at the point nearest to the corner.

Ref: docs/reference/programs.md. Written from the rules, not from the firmware.
"""

import cmath
from dataclasses import dataclass, replace
from math import pi

JOINED = 2      # pulses: offset ends so close are joined midway
LEAST = 4       # pulses of radius that an arc keeps, its ends being rounded
ALIKE = 16      # pulses: an arc back whose radius differs by no more is the same one


class NoOffsetError(Exception):
    """There is no path beside this one."""


@dataclass(frozen=True)
class Element:
    """A line (``turn`` 0) or an arc: 1 counter-clockwise, -1 clockwise.

    Ends that are joined midway may lie a little off the arc: its radius is what it is.
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
        """Of the way along the element."""
        return self.reach(self.end) if self.turn else abs(self.end - self.start)

    def reach(self, point: complex) -> float:
        """Way from the start to a point of the element; below zero before the start of a line."""
        if not self.turn:
            unit = (self.end - self.start) / abs(self.end - self.start)
            return ((point - self.start) * unit.conjugate()).real
        turned = (point - self.centre) / (self.start - self.centre)
        angle = cmath.phase(turned) * self.turn % (2 * pi)
        if point == self.end and angle * self.radius < 1e-6:
            angle = 2 * pi
        return angle * self.radius

    def at(self, way: float) -> complex:
        """Point after a way."""
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
        """The element beside this one, to the left (``side`` 1) or right (-1)."""
        radius = self.radius - side * self.turn * offset
        if self.turn and radius < (LEAST if offset else 1):
            raise NoOffsetError("radius")
        start, end = (p + 1j * side * offset * self.tangent(p) for p in (self.start, self.end))
        return replace(self, start=start, end=end, radius=radius)


def _crossings(a: Element, b: Element) -> list[complex]:
    """Points that the lines or circles of two elements have in common."""
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
    """The path beside a path, corners included.

    Raises
    ------
    NoOffsetError
        If an arc keeps no radius, two neighbours do not meet, or nothing is left of an element.
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
            # A cusp: the bends open it to one side, whatever the last place makes of the angle.
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
