# SPDX-License-Identifier: Apache-2.0
"""Removal detector: Ex of a unit distance by voltage or by discharges, and the ratio Es/Ex."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["RemovalDetector"]

COUNT = 20      # bits: samples of a window
FRACTION = 4    # bits of a level below the converter's code
UNITY = 1 << 12  # the ratio 1
RATE = 30
TOTAL = 48      # bits: sum of codes, or 2**-32 path pulses
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

    With ``shares`` the window measures discharges instead of voltage, for a feed mode of our own
    (G95 P5): ``way`` is the way that the feed ``rate`` makes in the clocks with ``burning`` high,
    at most ``2**16`` pulses, and Ex is ``way`` over the distance of the window, at most
    ``2**16 - 1`` of ``2**-16``. At the feed ``rate`` that is the share of the time in which good
    discharges burn; at any feed it is in proportion to the discharge per distance, so to the stock,
    and neither shorts nor the pauses change it. Es is then ``share``. Such a window needs no
    sample, and a distance of 0 counts as 1. A change of ``shares`` drops the present window.

    Results, rounded down; a level is ``2**-16`` of the converter's full scale:

    * ``mean``: sum of the samples over their number, 37 clocks after the window's end. With
      ``shares`` it stays.
    * ``drop``, Ex: ``no_load - mean``, or the share; at least ``least``; one clock later.
    * ``ratio``: ``reference / drop``, or ``share / drop``, in 1/4096, at least ``ratio_min`` and
      then at most ``ratio_max``; 37 clocks later. ``windows`` counts then, too. Ex = 0 gives
      ``ratio_max``.

    ``reference`` and ``share`` are read with the drop, ``ratio_min`` and ``ratio_max`` with the
    ratio.

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
    shares, burning : In(1)
        Ex by discharges; a good discharge burns in this clock.
    rate : In(30)
        F, 2**-32 pulse/clock.
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
    share : In(16)
        Es with ``shares``, 2**-16.
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
    shares: In(1)
    burning: In(1)
    rate: In(RATE)
    on: In(1)
    discard: In(1)
    hold: In(1)
    unit: In(16)
    window: In(32)
    no_load: In(16)
    reference: In(16)
    share: In(16)
    least: In(16)
    ratio_min: In(16)
    ratio_max: In(16)
    mean: Out(16)
    drop: Out(16)
    ratio: Out(16, init=UNITY)
    known: Out(1)
    windows: Out(8)

    def __init__(self):
        super().__init__()
        self.total = Signal(TOTAL)  # for tests too; saturates

    def elaborate(self, platform):
        m = Module()

        state = Signal(_State)
        total = self.total
        count = Signal(COUNT)
        distance = Signal(16)
        time = Signal(32)

        # Whether the window is over, by its counts of the clock before.
        over = Signal()
        close = Signal()
        runs = Signal()
        shared = Signal()   # ``shares`` of the clock before
        judged = Signal()   # ... of the window under computation
        drop = Signal()
        m.d.sync += shared.eq(self.shares)
        m.d.comb += [
            over.eq(((self.unit != 0) & (distance >= self.unit))
                    | ((self.window != 0) & (time >= self.window)) | count.all()),
            runs.eq(self.on & ~self.discard & ~self.hold),
            drop.eq(~self.on | self.discard | (self.shares != shared)),
            close.eq(runs & ~drop & over & ((count != 0) | self.shares)
                     & (state == _State.IDLE)),
        ]
        part = Signal(RATE)
        taken = Signal()
        summed = Signal(TOTAL + 1)
        m.d.comb += [
            part.eq(Mux(self.shares, Mux(self.burning, self.rate, 0),
                        Mux(self.sample_valid, self.sample, 0))),
            taken.eq(self.sample_valid & ~self.shares),
            summed.eq(total + part),
        ]
        with m.If(drop):
            m.d.sync += [total.eq(0), count.eq(0), distance.eq(0), time.eq(0)]
        with m.Elif(runs):
            with m.If(close):
                m.d.sync += [total.eq(part), count.eq(taken),
                             distance.eq(self.pulse), time.eq(1)]
            with m.Else():
                with m.If(~count.all()):
                    m.d.sync += [total.eq(summed | summed[-1].replicate(TOTAL)),
                                 count.eq(count + taken)]
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
                        shifted.eq(Mux(self.shares, total[16:], total[:32] << FRACTION)),
                        divisor.eq(Mux(self.shares, distance | (distance == 0), count)),
                        judged.eq(self.shares), remainder.eq(0),
                        step.eq(0), state.eq(_State.MEAN),
                    ]
            with m.Case(_State.MEAN):
                with m.If(step == STEPS - 1):
                    m.d.sync += state.eq(_State.DROP)
            with m.Case(_State.DROP):
                m.d.sync += [self.known.eq(1), state.eq(_State.BOUND)]
                with m.If(judged):
                    m.d.sync += difference.eq(shifted[:16] | shifted[16:].any().replicate(16))
                with m.Else():
                    m.d.sync += [self.mean.eq(shifted),
                                 difference.eq(self.no_load - shifted[:16])]
            with m.Case(_State.BOUND):
                m.d.sync += [
                    self.drop.eq(bounded), divisor.eq(bounded), remainder.eq(0), step.eq(0),
                    shifted.eq(Mux(judged, self.share, self.reference) * UNITY),
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
