# SPDX-License-Identifier: Apache-2.0
"""Reversible error counter: how far an axis is behind its command (Er)."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ErrorCounter"]


class ErrorCounter(wiring.Component):
    """Commanded position, position, and the difference between the two.

    ``command`` is the sum of the pulses Pi, ``position`` the sum of the feedback pulses FP, and
    ``error`` is Er: as long as ``saturated`` is low, ``command == position + error`` (modulo
    2**travel) in every clock. The pulses of a clock are in all three one clock later, Pi and FP of
    one clock together, at any rate up to one of each per clock.

    ``error`` stays within ``limit = 2**(width - 1) - 1`` on either side. A change (of up to two
    pulses) that would take it further is left out of ``error`` and sets ``saturated``, which stays
    until ``adopt``; ``command`` and ``position`` go on counting, so that their difference still
    tells how far off the axis is.

    ``adopt`` gives up the command: one clock later ``command`` equals ``position``, with the FP of
    the clock of ``adopt`` included, ``error`` is 0 and ``saturated`` low. A Pi in that clock is
    lost.

    ``damaged`` says that two clocks ago the equation failed with ``saturated`` low: a bit of one of
    the three registers has changed by itself. It stays high for as long as the equation fails.

    Ref: first patent (retraction conditions in the tape), Fig. 4, items 107a and 107b.
    Proof: ``testbench/formal/test_error_counter.py``.

    Parameters
    ----------
    width : int
        Bits of ``error``, at least 3.
    travel : int
        Bits of the positions, at least ``width``. They wrap: travel limits are kept upstream.

    Members
    -------
    pi : In(1)
        Command pulse.
    pi_reverse : In(1)
        Its direction, high for down.
    fp : In(1)
        Feedback pulse.
    fp_reverse : In(1)
        Its direction, high for down.
    adopt : In(1)
        Take the position as the command.
    command : Out(signed(travel))
        Sum of Pi, in pulses.
    position : Out(signed(travel))
        Sum of FP, in pulses.
    error : Out(signed(width))
        Er, in pulses: positive while the axis has still to go up.
    saturated : Out(1)
        A pulse did not fit into ``error`` since the last ``adopt``.
    damaged : Out(1)
        Position, command and Er do not belong together.

    Raises
    ------
    ValueError
        If ``width`` or ``travel`` is too small.
    """

    def __init__(self, *, width=18, travel=32):
        if width < 3:
            raise ValueError(f"error counter width must be at least 3 bits, not {width!r}")
        if travel < width:
            raise ValueError(f"travel must be at least the {width} bits of the error counter, "
                             f"not {travel!r}")
        self.width = width
        self.travel = travel
        super().__init__({
            "pi":         In(1),
            "pi_reverse": In(1),
            "fp":         In(1),
            "fp_reverse": In(1),
            "adopt":      In(1),
            "command":    Out(signed(travel)),
            "position":   Out(signed(travel)),
            "error":      Out(signed(width)),
            "saturated":  Out(1),
            "damaged":    Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        # -1, 0 or +1 as two bits of two's complement: the sign, and whether there is a pulse.
        ordered = Cat(self.pi, self.pi & self.pi_reverse).as_signed()
        moved = Cat(self.fp, self.fp & self.fp_reverse).as_signed()

        position = Signal(signed(self.travel))
        m.d.comb += position.eq(self.position + moved)
        m.d.sync += self.position.eq(position)

        # One bit more than the counter has is enough for the sum of any error and any change. The
        # counter's lowest code has no opposite and is not used, so that the range is symmetrical.
        #
        # The change is put together from bits: from a difference synthesis would build an adder of
        # three operands, 60 LUTs more.
        one = self.pi ^ self.fp
        two = self.pi & self.fp & (self.pi_reverse != self.fp_reverse)
        down = Mux(self.pi, self.pi_reverse, ~self.fp_reverse)
        change = Cat(one, two | (one & down), (one | two) & down).as_signed()
        total = Signal(signed(self.width + 1))
        lost = Signal()
        m.d.comb += [
            total.eq(self.error + change),
            lost.eq((total[-1] != total[-2]) | (total[:-1] == 1 << (self.width - 1))),
        ]
        with m.If(~lost):
            m.d.sync += self.error.eq(total)
        with m.Else():
            m.d.sync += self.saturated.eq(1)
        m.d.sync += self.command.eq(self.command + ordered)

        with m.If(self.adopt):
            m.d.sync += [self.command.eq(position), self.error.eq(0), self.saturated.eq(0)]

        # The sum is made in one clock and compared in the next.
        sum_, command = (Signal(signed(self.travel), name=name) for name in ("sum", "command_then"))
        counts = Signal()
        m.d.sync += [
            sum_.eq(self.position + self.error),
            command.eq(self.command),
            counts.eq(~self.saturated),
            self.damaged.eq(counts & (sum_ != command)),
        ]

        return m
