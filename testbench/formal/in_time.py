# SPDX-License-Identifier: Apache-2.0
"""Whether the watchdog is called in time: its contract, from the keys alone."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ASK", "EARLIEST", "PERIOD", "InTime"]

PERIOD = 24  # clocks of the watchdog in the proof; the argument does not depend on it
EARLIEST, ASK = 6, 12  # clocks before which a call is too soon; after which an answer is asked for


class InTime(wiring.Component):
    """Ages of the calls and answers to a watchdog, each ``PERIOD`` for none or too long ago.

    Members
    -------
    pet : In(1), key : In(8)
        A strobe that a key is written, and the key.
    called : Out(range(PERIOD + 1))
        Age of the last complete call that was not too soon.
    begun : Out(range(PERIOD + 1))
        Age of a first key that waits for its second.
    answered : Out(range(PERIOD + 1))
        Age of the last third key that was asked for.
    complete : Out(1)
        A second key is written that completes a call.
    late, mute : Out(1)
        The main loop is out of time; the interrupts are.
    hasty : Out(1)
        The call that is completed is too soon.
    """

    pet: In(1)
    key: In(8)
    called: Out(range(PERIOD + 1), init=PERIOD)
    begun: Out(range(PERIOD + 1), init=PERIOD)
    answered: Out(range(PERIOD + 1), init=PERIOD)
    complete: Out(1)
    late: Out(1)
    mute: Out(1)
    hasty: Out(1)

    def elaborate(self, platform):
        m = Module()
        third = Signal()
        m.d.comb += [
            self.late.eq(self.called >= PERIOD),
            self.mute.eq(self.answered >= PERIOD),
            self.complete.eq(self.pet & (self.key == 0x5A) & (self.begun < PERIOD)),
            self.hasty.eq(self.complete & ~self.late & (self.called < EARLIEST)),
            third.eq(self.pet & (self.key == 0xC3)),
        ]
        with m.If(~self.late):
            m.d.sync += self.called.eq(self.called + 1)
        with m.If(self.begun < PERIOD):
            m.d.sync += self.begun.eq(self.begun + 1)
        with m.If(self.pet & ~third):
            m.d.sync += self.begun.eq(Mux(self.key == 0xA5, 1, PERIOD))
        with m.If(self.complete):
            m.d.sync += self.called.eq(Mux(self.hasty, PERIOD, 1))
        with m.Elif(self.called == PERIOD - 1):
            m.d.sync += self.begun.eq(PERIOD)  # being late forgets the first key
        with m.If(third & (self.answered >= ASK)):
            m.d.sync += self.answered.eq(1)
        with m.Elif(~self.mute):
            m.d.sync += self.answered.eq(self.answered + 1)
        return m
