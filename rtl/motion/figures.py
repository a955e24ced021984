# SPDX-License-Identifier: Apache-2.0
"""Figures of a retraction: how soon the machine stopped, and how fast it went back."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Figures"]


class Figures(wiring.Component):
    """Latency and speed of a retraction, for its events.

    ``latency`` counts clocks from the sample that completed the short (the clock before
    ``completed``) to the last pulse before the machine is at rest; it is 0 if no pulse came.
    ``pulses`` and ``clocks`` measure the plateau: the longest stretch at the speed of the
    retraction, from its first pulse, which is not counted, to its last. ``latency`` is valid once
    the machine is at rest, the others once it has gone back, each until the next retraction.

    Members
    -------
    stopping, retracting : In(1)
        State of the retraction: coming to rest, going back.
    moving, steady : In(1)
        The state lets the machine move; pulses leave at the speed of the state.
    pp, reverse : In(1)
        Ramped path pulse, and its direction.
    completed : In(1)
        Ss has risen.
    latency : Out(16)
        In clocks, at most 2**16 - 1.
    pulses : Out(31), clocks : Out(32)
        Length and duration of the plateau, in pulses and clocks.
    """

    stopping: In(1)
    retracting: In(1)
    moving: In(1)
    steady: In(1)
    pp: In(1)
    reverse: In(1)
    completed: In(1)
    latency: Out(16)
    pulses: Out(31)
    clocks: Out(32)

    def elaborate(self, platform):
        m = Module()

        since = Signal(16)
        with m.If(self.completed):
            m.d.sync += since.eq(2)
        with m.Elif(~since.all()):
            m.d.sync += since.eq(since + 1)
        with m.If(self.stopping & self.pp):
            m.d.sync += self.latency.eq(since)
        with m.Elif(~self.stopping):
            m.d.sync += self.latency.eq(self.completed & self.pp & ~self.reverse)

        count = Signal(31)  # of the stretch under way
        now = Signal(32)
        begun = Signal()
        with m.If(self.stopping):
            m.d.sync += [self.pulses.eq(0), self.clocks.eq(0), begun.eq(0)]
        with m.Elif(self.retracting):
            m.d.sync += now.eq(now + 1)
            with m.If(~self.moving | ~self.steady):
                m.d.sync += begun.eq(0)
            with m.Elif(self.pp):
                m.d.sync += begun.eq(1)
                with m.If(begun):
                    m.d.sync += count.eq(count + 1)
                    with m.If(count >= self.pulses):
                        m.d.sync += [self.pulses.eq(count + 1), self.clocks.eq(now + 1)]
                with m.Else():
                    m.d.sync += [now.eq(0), count.eq(0)]

        return m
