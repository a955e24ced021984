# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.motion.supervision``: a coder that agrees with the model never trips.

The pulses and the phases are free of each other: that both phases have edges is assumed.
"""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.supervision import Supervision
from rtl.states import Check
from testbench.formal.prover import prove


class Small(Supervision):
    """The supervision without its check of the rate, with few bits and few clocks."""

    SIZE, GAIN, PACE, CAME = 2, 2, 4, 5
    LAG, MEMORY = 1, 2
    LEAST, BEGUN, LONGEST, SHARE, LIVELY, STILL = 3, 1, 4, 2, 2, 2
    COARSELY = 3
    FRACTION, COARSE, FINER = 2, 2, 0
    STEPS = SIZE + 6

    def _rate(self, m, valid):
        return C(0, 1)


APART = 6      # greatest difference of pulses and model's travel, in quarters of a pulse
ALLOWANCE = 4  # twice that, and the rounding of the decay: a quarter times 2**MEMORY


class Agreement(wiring.Component):
    """Pulses whose sum never differs from the model's travel by more than ``APART``.

    A tick comes every 8 clocks. ``on``, Er and the gain are free.
    """

    gain: In(Small.GAIN)
    size: In(Small.SIZE)
    negative: In(1)
    standing: In(1)
    resting: In(1)
    fp: In(1)
    fp_reverse: In(1)
    a: In(1)
    b: In(1)
    coarse: In(1)
    on: In(1)
    clear: In(1)

    def __init__(self, *, agrees=True):
        self.agrees = agrees
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Small(allowance=ALLOWANCE)
        for name in self.signature.members:
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += Assume(~ResetSignal("sync"))
        clock = Signal(range(Small.STEPS))
        m.d.sync += clock.eq(Mux(clock == Small.STEPS - 1, 0, clock + 1))
        m.d.comb += dut.tick.eq(clock == 0)
        add, take = Small.SIZE + 3, Small.SIZE + 4  # clocks after the tick

        # What came less what the model says, since ``valid``; and when the stretch began.
        apart, since = Signal(signed(10)), Signal(signed(10))
        now = Signal(signed(10))
        m.d.comb += now.eq(apart + Mux(clock == take,
                                       (dut.came << Small.FRACTION) - dut.speed, 0))
        with m.If(dut.valid):
            m.d.sync += apart.eq(now)
            if self.agrees:
                m.d.comb += [Assume((now <= APART) & (now >= -APART)), Assume(dut.lively.all())]
        with m.Else():
            m.d.sync += apart.eq(0)
        with m.If(~dut.valid):
            m.d.sync += since.eq(0)
        with m.Elif(dut.way == 0):
            m.d.sync += since.eq(now)

        if self.agrees:
            m.d.comb += Assert(dut.check == Check.NONE)
            self._invariants(m, dut, clock, add, take, apart, since)
        passed = Signal()
        m.d.sync += passed.eq(dut.way >= 8 << Small.FRACTION)
        m.d.comb += [Cover(passed & (dut.way == 0) & dut.valid & (dut.speed > 1)),
                     Cover(passed & (dut.way == 0) & dut.valid & (dut.speed < -1))]
        if not self.agrees:
            m.d.comb += [Cover(dut.check == found) for found in (
                Check.MODEL, Check.SILENT, Check.PHASE_A, Check.AGAINST, Check.SHARE)]
        return m

    def _invariants(self, m, dut, clock, add, take, apart, since):
        """Facts that the induction needs."""
        with m.If(clock == 0):
            m.d.comb += Assert(dut.step >= Small.STEPS - 1)
        with m.Else():
            m.d.comb += Assert(dut.step == clock - 1)
        for value in apart, since:
            m.d.comb += [Assert(value <= APART), Assert(value >= -APART)]
        # Of each tick below 0 the magnitude lacks a quarter: as much as the way, at most.
        more = (dut.back << Small.FRACTION) - dut.way
        gone = apart - since
        with m.If(dut.valid & (dut.way != 0) & (clock != take)):
            with m.If(dut.side):
                m.d.comb += [Assert(more + gone >= 0), Assert(more + gone <= dut.way)]
            with m.Else():
                m.d.comb += Assert(more == gone)
        rest = dut.misfit + apart
        kept = APART + (1 << Small.MEMORY)
        with m.If(dut.valid & ((clock > take) | (clock < add - 1))):
            m.d.comb += [Assert(rest <= kept), Assert(rest >= -kept)]


def test_no_trip_while_model_and_coder_agree(workdir):
    prove(Agreement(), workdir, depth=Small.STEPS + 3)


def test_stretches_pass(workdir):
    prove(Agreement(), workdir, depth=60, mode="cover")


def test_a_coder_that_does_not_agree_is_found(workdir):
    prove(Agreement(agrees=False), workdir, depth=60, mode="cover")
