# SPDX-License-Identifier: Apache-2.0
"""Path-pulse generator: the commanded rate becomes path pulses Ps, up to a bound."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.arithmetic import sum_or_difference

__all__ = ["PathPulseGenerator"]


class PathPulseGenerator(wiring.Component):
    """Pulse distributor's clock, 103 of the first patent: path pulses Ps at the commanded rate.

    While ``go`` is high a 32-bit phase grows by ``rate`` every clock; each overflow is one pulse.
    A pulse moves ``command`` one towards ``bound`` and never past it: at the bound the phase waits
    at the overflow. ``go`` low stops at once: no ``ps`` in the clock after, and the phase starts
    again from zero. ``pull`` asks for a pulse now, whatever ``go`` is; the bound still holds.
    Pulses are at least 4 clocks apart, so that the blocks behind can react to one before the next.

    After a change of ``bound`` or ``reverse`` keep ``go`` and ``pull`` low for 2 clocks: ``room``
    is one clock old.

    Members
    -------
    rate : In(30)
        Commanded rate, 2**-32 pulse/clock; below 2**30, a pulse every 4 clocks.
    go : In(1)
        Pulses may be made.
    reverse : In(1)
        Pulses count down. Changes only at rest.
    bound : In(signed(32))
        Last coordinate that may be commanded.
    pull : In(1)
        A pulse is wanted now.
    load : In(1)
        Set ``command`` to ``load_value`` and drop the pulse under way.
    load_value : In(signed(32))
        Path coordinate.
    ps : Out(1)
        A pulse, high for one clock.
    command : Out(signed(32))
        Path coordinate after the pulse being signalled. Wraps.
    room : Out(1)
        The bound was not reached one clock ago.
    """

    SPACING = 4

    rate: In(30)
    go: In(1)
    reverse: In(1)
    bound: In(signed(32))
    pull: In(1)
    load: In(1)
    load_value: In(signed(32))
    ps: Out(1)
    command: Out(signed(32))
    room: Out(1)

    def elaborate(self, platform):
        m = Module()

        # Coordinates wrap, so "before" is the sign of a difference, not of a comparison.
        distance = Signal(signed(32))
        m.d.comb += distance.eq(Mux(self.reverse, self.command - self.bound,
                                    self.bound - self.command))
        m.d.sync += self.room.eq(distance > 0)

        phase = Signal(32)
        due = Signal()
        total = Signal(33)
        m.d.comb += total.eq(phase + self.rate)
        spacing = Signal(range(self.SPACING))
        fire = Signal()
        m.d.comb += fire.eq(((due & self.go) | self.pull) & self.room & (spacing == 0))

        m.d.sync += self.ps.eq(0)
        with m.If(spacing != 0):
            m.d.sync += spacing.eq(spacing - 1)
        with m.If(~self.go):
            m.d.sync += [phase.eq(0), due.eq(0)]
        with m.Elif(~due | fire):
            m.d.sync += [phase.eq(total[:32]), due.eq(total[32])]
        with m.If(fire):
            m.d.sync += self.ps.eq(1)
            m.d.sync += spacing.eq(self.SPACING - 1)
            m.d.sync += self.command.eq(sum_or_difference(self.command, C(1), self.reverse))
        with m.If(self.load):
            m.d.sync += [self.ps.eq(0), due.eq(0), phase.eq(0), self.command.eq(self.load_value)]

        return m
