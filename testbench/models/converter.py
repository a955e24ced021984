# SPDX-License-Identifier: Apache-2.0
"""Model of the serial converter at its pins: MAX11123 to MAX11125, manual mode."""

from collections.abc import Callable
from dataclasses import dataclass

BITS = 16


@dataclass
class Converter:
    """Answers with the channel asked for in the last whole frame, as sampled when this one began.

    ``read`` gives the code of a channel, 0 to 4095. The pins idle with ``select`` low (active high
    here) and ``clock`` high. A bit goes out at the fall of the clock and comes in at its rise, the
    highest first. A frame of less than 16 bits asks for nothing. Without a command since power-on
    the result is that of channel 0, and has a zero before it and three behind in place of a channel
    before it. DOUT floats while there is no select, and is ``floating`` then.
    """

    read: Callable[[int], int]
    floating: int = 1
    channel: int = 0
    identified: bool = False
    select: int = 0
    clock: int = 1
    word: int = 0      # of the answer
    command: int = 0
    bits: int = 0      # of the command, that have come
    data: int = 0

    def tick(self, *, select: int, clock: int, command: int) -> int:
        """Take the levels of the pins in one clock; returns that of DOUT in it."""
        if select and not self.select:
            code = self.read(self.channel)
            self.word = self.channel << 12 | code if self.identified else code << 3
            self.command = self.bits = self.data = 0
        elif select and self.clock and not clock:
            self.data = self.word >> BITS - 1
            self.word = self.word << 1 & (1 << BITS) - 1
        elif select and clock and not self.clock:
            self.command = self.command << 1 | command
            self.bits += 1
            if self.bits == BITS:
                self._obey()
        self.select, self.clock = select, clock
        return self.data if select else self.floating

    def _obey(self):
        if self.command >> 11 == 0b00001:  # mode control, manual; others do not occur here
            self.channel = self.command >> 7 & 15
            self.identified = bool(self.command >> 2 & 1)
