# SPDX-License-Identifier: Apache-2.0
"""Slow outputs through external shift registers."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ShiftOutput"]


class ShiftOutput(wiring.Component):
    """Sends a word over and over to a chain of shift registers, such as 74HC595.

    A frame has ``width`` bits, the highest first, and then the latch. A bit is on ``serial`` for
    ``2 * half`` clocks, with ``clock`` low in the first half of them and high in the second. After
    the last bit ``latch`` is high for ``half`` clocks and low for ``half`` more; then the next
    frame begins. So a frame takes ``(2 * width + 2) * half`` clocks. From its latch on, output n of
    the chain, counted from this end, is bit n of the word. The first frame begins one clock after
    reset.

    The outputs are combinational: they need a register before they leave the device.

    Parameters
    ----------
    width : int
        Bits of the word, at least 1.
    half : int
        Clocks of half a bit, at least 1.

    Members
    -------
    data : In(width)
        The word.
    take : Out(1)
        ``data`` is taken in this clock, the last before a frame.
    serial, clock, latch : Out(1)
        To the shift registers.

    Raises
    ------
    ValueError
        If a parameter is less than 1.
    """

    def __init__(self, *, width, half):
        if width < 1 or half < 1:
            raise ValueError(f"width and half must be at least 1, not {width!r} and {half!r}")
        self.width = width
        self.half = half
        super().__init__({"data": In(width), "take": Out(1), "serial": Out(1), "clock": Out(1),
                          "latch": Out(1)})

    def elaborate(self, platform):
        m = Module()

        last = 2 * self.width + 1  # halves of a frame: two per bit, and the latch up and down
        half = Signal(range(last + 1), init=last)
        count = Signal(range(self.half), init=self.half - 1)
        word = Signal(self.width)
        m.d.comb += [
            self.take.eq((half == last) & (count == self.half - 1)),
            self.serial.eq(word[-1]),
            self.clock.eq(half[0] & (half != last)),
            self.latch.eq(half == last - 1),
        ]

        with m.If(count != self.half - 1):
            m.d.sync += count.eq(count + 1)
        with m.Else():
            m.d.sync += count.eq(0)
            with m.If(self.take):
                m.d.sync += [half.eq(0), word.eq(self.data)]
            with m.Else():
                m.d.sync += half.eq(half + 1)
                with m.If(half[0]):
                    m.d.sync += word.eq(word << 1)

        return m
