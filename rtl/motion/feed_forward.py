# SPDX-License-Identifier: Apache-2.0
"""Velocity feed-forward: what the path's speed asks of each axis, beside the position loop."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.distributor import Travel

__all__ = ["FORWARD_BITS", "FeedForward"]

FORWARD_BITS = 16  # of an axis's share, with sign: the DAC's range


class _Step(enum.Enum, shape=3):
    """What a round is doing."""

    LOOK = 0
    MULTIPLY = 1
    LOAD = 2
    DIVIDE = 3
    STORE = 4


class FeedForward(wiring.Component):
    """Speed along the path times its direction, for every axis, as pulses of Er.

    A position loop of gain K moves an axis at the speed v with Er = v / K. ``speed`` is that Er: it
    is added to Er at the DAC, and the loop has nothing left to build up. The block makes it of the
    rate of path pulses, not of the pulses: at slow feeds they come too seldom.

    A round takes ``ROUND`` clocks, and the next one follows. In its first clock it reads ``rate``
    and ``reverse``. The path's speed is ``rate * lead / 2**32`` pulses, rounded down to a quarter,
    at most ``2**17 - 1`` quarters. Then it takes the axes one after the other; the words of
    an axis are read in the clock ``1 + LEAD + 19 * n`` of the round, and ``speed`` of that axis
    changes 19 clocks later.

    * On a line the axes come by number. The share of an axis is ``magnitude / length``.
    * On an arc the major axis comes first. Its share of the path's speed is ``pace / divisor``. The
      minor axis is next: its share of the major one's speed is ``along / across``, the slope of
      the curve; that speed is rounded down to a quarter of a pulse. The third axis goes as on a
      line.

    A share is at most 1, and rounded down to 2**-16. ``speed`` is rounded to the nearest pulse, a
    half upwards, and at most 32767; its sign is that of the travel, the other one going back.

    When ``rate`` is 0, every ``speed`` is 0 in the next clock, and a round under way ends. Only
    then ``lead`` is taken over: so it makes no jump. While the segment is being fetched, and for 2
    clocks after, no round goes on. A round that a fetch interrupts is lost.

    Exact model: ``testbench/models/feed_forward.py``.

    Parameters
    ----------
    axes : int
        Number of axes, 1 to 3.

    Members
    -------
    rate : In(30)
        Rate of path pulses, 2**-32 pulse/clock; 0 at rest.
    reverse : In(1)
        The machine goes back.
    lead : In(27)
        Lag of the position loop that is to be made up, 1 / K, in clocks; 0 for the plain loop.
    ready : In(1)
        The segment has been fetched.
    length, travel, arc, major, minor, divisor : In
        The segment, as ``SegmentWindow`` has it.
    pace : In(32), along, across : In(signed(34))
        Place on the arc, as ``ArcDistributor`` has it.
    speed : Out(signed(16)) x axes
        In pulses of Er.
    ahead : Out(1)
        There is a feed-forward: the ``lead`` that was taken over is not 0. 1 clock after that.

    Raises
    ------
    ValueError
        If there are not 1 to 3 axes.
    """

    LEAD = 27      # bits of the lead
    RATE = 30
    SHARE = 16     # bits of a share behind the point
    QUARTER = 2    # bits of the path's speed behind the point
    TOP = 17       # bits of that speed
    WIDTH = 33     # bits of what is divided
    ROUND = 1 + LEAD + 3 * (SHARE + 3)

    def __init__(self, *, axes=3):
        if not 1 <= axes <= 3:
            raise ValueError(f"feed-forward is for 1 to 3 axes, not {axes!r}")
        self.axes = axes
        super().__init__({
            "rate": In(self.RATE),
            "reverse": In(1),
            "lead": In(self.LEAD),
            "ready": In(1),
            "length": In(30),
            "travel": In(Travel()).array(axes),
            "arc": In(1),
            "major": In(2),
            "minor": In(2),
            "divisor": In(30),
            "pace": In(32),
            "along": In(signed(34)),
            "across": In(signed(34)),
            "speed": Out(signed(FORWARD_BITS)).array(axes),
            "ahead": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        step = Signal(_Step)
        count = Signal(range(self.LEAD))
        index = Signal(2)      # of the axis in its turn
        back = Signal()
        in_force = Signal(self.LEAD)
        before = Signal(2)     # ``ready``, one and two clocks ago
        settled = self.ready & before.all()
        m.d.sync += [before.eq(Cat(self.ready, before)), self.ahead.eq(in_force.any())]

        # The path's speed: the rate for every bit of the lead, from the top one on.
        rate, bits = Signal(self.RATE), Signal(self.LEAD)
        product = Signal(self.RATE + self.LEAD)
        path = self._limited(m, product >> (32 - self.QUARTER), "path_speed")

        # An axis's share of a speed: a bit of the share at a time, and the speed for every bit.
        taken = self._words(index)
        axis, minor = Signal(2), Signal()
        shared = Signal(self.TOP)          # the speed that is shared out
        remainder, divisor = Signal(self.WIDTH + 1), Signal(self.WIDTH)
        total = Signal(self.TOP + self.SHARE + 1)
        over = remainder >= divisor
        major = Signal(self.TOP)           # speed of the major axis

        with m.Switch(step):
            with m.Case(_Step.LOOK):
                m.d.sync += [rate.eq(self.rate), back.eq(self.reverse), bits.eq(in_force),
                             product.eq(0), count.eq(self.LEAD - 1), index.eq(0),
                             step.eq(_Step.MULTIPLY)]
            with m.Case(_Step.MULTIPLY):
                m.d.sync += [product.eq((product << 1) + Mux(bits[-1], rate, 0)),
                             bits.eq(bits << 1), count.eq(count - 1)]
                with m.If(count == 0):
                    m.d.sync += step.eq(_Step.LOAD)
            with m.Case(_Step.LOAD):
                m.d.sync += [axis.eq(taken["axis"]), remainder.eq(taken["dividend"]),
                             divisor.eq(taken["divisor"]), minor.eq(taken["minor"]),
                             shared.eq(Mux(taken["minor"], major, path)),
                             total.eq(0), count.eq(self.SHARE), step.eq(_Step.DIVIDE)]
            with m.Case(_Step.DIVIDE):
                # A share above 1 counts as 1: nothing is left after its first bit.
                left = Mux(over, Mux(count == self.SHARE, 0, remainder - divisor), remainder)
                m.d.sync += [remainder.eq(left << 1),
                             total.eq((total << 1) + Mux(over, shared, 0)), count.eq(count - 1)]
                with m.If(count == 0):
                    m.d.sync += step.eq(_Step.STORE)
            with m.Case(_Step.STORE):
                size = self._size(m, total)
                for number, speed in enumerate(self.speed):
                    with m.If(axis == number):
                        m.d.sync += speed.eq(Mux(back ^ self.travel[number].negative, -size, size))
                with m.If(index == 0):
                    m.d.sync += major.eq(self._limited(m, total >> self.SHARE, "axis_speed"))
                m.d.sync += [index.eq(index + 1),
                             step.eq(Mux(index == 2, _Step.LOOK, _Step.LOAD))]
        with m.If(~settled):
            m.d.sync += step.eq(_Step.LOOK)
        with m.If(self.rate == 0):
            m.d.sync += [step.eq(_Step.LOOK), in_force.eq(self.lead),
                         *(speed.eq(0) for speed in self.speed)]

        return m

    def _words(self, index):
        """The axis whose turn it is, its share as a fraction, and whether it is a minor axis."""
        third = (3 - self.major - self.minor)[:2]
        magnitudes = Array([travel.magnitude for travel in self.travel]
                           + [C(0)] * (4 - self.axes))

        def by_turn(first, second, last):
            return Mux(index == 0, first, Mux(index == 1, second, last))

        def size(slope):
            """Magnitude, one less below 0."""
            return (slope ^ slope[-1].replicate(len(slope)))[:self.WIDTH]

        line = ~self.arc | (index == 2)
        return {
            "axis": Mux(self.arc, by_turn(self.major, self.minor, third), index),
            "dividend": Mux(line, magnitudes[Mux(self.arc, third, index)],
                            Mux(index == 0, self.pace, size(self.along))),
            "divisor": Mux(line, self.length, Mux(index == 0, self.divisor, size(self.across))),
            "minor": self.arc & (index == 1),
        }

    def _limited(self, m, speed, name):
        """A speed in quarters, at most the largest that is reckoned with."""
        limited = Signal(self.TOP, name=name)
        m.d.comb += limited.eq(Mux(speed[self.TOP:].any(), (1 << self.TOP) - 1, speed))
        return limited

    def _size(self, m, total):
        """A speed in pulses, rounded, at most full scale."""
        below = self.SHARE + self.QUARTER
        pulses = (total + (1 << below - 1)) >> below
        size = Signal(FORWARD_BITS - 1)
        m.d.comb += size.eq(Mux(pulses[FORWARD_BITS - 1:].any(), (1 << FORWARD_BITS - 1) - 1,
                                pulses))
        return size
