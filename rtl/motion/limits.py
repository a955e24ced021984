# SPDX-License-Identifier: Apache-2.0
"""Soft limits of an axis: no command leaves them."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["SoftLimits"]


class SoftLimits(wiring.Component):
    """Passes the pulses Pi of an axis only as far as its command may go.

    A pulse up passes while ``command`` is below ``high``, a pulse down while it is above ``low``.
    So a command within [low, high] never leaves it, and one outside can only come nearer. A pulse
    that does not pass is lost, and sets ``beyond_low`` or ``beyond_high`` until ``clear``. A pulse
    further onto a limit switch that the axis is leaving (``barred``) does not pass either:
    ``onto`` is high in the clock after it.

    The comparison with the limits takes a clock. A pulse in the clock after one that passed, or
    after ``clear``, comes too early for it: the pulse is refused and counts as beyond the limit.
    The distributor's pulses are at least 3 clocks apart.

    Pulses pass in their own clock.
    Proof: ``testbench/formal/test_limits.py``.

    Parameters
    ----------
    travel : int
        Bits of positions.

    Members
    -------
    pi, pi_reverse : In(1)
        Command pulse and its direction: down.
    command : In(signed(travel))
        Sum of the pulses that passed, as the axis has it one clock later.
    low, high : In(signed(travel))
        The limits. Change at rest only; they are in force two clocks later.
    barred_low, barred_high : In(1)
        No pulse further down, or up.
    clear : In(1)
        Clear ``beyond_low`` and ``beyond_high``; ``command`` may change without a pulse now.
    passed : Out(1)
        The pulse passes.
    beyond_low, beyond_high : Out(1)
        A pulse beyond this limit was refused since ``clear``.
    onto : Out(1)
        A pulse in a barred direction was refused in the clock before.
    """

    def __init__(self, *, travel=32):
        super().__init__({
            "pi":          In(1),
            "pi_reverse":  In(1),
            "command":     In(signed(travel)),
            "low":         In(signed(travel)),
            "high":        In(signed(travel)),
            "barred_low":  In(1),
            "barred_high": In(1),
            "clear":       In(1),
            "passed":      Out(1),
            "beyond_low":  Out(1),
            "beyond_high": Out(1),
            "onto":        Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        room_down, room_up = Signal(), Signal()
        known = Signal()  # the comparisons belong to the present command
        barred, within = Signal(), Signal()
        m.d.comb += [
            within.eq(known & Mux(self.pi_reverse, room_down, room_up)),
            barred.eq(Mux(self.pi_reverse, self.barred_low, self.barred_high)),
            self.passed.eq(self.pi & within & ~barred),
        ]
        m.d.sync += [
            room_down.eq(self.command > self.low),
            room_up.eq(self.command < self.high),
            known.eq(~self.passed & ~self.clear),
            self.onto.eq(self.pi & barred),
        ]
        with m.If(self.clear):
            m.d.sync += [self.beyond_low.eq(0), self.beyond_high.eq(0)]
        with m.Elif(self.pi & ~within):
            with m.If(self.pi_reverse):
                m.d.sync += self.beyond_low.eq(1)
            with m.Else():
                m.d.sync += self.beyond_high.eq(1)

        return m
