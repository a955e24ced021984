# SPDX-License-Identifier: Apache-2.0
"""Reference model of the short detector: keeps every sample since it last forgot."""

from dataclasses import dataclass, field


@dataclass
class ShortDetector:
    """The signal Ss; ``completed`` is true in its first clock."""

    shorted: bool = False
    completed: bool = False
    samples: list = field(default_factory=list)  # true for shorted, oldest first
    looked_at: list = field(default_factory=list)  # those since the last change of the window
    clocks: int = 0                              # shorted, since the last clear sample
    setting: int = 0                             # window as set in the last clock

    def clock(self, *, sample, sample_shorted, shorted_now, restart, needed, window, duration,
              clear_needed, by_mean=False, mean_low=False):
        """Take the inputs of one clock; the outputs are then those of the next."""
        changed, self.setting = window != self.setting, window
        window = min(max(window, 1), 32)
        needed = min(max(needed, 1), window)
        clear_needed = max(clear_needed, 1)
        was, self.completed = self.shorted, False
        if restart:
            self._forget()
            return
        if sample:
            self.samples.append(bool(sample_shorted))
            self.looked_at.append(bool(sample_shorted))
        if changed:
            self.looked_at = []
        if sample and not sample_shorted:
            self.clocks = 0
        elif shorted_now:
            self.clocks += 1
        if was:
            self._clear(sample, clear_needed)
            return
        ratio = (sample and sample_shorted and not changed
                 and sum(self.looked_at[-window:]) >= needed)
        held = duration and shorted_now and self.clocks >= duration
        if mean_low if by_mean else ratio or held:
            self.shorted = self.completed = True
            self.since = len(self.samples)

    def _clear(self, sample, clear_needed):
        recent = self.samples[self.since:][-clear_needed:]
        if sample and len(recent) == clear_needed and not any(recent):
            self._forget()

    def _forget(self):
        self.shorted, self.samples, self.looked_at, self.clocks = False, [], [], 0
