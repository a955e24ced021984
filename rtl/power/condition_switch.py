# SPDX-License-Identifier: Apache-2.0
"""Switching of the machining condition by the depth reached."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ConditionSwitch"]


class ConditionSwitch(wiring.Component):
    """Puts a staged condition in force between two pulses, by order or when a depth is reached.

    Firmware stages a condition in registers. ``take`` is high in the clock in which all of it comes
    into force: the first with ``between`` high after ``commit``, or after the depth was reached.
    ``pending`` is high from the clock after the commit, or the switch, up to that clock. The staged
    words may not change while ``pending`` is high.

    Depth is down: a position is at a depth or beyond it if ``position - depth <= 0``, modulo
    ``2**width``. The furthest position since ``restart`` counts, that of the clock of ``restart``
    included. So it does not matter if the axis goes back and comes again.

    ``arm`` sets the depth. There is one switch when the depth is reached, or at once if it has been
    reached; then none before the next ``arm``. A switch disarms. So do ``disarm`` and ``commit``.
    In a clock with an order there is no switch. While ``pending`` is high an armed switch waits.

    Latency: 2 clocks to ``switched`` and ``pending``, from the position that reaches the depth or
    from ``arm`` at a depth that has been reached. ``at`` is then the position of 2 clocks before:
    in the first case the one that reached the depth. It stays until the next switch.

    Ref: third patent (current by the depth), items 30 and 31. Proof:
    ``testbench/formal/test_condition_switch.py``.

    Parameters
    ----------
    width : int
        Bits of a position.

    Members
    -------
    position : In(signed(width))
        Position of the jump axis, from its encoder.
    depth : In(signed(width))
        Depth at which to switch. It may change with ``arm`` only.
    arm, disarm, commit, restart : In(1)
        Orders, for one clock; never ``arm`` with another.
    between : In(1)
        No pulse is under way, and none begins in the next clock.
    take : Out(1)
        Take the staged words.
    armed, pending : Out(1)
        A depth is awaited; a switch or a commit waits for the end of a pulse.
    switched : Out(1)
        The depth was reached: high for one clock.
    at : Out(signed(width))
        Position of the last switch.
    count : Out(8)
        Switches since reset, wraps.

    Attributes
    ----------
    place, deepest : Signal(signed(width))
        Position of the clock before, and the furthest up to it, for proofs.
    """

    def __init__(self, *, width=32):
        self.width = width
        super().__init__({
            "position": In(signed(width)), "depth": In(signed(width)),
            "arm": In(1), "disarm": In(1), "commit": In(1), "restart": In(1), "between": In(1),
            "take": Out(1), "armed": Out(1), "pending": Out(1), "switched": Out(1),
            "at": Out(signed(width)), "count": Out(8),
        })
        self.place = Signal(signed(width))
        self.deepest = Signal(signed(width))

    def elaborate(self, platform):
        m = Module()

        further = Signal(signed(self.width))
        left = Signal(signed(self.width))   # distance to the depth; below 0 when it is reached
        m.d.comb += [
            further.eq(self.position - self.deepest),
            left.eq(self.deepest - self.depth - 1),
        ]
        m.d.sync += self.place.eq(self.position)
        with m.If(self.restart | further[-1]):
            m.d.sync += self.deepest.eq(self.position)

        due = Signal()
        ordered = Signal()
        m.d.comb += [
            ordered.eq(self.disarm | self.commit),
            due.eq(self.armed & left[-1] & ~self.pending & ~ordered & ~self.arm),
            self.take.eq(self.pending & self.between),
        ]
        m.d.sync += self.switched.eq(due)
        with m.If(self.arm):
            m.d.sync += self.armed.eq(1)
        with m.Elif(due | ordered):
            m.d.sync += self.armed.eq(0)
        with m.If(due | self.commit):
            m.d.sync += self.pending.eq(1)
        with m.Elif(self.take):
            m.d.sync += self.pending.eq(0)
        with m.If(due):
            m.d.sync += [self.at.eq(self.place), self.count.eq(self.count + 1)]

        return m
