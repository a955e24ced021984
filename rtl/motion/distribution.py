# SPDX-License-Identifier: Apache-2.0
"""The pulse distributor: lines and arcs."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.arc import ArcDistributor, ArcState
from rtl.motion.distributor import LineDistributor, Travel

__all__ = ["Distributor"]


class Distributor(wiring.Component):
    """Pulse distributor 103 of the first patent: ramped path pulses become axis pulses Pi.

    On a line every axis goes by a ``LineDistributor``, 2 clocks after the pulse. On a piece of an
    arc the two axes of its plane go by the ``ArcDistributor``, 5 clocks after, and a third one as
    on a line: a helix.

    Parameters
    ----------
    axes : int
        Number of axes.

    Members
    -------
    pulse, reverse : In(1)
        A path pulse, at most every 4 clocks, and that it goes back.
    restart : In(1)
        The machine stands at a border: clear the remainders.
    length, travel, arc, outward, major, minor, divisor, change, enter, state : In
        The segment, as ``SegmentWindow`` has it.
    pi, pi_reverse : Out(axes)
        Axis pulses Pi, one clock each, and their direction: down.
    pace : Out(32), along, across : Out(signed(34))
        Place on the arc; see ``ArcDistributor``.
    """

    def __init__(self, *, axes=3):
        self.axes = axes
        super().__init__({
            "pulse": In(1),
            "reverse": In(1),
            "restart": In(1),
            "length": In(30),
            "travel": In(Travel()).array(axes),
            "arc": In(1),
            "outward": In(1),
            "major": In(2),
            "minor": In(2),
            "divisor": In(30),
            "change": In(signed(32)),
            "enter": In(1),
            "state": In(ArcState()),
            "pi": Out(axes),
            "pi_reverse": Out(axes),
            "pace": Out(32),
            "along": Out(signed(34)),
            "across": Out(signed(34)),
        })

    def follow(self, m, path):
        """Take pulses and segments from a ``SegmentWindow``, in the module that has both."""
        m.d.comb += [
            self.pulse.eq(path.distribute), self.reverse.eq(path.distribute_reverse),
            self.length.eq(path.length), self.arc.eq(path.arc), self.outward.eq(path.outward),
            self.major.eq(path.major), self.minor.eq(path.minor),
            self.divisor.eq(path.divisor), self.change.eq(path.change), self.enter.eq(path.enter),
        ]
        wiring.connect(m, path.state, self.state)
        for its, mine in zip(path.travel, self.travel, strict=True):
            wiring.connect(m, its, mine)

    def elaborate(self, platform):
        m = Module()
        m.submodules.line = line = LineDistributor(axes=self.axes)
        m.submodules.arc = arc = ArcDistributor(axes=max(2, self.axes))
        m.d.comb += [
            line.pulse.eq(self.pulse),
            line.reverse.eq(self.reverse),
            line.restart.eq(self.restart),
            line.length.eq(self.length),
            arc.pulse.eq(self.pulse & self.arc),
            arc.reverse.eq(self.reverse),
            arc.negative.eq(Cat(travel.negative for travel in self.travel)),
            arc.outward.eq(self.outward), arc.major.eq(self.major), arc.minor.eq(self.minor),
            arc.divisor.eq(self.divisor), arc.change.eq(self.change), arc.enter.eq(self.enter),
            self.pace.eq(arc.pace), self.along.eq(arc.along), self.across.eq(arc.across),
        ]
        wiring.connect(m, wiring.flipped(self.state), arc.state)
        for axis in range(self.axes):
            wiring.connect(m, wiring.flipped(self.travel[axis]), line.travel[axis])
            m.d.comb += [
                line.other[axis].eq(self.arc & ((self.major == axis) | (self.minor == axis))),
                self.pi[axis].eq(line.pi[axis] | arc.pi[axis]),
                self.pi_reverse[axis].eq(Mux(arc.pi[axis], arc.pi_reverse[axis],
                                             line.pi_reverse[axis])),
            ]
        return m
