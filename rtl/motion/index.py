# SPDX-License-Identifier: Apache-2.0
"""Index of the pulse coders: the first one after an order, once for each order."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.encoder import filtered

__all__ = ["Index"]


class Index(wiring.Component):
    """Tells when the index of an axis comes, if firmware has asked for it.

    A coder raises its index once in a turn. The line has the filter of the phases (``Encoder``), so
    with the same ``samples`` its latency is theirs too: with the first clock of a clean high level
    as clock 0, ``found`` is high in clock ``samples``, in which ``fp`` of an edge of clock 0 is
    high. The place of the index is the count in the clock after, which has that pulse; that of a
    coder coarser than a pulse comes some clocks later, and the place is then within its edge.

    An order names the axes that are armed from the next clock on, and disarms the others. Only a
    rise counts: an index that is high already must go and come again. ``found`` disarms its axis;
    an order in the same clock as the rise arms it anew. While ``safe`` nothing is armed or found.

    A flipped bit of ``armed`` is found without having been asked for, which firmware drops, or
    never: the search then ends at its longest way. One in the filter is a pulse on the line.

    Parameters
    ----------
    axes : int
        Axes; every vector has one bit for each, the first one lowest.
    samples : int
        Length of the glitch filter in clocks, at least 1; that of the ``Encoder``.

    Members
    -------
    line : In(axes)
        The index of each coder, synchronous to the clock.
    arm : In(axes)
        Axes that the order names.
    arm_strobe : In(1)
        The order.
    safe : In(1)
        Outputs are safe.
    found : Out(axes)
        The index has come: high for one clock.

    Raises
    ------
    ValueError
        If ``samples`` is too small.
    """

    def __init__(self, *, axes=3, samples=3):
        if samples < 1:
            raise ValueError(f"glitch filter must have at least 1 sample, not {samples!r}")
        self.samples = samples
        super().__init__({"line": In(axes), "arm": In(axes), "arm_strobe": In(1), "safe": In(1),
                          "found": Out(axes)})

    def elaborate(self, platform):
        m = Module()
        rises = []
        for axis, line in enumerate(self.line):
            level = Signal(name=f"level_{axis}")
            rises.append(filtered(m, line, level, self.samples, f"line_{axis}") & ~level)
        armed = Signal.like(self.arm)
        found = Cat(rises) & armed
        m.d.sync += [self.found.eq(Mux(self.safe, 0, found)), armed.eq(armed & ~found)]
        with m.If(self.arm_strobe):
            m.d.sync += armed.eq(self.arm)
        with m.If(self.safe):
            m.d.sync += armed.eq(0)
        return m
