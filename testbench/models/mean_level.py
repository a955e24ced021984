# SPDX-License-Identifier: Apache-2.0
"""Reference model of the mean voltage below a preset: keeps all samples of the window."""

from dataclasses import dataclass, field

MOST = 2**20 - 1        # samples that count


@dataclass
class MeanLevel:
    """``low`` in this clock, after calls of ``clock`` for those before."""

    low: bool = False
    above: list = field(default_factory=list)   # sample less preset, of the window under way
    clocks: int = 0
    pulsed: bool = False
    judged: int = 0                             # windows that had a sample and a pulse

    def clock(self, *, sample, pulse, on, level, window):
        """Take the inputs of one clock, ``sample`` None for none."""
        self.low = False
        if not on or not window:
            self._begin()
            return
        if sample is not None and len(self.above) < MOST:
            self.above.append(sample - level)
        self.pulsed |= bool(pulse)
        self.clocks += 1
        if self.clocks < window:
            return
        if self.above and self.pulsed:
            self.judged += 1
            self.low = sum(self.above) / len(self.above) < 0
        self._begin()

    def _begin(self):
        self.above, self.clocks, self.pulsed = [], 0, False
