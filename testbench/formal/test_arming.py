# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.safety.arming``: it never arms without a press after ``safe`` or ``disarm``."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.safety.arming import Arming
from testbench.formal.prover import prove

BOUNCE, CLOSING = 2, 3  # clocks


class ArmingContract(wiring.Component):
    """``closed`` is the specification, from the inputs: a press, and neither bar since."""

    arm: In(1)
    safe: In(1)
    disarm: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Arming(clock_hz=1000, button_ms=BOUNCE, close_ms=CLOSING)
        m.d.comb += [dut.arm.eq(self.arm), dut.safe.eq(self.safe), dut.disarm.eq(self.disarm)]
        m.d.comb += Assume(~ResetSignal("sync"))

        # The button: released and pressed for BOUNCE clocks in a row each.
        past = Signal(BOUNCE, init=-1)
        low = Signal()   # it was released last
        rose = Signal()
        m.d.sync += [past.eq(Cat(self.arm, past)), rose.eq(0)]
        with m.If(~Cat(self.arm, past[:-1]).any()):
            m.d.sync += low.eq(1)
        with m.If(low & Cat(self.arm, past[:-1]).all()):
            m.d.sync += [low.eq(0), rose.eq(1)]

        closed = Signal()
        age = Signal(range(CLOSING + 1))  # clocks for which it has been closed
        with m.If(self.safe | self.disarm):
            m.d.sync += [closed.eq(0), age.eq(0)]
        with m.Elif(closed):
            m.d.sync += age.eq(Mux(age == CLOSING, age, age + 1))
        with m.Elif(rose):
            m.d.sync += [closed.eq(1), age.eq(0)]

        m.d.comb += [
            Assert(~(self.safe & dut.contactor)),
            Assert(dut.contactor == (closed & ~self.safe)),
            Assert(dut.armed == (closed & (age == CLOSING))),
        ]
        # Needed for the induction: the block's own view of the button is the true one.
        m.d.comb += [
            Assert(dut.button.steady == low),
            Assert((~dut.held & ~dut.button.steady) == rose),
        ]
        m.d.comb += [Cover(dut.armed), Cover(dut.armed & self.disarm)]
        again = Signal()
        with m.If(self.disarm & dut.armed & ~self.safe):
            m.d.sync += again.eq(1)
        m.d.comb += Cover(again & dut.armed)
        return m


def test_contract_holds(workdir):
    prove(ArmingContract(), workdir, depth=10)


def test_contract_is_reachable(workdir):
    prove(ArmingContract(), workdir, depth=26, mode="cover")
