# SPDX-License-Identifier: Apache-2.0
"""Contours with the discharge off: how far the coders leave the programmed path."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from softcore.tables.settings import assign
from testbench.cosim.job import Job
from testbench.native.station import Session

__all__ = ["CORNER_MM", "FEED", "START_S", "Deviation", "Shape", "circle", "deviation", "rounded",
           "square"]

FEED = 600              # mm/min
START_S = 0.05          # after a start, before which a deviation does not count
LOOK_S = 2e-4           # between two places: 2 um at the feed
CORNER_MM = 0.5         # along the path from a sharp corner: what lies nearer belongs to the corner
UM = 10                 # pulses

Point = tuple[float, float]


@dataclass(frozen=True)
class Piece:
    """A line from ``begin`` to ``end`` or, with ``centre``, an arc counter-clockwise; in mm."""

    begin: Point
    end: Point
    centre: Point | None = None

    def block(self) -> str:
        """The block of a tape, absolute."""
        word = f"X{self.end[0]:g} Y{self.end[1]:g}"
        if self.centre is None:
            return f"G01 {word}"
        return f"G03 {word} I{self.centre[0] - self.begin[0]:g} J{self.centre[1] - self.begin[1]:g}"

    def away_mm(self, place: Point) -> float:
        """Distance of a place from the piece."""
        ends = min(math.dist(place, self.begin), math.dist(place, self.end))
        if self.centre is None:
            along = [b - a for a, b in zip(self.begin, self.end, strict=True)]
            from_begin = [p - a for a, p in zip(self.begin, place, strict=True)]
            length = math.hypot(*along)
            foot = sum(a * b for a, b in zip(along, from_begin, strict=True)) / length
            if not 0 < foot < length:
                return ends
            return abs(along[0] * from_begin[1] - along[1] * from_begin[0]) / length

        def angle(point: Point) -> float:
            return math.atan2(*(p - c for p, c in zip(reversed(point), reversed(self.centre),
                                                      strict=True)))
        sweep = (angle(self.end) - angle(self.begin)) % math.tau or math.tau
        if (angle(place) - angle(self.begin)) % math.tau > sweep:
            return ends
        return abs(math.dist(place, self.centre) - math.dist(self.begin, self.centre))


@dataclass(frozen=True)
class Shape:
    """A path of pieces from zero on, and its sharp corners."""

    pieces: tuple[Piece, ...]
    corners: tuple[Point, ...] = ()


@dataclass(frozen=True)
class Deviation:
    """Greatest distance of the coders from the path, um: of its course, and about its corners."""

    course: float
    corners: float


def circle(radius_mm: float, turns: int = 1) -> Shape:
    """A full circle through zero, so many times."""
    return Shape((Piece((0, 0), (0, 0), (-radius_mm, 0)),) * turns)


def square(side_mm: float) -> Shape:
    """A square with sharp corners: three of them lie between its sides."""
    places = [(0, 0), (side_mm, 0), (side_mm, side_mm), (0, side_mm), (0, 0)]
    return Shape(tuple(map(Piece, places, places[1:])), tuple(places[1:-1]))


def rounded(side_mm: float, radius_mm: float) -> Shape:
    """A square whose sides join tangent arcs: it begins in the middle of the lower side."""
    half, arm = side_mm / 2, side_mm / 2 - radius_mm
    pieces: list[Piece] = []
    at: Point = (0, 0)
    for quarter in range(4):
        def turned(x: float, y: float, turns: int = quarter) -> Point:
            for _ in range(turns):
                x, y = -y, x
            return x, y + half
        begin, end = turned(arm, -half), turned(half, -arm)
        pieces += [Piece(at, begin), Piece(begin, end, turned(arm, -arm))]
        at = end
    return Shape((*pieces, Piece(at, (0, 0))))


def deviation(session: Session, shape: Shape, *lines: str) -> Deviation:
    """Run a shape at ``FEED`` with the discharge off; how far the coders leave it.

    Parameters
    ----------
    session : Session
        The controller, switched on.
    shape : Shape
        The path.
    lines : str
        Settings, entered by hand first. The bound of speed on arcs is off.
    """
    job = Job(session, assign("arc_deviation_nm", 0), *lines, watched=())
    blocks: Iterable[str] = (piece.block() for piece in shape.pieces)
    job.start("\n".join(["%", f"G21 G90 G94 F{FEED}", "G04 P60", *blocks, "M02", "%", ""]))
    job.until(lambda: job.probe("path_command"), "a start", step=100)
    start = session.cycle
    course = corners = 0.0
    while not job.told("program_end"):
        assert not job.told("alarm"), job.told("alarm")
        job.run(round(LOOK_S * session.clock_hz))
        places = session.positions()
        place = places["x"] / UM / 1000, places["y"] / UM / 1000
        away = 1000 * min(piece.away_mm(place) for piece in shape.pieces)
        if any(math.dist(place, one) < CORNER_MM for one in shape.corners):
            corners = max(corners, away)
        elif session.cycle - start > START_S * session.clock_hz:
            course = max(course, away)
    return Deviation(course, corners)
