# SPDX-License-Identifier: Apache-2.0
"""Reference model of the reversible error counter, in exact integers."""

from dataclasses import dataclass


def wrapped(value: int, bits: int) -> int:
    """The value of ``bits`` bits of two's complement."""
    half = 1 << (bits - 1)
    return (value + half) % (1 << bits) - half


@dataclass
class ErrorCounter:
    """Sums of the pulses, unbounded, and Er, which leaves out what does not fit."""

    width: int = 18
    commanded: int = 0
    moved: int = 0
    error: int = 0
    saturated: bool = False

    @property
    def limit(self) -> int:
        return (1 << (self.width - 1)) - 1

    def tick(self, pi: int, fp: int, adopt: bool = False) -> None:
        """Count the pulses (-1, 0 or +1) of a clock."""
        self.moved += fp
        self.commanded += pi
        if adopt:
            self.commanded = self.moved
            self.error = 0
            self.saturated = False
        elif abs(self.error + pi - fp) <= self.limit:
            self.error += pi - fp
        else:
            self.saturated = True
