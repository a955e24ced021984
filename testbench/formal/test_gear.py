# SPDX-License-Identifier: Apache-2.0
"""Proof on ``rtl.motion.gear``: the steps are those of the count, for any gear and for ever."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.gear import Gear
from testbench.formal.prover import prove

SUM = 40    # bits of the sums: they wrap, on both sides of the equation alike


class GearContract(wiring.Component):
    """P n + m/2 = S m + phase with 0 <= phase < m, and so S = floor((P n + m/2) / m)."""

    steps: In(16)
    surplus: In(16)
    pending: In(1)
    negative: In(1)
    safe: In(1)
    width: In(8)
    space: In(8)
    setup: In(8)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Gear()
        begun, before = Signal(), Signal()
        for name in self.signature.members:
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        n, whole = Signal(17), Signal(17)
        m.d.comb += [n.eq(self.steps), whole.eq(self.steps + self.surplus),
                     dut.clear.eq(~begun), Assume(~ResetSignal("sync")),
                     Assume(self.steps != 0), Assume(whole <= 1 << 16)]
        was_steps, was_surplus = Signal(16), Signal(16)
        m.d.sync += [begun.eq(1), was_steps.eq(self.steps), was_surplus.eq(self.surplus),
                     before.eq(dut.step)]
        with m.If(begun):
            m.d.comb += [Assume(self.steps == was_steps), Assume(self.surplus == was_surplus)]

        # The pulse of this clock, and the step that has begun in it.
        pulse = Mux(dut.fp, Mux(dut.fp_reverse, -n, n), 0)
        step = Mux(dut.step & ~before, Mux(dut.dir, -whole, whole), 0)
        pulses, sent = Signal(signed(SUM)), Signal(signed(SUM))
        with m.If(begun):
            m.d.sync += [pulses.eq(pulses + pulse), sent.eq(sent + step)]
            phase = Signal(signed(SUM))
            m.d.comb += [
                phase.eq(pulses + pulse + (whole >> 1) - sent - step),
                # The phase of the block is that after the pulse of this clock.
                Assert(phase == dut.phase),
                Assert(dut.phase < whole),
                # A step comes with a pulse of its own direction.
                Assert(~(dut.step & ~before) | (dut.fp & (dut.dir == dut.fp_reverse))),
            ]
        m.d.comb += [Cover(dut.step & dut.dir & begun), Cover(dut.fp & ~dut.step & (n == 3))]
        return m


def test_steps_are_those_of_the_count(workdir):
    prove(GearContract(), workdir, depth=4)


def test_the_contract_is_reachable(workdir):
    prove(GearContract(), workdir, depth=12, mode="cover")
