# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.safety.watchdog``: whatever is written when, it is never quiet for too long."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.safety.watchdog import Watchdog
from testbench.formal.prover import prove

PERIOD = 24  # clocks; the argument does not depend on it
EARLIEST, ASK = 3, 12


class WatchdogContract(wiring.Component):
    """Quiet exactly while calls and answers are in time; silent exactly a period after that."""

    pet: In(1)
    key: In(8)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Watchdog(clock_hz=1_000_000, period_us=PERIOD)
        m.d.comb += [dut.pet.eq(self.pet), dut.key.eq(self.key)]
        m.d.comb += Assume(~ResetSignal("sync"))

        # The truth: the age of the last complete call that was not too soon, of a first key that
        # waits for its second, and of the last answer; PERIOD for none, or too long ago.
        called = Signal(range(PERIOD + 1), init=PERIOD)
        begun = Signal(range(PERIOD + 1), init=PERIOD)
        answered = Signal(range(PERIOD + 1), init=PERIOD)
        late, complete, alarm, third = Signal(), Signal(), Signal(), Signal()
        m.d.comb += [
            late.eq(called >= PERIOD),
            complete.eq(self.pet & (self.key == 0x5A) & (begun < PERIOD)),
            third.eq(self.pet & (self.key == 0xC3)),
            alarm.eq(late | (answered >= PERIOD)),
        ]
        with m.If(~late):
            m.d.sync += called.eq(called + 1)
        with m.If(begun < PERIOD):
            m.d.sync += begun.eq(begun + 1)
        with m.If(self.pet & ~third):
            m.d.sync += begun.eq(Mux(self.key == 0xA5, 1, PERIOD))
        with m.If(complete):
            m.d.sync += called.eq(Mux(late | (called >= EARLIEST), 1, PERIOD))
        with m.Elif(called == PERIOD - 1):
            m.d.sync += begun.eq(PERIOD)  # being late forgets the first key
        with m.If(third & (answered >= ASK)):
            m.d.sync += answered.eq(1)
        with m.Elif(answered < PERIOD):
            m.d.sync += answered.eq(answered + 1)

        # Clocks in a row with the alarm, PERIOD at most; counted from the first without it on.
        alarmed, began = Signal(range(PERIOD + 1)), Signal()
        with m.If(~alarm):
            m.d.sync += [alarmed.eq(0), began.eq(1)]
        with m.Elif(began & (alarmed < PERIOD)):
            m.d.sync += alarmed.eq(alarmed + 1)

        m.d.comb += [
            Assert(dut.expired == alarm), Assert(dut.late == late),
            Assert(dut.asked == (answered >= ASK)),
            Assert(dut.silent == (alarmed >= PERIOD)),
        ]

        awake, again, hasty = Signal(), Signal(), Signal()
        with m.If(~dut.expired):
            m.d.sync += awake.eq(1)
        with m.If(awake & dut.expired):
            m.d.sync += again.eq(1)     # it was quiet, and has expired since
        with m.If(complete & ~late & (called < EARLIEST)):
            m.d.sync += hasty.eq(1)
        m.d.comb += [Cover(again & ~dut.expired), Cover(~dut.expired & complete),
                     Cover(hasty & dut.expired & ~dut.silent), Cover(dut.silent)]
        return m


def test_contract_holds(workdir):
    prove(WatchdogContract(), workdir, depth=PERIOD + 12)


def test_contract_is_reachable(workdir):
    prove(WatchdogContract(), workdir, depth=2 * PERIOD + 8, mode="cover")
