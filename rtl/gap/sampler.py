# SPDX-License-Identifier: Apache-2.0
"""Front end of the serial converter that reads the gap voltage and the fluid cell."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Sampler"]

SERIAL_HZ = 16_000_000  # the converter's highest serial clock
BITS = 16               # of a frame
PHASES = 2 * BITS + 2   # halves of a frame: select low, select high, two of each bit
# Register "ADC mode control": manual mode, this channel next, channel id before the result. Bit 1
# (SWCNV) matters for the internal clock only; drivers proven on boards set it nevertheless.
COMMAND = 1 << 11 | 1 << 2 | 1 << 1
CHANNEL = 7             # lowest bit of the channel in it
PATIENCE = 4            # wrong answers in a row that are a fault


class Sampler(wiring.Component):
    """Asks a MAX11123 to MAX11125 for the gap voltage (channel 0) and the fluid cell (channel 1).

    Frames follow each other from reset on. A frame has 34 halves of ``half`` clocks each, where
    ``half`` is the least that keeps the serial clock at or below 16 MHz: one with ``adc_select``
    low; one with it high; and then, with it high, two for each of 16 bits, ``adc_clock`` low in the
    first of them and high in the second. ``adc_clock`` is high otherwise. Either side puts a bit on
    its wire at the fall and takes one at the rise, the highest first. The answer, 4 bits of channel
    and 12 of result, is to the frame before; so that of the first frame is not looked at. Of every
    ``every`` frames, from the first on, the last asks for the fluid cell.

    ``adc_data`` is taken ``latency`` clocks after each rise: an answer that is up to ``half``
    clocks later than that, or ``half - 1`` earlier, is read the same. One clock after the last bit
    the new result is in ``voltage`` or ``fluid``, and the ``valid`` of it high for one clock. An
    answer with a channel that was not asked for gives nothing.

    ``fault`` rises in the same clock with the fourth wrong answer in a row for one channel,
    whatever the answers for the other one are. (A line stuck low looks like right answers of
    channel 0 with 0 V; only those for channel 1 show it.) ``fault`` falls when the last answer of
    each channel was right. While it is high there are no results, and none from the answer that
    ends it.

    The outputs to the converter are combinational: they need a register before they leave the
    device.

    Ref: data sheet MAX11120 to MAX11128, ADC mode control register. Assumed of it, and not tried on
    a board: SCLK idles high, DIN is latched at its rise and DOUT changes at its fall; the fall of
    CS samples the channel that the frame before asked for; at power-on all inputs are unipolar
    and single-ended, without averaging.

    Parameters
    ----------
    clock_hz : int
        Frequency of ``sync``.
    every : int
        Frames of which one reads the fluid cell, at least 2.
    latency : int
        Clocks from ``adc_clock`` to the pin and from the pin to ``adc_data``, 1 to 31. The default
        is that of ``rtl.pads``.

    Members
    -------
    adc_select, adc_clock, adc_command : Out(1)
        To the converter: CS (active-high here), SCLK, DIN.
    adc_data : In(1)
        From the converter: DOUT.
    voltage : Out(12)
        Last result of the gap voltage.
    voltage_valid : Out(1)
        It is new: high for one clock.
    fluid : Out(12)
        Last result of the fluid cell.
    fluid_valid : Out(1)
        It is new: high for one clock.
    fault : Out(1)
        The converter does not answer for the channel that was asked for.

    Raises
    ------
    ValueError
        If a parameter is out of its range.
    """

    adc_select: Out(1)
    adc_clock: Out(1)
    adc_command: Out(1)
    adc_data: In(1)
    voltage: Out(12)
    voltage_valid: Out(1)
    fluid: Out(12)
    fluid_valid: Out(1)
    fault: Out(1)

    def __init__(self, *, clock_hz, every=16, latency=4):
        if clock_hz < 1:
            raise ValueError(f"clock_hz must be at least 1, not {clock_hz!r}")
        if every < 2:
            raise ValueError(f"every must be at least 2, not {every!r}")
        if not 1 <= latency <= 31:
            raise ValueError(f"latency must be 1 to 31, not {latency!r}")
        self.half = -(-clock_hz // (2 * SERIAL_HZ))
        self.every = every
        self.latency = latency
        super().__init__()

    def elaborate(self, platform):
        m = Module()

        # Halves count from the one with select low; bit n of a frame has 2 n + 2 and 2 n + 3.
        count = Signal(range(self.half))
        phase = Signal(range(PHASES))
        begins = Signal()  # first clock of the half
        rise = Signal()    # ... at which a bit is taken; the one before the first is shifted out
        last = Signal()    # ... of the last bit
        m.d.comb += [
            begins.eq(count == 0),
            self.adc_select.eq(phase != 0),
            self.adc_clock.eq(phase[0] | (phase == 0)),
            rise.eq(begins & phase[0]),
            last.eq(begins & (phase == PHASES - 1)),
        ]
        with m.If(count != self.half - 1):
            m.d.sync += count.eq(count + 1)
        with m.Else():
            m.d.sync += count.eq(0)
            m.d.sync += phase.eq(Mux(phase == PHASES - 1, 0, phase + 1))

        # Channels of this frame's command and of the answer in it; one bit each.
        frame = Signal(range(self.every))
        asked = Signal()
        answered = Signal()
        started = Signal()  # there was a command before: the answer counts
        expected = Signal()
        judged = Signal()
        m.d.comb += asked.eq(frame == self.every - 1)
        with m.Switch(phase[1:]):
            for bit in range(BITS):
                with m.Case(BITS - bit):
                    m.d.comb += self.adc_command.eq(asked if bit == CHANNEL else COMMAND >> bit & 1)
        with m.If(last):
            m.d.sync += [
                frame.eq(Mux(asked, 0, frame + 1)),
                answered.eq(asked),
                started.eq(1),
                expected.eq(answered),
                judged.eq(started),
            ]

        # The answer may arrive after the next frame has begun: so strobes take the same delay.
        rises = Signal(self.latency)
        lasts = Signal(self.latency)
        m.d.sync += [rises.eq(Cat(rise, rises)), lasts.eq(Cat(last, lasts))]
        before = Signal(BITS - 1)
        word = Signal(BITS)
        m.d.comb += word.eq(Cat(self.adc_data, before))
        with m.If(rises[-1]):
            m.d.sync += before.eq(word)

        wrong = Array(Signal(range(PATIENCE + 1), name=f"wrong_{n}") for n in range(2))
        right = Signal()
        taken = Signal()
        m.d.comb += [
            right.eq(word[12:] == expected),
            taken.eq(lasts[-1] & judged),
        ]
        m.d.sync += [self.voltage_valid.eq(0), self.fluid_valid.eq(0)]
        with m.If(taken & right):
            m.d.sync += wrong[expected].eq(0)
            with m.If(wrong[~expected] == 0):
                m.d.sync += self.fault.eq(0)
            with m.If(~self.fault & expected):
                m.d.sync += [self.fluid.eq(word), self.fluid_valid.eq(1)]
            with m.If(~self.fault & ~expected):
                m.d.sync += [self.voltage.eq(word), self.voltage_valid.eq(1)]
        with m.Elif(taken & (wrong[expected] != PATIENCE)):
            m.d.sync += wrong[expected].eq(wrong[expected] + 1)
            with m.If(wrong[expected] == PATIENCE - 1):
                m.d.sync += self.fault.eq(1)

        return m
