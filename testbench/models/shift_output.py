# SPDX-License-Identifier: Apache-2.0
"""Reference models: what the shift output sends, and the registers that receive it."""


def frame(word: int, *, width: int, half: int) -> list[tuple[int, int, int]]:
    """(serial, clock, latch) in every clock of the frame of ``word``; None: it does not matter."""
    halves = []
    for bit in reversed(range(width)):
        level = word >> bit & 1
        halves += [(level, 0, 0), (level, 1, 0)]
    halves += [(None, 0, 1), (None, 0, 0)]
    return [levels for levels in halves for _ in range(half)]


class ShiftRegisters:
    """A chain of 74HC595: shifts and latches on rising edges; ``outputs`` bit 0 is the nearest."""

    def __init__(self, width: int):
        self.width = width
        self.shifted = 0
        self.outputs = 0
        self.clock = self.latch = 0

    def see(self, serial: int, clock: int, latch: int) -> bool:
        """Take the levels of the three wires; return whether the outputs were loaded anew."""
        if clock and not self.clock:
            self.shifted = (self.shifted << 1 | serial) & (1 << self.width) - 1
        loaded = bool(latch and not self.latch)
        if loaded:
            self.outputs = self.shifted
        self.clock, self.latch = clock, latch
        return loaded
