# SPDX-License-Identifier: Apache-2.0
"""Messages that the gateware sends itself when the processor no longer can."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from softcore.tables.faults import alarm_line

__all__ = ["MEMORY", "SILENT", "FaultNotice"]

# Lines of an alarm, like those of the firmware. The digits of the address replace the zeros. Each
# starts with a line end, as the processor may have sent only part of a line before.
ALARM = f"\r\n{alarm_line('guard')} "
MEMORY = f"{ALARM}memory parity at 0x00000000\r\n".encode()
SILENT = f"{ALARM}watchdog: the processor does not answer\r\n".encode()
TEXT = MEMORY + SILENT
DIGITS = range(MEMORY.index(b"0x") + 2, len(MEMORY) - 2)


class FaultNotice(wiring.Component):
    """Holds the processor after a fault of its memory, or when it is silent, and tells the host.

    ``held`` is high from the clock after ``damaged`` or ``silent`` until reset. From then on a
    message is sent byte by byte, at once and again every ``period`` clocks: ``MEMORY``, with the
    address in hexadecimal digits, or ``SILENT``. Only the first of the two causes counts; if both
    come in one clock, ``damaged``.

    Parameters
    ----------
    period : int
        Clocks from one start of the message to the next. It must be longer than the message.

    Members
    -------
    damaged : In(1)
        A word of the memory has read wrong: a strobe.
    place : In(32)
        Its address. Read with ``damaged``.
    silent : In(1)
        The watchdog has found the processor silent.
    held : Out(1)
        No action of the processor may have any effect.
    by_damage : Out(1)
        ``held`` was caused by ``damaged``.
    data : Out(8), valid : Out(1), ready : In(1)
        Bytes for the line, each taken in a clock in which ``valid`` and ``ready`` are high.
    """

    def __init__(self, *, period):
        self.period = period
        super().__init__({
            "damaged": In(1), "place": In(32), "silent": In(1), "held": Out(1), "by_damage": Out(1),
            "data": Out(8), "valid": Out(1), "ready": In(1),
        })

    def elaborate(self, platform):
        m = Module()

        left = Signal(range(self.period), init=self.period - 1)  # clocks to the next start
        at = Signal(range(len(TEXT) + 1))
        begin, end = (Mux(self.by_damage, *places) for places in (
            (0, len(MEMORY)), (len(MEMORY), len(TEXT))))
        digits = Signal(32)  # the address; rotates once with every message
        digit = digits[28:]
        m.d.comb += self.valid.eq(self.held & (at != end))
        with m.Switch(at):
            for number, byte in enumerate(TEXT):
                with m.Case(number):
                    m.d.comb += self.data.eq(byte)
            with m.Default():
                m.d.comb += self.data.eq(TEXT[-1])
        within = (at >= DIGITS.start) & (at < DIGITS.stop)
        with m.If(within):
            m.d.comb += self.data.eq(digit + Mux(digit > 9, ord("A") - 10, ord("0")))

        with m.If((self.damaged | self.silent) & ~self.held):
            m.d.sync += [self.held.eq(1), self.by_damage.eq(self.damaged), digits.eq(self.place),
                         at.eq(Mux(self.damaged, 0, len(MEMORY)))]
        with m.If(self.held):
            m.d.sync += left.eq(Mux(left == 0, self.period - 1, left - 1))
            with m.If(left == 0):
                m.d.sync += at.eq(begin)
        with m.If(self.valid & self.ready):
            m.d.sync += at.eq(at + 1)
            with m.If(within):
                m.d.sync += digits.eq(Cat(digit, digits[:28]))

        return m
