# SPDX-License-Identifier: Apache-2.0
"""Cycles that touch the work: each yields the lines to send, and returns what it has found.

A cycle is a generator. It yields one line at a time, and receives what the controller reported
while it carried the line out: a ``Place``, or None. The caller waits for the answer to each line.
If a line is refused or an alarm comes, the caller closes the cycle, and no further line is sent.
``drive`` is such a caller, over a link; the panel has a loop of its own. What is wrong with the
words of a cycle is refused when it is made, by a ``UsageError``: before anything is sent.

Each surface is touched twice by G38.2. A quick touch finds it. The electrode goes back and comes
nearer again, and a slow touch measures. The gap conducts before electrode and work meet. So the
measured place lies before the surface by the *contact offset*: a few micrometres, which depend on
machine, electrode and fluid. It is calibrated once, by a hole or a boss of known diameter. It has
no effect on the middle of a hole or boss.

Lengths are in mm, feeds in mm/min, places in the machine frame. The lines set G21, G91 and G94.
"""

import re
from collections.abc import Callable, Generator
from dataclasses import dataclass, field

from host.errors import UsageError, UserError
from host.link.link import Link

__all__ = ["AXES", "Cycle", "Found", "Place", "Probe", "TouchError", "boss", "corner", "drive",
           "edge", "hole", "place_of"]

AXES = "XYZ"
_TOLD = re.compile(r"\[PRB:(-?[\d.]+),(-?[\d.]+),(-?[\d.]+):([01])\]")


class TouchError(UserError):
    """A cycle cannot go on."""


@dataclass(frozen=True)
class Place:
    """The report of a touch-off: where the axes stood, and whether there was contact."""

    x: float
    y: float
    z: float
    contact: bool

    def of(self, axis: str) -> float:
        """Coordinate of an axis."""
        return (self.x, self.y, self.z)[AXES.index(axis)]


@dataclass(frozen=True)
class Probe:
    """How to touch, and with what. Lengths in mm, feeds in mm/min.

    ``radius`` is that of the wire or of a round electrode, or half the width of a square one; it
    has an effect in X and Y only. ``offset`` is the contact offset. ``reach`` is the longest way of
    a quick touch, at the feed ``quick``. After a touch the electrode goes ``back``, which must be
    more than debris can bridge. The slow touch, at the feed ``slow``, begins at the distance
    ``near`` from the surface. Moves without measuring have the feed ``travel``, and keep the
    distance ``clear`` from the work.
    """

    radius: float = 0.0
    offset: float = 0.0
    reach: float = 5.0
    quick: float = 60.0
    slow: float = 2.0
    back: float = 0.4
    near: float = 0.06
    clear: float = 0.5
    travel: float = 300.0

    def __post_init__(self) -> None:
        if not 0 <= self.radius <= 500:
            raise UsageError(f"the radius must be 0 to 500 mm, not {self.radius:g}.")
        if not -0.1 <= self.offset <= 0.5:
            raise UsageError(f"the contact offset must be -0.1 to 0.5 mm, not {self.offset:g}.")
        if not 0.01 <= self.near < self.back <= self.reach <= 1000:
            raise UsageError("a touch needs 0.01 mm <= near < back <= reach <= 1000 mm, not "
                             f"{self.near:g}, {self.back:g} and {self.reach:g}.")
        if not 0 < self.slow <= self.quick <= 600 or not 0 < self.travel <= 600:
            raise UsageError("feeds of a touch must be above 0 and at most 600 mm/min, the slow "
                             "one not above the quick one.")

    def before(self, axis: str) -> float:
        """Distance from the axis's place to the surface that it touches, mm."""
        return self.offset + (self.radius if axis != "Z" else 0.0)


@dataclass(frozen=True)
class Found:
    """What a cycle has found.

    ``what`` is the shape, ``places`` the coordinate of the edge, corner or middle by axis, ``size``
    the diameter of a hole or boss, and ``told`` each of its sides, such as ``"X-"``.
    """

    what: str
    places: dict[str, float]
    size: float | None = None
    told: dict[str, float] = field(default_factory=dict)

    def offset(self, known: float, probe: Probe) -> float:
        """Contact offset with which the diameter would have been the known one."""
        if self.size is None:
            raise UsageError("the contact offset is calibrated by a hole or a boss.")
        wider = (known - self.size) / 2 * (1 if self.what == "hole" else -1)
        return probe.offset + wider


Cycle = Generator[str, Place | None, Found]
Part = Generator[str, Place | None, float]
Way = Generator[str, Place | None, None]


def place_of(line: str) -> Place | None:
    """The place in a line ``[PRB:…]`` of the controller; None for another line."""
    told = _TOLD.fullmatch(line)
    return told and Place(float(told[1]), float(told[2]), float(told[3]), told[4] == "1")


def _word(axis: str, way: float) -> str:
    return f"{axis}{way:.4f}"


def _move(probe: Probe, **ways: float) -> Way:
    """Move in a straight line; the contact guard watches."""
    words = " ".join(_word(axis, way) for axis, way in ways.items() if abs(way) >= 5e-5)
    if words:
        yield f"G21 G91 G94 G01 {words} F{probe.travel:g}"


def _back(probe: Probe, axis: str, way: int) -> Way:
    """Go back from a touch, and wait until the axis is there.

    The axis lags behind the path. A gap that is still bridged when the next move begins would end
    it by the contact guard.
    """
    yield from _move(probe, **{axis: -way * probe.back})
    yield "G04 P20"


def _touch(probe: Probe, axis: str, way: int) -> Part:
    """Touch quickly and slowly, and go ``back``; return the coordinate of the surface."""
    yield f"G21 G91 G94 G38.2 {_word(axis, way * probe.reach)} F{probe.quick:g}"
    yield from _back(probe, axis, way)
    yield from _move(probe, **{axis: way * (probe.back - probe.near)})
    place = yield f"G38.2 {_word(axis, way * 2 * probe.near)} F{probe.slow:g}"
    if place is None or not place.contact:
        raise TouchError(f"the controller reported no contact for the slow touch of {axis}.")
    yield from _back(probe, axis, way)
    return place.of(axis) + way * probe.before(axis)


def _check(axis: str, way: int) -> None:
    if axis not in AXES or len(axis) != 1 or way not in (1, -1):
        raise UsageError(f"a direction is X, Y or Z with + or -, not {axis}{way:+d}.")


def edge(probe: Probe, axis: str, way: int) -> Cycle:
    """Touch one surface. At the end the electrode stands ``back`` before it."""
    _check(axis, way)
    return _edge(probe, axis, way)


def _edge(probe: Probe, axis: str, way: int) -> Cycle:
    surface = yield from _touch(probe, axis, way)
    return Found("edge", {axis: surface})


def corner(probe: Probe, x_way: int, y_way: int, *, along: float = 2.0) -> Cycle:
    """Touch the two sides of an outer corner: one along X, then one along Y.

    With the ways +1 and +1 that is the corner of least X and least Y. The electrode starts beside
    the side that it touches along X; its middle is at most ``along`` from the corner. The cycle
    goes round the corner, and ends ``back`` before the other side.
    """
    _check("X", x_way)
    _check("Y", y_way)
    if not 0 < along <= 1000:
        raise UsageError("the way along a side must be above 0 and at most 1000 mm, not "
                         f"{along:g}.")
    out = along + probe.radius + probe.clear
    far = Probe(**{**vars(probe), "reach": max(probe.reach, out + probe.clear)})
    return _corner(probe, far, x_way, y_way, along, out)


def _corner(probe: Probe, far: Probe, x_way: int, y_way: int, along: float, out: float) -> Cycle:
    x = yield from _touch(probe, "X", x_way)
    yield from _move(probe, Y=-y_way * out)
    yield from _move(probe, X=x_way * (probe.back + probe.radius + along))
    y = yield from _touch(far, "Y", y_way)
    return Found("corner", {"X": x, "Y": y})


def _middle(first: float, second: float, told: dict[str, float], axis: str) -> float:
    told[f"{axis}-"], told[f"{axis}+"] = min(first, second), max(first, second)
    return (first + second) / 2


def hole(probe: Probe) -> Cycle:
    """Touch a hole from inside, along X and then along Y, and end in its middle.

    The start may be anywhere in the hole. The two places along X are the ends of a chord, so the
    middle between them is the X of the hole's middle. Y is then touched along a diameter.
    """
    told: dict[str, float] = {}
    places = {}
    for axis in "XY":
        above = yield from _touch(probe, axis, 1)
        below = yield from _touch(probe, axis, -1)
        places[axis] = _middle(above, below, told, axis)
        # The axis stands ``back`` and ``before`` above the coordinate of the lower side.
        yield from _move(probe, **{axis: places[axis] - (below + probe.before(axis) + probe.back)})
    return Found("hole", places, told["Y+"] - told["Y-"], told)


def boss(probe: Probe, size: float, *, lift: float = 0.0) -> Cycle:
    """Touch a boss or a block from outside, along X and then along Y.

    ``size`` is roughly its diameter. With a ``lift`` the electrode starts above the boss, roughly
    over its middle; it goes down by ``lift`` beside each side, and ends over the middle. Without a
    lift it goes round the boss. It then starts on the side of least X, ``clear`` before it and
    roughly on the line through the middle, and ends beside the side of least Y.
    """
    if not 0 < size <= 1000 or not 0 <= lift <= 1000:
        raise UsageError(f"a boss needs a size above 0 and a lift of 0 or more, both at most 1000 "
                         f"mm, not {size:g} and {lift:g}.")
    half = size / 2 + probe.radius + probe.clear   # from the middle to where a touch begins
    return _over(probe, half, lift) if lift else _round(probe, half)


def _beside(probe: Probe, axis: str, way: int, lift: float) -> Part:
    """Go down, touch, and go up again; the electrode stands ``back`` before the surface."""
    yield from _move(probe, Z=-lift)
    surface = yield from _touch(probe, axis, way)
    yield from _move(probe, Z=lift)
    return surface


def _over(probe: Probe, half: float, lift: float) -> Cycle:
    told: dict[str, float] = {}
    places = {}
    for axis in "XY":
        yield from _move(probe, **{axis: -half})
        below = yield from _beside(probe, axis, 1, lift)
        yield from _move(probe, **{axis: 2 * half})
        above = yield from _beside(probe, axis, -1, lift)
        places[axis] = _middle(above, below, told, axis)
        yield from _move(probe, **{axis: places[axis]
                                   - (above + probe.before(axis) + probe.back)})
    return Found("boss", places, told["Y+"] - told["Y-"], told)


def _round(probe: Probe, half: float) -> Cycle:
    told: dict[str, float] = {}
    below = yield from _touch(probe, "X", 1)
    # Go round the side of greatest Y to that of greatest X.
    yield from _move(probe, X=probe.back - probe.clear)
    yield from _move(probe, Y=half)
    yield from _move(probe, X=2 * half)
    yield from _move(probe, Y=-half)
    above = yield from _touch(probe, "X", -1)
    x = _middle(above, below, told, "X")
    stands = above + probe.before("X") + probe.back
    yield from _move(probe, X=probe.clear - probe.back)
    yield from _move(probe, Y=half)
    yield from _move(probe, X=x - (stands + probe.clear - probe.back))
    above = yield from _touch(probe, "Y", -1)
    yield from _move(probe, Y=probe.clear - probe.back)
    yield from _move(probe, X=half)
    yield from _move(probe, Y=-2 * half)
    yield from _move(probe, X=-half)
    below = yield from _touch(probe, "Y", 1)
    y = _middle(above, below, told, "Y")
    return Found("boss", {"X": x, "Y": y}, told["Y+"] - told["Y-"], told)


def drive(link: Link, cycle: Cycle, *, tell: Callable[[str], None] | None = None) -> Found:
    """Carry out a cycle over a link. Nobody else may use the link meanwhile.

    Raises
    ------
    LinkError
        If the controller refuses a line, as after an alarm, or does not answer.
    TouchError
        If the cycle cannot go on.
    """
    told: list[Place] = []
    inner = link.on_line

    def hear(line: str) -> None:
        if place := place_of(line):
            told.append(place)
        inner(line)

    link.on_line = hear
    try:
        line = next(cycle)
        while True:
            told.clear()
            if tell is not None:
                tell(line)
            link.command(line)
            # A touch-off tells its place before its answer.
            line = cycle.send(told[-1] if told else None)
    except StopIteration as end:
        found: Found = end.value
        return found
    finally:
        link.on_line = inner
