# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.gap.contact``: no pulse towards a possible contact, no voltage at rest."""

from amaranth import *
from amaranth.hdl import Assert, Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.gap.contact import ContactGuard
from testbench.formal.prover import prove

SETTLE = 5  # clocks; the argument does not depend on it
CLEARS = 2


class ContactContract(wiring.Component):
    """The guard; every input is free in every clock, except the number of clear samples."""

    off: In(1)
    safe: In(1)
    quiet: In(1)
    wanted: In(1)
    moving: In(1)
    reverse: In(1)
    fast: In(1)
    settled: In(1)
    away: In(1)
    lag_time: In(28)
    sample: In(1)
    sample_shorted: In(1)
    shorted: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = ContactGuard(clock_hz=1000, settle_ms=SETTLE)
        m.d.comb += Assume(~ResetSignal("sync"))
        for name in self.signature.members:
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += dut.clear_needed.eq(CLEARS)

        # VOLTAGE: only with motion, now or so recently that the axes may still move.
        since = Signal(range(SETTLE + 1), init=SETTLE)  # clocks since there was motion
        with m.If(self.wanted | self.moving):
            m.d.sync += since.eq(0)
        with m.Elif(since != SETTLE):
            m.d.sync += since.eq(since + 1)
        with m.If(dut.look):
            m.d.comb += [Assert(self.off & ~self.safe & ~self.quiet), Assert(since != SETTLE)]

        # MOTION: a pulse may come only if the discharge is on, or the gap was found open in the
        # present look, or the segment leads away. It never comes with Ss in a look, except on the
        # first part of a segment that leads away.
        opened = Signal()
        clears = Signal(8)   # in a row
        with m.If(~dut.look):
            m.d.sync += [opened.eq(0), clears.eq(0)]
        with m.Elif(self.sample):
            m.d.sync += clears.eq(Mux(self.sample_shorted, 0, clears + 1))
            with m.If(~self.sample_shorted & (clears + 1 >= CLEARS)):
                m.d.sync += opened.eq(1)
        m.d.comb += [Assert(dut.clears == clears), Assert(dut.known == opened)]
        allowed = Signal()
        m.d.comb += allowed.eq(~dut.wait & ~dut.contact)
        with m.If(allowed & self.off):
            m.d.comb += Assert(opened | self.away)
            with m.If(dut.look & self.shorted & ~self.reverse):
                m.d.comb += Assert(self.away & ~opened)
        with m.If(dut.look & self.shorted & ~self.reverse & (~self.away | opened)):
            m.d.comb += Assert(dut.contact)
        with m.If(~self.off):
            m.d.comb += [Assert(allowed), Assert(~dut.trip)]

        # TRIP: a contact, and always one while fast or just after.
        lately = Signal()
        m.d.sync += lately.eq(self.fast & (self.lag_time != 0))
        m.d.comb += Assert(dut.contact | ~dut.trip)
        with m.If(dut.contact & (self.fast | lately)):
            m.d.comb += Assert(dut.trip)

        m.d.comb += [Cover(dut.trip & self.away), Cover(dut.contact & ~dut.trip),
                     Cover(dut.look & ~self.wanted & ~self.moving),
                     Cover(allowed & self.off & ~self.away)]
        return m


def test_contract_holds(workdir):
    prove(ContactContract(), workdir, depth=SETTLE + 4)


def test_contract_is_reachable(workdir):
    prove(ContactContract(), workdir, depth=16, mode="cover")
