# SPDX-License-Identifier: Apache-2.0
"""Mean gap voltage over a time, below a preset: a short as the fourth patent's prior art has it."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["MeanLevel"]

COUNT = 20  # bits: samples of a window, at most; further ones do not count


class MeanLevel(wiring.Component):
    """Says after each window whether the mean of the gap voltage was below a preset.

    Windows of ``window`` clocks follow each other while ``on`` is high; a low ``on`` drops the one
    under way. ``low`` is high for one clock, the one after the last of a window, if ``pulse`` was
    high in the window and the mean of its samples was below ``level``. A window without a sample or
    without a pulse is not judged: while the pulses stop the voltage is 0, and that is no short. All
    samples count the same, whether the pulse is on or off.

    ``window`` 0 is never. A shorter ``window`` ends the present one in the next clock if it is over
    by then; ``level`` acts on each sample as it comes. After ``2**20`` samples further ones do not
    count.

    Ref: fourth patent (wire finishing), prior art: a short is judged by the mean voltage below a
    preset. What the text does not say, the window and what counts as judged, is ours.

    Members
    -------
    sample : In(12), sample_valid : In(1)
        Gap voltage, code of the converter.
    pulse : In(1)
        A main pulse is on.
    on : In(1)
        Pulses are wanted and allowed, and the gap is not known to be shorted.
    level : In(12)
        The preset, code of the converter.
    window : In(24)
        Clocks.
    low : Out(1)
        The mean of the last window was below the preset.
    """

    sample: In(12)
    sample_valid: In(1)
    pulse: In(1)
    on: In(1)
    level: In(12)
    window: In(24)
    low: Out(1)

    def elaborate(self, platform):
        m = Module()

        # The sum of the differences is below 0 just when the mean is below the preset: no division.
        total = Signal(signed(13 + COUNT))
        count = Signal(COUNT)
        time = Signal(24)       # clocks of the window before this one
        seen = Signal()
        now = Signal(signed(13 + COUNT))
        pulsed = Signal()
        last = Signal()
        m.d.comb += [
            now.eq(total + Mux(self.sample_valid & ~count.all(), self.sample - self.level, 0)),
            pulsed.eq(seen | self.pulse),
            last.eq((self.window != 0) & (time + 1 >= self.window)),
        ]
        m.d.sync += self.low.eq(self.on & last & pulsed & (now < 0))
        with m.If(~self.on | last | (self.window == 0)):
            m.d.sync += [total.eq(0), count.eq(0), time.eq(0), seen.eq(0)]
        with m.Else():
            m.d.sync += [total.eq(now), count.eq(count + (self.sample_valid & ~count.all())),
                         time.eq(time + 1), seen.eq(pulsed)]

        return m
