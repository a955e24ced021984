# SPDX-License-Identifier: Apache-2.0
"""Model of the program dialect: what a block means, in exact decimal arithmetic.

Written from the rules of the dialect and not from the firmware. Distances are rounded to whole
pulses half away from zero, speeds to whole um/min half upwards; an inch is 25.4 mm. The centre of
an arc is in 1/64 pulse.

Ref: ISO 6983-1; docs/reference/programs.md.
"""

import re
from dataclasses import dataclass, field
from decimal import ROUND_HALF_UP, Decimal
from math import atan2, hypot, isclose, pi, sqrt

LIMIT = 1 << 28         # pulses: furthest position in any frame
HIGHEST = 1_800_000     # um/min: what the machine is set to
TIMES = {100: (15, 25), 110: (30, 30), 120: (60, 40), 130: (100, 50), 140: (150, 75),
         150: (200, 100), 500: (5, 40), 510: (3, 30)}   # of the conditions, us
CONDITIONS = set(TIMES)
ENTERED = 16            # conditions that can be entered
CODES = 6               # G words, and M words, of a block
ITEMS = "RLHEQZ"
SIGNED, NAMES, OTHERS = set("XYZIJKR"), set("NOCDST"), set("GMFPLHEQUV")
FINE = 64               # parts of a pulse in which centres are given
RADIUS_MM = 1000        # largest of an arc
DIFFERENCE_MM = Decimal("0.002")    # of start and end radius, largest
WIRES = 16              # wire offsets, D0 among them
GROUPS = {0: "motion", 1: "motion", 2: "motion", 3: "motion", 4: "once",
          17: "plane", 18: "plane", 19: "plane", 40: "wire", 41: "wire", 42: "wire",
          **dict.fromkeys(range(54, 60), "system"), 10: "once", 20: "units", 21: "units",
          36: "once", 37: "once", 38: "once", 39: "once", 90: "distance", 91: "distance",
          92: "once", 94: "feed", 95: "feed"}
ALONE = 10, 36, 37, 38, 39
STEPS = 32              # of a series of conditions by depth
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}  # first, second and third axis
_NUMBER = re.compile(r"[ \t]*([+-]?)(\d+\.?\d*|\.\d+)")


class DialectError(Exception):
    """The block is no block of the dialect."""


@dataclass
class Meaning:
    """What a block does. Distances in pulses, speeds in um/min, times in clocks."""

    skipped: bool = False
    delta: tuple[int, ...] = (0, 0, 0)
    speed: int = 0
    act: str = "none"
    stop: str = "none"
    machining: int = 0
    condition: int = 0
    codes: dict = field(default_factory=dict)   # S, T and the list M of the machine side
    fluid_off: bool = False
    dwell: int = 0
    servo: int = 0
    arc: int = 0            # 1 counter-clockwise, -1 clockwise
    centre: tuple[int, ...] = (0, 0)
    plane: int = 17
    offset: tuple[int, ...] = (0, 0, 0)


def _require(condition, message):
    if not condition:
        raise DialectError(message)


def _words(text, skip):
    """Words of a block as (letter, sign, digits); nothing at all if it is skipped."""
    at, begun, words = 0, False, []
    while at < len(text):
        char = text[at].upper()
        if char in " \t":
            at += 1
        elif char == "(":
            at = text.find(")", at) + 1
            _require(at, "comment not closed")
        elif char == ";":
            break
        elif char == "/" and not begun:
            if skip:
                return None
            at += 1
            begun = True
        else:
            letter = "O" if char == ":" else char
            _require(letter in SIGNED | NAMES | OTHERS, f"unknown {letter}")
            match = _NUMBER.match(text, at + 1)
            _require(match, "no number")
            _require(not match[1] or letter in SIGNED, "sign")
            words.append((letter, match[1], match[2]))
            at, begun = match.end(), True
    return words


def _value(letter, sign, digits):
    whole, _, decimals = digits.partition(".")
    significant = (whole + decimals).lstrip("0")
    _require(len(significant) <= 12, "digits")
    _require(len(decimals) <= 7, "decimals")
    if letter in NAMES:
        _require("." not in digits, "point")
        _require(int(digits) <= 99_999_999, "name")
    if letter in "GM":
        _require(int(significant or "0") < 10**7, "code")
    return Decimal(digits) * (-1 if sign == "-" else 1)


def _whole(words, letter, lowest, highest, default=None):
    """A whole number of a word, if it is there."""
    value = words.pop(letter, None)
    if value is None:
        return default
    _require(value.as_tuple().exponent == 0 and not value.is_signed(), "whole")
    _require(lowest <= value <= highest, "range")
    return int(value)


def _round(value):
    return int(value.to_integral_value(rounding=ROUND_HALF_UP))


class Dialect:
    """Modal state of a program, and the judgement of its blocks in turn."""

    def __init__(self, *, pulses_per_mm=10_000, clock_hz=2_000_000, skip=True, mdi=None):
        self.pulses_per_mm, self.clock_hz, self.skip = pulses_per_mm, clock_hz, skip
        self.inch = self.incremental = False
        self.mode = None
        self.feed = 0
        self.position = [0, 0, 0]
        self.shift = [0, 0, 0]          # G92
        self.systems = [[0, 0, 0] for _ in range(6)]
        self.system, self.plane = 0, 17
        self.side, self.wire, self.wires = 40, None, {0: 0}
        self.mdi = dict(mdi or {})
        self.tape = {}
        self.jump = {"P": 0, "L": 0, "R": 0, "H": 0}
        self.condition = 0
        self.table = {}         # rows entered: times, voltages, open level and references in mV
        self.references = 0, 0  # Vs and Es of the condition in force
        self.series = []        # steps: depth, and Vs and Es of the condition there
        self.machining, self.servo, self.served = False, 0, 0

    @property
    def offset(self):
        """Of the program frame."""
        return [a + b for a, b in zip(self.systems[self.system], self.shift, strict=True)]

    @property
    def items(self):
        """Retraction data in force."""
        return {**self.mdi, **self.tape}

    def block(self, text: str) -> Meaning:
        """Judge a block and take over what it changes.

        Raises
        ------
        DialectError
            If it is damaged; the state is then of no more use.
        """
        found = _words(text, self.skip)
        if found is None:
            return Meaning(skipped=True)
        words, codes = {}, {"G": [], "M": []}
        for letter, sign, digits in found:
            value = _value(letter, sign, digits)
            if letter in codes:
                _require(value * 10 == int(value * 10) and value * 10 <= 65535, "code")
                _require(value not in codes[letter] and len(codes[letter]) < CODES, "code twice")
                codes[letter].append(value)
            else:
                _require(letter not in words, "word twice")
                words[letter] = value
        words.pop("N", None)
        return self._meaning(words, codes["G"], codes["M"])

    def _meaning(self, words, g_codes, m_codes):
        meaning = Meaning()
        groups = {}
        for code in g_codes:
            _require(code in GROUPS, f"G{code}")
            _require(GROUPS[code] not in groups, "group")
            groups[GROUPS[int(code)]] = int(code)
        once = groups.get("once")
        _require(once is None or "motion" not in groups, "motion with a function")
        _require(once not in ALONE or len(g_codes) + len(m_codes) == 1, "not alone")
        _require(once not in ALONE or "O" not in words, "not alone")
        words.pop("O", None)
        if "units" in groups:
            self.inch = groups["units"] == 20
        if "distance" in groups:
            self.incremental = groups["distance"] == 91
        self.mode = groups.get("motion", self.mode)
        self.system = groups.get("system", 54 + self.system) - 54
        self._side(groups, words, once)
        if once is not None:
            {4: self._dwell, 10: self._enter, 36: self._retraction, 37: self._defaults,
             38: self._jump, 39: self._series, 92: self._set_position}[once](words, meaning)
            _require(once not in ALONE or not words, "not alone")
        if "feed" in groups:
            self.servo = 0
            if groups["feed"] == 95:
                _require(once is None, "servo and a function")
                self.servo = _whole(words, "P", 1, 4)
                _require(self.servo, "law")
        if "F" in words:
            self.feed = self._speed(words.pop("F"))
        if "C" in words:
            meaning.condition = self.condition = int(words.pop("C"))
            _require(self.condition in CONDITIONS | set(self.table), "condition")
            self.references = self.table.get(self.condition, (0, 0))[-2:]
            self.series = []
        if self.condition and (meaning.condition or "feed" in groups):
            for references in (self.references, *(step[1] for step in self.series)):
                _require(self.servo < 2 or references[self.servo == 4], "reference of the law")
        discharging = self.machining or 3 in m_codes  # M05 acts after the motion
        self._auxiliary(words, m_codes, meaning)
        if once is None:
            self._move(words, meaning, discharging)
        _require(not words, f"left: {words}")
        meaning.plane, meaning.offset = self.plane, tuple(self.offset)
        return meaning

    def _distance(self, value):
        scale = Decimal("25.4") if self.inch else 1
        pulses = _round(value * scale * self.pulses_per_mm)
        _require(abs(pulses) <= LIMIT, "distance")
        return pulses

    def _speed(self, value):
        _require(not value.is_signed(), "sign")
        speed = _round(value * (Decimal("25.4") if self.inch else 1) * 1000)
        _require(0 < speed <= HIGHEST, "speed")
        return speed

    def _clocks(self, seconds):
        us = _round(seconds * 1_000_000)
        _require(0 <= us <= 36_000_000_000, "time")
        return us * (self.clock_hz // 1000) // 1000

    def _dwell(self, words, meaning):
        meaning.act = "dwell"
        _require(("P" in words) != ("X" in words), "dwell")
        seconds = words.pop("P") / 1000 if "P" in words else words.pop("X")
        _require(seconds >= 0 and not (seconds == 0 and str(seconds).startswith("-")), "negative")
        meaning.dwell = self._clocks(seconds)

    def _retraction(self, words, meaning):
        meaning.act = "retraction"
        for letter in ITEMS:
            if letter in words:
                value = words.pop(letter)
                if letter in "RHE":
                    self.tape[letter] = self._speed(value)
                else:
                    self.tape[letter] = self._distance(value)
                    if letter == "Z":
                        self.tape[letter] += self.offset[2]
        self._complete()

    def _enter(self, words, meaning):
        meaning.act = "table"
        if not {"C", "L"} & set(words):
            _require({"D", "P"} & set(words), "what")
            if "D" in words:
                self._enter_wire(words)
            else:
                self._enter_system(words)
            return
        for letter in "XYZ":
            _whole(words, letter, 0, 255)
        if "C" not in words:
            _whole(words, "L", 0, 3)
            _whole(words, "H", 50, 100)
            return
        number = int(words.pop("C"))
        usual = (*TIMES.get(number, (0, 0)), 80, 75, 0, 0)
        on, off, open_v, percent, *references = self.table.get(number, usual)
        if "I" in words:
            _require(not words["I"].is_signed(), "sign")
            milli_ip = _round(words.pop("I") * 1000)
            _require(min(milli_ip % 1000, -milli_ip % 1000) <= 10, "no step of the supply")
            _require(milli_ip <= 20_010, "current")
        _whole(words, "R", 0, 20_000)
        row = (_whole(words, "P", 1, 2000, on), _whole(words, "Q", 1, 20_000, off),
               _whole(words, "E", 20, 300, open_v), _whole(words, "H", 1, 99, percent))
        polarity = words.pop("K", Decimal(1))
        _require(abs(polarity) == 1 and polarity.as_tuple().exponent == 0, "polarity")
        if "L" in words:
            _require(0 < self._distance(words.pop("L")) <= 65535, "step")
        _require(row[0] and row[1], "times")
        _require(row[2] % 20 == 0, "step of the supply")
        _require(row[2] * row[3] * 50 > 20 * 100 * 100, "levels")
        references = [_round(words.pop(letter) * 1000) if letter in words else kept
                      for letter, kept in zip("VU", references, strict=True)]
        no_load = row[2] * 1000 * row[0] // (row[0] + row[1])
        _require(all(not mv or mv < no_load for mv in references), "reference")
        row += tuple(references)
        self.table[number] = row
        _require(len(self.table) <= ENTERED, "too many")

    def _enter_wire(self, words):
        number = int(words.pop("D"))
        _require(0 < number < WIRES and "R" in words, "wire offset")
        value = words.pop("R")
        _require(not value.is_signed(), "sign")
        self.wires[number] = self._distance(value)
        _require(self.wires[number] <= RADIUS_MM * self.pulses_per_mm // 10, "wire offset")

    def _enter_system(self, words):
        system = self.systems[_whole(words, "P", 1, 6) - 1]
        _require(set("XYZ") & set(words), "no axis")
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                system[axis] = self._distance(words.pop(letter))

    def _side(self, groups, words, once):
        before = self.side, self.wire
        plane = groups.get("plane", self.plane)
        _require(self.side == 40 or plane == self.plane, "plane under a wire offset")
        self.plane = plane
        self.side = groups.get("wire", self.side)
        if groups.get("wire", 40) != 40:
            if once != 10:
                self.wire = int(words.pop("D", -1 if self.wire is None else self.wire))
            _require(self.wire in self.wires, "no wire offset")
            _require(before[0] == 40 or before == (self.side, self.wire), "G40 between")

    def _complete(self):
        items = self.items
        _require(set(ITEMS) - {"Z"} <= set(items), "missing item")
        _require(items["L"] > 0 and 0 <= items["Q"] <= items["L"], "Q and L")

    def _defaults(self, words, meaning):
        meaning.act = "defaults"
        self.tape = {}
        self._complete()

    def _jump(self, words, meaning):
        meaning.act = "jump"
        _require("P" in words, "period")
        self.jump["P"] = self._clocks(words.pop("P") / 1000)
        _require(self.jump["P"] < 1 << 32, "period")
        if "L" in words:
            self.jump["L"] = self._distance(words.pop("L"))
        for letter in "RH":
            if letter in words:
                value = words.pop(letter)
                _require(not value.is_signed(), "sign")
                self.jump[letter] = self._speed(value) if value else 0
        if self.jump["P"]:
            _require(all(self.jump.values()), "jump item")
            _require(set(ITEMS) - {"Z"} <= set(self.items), "jump without data")

    def _series(self, words, meaning):
        meaning.act = "series"
        if not words:
            self.series = []
            return
        if "P" in words:
            _whole(words, "P", 1, 1)
            _require(not words and self.side == 40, "planned")
            # A check knows no plan: one condition, with any reference, stands for it.
            meaning.act, meaning.condition, self.condition = "planned", 100, 100
            self.references, self.series = (1, 1), []
            return
        _require({"Z", "C"} == set(words), "depth and condition")
        _require(self.condition and self.side == 40, "when")
        depth = self._distance(words.pop("Z")) + self.offset[2]
        number = int(words.pop("C"))
        _require(number in CONDITIONS | set(self.table), "condition")
        _require(len(self.series) < STEPS, "room")
        _require(not self.series or depth < self.series[-1][0], "not deeper")
        references = self.table.get(number, (0, 0))[-2:]
        _require(self.servo < 2 or references[self.servo == 4], "reference of the law")
        self.series.append((depth, references))

    def _set_position(self, words, meaning):
        meaning.act = "set position"
        _require(set("XYZ") & set(words), "no axis")
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                self.shift[axis] = (self.position[axis] - self._distance(words.pop(letter))
                                    - self.systems[self.system][axis])

    def _auxiliary(self, words, m_codes, meaning):
        codes = {letter: int(words.pop(letter, -1)) for letter in "ST"}
        _require(max(codes.values()) <= 65535, "code")
        _require(all(code == int(code) for code in m_codes), "M with a decimal")
        for group in ({0, 1, 2, 30}, {3, 5}, {8, 9}):
            _require(len(group & set(m_codes)) <= 1, "M group")
        stops = {0: "program", 1: "optional", 2: "end", 30: "end"}
        meaning.stop = next((stops[code] for code in map(int, m_codes) if code in stops), "none")
        meaning.machining = (3 in m_codes) - (5 in m_codes)
        meaning.fluid_off = 9 in m_codes
        own = set(stops) | {3, 5, 9}
        meaning.codes = {**codes, "M": [int(code) for code in m_codes if code not in own]}
        _require(3 not in m_codes or self.condition, "M03 without condition")
        self.machining = 3 in m_codes or (self.machining and 5 not in m_codes)

    def _move(self, words, meaning, discharging):
        delta = [0, 0, 0]
        start, given = list(self.position), set("XYZ") & set(words)
        for axis, letter in enumerate("XYZ"):
            if letter not in words:
                continue
            _require(self.mode is not None, "mode")
            pulses = self._distance(words.pop(letter))
            base = self.position if self.incremental else self.offset
            target = base[axis] + pulses
            _require(abs(target) <= LIMIT, "travel")
            delta[axis] = target - self.position[axis]
            self.position[axis] = target
        meaning.delta = tuple(delta)
        if self.mode in (2, 3):
            self._arc(words, meaning, start, given)
        moves = any(delta) or meaning.arc
        if moves:
            served = self.servo if self.mode != 0 else 0
            meaning.servo = 0 if served == self.served else served or -1
            self.served = served
            _require(not served or discharging, "servo without machining")
            _require(not served or set(ITEMS) - {"Z"} <= set(self.items), "servo without data")
        meaning.speed = HIGHEST if self.mode == 0 else self.feed
        _require(not moves or meaning.speed, "no feed")

    def _fine(self, value):
        scale = Decimal("25.4") if self.inch else 1
        _require(_round(abs(value) * scale * self.pulses_per_mm) <= RADIUS_MM * self.pulses_per_mm,
                 "radius above 1 m")
        return _round(value * scale * self.pulses_per_mm * FINE)

    def _arc(self, words, meaning, start, given):
        first, second, third = PLANES[self.plane]
        _require("IJK"[third] not in words, "other plane")
        centres = [axis for axis in (first, second) if "IJK"[axis] in words]
        _require("R" not in words or not centres, "centre and radius")
        if "R" not in words and not centres:
            _require(not given, "neither centre nor radius")
            return
        meaning.arc = 1 if self.mode == 3 else -1
        chord = [meaning.delta[axis] * FINE for axis in (first, second)]
        largest, tolerance = (x * self.pulses_per_mm * FINE for x in (RADIUS_MM, DIFFERENCE_MM))
        if centres:
            centre = [self._fine(words.pop("IJK"[axis], Decimal(0))) for axis in (first, second)]
            radius = hypot(*centre)
            _require(radius > FINE - 0.5, "no radius")
            _require(radius <= largest + 0.5, "radius above 1 m")
            difference = abs(hypot(*(c - m for c, m in zip(chord, centre, strict=True))) - radius)
            length = radius * abs(_sweep(centre, chord, meaning.arc))
            short = hypot(*chord) if length < pi * radius else 2 * radius
            _require(difference <= tolerance and 16 * difference <= short, "radii")
        else:
            signed = self._fine(words.pop("R"))
            radius = abs(signed)
            _require(radius >= FINE, "no radius")
            _require(any(chord), "no chord")
            _require(hypot(*chord) <= 2 * radius + float(tolerance), "chord")
            half = [c / 2 for c in chord]
            away = sqrt(max(0, radius * radius - half[0] ** 2 - half[1] ** 2)) / hypot(*chord)
            away *= meaning.arc * (1 if signed > 0 else -1)
            centre = [round(half[0] - chord[1] * away), round(half[1] + chord[0] * away)]
        meaning.centre = tuple(centre)
        sweep = _sweep(centre, chord, meaning.arc)
        begin = atan2(-centre[1], -centre[0])
        for quarter in range(-8, 9):
            turned = quarter * pi / 2 - begin
            if 0 <= turned * meaning.arc <= abs(sweep):
                axis = first if quarter % 2 == 0 else second
                side = 1 if quarter % 4 in (0, 1) else -1
                reach = (centre[quarter % 2] + side * hypot(*centre)) / FINE
                _require(abs(start[axis] + reach) < LIMIT + 0.5, "arc beyond the travel")


def _sweep(centre, chord, direction):
    """Angle of an arc with a sign, from above zero to a whole turn."""
    begin = atan2(-centre[1], -centre[0])
    end = atan2(chord[1] - centre[1], chord[0] - centre[0])
    sweep = (end - begin) * direction % (2 * pi)
    return direction * (2 * pi if isclose(sweep, 0, abs_tol=1e-12) else sweep)
