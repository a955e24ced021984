# SPDX-License-Identifier: Apache-2.0
"""What the gateware tells by itself, when the processor no longer can."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["MEMORY", "FaultNotice"]

# An alarm's line, as the firmware's are; the digits of the place are put in for the zeros. It
# begins a line of its own: who knows what stood before. 55 is FAULT_GUARD of the firmware.
MEMORY = b"\r\nALARM:55 memory parity at 0x00000000\r\n"
DIGITS = range(MEMORY.index(b"0x") + 2, len(MEMORY) - 2)


class FaultNotice(wiring.Component):
    """Holds the processor after a fault of its memory, and tells the fault in its place.

    ``held`` is high from the clock after ``damaged`` on until reset. From then on the sentence
    ``MEMORY`` is offered, byte by byte, with the place of the first fault in hexadecimal digits:
    at once, and again every ``period`` clocks.

    Parameters
    ----------
    period : int
        Clocks from one beginning of the sentence to the next. It must be over by then.

    Members
    -------
    damaged : In(1)
        A word of the memory has read wrong: a strobe.
    place : In(32)
        Its address. Read with ``damaged``.
    held : Out(1)
        Nothing that the processor does may have any effect.
    data : Out(8), valid : Out(1), ready : In(1)
        Bytes for the line, each taken in a clock in which ``valid`` and ``ready`` are high.
    """

    def __init__(self, *, period):
        self.period = period
        super().__init__({
            "damaged": In(1), "place": In(32), "held": Out(1),
            "data": Out(8), "valid": Out(1), "ready": In(1),
        })

    def elaborate(self, platform):
        m = Module()

        left = Signal(range(self.period), init=self.period - 1)  # clocks to the next beginning
        at = Signal(range(len(MEMORY) + 1))
        digits = Signal(32)  # of the place; once round with every sentence
        digit = digits[28:]
        m.d.comb += self.valid.eq(self.held & (at != len(MEMORY)))
        with m.Switch(at):
            for number, byte in enumerate(MEMORY):
                with m.Case(number):
                    m.d.comb += self.data.eq(byte)
            with m.Default():
                m.d.comb += self.data.eq(MEMORY[-1])
        within = (at >= DIGITS.start) & (at < DIGITS.stop)
        with m.If(within):
            m.d.comb += self.data.eq(digit + Mux(digit > 9, ord("A") - 10, ord("0")))

        with m.If(self.damaged & ~self.held):
            m.d.sync += [self.held.eq(1), digits.eq(self.place)]
        with m.If(self.held):
            m.d.sync += left.eq(Mux(left == 0, self.period - 1, left - 1))
            with m.If(left == 0):
                m.d.sync += at.eq(0)
        with m.If(self.valid & self.ready):
            m.d.sync += at.eq(at + 1)
            with m.If(within):
                m.d.sync += digits.eq(Cat(digit, digits[:28]))

        return m
