# SPDX-License-Identifier: Apache-2.0
"""Serial port to the flash memory: one byte each way at a time."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["SECTOR", "FlashPort"]

SECTOR = 4096           # bytes that are erased together
SERIAL_HZ = 12_500_000  # highest serial clock: a quarter of what any of the parts can read at
BITS = 8


class FlashPort(wiring.Component):
    """Exchanges bytes with a serial flash memory, in SPI mode 0.

    ``start`` begins an exchange, from the next clock on; while ``busy`` it does nothing. Each of
    the 8 bits, the highest first, takes two halves of ``half`` clocks, ``clock`` low in the first
    and high in the second. ``clock`` is low otherwise. ``command`` has the bit during both halves.
    ``data`` is taken ``latency`` clocks after each rise of ``clock``. In the clock in which
    ``busy`` falls ``received`` is the whole byte, until the next exchange. Select is not part of
    this block: whoever gives the orders holds it around a command's bytes.

    ``half`` is the least that keeps the serial clock at or below 12.5 MHz. The outputs are
    combinational: they need a register before they leave the device.

    Parameters
    ----------
    clock_hz : int
        Frequency of ``sync``.
    latency : int
        Clocks from ``clock`` to the pin and from the pin to ``data``, 1 to 31. The default is that
        of ``rtl.pads``.

    Members
    -------
    start : In(1)
        Exchange a byte.
    send : In(8)
        The byte to the memory. Read with ``start``.
    busy : Out(1)
        An exchange is under way.
    received : Out(8)
        The byte from the memory.
    clock, command : Out(1)
        To the memory: its clock and its input.
    data : In(1)
        From the memory: its output.

    Raises
    ------
    ValueError
        If a parameter is out of its range.
    """

    start: In(1)
    send: In(BITS)
    busy: Out(1)
    received: Out(BITS)
    clock: Out(1)
    command: Out(1)
    data: In(1)

    def __init__(self, *, clock_hz, latency=4):
        if clock_hz < 1:
            raise ValueError(f"clock_hz must be at least 1, not {clock_hz!r}")
        if not 1 <= latency <= 31:
            raise ValueError(f"latency must be 1 to 31, not {latency!r}")
        self.half = -(-clock_hz // (2 * SERIAL_HZ))
        self.latency = latency
        super().__init__()

    def elaborate(self, platform):
        m = Module()

        halves = Signal(range(2 * BITS + 1))    # that are left; odd ones have the clock high
        count = Signal(range(self.half))
        word = Signal(BITS)
        rises = Signal(self.latency)
        m.d.comb += [
            self.clock.eq(halves[0]),
            self.command.eq(word[-1]),
            self.busy.eq((halves != 0) | rises.any()),
        ]
        m.d.sync += rises.eq(Cat(halves[0] & (count == 0), rises))

        with m.If(halves == 0):
            with m.If(self.start & ~self.busy):
                m.d.sync += [halves.eq(2 * BITS), word.eq(self.send)]
        with m.Elif(count != self.half - 1):
            m.d.sync += count.eq(count + 1)
        with m.Else():
            m.d.sync += [count.eq(0), halves.eq(halves - 1)]
            with m.If(halves[0]):
                m.d.sync += word.eq(word << 1)

        with m.If(rises[-1]):
            m.d.sync += self.received.eq(Cat(self.data, self.received[:-1]))
        return m
