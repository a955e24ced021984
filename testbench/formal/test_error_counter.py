# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.motion.error_counter``: no pulse is lost unnoticed, and nothing wraps."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.error_counter import ErrorCounter
from testbench.formal.prover import prove

WIDTH, TRAVEL = 6, 9
LIMIT = (1 << (WIDTH - 1)) - 1


class ErrorCounterContract(wiring.Component):
    """The contract, with sums of the pulses kept beside the block."""

    pi: In(1)
    pi_reverse: In(1)
    fp: In(1)
    fp_reverse: In(1)
    adopt: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = ErrorCounter(width=WIDTH, travel=TRAVEL)
        for name in ("pi", "pi_reverse", "fp", "fp_reverse", "adopt"):
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += Assume(~ResetSignal("sync"))

        ordered = Mux(self.pi, Mux(self.pi_reverse, -1, 1), 0)
        moved = Mux(self.fp, Mux(self.fp_reverse, -1, 1), 0)
        command, position = Signal(signed(TRAVEL)), Signal(signed(TRAVEL))
        m.d.sync += [command.eq(Mux(self.adopt, position + moved, command + ordered)),
                     position.eq(position + moved)]
        m.d.comb += [Assert(dut.command == command), Assert(dut.position == position)]

        # The invariant: modulo 2**TRAVEL, as the positions wrap.
        difference = Signal(signed(TRAVEL))
        m.d.comb += difference.eq(dut.command - dut.position)
        with m.If(~dut.saturated):
            m.d.comb += Assert(difference == dut.error)
        m.d.comb += [Assert(dut.error <= LIMIT), Assert(dut.error >= -LIMIT)]

        # Er changes by the pulses, or not at all and with the alarm: it cannot wrap.
        ready = Signal()
        before, change, adopted, alarm = Signal(signed(WIDTH)), Signal(3), Signal(), Signal()
        m.d.sync += [ready.eq(1), before.eq(dut.error), change.eq(ordered - moved),
                     adopted.eq(self.adopt), alarm.eq(dut.saturated)]
        after = Signal(signed(WIDTH + 1))
        m.d.comb += after.eq(before + change.as_signed())
        with m.If(ready & adopted):
            m.d.comb += Assert((dut.error == 0) & ~dut.saturated & (dut.command == dut.position))
        with m.Elif(ready & (after <= LIMIT) & (after >= -LIMIT)):
            m.d.comb += Assert((dut.error == after) & (dut.saturated == alarm))
        with m.Elif(ready):
            m.d.comb += Assert((dut.error == before) & dut.saturated)

        # The guard gives no false alarm.
        m.d.comb += Assert(~dut.damaged)

        m.d.comb += [
            Cover(dut.saturated & (dut.error == LIMIT)),
            Cover(dut.saturated & (dut.error == -LIMIT)),
            Cover(dut.saturated & (dut.error == LIMIT - 1) & (before == LIMIT - 1)),
            Cover(adopted & alarm & (dut.position != 0)),
        ]
        return m


class DamageContract(wiring.Component):
    """From any state of the registers, reachable or not: a broken equation is reported.

    Nothing else is asserted, so that the induction begins in every state that a changed bit can
    cause.
    """

    pi: In(1)
    pi_reverse: In(1)
    fp: In(1)
    fp_reverse: In(1)
    adopt: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = ErrorCounter(width=WIDTH, travel=TRAVEL)
        for name in ("pi", "pi_reverse", "fp", "fp_reverse", "adopt"):
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += Assume(~ResetSignal("sync"))

        difference = Signal(signed(TRAVEL))
        m.d.comb += difference.eq(dut.command - dut.position)
        broken, broken_before, clocks = Signal(), Signal(), Signal(2)
        m.d.comb += broken.eq(~dut.saturated & (difference != dut.error))
        before = Signal()
        m.d.sync += [before.eq(broken), broken_before.eq(before),
                     clocks.eq(Cat(C(1, 1), clocks))]
        with m.If(clocks.all()):
            m.d.comb += Assert(dut.damaged == broken_before)
        return m


def test_any_damage_is_found_in_two_clocks(workdir):
    prove(DamageContract(), workdir, depth=3)


def test_contract_holds(workdir):
    prove(ErrorCounterContract(), workdir, depth=3)


def test_contract_is_reachable(workdir):
    prove(ErrorCounterContract(), workdir, depth=24, mode="cover")
