# SPDX-License-Identifier: Apache-2.0
"""Reference model of the wait for the outside, on the record of all words."""

from dataclasses import dataclass, field


@dataclass
class Settling:
    """When each word last changed, and how long that counts.

    Call ``clock`` with the inputs of each clock, from the first one after reset on.
    """

    latch: int
    settle: int
    now: int = 0
    words: dict[str, int] = field(default_factory=lambda: {"supply": 0, "reference": 0})
    until: dict[str, int] = field(default_factory=dict)

    def __post_init__(self):
        self.until = dict.fromkeys(self.words, max(self.latch, self.settle))

    def clock(self, *, supply, reference, longer=0):
        """Return ``(latched, settled)`` and go to the next clock."""
        steady = []
        for name, word, least in (("supply", supply, self.latch),
                                  ("reference", reference, self.settle)):
            if word != self.words[name]:
                self.words[name] = word
                self.until[name] = self.now + max(least, longer)
            steady.append(int(self.now >= self.until[name]))
        self.now += 1
        return tuple(steady)
