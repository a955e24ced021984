# SPDX-License-Identifier: Apache-2.0
"""Reference model of the soft limits of an axis."""

from dataclasses import dataclass


@dataclass
class SoftLimits:
    """Call ``clock`` for every clock; ``command`` is the sum of what passed."""

    low: int
    high: int
    command: int = 0
    moved: bool = False        # in the clock before
    beyond: frozenset = frozenset()
    onto: bool = False

    def clock(self, pi: int, *, barred=(), clear=False) -> bool:
        """Whether a pulse (-1, 0 or +1) passes; ``barred`` has the directions of live switches."""
        room = self.command < self.high if pi > 0 else self.command > self.low
        within = bool(pi) and room and not self.moved
        self.onto = bool(pi) and pi in barred
        passed = within and not self.onto
        if clear:
            self.beyond = frozenset()
        elif pi and not within:
            self.beyond |= {pi}
        self.command += pi * passed
        self.moved = passed or clear
        return passed
