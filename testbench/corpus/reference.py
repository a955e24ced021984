# SPDX-License-Identifier: Apache-2.0
"""What a program text does, told by walking through it: the second opinion of the corpus.

Written from ``docs/reference/programs.md`` alone. It shares no code with the host's tape codec, the
firmware or ``testbench.models.dialect``: it reads the text itself, walks through calls instead of
writing them out, and keeps places as exact fractions of a millimetre. It knows no wire offset and
judges nothing: what it does not know is an error of the corpus.

Ref: ISO 6983-1; calls as on Fanuc's controls.
"""

import re
from dataclasses import dataclass
from fractions import Fraction
from math import floor, sqrt

__all__ = ["Act", "Move", "walk"]

PULSES_PER_MM = 10_000
INCH = Fraction(254, 10)
AXES, CENTRES = "XYZ", "IJK"
# First and second axis of the planes: G17, G18, G19.
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}
WORD = re.compile(r"([A-Z:])[ \t]*([+-]?(?:\d+\.?\d*|\.\d+))")
OURS = {0, 1, 2, 3, 5, 9, 30}       # M words that are not for the machine side


@dataclass(frozen=True)
class Move:
    """A motion: places in mm of the machine frame, ``centre`` in its plane, feed in mm/min.

    ``turn`` is 1 counter-clockwise, -1 clockwise, 0 for a line; ``feed`` is None of a rapid.
    """

    line: int
    start: tuple[Fraction, ...]
    end: tuple[Fraction, ...]
    turn: int = 0
    plane: int = 17
    centre: tuple[float, float] = (0.0, 0.0)
    feed: Fraction | None = None


@dataclass(frozen=True)
class Act:
    """Anything else that a block does: its line, what, and how much."""

    line: int
    what: str
    value: object = None


def whole(value):
    """Nearest whole number of pulses as mm, half away from zero."""
    pulses = floor(abs(value) * PULSES_PER_MM + Fraction(1, 2))
    return Fraction(pulses if value >= 0 else -pulses, PULSES_PER_MM)


def program_of(text):
    """Lines of the program with their numbers: between the ``%``, words in capitals alone."""
    lines = list(enumerate(re.split(r"\r\n|\r|\n", text.removeprefix("\ufeff")), start=1))
    marks = [at for at, (_, line) in enumerate(lines) if line.strip() == "%"]
    ends = [at for at, (_, line) in enumerate(lines) if re.search(r"M0*(2|30)\b", line.upper())]
    first = 0
    if marks and (not ends or marks[0] < ends[0]):
        first = marks.pop(0) + 1
    last = marks[0] if marks else len(lines)
    kept = []
    for number, line in lines[first:last]:
        line = re.sub(r"\([^)]*\)", " ", line).split(";")[0]
        line = line.upper().strip()
        if not line.startswith("/"):
            kept.append((number, line))
    return kept


class Walk:
    """State of a program on its way through the text."""

    def __init__(self):
        self.units, self.absolute = Fraction(1), True
        self.mode, self.plane, self.feed = None, 17, None
        self.place = [Fraction(0)] * 3
        self.systems, self.system = [[Fraction(0)] * 3 for _ in range(6)], 0
        self.shift = [Fraction(0)] * 3
        self.homes = {}
        self.done = []
        self.over = False

    def block(self, number, line):
        """Carry out a block; the subprogram that it calls and how often, if it calls one."""
        words = [(letter, Fraction(value)) for letter, value in WORD.findall(line)]
        rest = WORD.sub("", line).strip()
        if rest:
            raise ValueError(f"line {number}: {rest!r}")
        codes = [value for letter, value in words if letter == "G"]
        functions = [int(value) for letter, value in words if letter == "M"]
        values = {letter: value for letter, value in words if letter not in "GM"}
        called = (int(values.pop("P")), int(values.pop("L", 1))) if 98 in functions else None
        self.modes(codes)
        self.before(number, functions, values, codes)
        self.act(number, codes, values)
        self.after(number, functions)
        return called

    def modes(self, codes):
        for code in codes:
            if code in (20, 21):
                self.units = INCH if code == 20 else Fraction(1)
            elif code in (90, 91):
                self.absolute = code == 90
            elif code in PLANES:
                self.plane = int(code)
            elif code in (0, 1, 2, 3):
                self.mode = int(code)
            elif code == 80:
                self.mode = None
            elif 54 <= code <= 59:
                self.system = int(code) - 54

    def before(self, number, functions, values, codes):
        """What comes before the motion."""
        if "F" in values:
            micrometres = values.pop("F") * self.units * 1000
            self.feed = Fraction(floor(micrometres + Fraction(1, 2)), 1000)
        if "C" in values and 10 not in codes:
            self.done.append(Act(number, "condition", int(values.pop("C"))))
        self.done += [Act(number, "on")] * (3 in functions)
        self.done += [Act(number, letter, int(values.pop(letter)))
                      for letter in "ST" if letter in values]
        self.done += [Act(number, "M", code) for code in functions
                      if code not in OURS and code not in (98, 99)]

    def after(self, number, functions):
        """What comes behind it."""
        names = {5: "off", 9: "fluid off", 0: "stop", 1: "optional stop", 2: "end", 30: "end"}
        self.done += [Act(number, names[code]) for code in functions if code in names]
        self.over = bool({2, 30} & set(functions))

    def act(self, number, codes, values):
        once = [code for code in codes
                if code in (4, 10, 28, 30, 36, 38, 92) or code.denominator > 1]
        for letter in "NO:":
            values.pop(letter, None)
        if 64 in codes:
            values.pop("P", None)
        if not once:
            self.move(number, codes, values)
        elif once[0] == 4:
            ms = values["P"] if "P" in values else values["X"] * 1000
            self.done.append(Act(number, "dwell", ms))
        elif once[0] == 10:
            self.enter(values)
        elif once[0] == 92:
            for axis, value in self.given(values):
                self.shift[axis] = self.place[axis] - value - self.systems[self.system][axis]
        elif once[0] == Fraction("92.1"):
            self.shift = [Fraction(0)] * 3
        elif once[0] in (Fraction("28.1"), Fraction("30.1")):
            self.homes[int(once[0])] = list(self.place)
        elif once[0] in (28, 30):
            self.home(number, int(once[0]), values)

    def given(self, values):
        return [(axis, whole(values[letter] * self.units))
                for axis, letter in enumerate(AXES) if letter in values]

    def enter(self, values):
        if {"C", "D", "W"} & set(values):
            return      # conditions, wire offsets and classes of the fluid move nothing
        system = self.systems[int(values["P"]) - 1 if values["P"] else self.system]
        for axis, value in self.given(values):
            system[axis] = (value if values.get("L", 2) == 2
                            else self.place[axis] - self.shift[axis] - value)

    def origin(self, axis):
        return self.systems[self.system][axis] + self.shift[axis]

    def go(self, number, end, **how):
        if tuple(end) != tuple(self.place) or how.get("turn"):
            self.done.append(Move(number, tuple(self.place), tuple(end), **how))
        self.place = list(end)

    def home(self, number, which, values):
        over, given = list(self.place), self.given(values)
        for axis, value in given:
            over[axis] = value + (self.origin(axis) if self.absolute else self.place[axis])
        end = list(over)
        for axis in [axis for axis, _ in given] or range(3):
            end[axis] = self.homes[which][axis]
        self.go(number, over)
        self.go(number, end)

    def move(self, number, codes, values):
        end = list(self.place)
        for axis, value in self.given(values):
            base = self.origin(axis) if self.absolute else self.place[axis]
            end[axis] = value + (Fraction(0) if 53 in codes else base)
        if self.mode in (2, 3) and set("IJKR") & set(values):
            turn = 1 if self.mode == 3 else -1
            self.go(number, end, turn=turn, plane=self.plane, feed=self.feed,
                    centre=self.centre(end, values, turn))
        elif self.mode is not None:
            self.go(number, end, feed=None if self.mode == 0 else self.feed)

    def centre(self, end, values, turn):
        """Of an arc, in its plane, mm of the machine frame."""
        first, second = PLANES[self.plane]
        here = self.place[first], self.place[second]
        if "R" not in values:
            return tuple(float(here[k] + values.get(CENTRES[axis], 0) * self.units)
                         for k, axis in enumerate((first, second)))
        radius = float(values["R"] * self.units)
        u, v = (float(end[axis] - self.place[axis]) for axis in (first, second))
        chord = sqrt(u * u + v * v)
        away = sqrt(max(0.0, radius * radius - chord * chord / 4)) / chord
        # The shorter way round has its centre on the side to which it turns.
        away *= turn if radius > 0 else -turn
        return float(here[0]) + u / 2 - v * away, float(here[1]) + v / 2 + u * away


def walk(text):
    """Everything that a program does, in order.

    Parameters
    ----------
    text : str
        The whole file.

    Raises
    ------
    ValueError
        If a line holds something that this walk cannot read.
    """
    program = program_of(text)
    names = {}
    for at, (_, line) in enumerate(program):
        if found := re.match(r"(?:N\d+\s*)?[O:]\s*(\d+)", line):
            names.setdefault(int(found[1]), at)
    walker = Walk()

    def run(at):
        while at < len(program):
            number, line = program[at]
            called = walker.block(number, line)
            if called and called[0] not in names:   # Fanuc's: times in front of four digits
                called = called[0] % 10_000, called[0] // 10_000
            for _ in range(called[1] if called else 0):
                run(names[called[0]])
            if walker.over or re.search(r"M0*99\b", line):
                return
            at += 1

    run(0)
    return walker.done
