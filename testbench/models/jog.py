# SPDX-License-Identifier: Apache-2.0
"""Reference model of a jog, from grbl's contract: what is wrong with a line, or where it leads.

Ref: grbl 1.1, ``doc/markdown/jogging.md``, and ``doc/csv/error_codes_en_US.csv``.
"""

import re
from dataclasses import dataclass, field
from fractions import Fraction

PULSES_PER_MM = 10_000
# Errors of grbl.
BAD_NUMBER, NOT_IDLE, LOCKED, TRAVEL, WRONG_WORD, MODAL = 2, 8, 9, 15, 16, 21
NO_FEED, TWICE, MISSING, UNUSED = 22, 25, 28, 36
ALLOWED = {20, 21, 53, 90, 91}
EXCLUDED = ({20, 21}, {90, 91}, {53, 91})


def nearest(value: Fraction) -> int:
    """Nearest whole number; halves away from zero."""
    whole = int(abs(value) + Fraction(1, 2))
    return -whole if value < 0 else whole


@dataclass
class Jogger:
    """A machine at ``position`` (pulses), with what is in force for a line without codes.

    ``offset`` is the zero of the program frame, ``low`` and ``high`` are the soft limits, all in
    pulses; ``highest`` is the highest speed in mm/min.
    """

    position: list[int]
    offset: list[int]
    low: list[int]
    high: list[int]
    highest: int
    inch: bool = False
    incremental: bool = False
    wrong: set[int] = field(default_factory=set)

    def jog(self, text: str) -> set[int]:
        """Carry out the text after ``$J=``; return all errors that it has.

        Without an error ``position`` is the end of the jog; otherwise nothing changes.
        """
        self.wrong = set()
        text = re.sub(r"\([^)]*\)", "", text.upper())
        words = re.findall(r"([A-Z])\s*([-+]?[0-9]*\.?[0-9]*)", text)
        given = [float(number) for letter, number in words if letter == "G"]
        codes = set(given)
        if len(codes) < len(given):
            self.wrong.add(TWICE)
        values = {}
        for letter, number in words:
            if letter == "M" or (letter == "G" and float(number) not in ALLOWED):
                self.wrong.add(WRONG_WORD)
            elif letter not in "GXYZFN":
                self.wrong.add(UNUSED)
            elif letter != "G":
                if letter in values:
                    self.wrong.add(TWICE)
                values[letter] = Fraction(number)
        if any(pair <= codes for pair in EXCLUDED):
            self.wrong.add(MODAL)
        scale = Fraction(254, 10) if 20 in codes or (self.inch and 21 not in codes) else 1
        if not 0 < nearest(values.get("F", Fraction(0)) * scale * 1000) <= self.highest * 1000:
            self.wrong.add(NO_FEED)
        if not set(values) & set("XYZ"):
            self.wrong.add(MISSING)
        self._go({"XYZ".index(letter): nearest(value * scale * PULSES_PER_MM)
                  for letter, value in values.items() if letter in "XYZ"}, codes)
        return self.wrong

    def _go(self, words, codes):
        relative = 91 in codes or (self.incremental and not codes & {90, 53})
        target = list(self.position)
        for axis, value in words.items():
            frame = 0 if 53 in codes else self.offset[axis]
            target[axis] = value + (self.position[axis] if relative else frame)
            outward = (target[axis] > max(self.position[axis], self.high[axis])
                       or target[axis] < min(self.position[axis], self.low[axis]))
            if outward:
                self.wrong.add(TRAVEL)
        if not self.wrong:
            self.position = target
