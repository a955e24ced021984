# SPDX-License-Identifier: Apache-2.0
"""Proof on ``rtl.motion.coder_gear``: the pulses are those of the edges, for any gear and for ever.

While no bit turns over by itself, it never calls itself damaged.
"""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.coder_gear import CoderGear
from testbench.formal.prover import prove

SUM = 44    # bits of the sums: they wrap, on both sides of the equation alike


class CoderGearContract(wiring.Component):
    """E m + n/2 = P n + rest, and each pulse brings rest nearer to 0 <= rest < n, never beyond."""

    steps: In(16)
    surplus: In(16)
    edge: In(1)
    edge_reverse: In(1)
    forget: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = CoderGear()
        begun = Signal()
        n, whole = Signal(17), Signal(17)
        was_steps, was_surplus = Signal(16), Signal(16)
        m.d.sync += [begun.eq(1), was_steps.eq(self.steps), was_surplus.eq(self.surplus)]
        for name in self.signature.members:
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += [
            dut.clear.eq(~begun), n.eq(self.steps), whole.eq(self.steps + self.surplus),
            Assume(~ResetSignal("sync")), Assume(self.steps != 0), Assume(whole <= 1 << 16),
        ]
        with m.If(begun):
            m.d.comb += [Assume(self.steps == was_steps), Assume(self.surplus == was_surplus)]

        # Sums times m and n. An edge that is told to be lost is not in them.
        came, made = (Signal(signed(SUM), name=name) for name in ("came", "made"))
        was_edge, was_begun = Signal(), Signal()
        was_rest = Signal.like(dut.rest)
        room = Signal(signed(SUM))
        way = Mux(self.edge_reverse, -whole, whole)
        limit = 1 << (len(dut.rest) - 1)
        m.d.comb += room.eq(dut.rest + way)
        fits = (room >= -limit) & (room < limit)
        pulse = Mux(dut.fp, Mux(dut.fp_reverse, -n, n), 0)
        lost, left = Signal(), Signal(signed(SUM))
        m.d.sync += was_rest.eq(dut.rest)
        with m.If(begun):
            m.d.sync += [came.eq(came + Mux(self.edge & fits, way, 0)), made.eq(made + pulse),
                         lost.eq((lost | (self.edge & ~fits)) & ~self.forget)]
            m.d.comb += [
                left.eq(came + (n >> 1) - made - pulse),
                Assert(left == dut.rest),
                # A pulse was due, and is not one too many.
                Assert(~(dut.fp & ~dut.fp_reverse) | (dut.rest >= 0)),
                Assert(~(dut.fp & dut.fp_reverse) | (dut.rest < n)),
                Assert(dut.lost == lost),
                Assert(Cat(dut.rest, dut.parity).xor()),
                Assert(~dut.damaged),
            ]
        m.d.sync += [was_edge.eq(self.edge), was_begun.eq(begun)]
        # While a pulse is due, each clock without an edge makes one.
        with m.If(begun & was_begun & ~was_edge & ((was_rest < 0) | (was_rest >= n))):
            m.d.comb += Assert(dut.fp)
        m.d.comb += [Cover(begun & dut.fp & dut.fp_reverse & (n == 1) & (whole == 3)),
                     Cover(begun & dut.lost)]
        return m


def test_the_pulses_are_those_of_the_edges(workdir):
    prove(CoderGearContract(), workdir, depth=4)


def test_the_contract_is_reachable(workdir):
    prove(CoderGearContract(), workdir, depth=20, mode="cover")
