# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.safety.watchdog``: for any writes it is never quiet for too long."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.safety.watchdog import Watchdog
from testbench.formal.in_time import ASK, PERIOD, InTime
from testbench.formal.prover import prove


class WatchdogContract(wiring.Component):
    """Quiet exactly while calls and answers are in time; silent exactly a period after that."""

    pet: In(1)
    key: In(8)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Watchdog(clock_hz=1_000_000, period_us=PERIOD)
        m.d.comb += [dut.pet.eq(self.pet), dut.key.eq(self.key)]
        m.d.comb += Assume(~ResetSignal("sync"))

        m.submodules.truth = truth = InTime()
        m.d.comb += [truth.pet.eq(self.pet), truth.key.eq(self.key)]
        alarm = truth.late | truth.mute

        # Clocks in a row with the alarm, PERIOD at most; counted from the first without it on.
        alarmed, began = Signal(range(PERIOD + 1)), Signal()
        with m.If(~alarm):
            m.d.sync += [alarmed.eq(0), began.eq(1)]
        with m.Elif(began & (alarmed < PERIOD)):
            m.d.sync += alarmed.eq(alarmed + 1)

        m.d.comb += [
            Assert(dut.expired == alarm), Assert(dut.late == truth.late),
            Assert(dut.asked == (truth.answered >= ASK)),
            Assert(dut.silent == (alarmed >= PERIOD)),
        ]

        awake, again, hasty = Signal(), Signal(), Signal()
        with m.If(~dut.expired):
            m.d.sync += awake.eq(1)
        with m.If(awake & dut.expired):
            m.d.sync += again.eq(1)     # it was quiet, and has expired since
        with m.If(truth.hasty):
            m.d.sync += hasty.eq(1)
        m.d.comb += [Cover(again & ~dut.expired), Cover(~dut.expired & truth.complete),
                     Cover(hasty & dut.expired & ~dut.silent), Cover(dut.silent)]
        return m


def test_contract_holds(workdir):
    prove(WatchdogContract(), workdir, depth=PERIOD + 12)


def test_contract_is_reachable(workdir):
    prove(WatchdogContract(), workdir, depth=2 * PERIOD + 8, mode="cover")
