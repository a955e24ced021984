# SPDX-License-Identifier: Apache-2.0
"""The path that a tape programs, for a picture: points, each with the line that it belongs to.

The controller's own interpreter decides where the machine goes. This one reads only the words that
draw a path (G00 to G03, G90, G91, G20, G21; X, Y, Z, I, J), without wire offset and with arcs in
the plane of X and Y, and ignores whatever else stands there.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

__all__ = ["Outline", "outline"]

_WORD = re.compile(r"([A-Z])\s*([+-]?\d*\.?\d*)")
_COMMENT = re.compile(r"\([^)]*\)?")
INCH_MM = 25.4
STEP = math.radians(6)      # of an arc, between two points
LONGEST = 5000              # points; a longer path is drawn to there


@dataclass(frozen=True)
class Outline:
    """A path as points.

    ``points`` are X, Y, Z in mm in the frame of the program, and the line of the source, from 1.
    ``rapid`` says of each point whether it is reached by G00.
    """

    points: list[tuple[float, float, float, int]] = field(default_factory=list)
    rapid: list[bool] = field(default_factory=list)


def outline(lines: Sequence[str]) -> Outline:
    """The programmed path of a tape, from where its first move begins: zero."""
    made = Outline([(0.0, 0.0, 0.0, 0)], [True])
    place = [0.0, 0.0, 0.0]
    motion, incremental, scale = 0, False, 1.0
    for number, text in enumerate(lines, start=1):
        words = [(letter, float(value)) for letter, value in _WORD.findall(
            _COMMENT.sub("", text.upper())) if any(char.isdigit() for char in value)]
        codes = {int(value) for letter, value in words if letter == "G" and value.is_integer()}
        for code in codes:
            motion = code if code in (0, 1, 2, 3) else motion
            incremental = code == 91 if code in (90, 91) else incremental
            scale = (INCH_MM if code == 20 else 1.0) if code in (20, 21) else scale
        if codes & {4, 10, 28, 30, 36, 38, 39, 92}:
            continue    # their words are no path
        given = {letter: value * scale for letter, value in words if letter in "XYZIJ"}
        if not given or len(made.points) > LONGEST:
            continue
        target = [given.get(axis, 0.0) + place[index] if incremental else
                  given.get(axis, place[index]) for index, axis in enumerate("XYZ")]
        if motion in (2, 3):
            _arc(made, place, target, given, motion == 2, number)
        made.points.append((target[0], target[1], target[2], number))
        made.rapid.append(motion == 0)
        place = target
    return made


def _arc(made: Outline, start: list[float], target: list[float], given: dict[str, float],
         clockwise: bool, number: int) -> None:
    """Points between the ends of an arc in the plane of X and Y."""
    centre = start[0] + given.get("I", 0.0), start[1] + given.get("J", 0.0)
    radius = math.dist(centre, start[:2])
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    turn = math.atan2(target[1] - centre[1], target[0] - centre[0]) - first
    turn %= math.tau
    if math.dist(start[:2], target[:2]) < 1e-9:
        turn = math.tau
    elif clockwise:
        turn -= math.tau
    if clockwise and turn == math.tau:
        turn = -turn
    steps = max(1, math.ceil(abs(turn) / STEP))
    for step in range(1, steps):
        share = step / steps
        made.points.append((centre[0] + radius * math.cos(first + turn * share),
                            centre[1] + radius * math.sin(first + turn * share),
                            start[2] + (target[2] - start[2]) * share, number))
        made.rapid.append(False)
