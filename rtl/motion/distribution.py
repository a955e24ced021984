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

    # Members that have the same name in the window.
    SEGMENT = ("length", "arc", "outward", "major", "minor", "divisor", "change", "enter")

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

    def follow(self, path):
        """Assignments that take the segments from a ``SegmentWindow``."""
        pairs = [(self.pulse, path.distribute), (self.reverse, path.distribute_reverse)]
        pairs += [(getattr(self, name), getattr(path, name)) for name in self.SEGMENT]
        pairs += [(getattr(self.state, name), getattr(path.state, name))
                  for name in ArcState().members]
        pairs += [(getattr(mine, name), getattr(its, name))
                  for mine, its in zip(self.travel, path.travel, strict=True)
                  for name in Travel().members]
        return [mine.eq(its) for mine, its in pairs]

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
            *(getattr(arc, name).eq(getattr(self, name)) for name in (
                "outward", "major", "minor", "divisor", "change", "enter")),
            *(getattr(arc.state, name).eq(getattr(self.state, name))
              for name in ArcState().members),
            *(getattr(self, name).eq(getattr(arc, name)) for name in ("pace", "along", "across")),
        ]
        for axis in range(self.axes):
            m.d.comb += [
                line.travel[axis].magnitude.eq(self.travel[axis].magnitude),
                line.travel[axis].negative.eq(self.travel[axis].negative),
                line.other[axis].eq(self.arc & ((self.major == axis) | (self.minor == axis))),
                self.pi[axis].eq(line.pi[axis] | arc.pi[axis]),
                self.pi_reverse[axis].eq(Mux(arc.pi[axis], arc.pi_reverse[axis],
                                             line.pi_reverse[axis])),
            ]
        return m
