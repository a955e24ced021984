# SPDX-License-Identifier: Apache-2.0
"""Reference model of the fluid detector: from whole averages to a class."""

from dataclasses import dataclass, field

DELAY = 8  # clocks from an average to the other outputs


@dataclass(frozen=True)
class Settings:
    """Thresholds and bounds in codes."""

    thresholds: tuple = (3670, 2819, 707)
    hysteresis: int = 20
    lowest: int = 40
    highest: int = 4030

    @property
    def ordered(self) -> bool:
        """Whether each class has a code that gives it, whatever the class was."""
        first, second, third = self.thresholds
        h = self.hysteresis
        return (first + h <= self.highest and second + h < first - h and third + h < second - h
                and self.lowest < third - h)


def classify(level: int, settings: Settings, before: int) -> int:
    """Class of an average; it was ``before``."""
    found = 0
    for number, threshold in enumerate(settings.thresholds):
        if level < threshold - settings.hysteresis:
            past = True
        elif level >= threshold + settings.hysteresis:
            past = False
        else:
            past = before > number
        found += past
    return found


@dataclass
class FluidDetector:
    """Outputs in this clock; ``class_`` and ``changed`` depend on the inputs of this clock."""

    samples: int = 16
    level: int = 0
    measured: int = 0
    known: bool = False
    broken_low: bool = False
    broken_high: bool = False
    disordered: bool = False
    waiting: int = 0                            # clocks to the decision
    kept: list = field(default_factory=list)    # samples of the coming average
    last: int = 0                               # class_ of the clock before

    def class_(self, manual: bool, manual_class: int) -> int:
        """Class that the presets follow."""
        return manual_class if manual else self.measured

    def clock(self, *, sample: int | None, settings: Settings, manual: bool, manual_class: int):
        """Take the inputs of one clock; the outputs are then those of the next."""
        self.last = self.class_(manual, manual_class)
        if self.waiting:
            self.waiting -= 1
            if not self.waiting:
                self._decide(settings)
        if sample is not None:
            self.kept.append(sample)
            if len(self.kept) == self.samples:
                self.level = sum(self.kept) // self.samples
                self.kept = []
                self.waiting = DELAY

    def _decide(self, settings):
        self.broken_low = self.level < settings.lowest
        self.broken_high = self.level > settings.highest
        self.disordered = not settings.ordered
        if not (self.broken_low or self.broken_high or self.disordered):
            self.measured = classify(self.level, settings, self.measured)
            self.known = True
