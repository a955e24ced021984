# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.safety.watchdog``: whatever is written when, it is never quiet for too long."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.safety.watchdog import Watchdog
from testbench.formal.prover import prove

PERIOD = 6  # clocks; the argument does not depend on it


class WatchdogContract(wiring.Component):
    """Quiet exactly while the last complete call is less than a period old."""

    pet: In(1)
    key: In(8)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Watchdog(clock_hz=1_000_000, period_us=PERIOD)
        m.d.comb += [dut.pet.eq(self.pet), dut.key.eq(self.key)]
        m.d.comb += Assume(~ResetSignal("sync"))

        # The truth: the age of the last complete call, and of a first key that waits for its
        # second; PERIOD for none.
        called = Signal(range(PERIOD + 1), init=PERIOD)
        begun = Signal(range(PERIOD + 1), init=PERIOD)
        alarm, complete = Signal(), Signal()
        m.d.comb += [
            alarm.eq(called == PERIOD),
            complete.eq(self.pet & (self.key == 0x5A) & (begun != PERIOD)),
        ]
        with m.If(~alarm):
            m.d.sync += called.eq(called + 1)
        with m.If(begun != PERIOD):
            m.d.sync += begun.eq(begun + 1)
        with m.If(self.pet):
            m.d.sync += begun.eq(Mux(self.key == 0xA5, 1, PERIOD))
        with m.If(complete):
            m.d.sync += called.eq(1)
        with m.Elif(called == PERIOD - 1):
            m.d.sync += begun.eq(PERIOD)  # expiring forgets the first key

        m.d.comb += Assert(dut.expired == alarm)

        awake, again = Signal(), Signal()  # it was quiet, and has expired since
        with m.If(~dut.expired):
            m.d.sync += awake.eq(1)
        with m.If(awake & dut.expired):
            m.d.sync += again.eq(1)
        m.d.comb += [Cover(again & ~dut.expired), Cover(~dut.expired & complete)]
        return m


def test_contract_holds(workdir):
    prove(WatchdogContract(), workdir, depth=PERIOD + 3)


def test_contract_is_reachable(workdir):
    prove(WatchdogContract(), workdir, depth=3 * PERIOD, mode="cover")
