# SPDX-License-Identifier: Apache-2.0
"""Short detector: forms the signal Ss from single shorted pulses."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ShortDetector"]

WINDOW = 32  # samples looked back at, the newest included


class ShortDetector(wiring.Component):
    """Ss: N shorted pulses of the last M, or a short for longer than a time.

    A single shorted pulse is normal. ``shorted`` (Ss) rises in the clock after either

    * a shorted sample that makes at least ``needed`` shorted ones of the last ``window``; or
    * the clock that makes ``duration`` clocks with ``shorted_now`` high and no clear sample in
      between. Pauses between pulses do not count, and do not end the count.

    With ``by_mean`` it rises in the clock after one with ``mean_low`` instead, and by nothing else.

    ``completed`` is high in the first clock of ``shorted``. ``shorted`` falls in the clock after
    the last of ``clear_needed`` clear samples in a row; then all samples and clocks are forgotten.
    That end is the same with ``by_mean``: while pulses stop the mean voltage is 0.
    ``restart`` does the same from any state in the next clock, and wins over everything.

    ``window`` 0 counts as 1, and more than 32 as 32. ``needed`` 0 counts as 1, and more than
    ``window`` as ``window``: so a wrong setting makes Ss late, but never keeps it off.
    ``clear_needed`` 0 counts as 1; ``duration`` 0 switches that criterion off. A setting acts from
    the next sample or clock on. A change of ``window`` forgets the samples, that of its clock
    included, but neither Ss nor the clocks. Samples before reset count as clear.

    Members
    -------
    sample : In(1)
        A pulse was classified.
    sample_shorted : In(1)
        It was shorted, else clear. Valid with ``sample``.
    shorted_now : In(1)
        A pulse is on and shorted in this clock.
    by_mean, mean_low : In(1)
        Ss by the mean voltage, and it is below its preset; see ``rtl.gap.mean_level``.
    restart : In(1)
        Forget everything.
    needed, window : In(6)
        In samples.
    duration : In(24)
        In clocks.
    clear_needed : In(8)
        In samples.
    shorted : Out(1)
        The signal Ss.
    completed : Out(1)
        Ss has risen: high for one clock.
    """

    sample: In(1)
    sample_shorted: In(1)
    shorted_now: In(1)
    by_mean: In(1)
    mean_low: In(1)
    restart: In(1)
    needed: In(6)
    window: In(6)
    duration: In(24)
    clear_needed: In(8)
    shorted: Out(1)
    completed: Out(1)

    def __init__(self):
        super().__init__()
        # For tests too: clocks shorted without a clear sample; saturates.
        self.held = Signal(24)

    def elaborate(self, platform):
        m = Module()

        clear = Signal()
        m.d.comb += clear.eq(self.sample & ~self.sample_shorted)

        # A counter keeps the number of shorted ones among the older samples of the window: it goes
        # up or down when the sample that enters differs from the one that leaves.
        span = Signal(range(WINDOW))       # older samples in the window
        threshold = Signal(range(WINDOW))  # shorted ones of them, so that one more is enough
        older = Signal(WINDOW - 1)         # newest in bit 0
        count = Signal(range(WINDOW))
        leaving = Signal()
        other = Signal()                   # ``window`` has changed
        last_window = Signal(6)
        enough = Signal()
        with m.If(self.window > WINDOW):
            m.d.comb += span.eq(WINDOW - 1)
        with m.Elif(self.window != 0):
            m.d.comb += span.eq(self.window - 1)
        with m.If(self.needed > span):
            m.d.comb += threshold.eq(span)
        with m.Elif(self.needed != 0):
            m.d.comb += threshold.eq(self.needed - 1)
        m.d.comb += [
            leaving.eq(Mux(span == 0, self.sample_shorted, Cat(0, older).bit_select(span, 1))),
            other.eq(self.window != last_window),
            enough.eq((count >= threshold) & ~other),
        ]
        m.d.sync += last_window.eq(self.window)
        with m.If(other):
            m.d.sync += [older.eq(0), count.eq(0)]
        with m.Elif(self.sample):
            m.d.sync += older.eq(Cat(self.sample_shorted, older))
            m.d.sync += count.eq(count + self.sample_shorted - leaving)

        held = self.held
        enough_held = Signal()      # one more is enough
        m.d.comb += enough_held.eq((self.duration != 0) & (held + 1 >= self.duration))
        with m.If(clear):
            m.d.sync += held.eq(0)
        with m.Elif(self.shorted_now & ~held.all()):
            m.d.sync += held.eq(held + 1)

        clears = Signal(8)          # clear samples in a row
        m.d.sync += self.completed.eq(0)
        with m.If(self.restart | (self.shorted & clear & (clears + 1 >= self.clear_needed))):
            m.d.sync += [self.shorted.eq(0), older.eq(0), count.eq(0), held.eq(0),
                         clears.eq(0)]
        with m.Elif(self.shorted), m.If(self.sample):
            m.d.sync += clears.eq(Mux(self.sample_shorted, 0, clears + 1))
        with m.Elif(Mux(self.by_mean, self.mean_low,
                        (self.sample & self.sample_shorted & enough)
                        | (self.shorted_now & enough_held))):
            m.d.sync += [self.shorted.eq(1), self.completed.eq(1)]

        return m
