# SPDX-License-Identifier: Apache-2.0
"""Gap servo: the place on the path to which UP and DOWN move the electrode."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Servo"]

coordinate = signed(32)


class Servo(wiring.Component):
    """Goal of the gap servo: a step from where the machine is, ahead on ``down``, back on ``up``.

    ``goal`` and ``back`` change one clock after a strobe and stay until the next one. With both
    strobes ``up`` wins. Without ``on`` the goal is the machine's own place, and ``back`` is low.

    ``refused`` is high in the clock of an ``up`` that would pass ``lowest``. Coordinates wrap.

    Ref: second patent (gap by counted pulses), UP and DOWN generators 16 and 17.

    Members
    -------
    on : In(1)
        The servo is in use, and the machine is at the front.
    up, down : In(1)
        Widen, narrow the gap.
    step : In(16)
        Path pulses.
    command, lowest : In(signed(32))
        Path coordinates: of the machine, and of the lowest point allowed.
    goal : Out(signed(32))
        Path coordinate.
    back : Out(1)
        The goal lies behind.
    refused : Out(1)
        The step would go too far back.
    """

    on: In(1)
    up: In(1)
    down: In(1)
    step: In(16)
    command: In(coordinate)
    lowest: In(coordinate)
    goal: Out(coordinate)
    back: Out(1)
    refused: Out(1)

    def elaborate(self, platform):
        m = Module()

        # One adder does all: a step back is the complement of a step ahead plus a carry, and
        # without a strobe nothing is added.
        back = Signal()
        step = Signal(17)
        reached = Signal(coordinate)
        m.d.comb += [
            back.eq(self.on & self.up),
            step.eq(Mux(back, ~Cat(self.step, 0), Mux(self.on, self.step, 0))),
            reached.eq((Cat(1, self.command).as_signed() + Cat(back, step).as_signed())[1:]),
            self.refused.eq(back & ((reached - self.lowest)[:32].as_signed() < 0)),
        ]
        with m.If(~self.on | self.up | self.down):
            m.d.sync += [self.goal.eq(reached), self.back.eq(back)]

        return m
