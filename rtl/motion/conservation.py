# SPDX-License-Identifier: Apache-2.0
"""Conservation of path pulses: none is lost, and none appears from nowhere."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.arithmetic import sum_or_difference

__all__ = ["Conservation"]


class Conservation(wiring.Component):
    """Checks in every clock that every path pulse is accounted for, from generator to window.

    A pulse that was commanded is stored in the ramp, on its way, or in the position. So
    ``command - position`` is ``stored + ps + pp``, or its opposite on the way back. ``damaged``
    says that this failed three clocks ago, with ``drop`` low.

    Proof: ``testbench/formal/test_conservation.py``.

    Members
    -------
    command, position : In(signed(32))
        Path coordinates, of the pulse generator and of the window.
    stored : In(24)
        Pulses in the ramp.
    ps, pp : In(1)
        A pulse on its way into the ramp, and one out of it.
    reverse : In(1)
        Pulses count down.
    drop : In(1)
        Pulses on their way are being dropped, and the command is set back to the position.
    damaged : Out(1)
        The sum is wrong.
    """

    command: In(signed(32))
    position: In(signed(32))
    stored: In(24)
    ps: In(1)
    pp: In(1)
    reverse: In(1)
    drop: In(1)
    damaged: Out(1)

    def elaborate(self, platform):
        m = Module()
        apart = Signal(32)
        under_way = Signal(25)
        back = Signal()
        remainder = Signal(32)
        looked = Signal(2)
        m.d.sync += [
            apart.eq(self.command - self.position),
            under_way.eq(self.stored + self.ps + self.pp),
            back.eq(self.reverse),
            remainder.eq(sum_or_difference(apart, under_way, ~back)),
            looked.eq(Cat(~self.drop, looked)),
            self.damaged.eq(looked[1] & remainder.any()),
        ]
        return m
