# SPDX-License-Identifier: Apache-2.0
"""Step/direction output: sends a drive the steps that an error counter holds."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["StepDir"]


class StepDir(wiring.Component):
    """Shape of the step pulses, one for each pulse stored in a signed counter outside.

    The queue of steps is that counter (the axis' own Er, by way of its ``Gear``): ``pending`` and
    ``negative`` say whether it holds any and which way, and each ``taken`` must bring it one nearer
    to zero in the next clock. So a step is either stored there or sent, and none is lost or sent
    twice.

    ``step`` is high for ``width`` clocks and then low for at least ``space``; ``dir`` changes only
    while ``step`` is low, ``space`` clocks or more after it fell and ``setup`` or more before it
    rises. A time of 0 counts as 1. A time is read in the clock in which it begins. An idle output
    steps one clock after ``pending``, or ``1 + setup`` clocks with a change of direction.

    ``safe`` takes ``step`` low in the next clock and keeps it there, even in the middle of a pulse,
    which still counts; ``dir`` keeps its level. The first step afterwards comes ``space`` clocks
    or more after ``safe`` fell.

    Members
    -------
    pending : In(1)
        There are steps to send.
    negative : In(1)
        They go down. Read while ``pending`` is high.
    width : In(8)
        Length of a step pulse, in clocks.
    space : In(8)
        Shortest distance between step pulses, in clocks.
    setup : In(8)
        Time of ``dir`` before ``step``, in clocks.
    safe : In(1)
        No steps.
    step : Out(1)
        To the drive.
    dir : Out(1)
        To the drive, high for down.
    takes : Out(1)
        A step begins in the next clock.
    taken : Out(1)
        A step has begun: high in the first clock of ``step``. Its direction is ``dir``.
    """

    pending: In(1)
    negative: In(1)
    width: In(8)
    space: In(8)
    setup: In(8)
    safe: In(1)
    step: Out(1)
    dir: Out(1)
    takes: Out(1)
    taken: Out(1)

    def elaborate(self, platform):
        m = Module()

        remaining = Signal(8)  # clocks of the present phase, this one included
        m.d.sync += self.taken.eq(0)
        with m.If(self.safe):
            m.d.sync += [self.step.eq(0), remaining.eq(self.space)]
        with m.Elif(remaining > 1):
            m.d.sync += remaining.eq(remaining - 1)
        with m.Elif(self.step):
            m.d.sync += [self.step.eq(0), remaining.eq(self.space)]
        with m.Elif(self.pending & (self.dir == self.negative)):
            m.d.comb += self.takes.eq(1)
            m.d.sync += [self.step.eq(1), self.taken.eq(1), remaining.eq(self.width)]
        with m.Elif(self.pending):
            m.d.sync += [self.dir.eq(self.negative), remaining.eq(self.setup)]

        return m
