# SPDX-License-Identifier: Apache-2.0
"""Digital-to-analog converter: a velocity command as the density of pulses on one pin."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Dac", "PulseWidth", "SigmaDelta"]

BITS = 15  # of the magnitude; full scale of the analog side is 2**15


def check_bits(bits):
    """Raise ``ValueError`` unless PWM can have a period of ``2**bits`` clocks."""
    if not 1 <= bits <= BITS:
        raise ValueError(f"period of the PWM must have 1 to {BITS} bits, not {bits!r}")


def check_modulator(name):
    """Raise ``ValueError`` unless there is such a modulator."""
    if name not in ("sigma_delta", "pwm"):
        raise ValueError(f"modulator must be sigma_delta or pwm, not {name!r}")


class PulseWidth(wiring.Component):
    """Pulse-width modulator with carried remainder.

    A period is ``2**bits`` clocks of ``enable``. It begins with ``high`` up for
    ``floor((magnitude + remainder) / 2**(15 - bits))`` clocks; the remainder of the division goes
    into the next period. So at a constant magnitude any run of 2**15 clocks of ``enable`` has
    exactly ``magnitude`` of them high, wherever it starts. ``magnitude`` is read in the first clock
    of the period. ``clear`` begins a period, with no remainder.

    Parameters
    ----------
    bits : int
        Logarithm of the period, 1 to 15.

    Members
    -------
    enable : In(1)
        Go on by one clock.
    clear : In(1)
        Start afresh in the next clock.
    magnitude : In(15)
        Density wanted, in 2**-15.
    high : Out(1)
        The output, combinational; for this clock if ``enable`` is high.

    Raises
    ------
    ValueError
        If ``bits`` is out of range.
    """

    def __init__(self, *, bits=10):
        check_bits(bits)
        self.bits = bits
        super().__init__({
            "enable":    In(1),
            "clear":     In(1),
            "magnitude": In(BITS),
            "high":      Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        clock = Signal(self.bits)
        remainder = Signal(BITS - self.bits)
        total = Signal(BITS + 1)
        m.d.comb += total.eq(self.magnitude + remainder)
        duty = total[BITS - self.bits:]

        # From the second clock of the period on: clocks of high output still to come, plus 1.
        left = Signal(self.bits + 1)
        first = Signal()
        m.d.comb += [
            first.eq(clock == 0),
            self.high.eq(Mux(first, duty != 0, left > 1)),
        ]
        with m.If(self.enable):
            m.d.sync += clock.eq(clock + 1)
            with m.If(first):
                m.d.sync += [remainder.eq(total), left.eq(duty)]
            with m.Elif(left > 1):
                m.d.sync += left.eq(left - 1)
        with m.If(self.clear):
            m.d.sync += [clock.eq(0), remainder.eq(0)]

        return m


class SigmaDelta(wiring.Component):
    """Second-order sigma-delta modulator with one bit of output.

    The error-feedback form ``high = (magnitude + 2 e1 - e2 >= 1/2)`` of the noise transfer function
    ``(1 - z**-1)**2``, as two sums: ``due`` sums what was asked for less what was sent, and
    ``noise`` sums ``due``. ``due`` is exact, whatever ``noise`` does, so the mean is exact: over
    any clocks of ``enable``, 2**15 times the number of high ones differs from the sum of the
    magnitudes by no more than the range of ``due``. ``due`` is

    * in (-1, 2) * 2**15 at a constant magnitude after ``clear`` (so that any window has the right
      number of pulses to within 3, and a long one the exact density),
    * in (-2.75, 3.5) * 2**15 for magnitudes that change at will.

    ``noise`` is limited to 4 pulses. At a constant density between 0.15 and 0.9 it never gets
    there, and the noise shaping is of second order. Nearer to the ends no one-bit modulator of
    second order is stable: there ``noise`` stays at its limit and the shaping falls back towards
    first order. The mean stays exact up to full scale.

    Bounds: ``testbench/unit/rtl/test_dac.py``, over every constant magnitude and, with a coarser
    magnitude, over every state that any sequence of magnitudes can reach.

    Members
    -------
    enable : In(1)
        Go on by one clock.
    clear : In(1)
        Start afresh in the next clock.
    magnitude : In(15)
        Density wanted, in 2**-15.
    high : Out(1)
        The output, combinational; for this clock if ``enable`` is high. This clock's ``magnitude``
        acts on the next output, not on this one.
    """

    enable: In(1)
    clear: In(1)
    magnitude: In(BITS)
    high: Out(1)

    def elaborate(self, platform):
        m = Module()

        # Three bits before the point hold ``due`` and the limited ``noise``; their sum needs four.
        # ``noise`` has half a pulse of offset, so that the sign of the sum is the decision.
        due = Signal(signed(BITS + 3))
        noise = Signal(signed(BITS + 3), init=-(1 << (BITS - 1)))
        total = Signal(signed(BITS + 4))
        whole = Signal(signed(4))
        m.d.comb += [
            total.eq(noise + due),
            self.high.eq(~total[-1]),
            whole.eq(total[BITS:].as_signed() - self.high),
        ]

        # A high output takes away a whole pulse, so only the bits before the point see it: the
        # carries of the two sums run side by side and not through each other.
        asked = Signal(signed(BITS + 3))
        m.d.comb += asked.eq(due + self.magnitude)
        with m.If(self.enable):
            m.d.sync += [
                due.eq(Cat(asked[:BITS], asked[BITS:] - self.high)),
                noise.eq(Cat(total[:BITS], whole)),
            ]
            with m.If(whole > 3):
                m.d.sync += noise[BITS:].eq(3)
            with m.If(whole < -4):
                m.d.sync += noise[BITS:].eq(-4)
        with m.If(self.clear):
            m.d.sync += [due.eq(due.init), noise.eq(noise.init)]

        return m


class Dac(wiring.Component):
    """Sign-magnitude velocity command as a train of pulses and a sign.

    The density of ``pulse`` is ``magnitude / 2**15`` on average over the clocks in which the
    magnitude is not 0; ``SigmaDelta`` and ``PulseWidth`` state it exactly. Latency: one clock; PWM
    takes a new magnitude only at the start of its next period.

    At a magnitude of 0 there is no pulse, the modulator stops where it is, and ``negative`` keeps
    its value. When the sign of a magnitude changes, there is no pulse in the clock in which
    ``negative`` changes, and the modulator starts afresh. From the clock after ``safe`` on there
    is no pulse, the sign is positive, and the modulator is at its start.

    Parameters
    ----------
    modulator : str
        ``"sigma_delta"`` or ``"pwm"``.
    bits : int
        Logarithm of the period of PWM in clocks.

    Members
    -------
    magnitude : In(15)
        Size of the velocity, full scale 2**15 - 1.
    reverse : In(1)
        Its sign, high for negative.
    safe : In(1)
        No pulses.
    pulse : Out(1)
        To the pin.
    negative : Out(1)
        To the pin; sign of the pulses.

    Raises
    ------
    ValueError
        If there is no such modulator, or ``bits`` is out of range.
    """

    def __init__(self, modulator="sigma_delta", *, bits=10):
        check_modulator(modulator)
        check_bits(bits)
        self.modulator = modulator
        self.bits = bits
        super().__init__({
            "magnitude": In(BITS),
            "reverse":   In(1),
            "safe":      In(1),
            "pulse":     Out(1),
            "negative":  Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        sigma_delta = self.modulator == "sigma_delta"
        modulator = SigmaDelta() if sigma_delta else PulseWidth(bits=self.bits)
        m.submodules.modulator = modulator

        wanted = Signal()
        turning = Signal()
        m.d.comb += [
            wanted.eq(self.magnitude != 0),
            turning.eq(wanted & (self.reverse != self.negative)),
            modulator.magnitude.eq(self.magnitude),
            modulator.enable.eq(wanted & ~turning & ~self.safe),
            modulator.clear.eq(turning | self.safe),
        ]
        m.d.sync += self.pulse.eq(modulator.high & modulator.enable)
        with m.If(self.safe):
            m.d.sync += self.negative.eq(0)
        with m.Elif(turning):
            m.d.sync += self.negative.eq(self.reverse)

        return m
