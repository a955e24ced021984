# SPDX-License-Identifier: Apache-2.0
"""Reference model of the quadrature decoder."""

from collections import deque
from dataclasses import dataclass, field

CYCLE = ((0, 0), (1, 0), (1, 1), (0, 1))  # levels of (a, b) going up


@dataclass
class Encoder:
    """Filtered levels as a place in the cycle of four, and what its changes meant."""

    samples: int = 3
    settle: int = 15
    clocks: int = 0
    levels: list = field(default_factory=lambda: [0, 0])
    illegal: bool = False
    seen: list = field(default_factory=list)

    def __post_init__(self):
        self.seen = [deque([0] * self.samples, maxlen=self.samples) for _ in range(2)]

    def tick(self, a: int, b: int, clear: bool = False) -> tuple[int, bool]:
        """Sample the phases; return the pulse (-1, 0 or +1) and whether there was a jump."""
        before = CYCLE.index(tuple(self.levels))
        for phase, level in enumerate((a, b)):
            self.seen[phase].append(level)
            if len(set(self.seen[phase])) == 1:
                self.levels[phase] = level
        turned = (CYCLE.index(tuple(self.levels)) - before) % 4
        self.clocks += 1
        if self.clocks <= self.settle:
            turned = 0
        jump = turned == 2
        self.illegal = (self.illegal or jump) and not clear
        return {0: 0, 1: 1, 2: 0, 3: -1}[turned], jump
