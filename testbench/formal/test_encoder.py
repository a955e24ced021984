# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.motion.encoder``: every legal edge is counted, every jump is flagged."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.encoder import Encoder
from testbench.formal.prover import prove

SAMPLES, SETTLE = 3, 4


class EncoderContract(wiring.Component):
    """The contract for any levels, and the count of a shaft that is slow enough.

    The shaft turns by at most one edge in ``SAMPLES`` + 1 clocks. The sum of the pulses must be its
    true place, delayed by the latency.
    """

    a: In(1)
    b: In(1)
    clear: In(1)
    turn: In(1)
    turn_down: In(1)

    def __init__(self, *, clean):
        self.clean = clean
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Encoder(samples=SAMPLES, settle=SETTLE)
        m.d.comb += [dut.clear.eq(self.clear), Assume(~ResetSignal("sync"))]
        if self.clean:
            self.add_shaft(m, dut)
        else:
            self.add_levels(m, dut)
        return m

    def add_shaft(self, m, dut):
        place = Signal(4)
        quiet = Signal(range(SAMPLES + 1))  # clocks for which the levels must still stay
        turning = Signal()
        clocks = Signal(range(SETTLE + SAMPLES + 1))
        m.d.comb += turning.eq(self.turn & (quiet == 0) & (clocks > SETTLE))
        with m.If(clocks != SETTLE + SAMPLES):
            m.d.sync += clocks.eq(clocks + 1)
        with m.If(turning):
            m.d.sync += [place.eq(place + Mux(self.turn_down, -1, 1)), quiet.eq(SAMPLES)]
        with m.Elif(quiet != 0):
            m.d.sync += quiet.eq(quiet - 1)
        # Going up, a leads: 00, 10, 11, 01.
        m.d.comb += [dut.a.eq(place[1] ^ place[0]), dut.b.eq(place[1])]

        delayed = [place]
        for index in range(SAMPLES + 1):
            delayed.append(Signal(4, name=f"place_{index}"))
            m.d.sync += delayed[-1].eq(delayed[-2])
        counted = Signal(4)
        m.d.sync += counted.eq(counted + Mux(dut.fp, Mux(dut.fp_reverse, -1, 1), 0))
        m.d.comb += [Assert(counted == delayed[SAMPLES + 1]), Assert(~dut.jump & ~dut.illegal)]
        m.d.comb += [Cover(counted == 2), Cover(counted == 14)]

    def add_levels(self, m, dut):
        m.d.comb += [dut.a.eq(self.a), dut.b.eq(self.b)]

        def settled(line, name):
            """Level after the filter, by its definition, and the one before."""
            past = [line]
            for index in range(SAMPLES - 1):
                past.append(Signal(name=f"{name}_{index}"))
                m.d.sync += past[-1].eq(past[-2])
            level, before = Signal(name=f"{name}_level"), Signal(name=f"{name}_before")
            m.d.sync += before.eq(level)
            with m.If(Cat(past).all()):
                m.d.sync += level.eq(1)
            with m.Elif(~Cat(past).any()):
                m.d.sync += level.eq(0)
            return level, before

        (a, a_before), (b, b_before) = settled(self.a, "a"), settled(self.b, "b")
        clocks, illegal, cleared = Signal(range(SETTLE + 2)), Signal(), Signal()
        counting = clocks > SETTLE
        with m.If(clocks != SETTLE + 1):
            m.d.sync += clocks.eq(clocks + 1)
        m.d.sync += [illegal.eq(dut.illegal), cleared.eq(self.clear)]

        # Index of the levels in 00, 10, 11, 01, and its change.
        turned = Signal(2)
        m.d.comb += turned.eq(Cat(a ^ b, b) - Cat(a_before ^ b_before, b_before))
        m.d.comb += [
            Assert(dut.fp == (counting & turned[0])),
            Assert(dut.jump == (counting & (turned == 2))),
            Assert(dut.illegal == ((illegal | dut.jump) & ~cleared)),
            Assert(~(dut.fp & dut.jump)),
        ]
        # Without this, induction starts from filters that disagree and may stay so for ever.
        m.d.comb += [Assert(dut.a_level == a), Assert(dut.b_level == b)]
        with m.If(dut.fp):
            m.d.comb += Assert(dut.fp_reverse == turned[1])
        m.d.comb += [Cover(dut.fp & dut.fp_reverse), Cover(dut.fp & ~dut.fp_reverse),
                     Cover(dut.jump & illegal), Cover(illegal & ~dut.illegal)]


def test_any_levels_keep_the_contract(workdir):
    prove(EncoderContract(clean=False), workdir, depth=8)


def test_a_clean_shaft_is_counted_exactly(workdir):
    prove(EncoderContract(clean=True), workdir, depth=20)


def test_contract_is_reachable(workdir):
    prove(EncoderContract(clean=False), workdir, depth=24, mode="cover")


def test_shaft_is_reachable(workdir):
    prove(EncoderContract(clean=True), workdir, depth=24, mode="cover")
