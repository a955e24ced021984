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

    A period is ``2**bits`` clocks of ``enable``; ``high`` is up at its start, for
    ``floor((magnitude + remainder) / 2**(15 - bits))`` clocks; what the division leaves is the next
    period's remainder. So at a constant magnitude each run of 2**15 clocks of ``enable`` has
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

        # In the second clock of the period and later: clocks of high output that are left, and 1.
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
    ``(1 - z**-1)**2``, as two sums: ``due``, of what was asked for less what was sent, and
    ``noise``, the sum of ``due``. ``due`` is kept exactly, whatever ``noise`` does, so nothing is
    ever lost on average: over any clocks of ``enable``, 2**15 times the number of high ones differs
    from the sum of the magnitudes by no more than the change of ``due``, which is

    * in (-1, 2) * 2**15 at a constant magnitude after ``clear`` (so that any window has the right
      number of pulses to within 3, and a long one the exact density),
    * in (-2.75, 3.5) * 2**15 for magnitudes that change at will.

    ``noise`` is held within 4 pulses. At a constant density between 0.15 and 0.9 it never gets
    there, and the noise is shaped by the second order. Nearer to the ends, where no one-bit
    modulator of second order is stable, the whole part of ``noise`` sticks at its bound and shaping
    falls back towards the first order; the mean stays exact up to full scale.

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
        The output, combinational; for this clock if ``enable`` is high. It does not depend on this
        clock's ``magnitude``: that is taken in for the next.
    """

    enable: In(1)
    clear: In(1)
    magnitude: In(BITS)
    high: Out(1)

    def elaborate(self, platform):
        m = Module()

        # Three bits before the point hold ``due`` and, with its bound, ``noise``; their sum needs
        # four. Half a pulse of offset in ``noise`` makes the decision the sign of the sum.
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

    The density of ``pulse`` is ``magnitude / 2**15`` on average, by the law of ``SigmaDelta`` or
    ``PulseWidth``, over the clocks in which the magnitude is not 0. Latency: one clock, through
    which PWM takes a new magnitude at the start of its next period only.

    A magnitude of 0 gives no pulse and lets the modulator rest where it is, and ``negative``
    stays. A change of sign with a magnitude makes one clock without a pulse, the one in
    which ``negative`` changes, and starts the modulator afresh. ``safe`` gives no pulse from the
    next clock on, positive sign, and a modulator at its start.

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
