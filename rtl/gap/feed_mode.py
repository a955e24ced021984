# SPDX-License-Identifier: Apache-2.0
"""Feed modes: the feed at the front by the mean gap voltage, or by Es/Ex."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["FeedCalculator", "FeedMode"]

FACTOR = 16   # bits: deviation of the voltage, or ratio
SCALE = 12    # bits of the product below the rate
RATE = 30


class FeedMode(enum.Enum, shape=2):
    """What the feed at the front depends on."""

    CONSTANT = 0  # G94, and G95 P1: F
    ZERO = 1      # G95 P2: K (V - Vs), also backwards
    OFFSET = 2    # G95 P3: F + K (V - Vs)
    REMOVAL = 3   # G95 P4, P5: F Es/Ex


class FeedCalculator(wiring.Component):
    """Feed pulse calculator 13 of the fourth patent, in any of the feed modes.

    * ``CONSTANT``: ``feed`` is ``rate``, in the same clock.
    * ``ZERO``: steps, forward while the voltage is above ``reference`` and backward below it. Their
      rate is ``gain * |mean - reference| / 2**12``, in 2**-32 step/clock. Each step is ``up`` or
      ``down`` for one clock, and ``rtl.motion.servo`` makes a path pulse of it. ``feed`` is
      ``rate``: the path goes no faster, and steps above it are lost.
    * ``OFFSET``: ``feed`` is ``rate`` plus or minus the rate of ``ZERO``, at least 0.
    * ``REMOVAL``: ``feed`` is ``rate * ratio / 2**12``.

    Products are rounded down. In the last two modes ``feed`` is at most ``highest``, and is
    ``rate`` for the first 42 clocks. While ``known`` is low the voltage counts as the reference:
    ``ZERO`` makes no steps and ``OFFSET`` gives ``rate``.

    The block computes in rounds of 21 clocks and reads its inputs as it goes. A change of an input
    or of the mode takes full effect within 42 clocks; until then a result may mix old and new
    values. The phase of the steps continues over changes. ``held`` stops the steps and clears the
    phase.

    With a window of ``rtl.gap.removal`` over time, ``ZERO`` and ``OFFSET`` are the feed modes of JP
    3231567 B for rough and finish cuts, as the fourth patent describes them. With a window over a
    distance, ``OFFSET`` equals ``REMOVAL`` to the first order around ``reference = no_load - Es``,
    if ``gain`` is ``rate / Es``.

    Members
    -------
    mode : In(FeedMode)
    rate : In(30)
        F, the feed of the segment, 2**-32 pulse/clock.
    highest : In(30)
        Highest feed, 2**-32 pulse/clock.
    gain : In(30)
        K: 2**-32 pulse/clock for each sixteenth of full scale (2**12 levels).
    mean, reference : In(16)
        V and Vs: levels, 2**-16 of the converter's full scale.
    known : In(1)
        ``mean`` is valid.
    ratio : In(16)
        Es/Ex, 1/4096.
    held : In(1)
        No steps: the machine is not at the front, or on hold, or the gap is short.
    feed : Out(30)
        2**-32 pulse/clock.
    up, down : Out(1)
        A step backward, forward: high for one clock.
    """

    ROUND = FACTOR + 5  # clocks

    mode: In(FeedMode)
    rate: In(RATE)
    highest: In(RATE)
    gain: In(RATE)
    mean: In(FACTOR)
    reference: In(FACTOR)
    known: In(1)
    ratio: In(FACTOR)
    held: In(1)
    feed: Out(RATE)
    up: Out(1)
    down: Out(1)

    def elaborate(self, platform):
        m = Module()

        removal = Signal()
        m.d.comb += removal.eq(self.mode == FeedMode.REMOVAL)
        step = Signal(range(self.ROUND))
        m.d.sync += step.eq(Mux(step == self.ROUND - 1, 0, step + 1))

        deviation = Signal(signed(FACTOR + 1))
        below = Signal()              # the product of this round is negative
        multiplicand = Signal(RATE)
        product = Signal(RATE + FACTOR)  # starts with the factor in its low bits, shifted out
        partial = Signal(RATE + 1)
        m.d.comb += partial.eq(product[FACTOR:] + Mux(product[0], multiplicand, 0))
        size = Signal(RATE)           # magnitude of the product, limited to the range of a rate
        total = Signal(signed(RATE + 2))
        result = Signal(RATE)
        speed = Signal(RATE)          # rate of the steps
        back = Signal()
        rounds = Signal(2)
        with m.Switch(step):
            with m.Case(0):
                m.d.sync += deviation.eq(Mux(self.known, self.mean - self.reference, 0))
            with m.Case(1):
                m.d.sync += [
                    below.eq((deviation < 0) & ~removal),
                    multiplicand.eq(Mux(removal, self.rate, self.gain)),
                    product.eq(Mux(removal, self.ratio, abs(deviation)[:FACTOR])),
                ]
            with m.Case(self.ROUND - 3):
                m.d.sync += size.eq(Mux(product[SCALE + RATE:].any(), (1 << RATE) - 1,
                                        product[SCALE:]))
            with m.Case(self.ROUND - 2):
                m.d.sync += [
                    # To subtract, the complement and a carry are added.
                    total.eq(Mux(removal, 0, self.rate) + (size ^ below.replicate(RATE + 2))
                             .as_signed() + below),
                    speed.eq(size),
                    back.eq(below),
                ]
            with m.Case(self.ROUND - 1):
                m.d.sync += result.eq(Mux(total < 0, 0, Mux(
                    total > Cat(self.highest, C(0, 2)).as_signed(), self.highest, total)))
                with m.If(rounds != 2):
                    m.d.sync += rounds.eq(rounds + 1)
            with m.Default():
                m.d.sync += product.eq(Cat(product[1:FACTOR], partial))

        by_product = Signal()
        m.d.comb += [
            by_product.eq((self.mode == FeedMode.OFFSET) | removal),
            self.feed.eq(Mux(by_product & (rounds == 2), result, self.rate)),
        ]
        with m.If(self.mode == FeedMode.CONSTANT):
            m.d.sync += rounds.eq(0)

        phase = Signal(32)
        due = Signal()
        m.d.sync += [self.up.eq(due & back & ~self.held), self.down.eq(due & ~back & ~self.held)]
        with m.If(self.held | (self.mode != FeedMode.ZERO) | (rounds != 2)):
            m.d.sync += [phase.eq(0), due.eq(0)]
        with m.Else():
            m.d.sync += Cat(phase, due).eq(phase + speed)

        return m
