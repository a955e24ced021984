# SPDX-License-Identifier: Apache-2.0
"""Model of the program dialect: the meaning of blocks, in exact decimal arithmetic.

Written from the rules of the dialect and not from the firmware. Distances are rounded to whole
pulses half away from zero, speeds to whole um/min half upwards; an inch is 25.4 mm. The centre of
an arc is in 1/64 pulse.

Ref: ISO 6983-1; docs/reference/programs.md.
"""

from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from math import atan2, hypot, isclose, pi, sqrt

from testbench.models.dialect_words import DialectError, require, rounded, value_of, whole, words_of

__all__ = ["Dialect", "DialectError", "Meaning"]

LIMIT = 1 << 28         # pulses: furthest position in any frame
HIGHEST = 1_800_000     # um/min: what the machine is set to
TIMES = {100: (15, 25), 110: (30, 30), 120: (60, 40), 130: (100, 50), 140: (150, 75),
         150: (200, 100), 500: (5, 40), 510: (3, 30),
         520: (5, 40), 530: (3, 30)}   # of the conditions, us
WAITS = {520: 20, 530: 15}          # for the ignition, us
CONDITIONS = set(TIMES)
ENTERED = 16            # conditions that can be entered
# Words of a condition on how pulses are counted and judged, with their ranges.
RULES = ("J", 0, 5), ("W", 1, 255), ("S", 0, 15), ("F", 0, 7), ("T", 0, 1_000_000)
CODES = {"G": 12, "M": 6}           # words of a block
ITEMS = "RLHEQZ"
FINE = 64               # parts of a pulse in which centres are given
RADIUS_MM = 1000        # largest of an arc
DIFFERENCE_MM = Decimal("0.003")    # of start and end radius, largest; in inches 2.54 times it
WIRES = 16              # wire offsets, D0 among them
GROUPS = {0: "motion", 1: "motion", 2: "motion", 3: "motion", 4: "once",
          17: "plane", 18: "plane", 19: "plane", 40: "wire", 41: "wire", 42: "wire",
          **dict.fromkeys(range(54, 60), "system"), 10: "once", 20: "units", 21: "units",
          36: "once", 37: "once", 38: "once", 39: "once", 90: "distance", 91: "distance",
          92: "once", 94: "feed", 95: "feed", 53: "frame",
          **dict.fromkeys((28, 30, *map(Decimal, ("28.1", "30.1", "92.1"))), "once")}
# Change nothing on this machine; 80 ends the mode of motion.
SILENT = {49, 50, 61, 64, 69, 80, Decimal("91.1"), 98, 99}
NOT_THE_MACHINES = {70, 71, 72, 73, 98, 99}     # M codes that are not for the machine side
ALONE = 10, 36, 37, 38, 39
STEPS = 32              # of a depth series
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}  # first, second and third axis


@dataclass
class Meaning:
    """Effects of a block. Distances in pulses, speeds in um/min, times in clocks."""

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
    via: tuple[int, ...] = (0, 0, 0)        # first, in a line of its own


class Dialect:
    """Modal state of a program, which judges its blocks one after the other."""

    def __init__(self, *, pulses_per_mm=10_000, clock_hz=2_000_000, skip=True, mdi=None):
        self.pulses_per_mm, self.clock_hz, self.skip = pulses_per_mm, clock_hz, skip
        self.inch = self.incremental = False
        self.mode = None
        self.feed = 0
        self.position = [0, 0, 0]
        self.shift = [0, 0, 0]          # G92
        self.systems = [[0, 0, 0] for _ in range(6)]
        self.system, self.plane = 0, 17
        self.places = {}                # of G28 and G30
        self.side, self.wire, self.wires = 40, None, {0: 0}
        self.mdi = dict(mdi or {})
        self.tape = {}
        self.jump = {"P": 0, "L": 0, "R": 0, "H": 0}
        self.condition = 0
        self.table = {}         # rows entered; the last two are references in mV
        self.references = 0, 0  # Vs and Es of the condition in force
        self.depth_series = []        # steps: depth, and Vs and Es of the condition there
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
        """Judge a block and apply its changes to the state.

        Raises
        ------
        DialectError
            If the block is not allowed; the state must not be used any more.
        """
        found = words_of(text, self.skip)
        if found is None:
            return Meaning(skipped=True)
        words, codes = {}, {"G": [], "M": []}
        for letter, sign, digits in found:
            value = value_of(letter, sign, digits)
            if letter in codes:
                require(value * 10 == int(value * 10) and value * 10 <= 65535, "code")
                require(value not in codes[letter], "code twice")
                require(len(codes[letter]) < CODES[letter], "codes")
                codes[letter].append(value)
            else:
                require(letter not in words, "word twice")
                words[letter] = value
        words.pop("N", None)
        return self._meaning(words, codes["G"], codes["M"])

    def _meaning(self, words, g_codes, m_codes):
        meaning = Meaning()
        groups = {}
        for code in g_codes:
            if code in SILENT:
                require(code != 50 or not {"X", "Y", "Z"} & set(words), "place by G50")
                continue
            require(code in GROUPS, f"G{code}")
            require(GROUPS[code] not in groups, "group")
            groups[GROUPS[code]] = int(code) if code == int(code) else code
        once = groups.get("once")
        require(once is None or not {"motion", "frame"} & set(groups), "motion with a function")
        require(once not in ALONE or len(g_codes) + len(m_codes) == 1, "not alone")
        require(once not in ALONE or "O" not in words, "not alone")
        words.pop("O", None)
        if "units" in groups:
            self.inch = groups["units"] == 20
        if "distance" in groups:
            self.incremental = groups["distance"] == 91
        self.mode = groups.get("motion", None if 80 in g_codes else self.mode)
        self.system = groups.get("system", 54 + self.system) - 54
        self._side(groups, words, once)
        if once is not None:
            {4: self._dwell, 10: self._enter, 36: self._retraction, 37: self._defaults,
             38: self._jump, 39: self._series, 92: self._set_position,
             Decimal("92.1"): self._forget, **dict.fromkeys((28, 30), partial(self._go, once)),
             **dict.fromkeys(map(Decimal, ("28.1", "30.1")), partial(self._store, once))
             }[once](words, meaning)
            require(once not in ALONE or not words, "not alone")
        if "feed" in groups:
            self.servo = 0
            if groups["feed"] == 95:
                require(once is None, "servo and a function")
                self.servo = whole(words, "P", 1, 4)
                require(self.servo, "feed mode")
        if 64 in g_codes and once is None and groups.get("feed") != 95:
            words.pop("P", None)        # how far a path may be left: here never
            words.pop("Q", None)
        if "F" in words:
            self.feed = self._speed(words.pop("F"))
        if "C" in words:
            meaning.condition = self.condition = int(words.pop("C"))
            require(self.condition in CONDITIONS | set(self.table), "condition")
            self.references = self.table.get(self.condition, (0, 0))[-2:]
            self.depth_series = []
        if self.condition and (meaning.condition or "feed" in groups):
            for references in (self.references, *(step[1] for step in self.depth_series)):
                require(self.servo < 2 or references[self.servo == 4], "reference of the feed mode")
        discharging = self.machining or 3 in m_codes  # M05 acts after the motion
        self._auxiliary(words, m_codes, meaning)
        if once is None:
            self._move(words, meaning, discharging, "frame" in groups)
        require(not words, f"left: {words}")
        meaning.plane, meaning.offset = self.plane, tuple(self.offset)
        return meaning

    def _distance(self, value):
        scale = Decimal("25.4") if self.inch else 1
        pulses = rounded(value * scale * self.pulses_per_mm)
        require(abs(pulses) <= LIMIT, "distance")
        return pulses

    def _speed(self, value):
        require(not value.is_signed(), "sign")
        speed = rounded(value * (Decimal("25.4") if self.inch else 1) * 1000)
        require(0 < speed <= HIGHEST, "speed")
        return speed

    def _clocks(self, seconds):
        us = rounded(seconds * 1_000_000)
        require(0 <= us <= 36_000_000_000, "time")
        return us * (self.clock_hz // 1000) // 1000

    def _dwell(self, words, meaning):
        meaning.act = "dwell"
        require(("P" in words) != ("X" in words), "dwell")
        require("P" not in words or words["P"].as_tuple().exponent == 0, "ms with decimals")
        seconds = words.pop("P") / 1000 if "P" in words else words.pop("X")
        require(seconds >= 0 and not (seconds == 0 and str(seconds).startswith("-")), "negative")
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
        if not {"C", "W"} & set(words):
            require({"D", "P"} & set(words), "what")
            if "D" in words:
                self._enter_wire(words)
            else:
                self._enter_system(words)
            return
        for letter in "XYZ":
            whole(words, letter, 0, 255)
        if "C" not in words:
            whole(words, "W", 0, 3)
            whole(words, "H", 50, 100)
            return
        number = int(words.pop("C"))
        usual = (*TIMES.get(number, (0, 0)), 80, 75,
                 int(number in WAITS), WAITS.get(number, 0), 0, 0)
        on, off, open_v, percent, ignition, wait, *references = self.table.get(number, usual)
        if "I" in words:
            require(not words["I"].is_signed(), "sign")
            milli_ip = rounded(words.pop("I") * 1000)
            require(min(milli_ip % 1000, -milli_ip % 1000) <= 10, "no step of the supply")
            require(milli_ip <= 20_010, "current")
        whole(words, "R", 0, 20_000)
        for letter, lowest, highest in RULES:
            whole(words, letter, lowest, highest)
        row = (whole(words, "P", 1, 2000, on), whole(words, "Q", 1, 20_000, off),
               whole(words, "E", 20, 300, open_v), whole(words, "H", 1, 99, percent))
        ignition = whole(words, "A", 0, 1, ignition)
        require(ignition or "B" not in words, "B without A1")
        wait = whole(words, "B", 0, 2000, wait) if ignition else 0
        longest = (wait or row[0]) if ignition else row[0]
        require(not ignition or row[0] + longest <= 2000, "wait and on-time")
        polarity = words.pop("K", Decimal(1))
        require(abs(polarity) == 1 and polarity.as_tuple().exponent == 0, "polarity")
        if "L" in words:
            require(0 < self._distance(words.pop("L")) <= 65535, "step")
        require(row[0] and row[1], "times")
        require(row[2] % 20 == 0, "step of the supply")
        require(row[2] * row[3] * 50 > 20 * 100 * 100, "levels")
        references = [rounded(words.pop(letter) * 1000) if letter in words else kept
                      for letter, kept in zip("VU", references, strict=True)]
        no_load = row[2] * 1000 * longest // (longest + row[1])
        require(all(not mv or mv < no_load for mv in references), "reference")
        row += (ignition, wait, *references)
        self.table[number] = row
        require(len(self.table) <= ENTERED, "too many")

    def _enter_wire(self, words):
        number = int(words.pop("D"))
        require(0 < number < WIRES and "R" in words, "wire offset")
        value = words.pop("R")
        require(not value.is_signed(), "sign")
        self.wires[number] = self._distance(value)
        require(self.wires[number] <= RADIUS_MM * self.pulses_per_mm // 10, "wire offset")

    def _enter_system(self, words):
        how = whole(words, "L", 2, 20, 2)
        require(how in (2, 20), "L2 or L20")
        number = whole(words, "P", 0, 6)
        shift = list(self.shift)
        system = self.systems[number - 1 if number else self.system]
        require(set("XYZ") & set(words), "no axis")
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                value = self._distance(words.pop(letter))
                system[axis] = (value if how == 2
                                else self.position[axis] - shift[axis] - value)

    def _side(self, groups, words, once):
        before = self.side, self.wire
        plane = groups.get("plane", self.plane)
        require(self.side == 40 or plane == self.plane, "plane under a wire offset")
        self.plane = plane
        self.side = groups.get("wire", self.side)
        if groups.get("wire", 40) != 40:
            if once != 10:
                self.wire = int(words.pop("D", -1 if self.wire is None else self.wire))
            require(self.wire in self.wires, "no wire offset")
            require(before[0] == 40 or before == (self.side, self.wire), "G40 between")

    def _complete(self):
        items = self.items
        require(set(ITEMS) - {"Z"} <= set(items), "missing item")
        require(items["L"] > 0 and 0 <= items["Q"] <= items["L"], "Q and L")

    def _defaults(self, words, meaning):
        meaning.act = "defaults"
        self.tape = {}
        self._complete()

    def _jump(self, words, meaning):
        meaning.act = "jump"
        require("P" in words, "period")
        self.jump["P"] = self._clocks(words.pop("P") / 1000)
        require(self.jump["P"] < 1 << 32, "period")
        if "L" in words:
            self.jump["L"] = self._distance(words.pop("L"))
        for letter in "RH":
            if letter in words:
                value = words.pop(letter)
                require(not value.is_signed(), "sign")
                self.jump[letter] = self._speed(value) if value else 0
        if self.jump["P"]:
            require(all(self.jump.values()), "jump item")
            require(set(ITEMS) - {"Z"} <= set(self.items), "jump without data")

    def _series(self, words, meaning):
        meaning.act = "depth series"
        if not words:
            self.depth_series = []
            return
        if "P" in words:
            whole(words, "P", 1, 1)
            require(not words and self.side == 40, "planned")
            # A check knows no plan: one condition, with any reference, stands for it.
            meaning.act, meaning.condition, self.condition = "planned", 100, 100
            self.references, self.depth_series = (1, 1), []
            return
        require({"Z", "C"} == set(words), "depth and condition")
        require(self.condition and self.side == 40, "when")
        depth = self._distance(words.pop("Z")) + self.offset[2]
        number = int(words.pop("C"))
        require(number in CONDITIONS | set(self.table), "condition")
        require(len(self.depth_series) < STEPS, "room")
        require(not self.depth_series or depth < self.depth_series[-1][0], "not deeper")
        references = self.table.get(number, (0, 0))[-2:]
        require(self.servo < 2 or references[self.servo == 4], "reference of the feed mode")
        self.depth_series.append((depth, references))

    def _set_position(self, words, meaning):
        meaning.act = "set position"
        require(set("XYZ") & set(words), "no axis")
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                self.shift[axis] = (self.position[axis] - self._distance(words.pop(letter))
                                    - self.systems[self.system][axis])

    def _forget(self, words, meaning):
        meaning.act = "set position"
        self.shift = [0, 0, 0]

    def _store(self, once, words, meaning):
        meaning.act = "table"
        self.places[int(once)] = list(self.position)

    def _go(self, once, words, meaning):
        """Motion of the named axes to a stored place, over the point of their words."""
        require(self.side == 40, "under a wire offset")
        require(once in self.places, "no place")
        named = [axis for axis, letter in enumerate("XYZ") if letter in words]
        over, place = list(self.position), self.places[once]
        for axis in named:
            base = self.position if self.incremental else self.offset
            over[axis] = base[axis] + self._distance(words.pop("XYZ"[axis]))
            require(abs(over[axis]) <= LIMIT, "travel")
        end = [place[axis] if not named or axis in named else over[axis] for axis in range(3)]
        legs = [tuple(b - a for a, b in zip(*leg, strict=True))
                for leg in ((self.position, over), (over, end))]
        meaning.via, meaning.delta = legs if any(legs[1]) else ((0, 0, 0), legs[0])
        self.position = end
        if any(meaning.delta):
            meaning.servo, self.served = -1 if self.served else 0, 0
        meaning.speed = HIGHEST

    def _auxiliary(self, words, m_codes, meaning):
        codes = {letter: int(words.pop(letter, -1)) for letter in "ST"}
        require(max(codes.values()) <= 65535, "code")
        require(all(code == int(code) for code in m_codes), "M with a decimal")
        require(not NOT_THE_MACHINES & set(m_codes), "M of a subprogram, or of modal state")
        for group in ({0, 1, 2, 30}, {3, 5}, {8, 9}):
            require(len(group & set(m_codes)) <= 1, "M group")
        stops = {0: "program", 1: "optional", 2: "end", 30: "end"}
        meaning.stop = next((stops[code] for code in map(int, m_codes) if code in stops), "none")
        meaning.machining = (3 in m_codes) - (5 in m_codes)
        meaning.fluid_off = 9 in m_codes
        own = set(stops) | {3, 5, 9}
        meaning.codes = {**codes, "M": [int(code) for code in m_codes if code not in own]}
        require(3 not in m_codes or self.condition, "M03 without condition")
        self.machining = 3 in m_codes or (self.machining and 5 not in m_codes)

    def _move(self, words, meaning, discharging, in_machine):
        delta = [0, 0, 0]
        require(not in_machine or (self.mode in (0, 1) and not self.incremental
                                    and self.side == 40), "G53")
        start, given = list(self.position), set("XYZ") & set(words)
        for axis, letter in enumerate("XYZ"):
            if letter not in words:
                continue
            require(self.mode is not None, "mode")
            pulses = self._distance(words.pop(letter))
            base = self.position if self.incremental else self.offset
            target = pulses + (0 if in_machine else base[axis])
            require(abs(target) <= LIMIT, "travel")
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
            require(not served or discharging, "servo without machining")
            require(not served or set(ITEMS) - {"Z"} <= set(self.items), "servo without data")
        meaning.speed = HIGHEST if self.mode == 0 else self.feed
        require(not moves or meaning.speed, "no feed")

    def _fine(self, value):
        scale = Decimal("25.4") if self.inch else 1
        require(rounded(abs(value) * scale * self.pulses_per_mm) <= RADIUS_MM * self.pulses_per_mm,
                 "radius above 1 m")
        return rounded(value * scale * self.pulses_per_mm * FINE)

    def _arc(self, words, meaning, start, given):
        first, second, third = PLANES[self.plane]
        require("IJK"[third] not in words, "other plane")
        centres = [axis for axis in (first, second) if "IJK"[axis] in words]
        require("R" not in words or not centres, "centre and radius")
        if "R" not in words and not centres:
            require(not given, "neither centre nor radius")
            return
        meaning.arc = 1 if self.mode == 3 else -1
        chord = [meaning.delta[axis] * FINE for axis in (first, second)]
        largest, tolerance = (x * self.pulses_per_mm * FINE for x in (RADIUS_MM, DIFFERENCE_MM))
        tolerance *= Decimal("2.54") if self.inch else 1
        if centres:
            centre = [self._fine(words.pop("IJK"[axis], Decimal(0))) for axis in (first, second)]
            radius = hypot(*centre)
            require(radius > FINE - 0.5, "no radius")
            require(radius <= largest + 0.5, "radius above 1 m")
            difference = abs(hypot(*(c - m for c, m in zip(chord, centre, strict=True))) - radius)
            length = radius * abs(_sweep(centre, chord, meaning.arc))
            short = hypot(*chord) if length < pi * radius else 2 * radius
            require(difference <= tolerance and 16 * difference <= short, "radii")
        else:
            signed = self._fine(words.pop("R"))
            radius = abs(signed)
            require(radius >= FINE, "no radius")
            require(any(chord), "no chord")
            require(hypot(*chord) <= 2 * radius + float(tolerance), "chord")
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
                require(abs(start[axis] + reach) < LIMIT + 0.5, "arc beyond the travel")


def _sweep(centre, chord, direction):
    """Angle of an arc with a sign, from above zero to a whole turn."""
    begin = atan2(-centre[1], -centre[0])
    end = atan2(chord[1] - centre[1], chord[0] - centre[0])
    sweep = (end - begin) * direction % (2 * pi)
    return direction * (2 * pi if isclose(sweep, 0, abs_tol=1e-12) else sweep)
