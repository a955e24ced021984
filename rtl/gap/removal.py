# SPDX-License-Identifier: Apache-2.0
"""Removal detector: mean gap voltage over a unit distance, drop Ex, and the ratio Es/Ex."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["RemovalDetector"]

COUNT = 20      # bits: samples of a window
FRACTION = 4    # bits of a level below the converter's code
UNITY = 1 << 12  # the ratio 1
STEPS = 12 + FRACTION + COUNT  # of a division


class _State(enum.Enum, shape=3):
    IDLE = 0
    MEAN = 1
    DROP = 2
    BOUND = 3
    RATIO = 4
    CLAMP = 5


class RemovalDetector(wiring.Component):
    """Change of the machining amount per unit distance, as the fourth patent measures it.

    A window lasts until the machine has gone ``unit`` path pulses at the front, or for ``window``
    clocks, whichever comes first. With ``unit`` 0 the mean is one over time; with both, the time
    keeps a wire that stands still from standing for ever. All samples of a window count the same,
    whether the pulse is on or off. The converter takes them at equal intervals, so their mean is
    that of the voltage over time, off-time included; the no-load level must be such a mean too.

    When a window ends the next one begins: the sample and the pulse of that clock are its first.
    A window without a sample is prolonged until it has one. The computation for a window takes 75
    clocks; if the next one is shorter, it is prolonged until the computation is done. A window ends
    at ``2**20 - 1`` samples.

    Results, rounded down; a level is ``2**-16`` of the converter's full scale:

    * ``mean``: sum of the samples over their number, 37 clocks after the window's end.
    * ``drop``, Ex: ``no_load - mean``, at least ``least``; one clock later.
    * ``ratio``: ``reference / drop`` in 1/4096, at least ``ratio_min`` and then at most
      ``ratio_max``; 37 clocks later. ``windows`` counts then, too. Ex = 0 gives ``ratio_max``.

    ``reference`` is read with the drop, ``ratio_min`` and ``ratio_max`` with the ratio.

    Edge cases: while ``on`` is low, and until the end of the first window after, ``known`` is low
    and the ratio is 1. Without any discharge Ex is ``least``. ``discard`` (a short, a retraction)
    drops the present window: distance and time begin anew after it, and the last results stay.
    ``hold`` stops distance, time and samples; the window goes on after it. A window goes on across
    the borders of segments.

    Ref: fourth patent (wire finishing), claim 1: rate of machining, unit distance, Es and Ex. The
    time limit, the bounds and ``discard`` are ours.

    Members
    -------
    sample : In(12), sample_valid : In(1)
        Gap voltage, code of the converter.
    pulse : In(1)
        Path pulse forward at the front.
    on, discard, hold : In(1)
        See above; a low ``on`` overrides ``discard``, and that overrides ``hold``.
    unit : In(16)
        Unit distance, path pulses; 0 for none.
    window : In(32)
        Longest time of a window, clocks; 0 for no bound.
    no_load : In(16)
        Mean voltage of the gap without discharges, level.
    reference : In(16)
        Es, level.
    least : In(16)
        Lowest Ex, level.
    ratio_min, ratio_max : In(16)
        Bounds of the ratio, 1/4096.
    mean, drop : Out(16)
        Levels.
    ratio : Out(16)
        1/4096.
    known : Out(1)
        There is a mean since ``on``.
    windows : Out(8)
        Windows computed. Wraps.
    """

    sample: In(12)
    sample_valid: In(1)
    pulse: In(1)
    on: In(1)
    discard: In(1)
    hold: In(1)
    unit: In(16)
    window: In(32)
    no_load: In(16)
    reference: In(16)
    least: In(16)
    ratio_min: In(16)
    ratio_max: In(16)
    mean: Out(16)
    drop: Out(16)
    ratio: Out(16, init=UNITY)
    known: Out(1)
    windows: Out(8)

    def elaborate(self, platform):
        m = Module()

        state = Signal(_State)
        total = Signal(12 + COUNT)
        count = Signal(COUNT)
        distance = Signal(16)
        time = Signal(32)

        # Whether the window is over, by its counts of the clock before.
        over = Signal()
        close = Signal()
        runs = Signal()
        m.d.comb += [
            over.eq(((self.unit != 0) & (distance >= self.unit))
                    | ((self.window != 0) & (time >= self.window)) | count.all()),
            runs.eq(self.on & ~self.discard & ~self.hold),
            close.eq(runs & over & (count != 0) & (state == _State.IDLE)),
        ]
        sample = Signal(12)
        m.d.comb += sample.eq(Mux(self.sample_valid, self.sample, 0))
        with m.If(~self.on | self.discard):
            m.d.sync += [total.eq(0), count.eq(0), distance.eq(0), time.eq(0)]
        with m.Elif(runs):
            with m.If(close):
                m.d.sync += [total.eq(sample), count.eq(self.sample_valid),
                             distance.eq(self.pulse), time.eq(1)]
            with m.Else():
                with m.If(~count.all()):
                    m.d.sync += [total.eq(total + sample), count.eq(count + self.sample_valid)]
                with m.If(~distance.all()):
                    m.d.sync += distance.eq(distance + self.pulse)
                with m.If(~time.all()):
                    m.d.sync += time.eq(time + 1)

        # One divider makes both quotients, a bit a clock, the highest first.
        shifted = Signal(STEPS)   # bits of the dividend still to come, then those of the quotient
        remainder = Signal(COUNT)
        divisor = Signal(COUNT)
        step = Signal(range(STEPS))
        trial = Signal(COUNT + 2)
        m.d.comb += trial.eq(Cat(shifted[-1], remainder) - divisor)
        with m.If((state == _State.MEAN) | (state == _State.RATIO)):
            m.d.sync += [
                shifted.eq(Cat(~trial[-1], shifted)),
                remainder.eq(Mux(trial[-1], Cat(shifted[-1], remainder), trial)),
                step.eq(step + 1),
            ]

        difference = Signal(signed(17))
        bounded = Signal(16)
        m.d.comb += bounded.eq(Mux(difference < Cat(self.least, C(0, 1)).as_signed(), self.least,
                                   difference))
        with m.Switch(state):
            with m.Case(_State.IDLE):
                with m.If(close):
                    m.d.sync += [
                        shifted.eq(total << FRACTION), remainder.eq(0), divisor.eq(count),
                        step.eq(0), state.eq(_State.MEAN),
                    ]
            with m.Case(_State.MEAN):
                with m.If(step == STEPS - 1):
                    m.d.sync += state.eq(_State.DROP)
            with m.Case(_State.DROP):
                m.d.sync += [
                    self.mean.eq(shifted), self.known.eq(1),
                    difference.eq(self.no_load - shifted[:16]),
                    state.eq(_State.BOUND),
                ]
            with m.Case(_State.BOUND):
                m.d.sync += [
                    self.drop.eq(bounded), divisor.eq(bounded), remainder.eq(0), step.eq(0),
                    shifted.eq(self.reference * UNITY),
                    state.eq(_State.RATIO),
                ]
            with m.Case(_State.RATIO):
                with m.If(step == STEPS - 1):
                    m.d.sync += state.eq(_State.CLAMP)
            with m.Case(_State.CLAMP):
                raised = Signal(16)
                m.d.comb += raised.eq(Mux(shifted < self.ratio_min, self.ratio_min, shifted[:16]))
                m.d.sync += [
                    self.ratio.eq(Mux(shifted[16:].any() | (raised > self.ratio_max),
                                      self.ratio_max, raised)),
                    self.windows.eq(self.windows + 1),
                    state.eq(_State.IDLE),
                ]
        with m.If(~self.on):
            m.d.sync += [state.eq(_State.IDLE), self.known.eq(0), self.ratio.eq(UNITY)]

        return m
