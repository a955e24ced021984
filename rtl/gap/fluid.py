# SPDX-License-Identifier: Apache-2.0
"""Fluid detector: class of the fluid's resistance, from the codes of the conductivity cell."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

__all__ = ["FluidDetector"]

EDGES = 8  # codes with which an average is compared, one a clock


class FluidDetector(wiring.Component):
    """Fluid-resistance detector 11 and level discriminator 12 of the second patent.

    ``level`` is the average, rounded down, of ``samples`` samples in a row; it is valid one clock
    after the last of them. The other outputs follow 8 clocks later, once for each average. The
    settings are read in these 8 clocks: one that changes meanwhile makes a mixed decision, which
    the next average corrects.

    The codes fall from class 0, the highest resistance, to class 3. Threshold n lies between the
    classes n and n + 1. An average below ``threshold - hysteresis`` is past the threshold; one at
    ``threshold + hysteresis`` or above is not; one in between changes nothing. So the class may
    jump over others. It begins at 0, the class whose presets retreat first.

    The class does not change when the average is below ``lowest`` or above ``highest`` (a broken or
    shorted wire of the cell), nor when the settings are out of order: each class needs a code that
    always gives it. They are in order if ``highest >= threshold_0 + hysteresis``, ``threshold_0 -
    hysteresis > threshold_1 + hysteresis``, likewise for 1 and 2, and ``threshold_2 - hysteresis >
    lowest``.

    Parameters
    ----------
    samples : int
        Samples of an average, a power of two.

    Members
    -------
    sample : In(12)
        Code of the cell.
    sample_valid : In(1)
        ``sample`` is new. At least 10 clocks apart.
    threshold_0, threshold_1, threshold_2 : In(12)
        Codes, falling.
    hysteresis : In(8)
        In codes, to either side.
    lowest, highest : In(12)
        Codes that a sound cell gives, inclusive.
    manual : In(1)
        Switch by hand: ``class_`` is ``manual_class``.
    manual_class : In(2)
        Class set by hand.
    class_ : Out(2)
        Class in force, for the presets. ``manual`` and ``manual_class`` act in the same clock.
    changed : Out(1)
        ``class_`` differs from that of the clock before.
    measured : Out(2)
        Class of the fluid, also while ``manual``: for display.
    known : Out(1)
        There has been an average, so ``measured`` is valid.
    level : Out(12)
        Last average.
    broken_low, broken_high : Out(1)
        Last average was out of bounds.
    disordered : Out(1)
        Settings were out of order at the last average.

    Raises
    ------
    ValueError
        If ``samples`` is no power of two.
    """

    sample: In(12)
    sample_valid: In(1)
    threshold_0: In(12)
    threshold_1: In(12)
    threshold_2: In(12)
    hysteresis: In(8)
    lowest: In(12)
    highest: In(12)
    manual: In(1)
    manual_class: In(2)
    class_: Out(2)
    changed: Out(1)
    measured: Out(2)
    known: Out(1)
    level: Out(12)
    broken_low: Out(1)
    broken_high: Out(1)
    disordered: Out(1)

    def __init__(self, *, samples=16):
        if samples < 1 or samples & (samples - 1):
            raise ValueError(f"samples must be a power of two, not {samples!r}")
        self.shift = exact_log2(samples)
        super().__init__()

    def elaborate(self, platform):
        m = Module()

        # Average.
        count = Signal(self.shift)
        total = Signal(12 + self.shift)
        summed = Signal(12 + self.shift)  # wide enough for 2**shift samples
        busy = Signal()
        m.d.comb += summed.eq(total + self.sample)
        with m.If(self.sample_valid):
            m.d.sync += [count.eq(count + 1), total.eq(summed)]
            with m.If(count == (1 << self.shift) - 1):
                m.d.sync += [total.eq(0), self.level.eq(summed[self.shift:]), busy.eq(1)]

        # One comparator goes down the edges: highest + 1, threshold 0 + and - hysteresis, ...,
        # lowest. Edges are signed, so that none wraps.
        step = Signal(range(EDGES))
        base = Signal(12)
        spread = Signal(9)        # added to ``base``, with the carry
        carry = Signal()
        edge = Signal(signed(14))
        before = Signal(signed(14))
        below = Signal()          # the average is below the edge
        with m.Switch(step):
            with m.Case(0):
                m.d.comb += base.eq(self.highest)
            for n, threshold in enumerate((self.threshold_0, self.threshold_1, self.threshold_2)):
                with m.Case(2 * n + 1, 2 * n + 2):
                    m.d.comb += base.eq(threshold)
            with m.Default():
                m.d.comb += base.eq(self.lowest)
        minus = Signal()
        m.d.comb += [
            minus.eq(~step[0] & (step != 0)),
            carry.eq(~step[0]),
            spread.eq(Mux((step == 0) | (step == EDGES - 1), 0,
                          Cat(self.hysteresis, C(0, 1)) ^ minus.replicate(9))),
            edge.eq(base + spread.as_signed() + carry),
            below.eq(self.level < edge),
        ]

        # Number of thresholds that the average is past, and the other results.
        past = Signal(2)
        low_side = Signal()       # the last average was past this threshold
        add = Signal()
        ordered = Signal()
        above = Signal()
        in_order = Signal()
        m.d.comb += [
            low_side.eq(self.measured > ((step - 1) >> 1)[:2]),
            add.eq(below & (low_side == step[0])),  # not used in the first step and the last
            in_order.eq((ordered | (step == 0)) & (~step[0] | (edge < before))),
        ]
        with m.If(busy):
            m.d.sync += [
                step.eq(step + 1),
                before.eq(edge),
                ordered.eq(in_order),
                past.eq(Mux(step == 0, 0, past + add)),
            ]
            with m.If(step == 0):
                m.d.sync += above.eq(~below)
            with m.If(step == EDGES - 1):
                m.d.sync += [
                    busy.eq(0),
                    self.broken_low.eq(below),
                    self.broken_high.eq(above),
                    self.disordered.eq(~in_order),
                ]
                with m.If(in_order & ~below & ~above):
                    m.d.sync += [self.measured.eq(past), self.known.eq(1)]

        # Switching by hand.
        last = Signal(2)
        m.d.comb += [
            self.class_.eq(Mux(self.manual, self.manual_class, self.measured)),
            self.changed.eq(self.class_ != last),
        ]
        m.d.sync += last.eq(self.class_)

        return m
