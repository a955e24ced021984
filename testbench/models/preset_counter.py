# SPDX-License-Identifier: Apache-2.0
"""Reference model of the preset counters: each keeps its pulses, and counts them all each time."""

from dataclasses import dataclass, field

from testbench.models.discriminator import DAME, OK, OPEN, SHORT

ACCUMULATE, CONSECUTIVE, TOTAL, RELATIVE, OWN_GATE, OK_ALONE = range(6)     # else ACCUMULATE
CLASSES = {5: (DAME, SHORT), 6: (OPEN,), 7: (OK,)}


@dataclass(frozen=True)
class Outputs:
    """Outputs of one clock."""

    up: bool = False
    down: bool = False
    strobe: bool = False
    dame_full: bool = False
    open_full: bool = False
    ok_full: bool = False


@dataclass
class PresetCounters:
    """One call of ``clock`` a clock."""

    full: set = field(default_factory=set)  # of 5 and 6, and in OK_ALONE of 7
    kept: dict = field(default_factory=lambda: {5: [], 6: [], 7: []})  # (kind, weight) of pulses
    window: list = field(default_factory=list)
    age: int = 0                            # clocks since the strobe
    mode: int = ACCUMULATE                  # of the last clock
    gone: tuple = (False, False, False)     # up, down, strobe and
    overflow: bool = False                  # output of 7: of the last clock, seen in this one

    def clock(self, *, sample, kind, dame, open_, ok, mode, window, weight, period, freeze):
        """Return the outputs of this clock, and go to the next."""
        up, down, strobe = (False, False, False) if freeze else self.gone
        seen = Outputs(up, down, strobe, 5 in self.full, 6 in self.full,
                       self.overflow or 7 in self.full)

        presets = {5: dame, 6: open_, 7: ok}
        changed, self.mode = mode != self.mode, mode
        self.overflow = False
        if freeze or changed:
            self._clear(5, 6, 7)
            self.window = []
        self._clear(*(number for number, preset in presets.items() if not preset))
        if sample and not (freeze or changed):
            self._pulse(kind, weight, presets, max(window, 1))

        self.age = 0 if freeze or not period else self.age + 1
        strobe = bool(period) and self.age >= period
        if mode == OK_ALONE:
            up = strobe and 7 in self.full
            down = strobe and bool(ok) and not up and not (freeze or changed)
        else:
            up = strobe and 5 in self.full
            down = strobe and 6 in self.full and not up
        if strobe:
            self.age = 0
        if up or down:
            self._clear(*(self.full if mode == OWN_GATE else {7} if mode == OK_ALONE else {5, 6}))
            if mode == TOTAL:
                self._clear(7)
                self.window = []
        self.gone = up, down, strobe
        return seen

    def _clear(self, *numbers):
        for number in numbers:
            self.full.discard(number)
            self.kept[number] = []

    def _pulse(self, kind, weight, presets, window):
        for number, preset in presets.items():
            if preset and (self.mode == TOTAL or number not in self.full):
                self.kept[number].append((kind, weight))
        self.window.append(kind)
        if self.mode == TOTAL:
            if len(self.window) < window:
                return
            asked = {5, 6, 7}
            self.full, self.window = set(), []
        else:
            asked = {number for number, kinds in CLASSES.items() if kind in kinds}
            if self.mode == RELATIVE:
                asked -= {7}
            if self.mode == OK_ALONE:
                asked &= {7}
        reached = {number for number in asked
                   if presets[number] and self._count(number) >= presets[number]}
        if 7 in reached and self.mode != OK_ALONE:
            self._clear(5, 6, 7)
            self.overflow = True
        else:
            self.full |= reached
        if self.mode == TOTAL:
            self.kept = {5: [], 6: [], 7: []}

    def _count(self, number):
        count = 0
        for kind, weight in self.kept[number]:
            if kind in CLASSES[number]:
                count += 1
            elif self.mode == CONSECUTIVE:
                count = 0
            elif self.mode == RELATIVE and kind == OK:
                count = max(count - weight, 0)
        return count
