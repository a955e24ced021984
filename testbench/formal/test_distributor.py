# SPDX-License-Identifier: Apache-2.0
"""Proof on ``rtl.motion.distributor``: the steps depend on the place alone, so it is reversible."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.distributor import LineDistributor
from testbench.formal.prover import prove

WIDTH = 4


class DistributorContract(wiring.Component):
    """An axis that goes along segment after segment, and turns anywhere.

    ``place`` is the number of path pulses into the segment and ``steps`` that of the axis pulses,
    both counted forwards. At either end any segment may follow, entered at either of its ends.
    """

    pulse: In(1)
    reverse: In(1)
    change: In(1)
    at_end: In(1)
    next_length: In(WIDTH)
    next_magnitude: In(WIDTH)
    next_negative: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = LineDistributor(axes=1, width=WIDTH)
        m.d.comb += Assume(~ResetSignal("sync"))

        length, magnitude = Signal(WIDTH, init=1), Signal(WIDTH)
        negative = Signal()
        place, steps = Signal(WIDTH), Signal(signed(WIDTH + 1))
        age = Signal(2, init=2)  # clocks since the last pulse, as far as it matters
        back, turned = Signal(), Signal()
        pulse = Signal()
        m.d.comb += [
            pulse.eq(self.pulse & (age == 2) & Mux(self.reverse, place != 0, place != length)),
            dut.pulse.eq(pulse), dut.reverse.eq(self.reverse),
            dut.length.eq(length),
            dut.travel[0].magnitude.eq(magnitude), dut.travel[0].negative.eq(negative),
        ]
        now = Signal(signed(WIDTH + 2))  # steps with the one being made
        m.d.comb += now.eq(steps + Mux(dut.pi, Mux(dut.pi_reverse[0] ^ negative, -1, 1), 0))
        m.d.sync += steps.eq(now)
        with m.If(pulse):
            m.d.sync += [age.eq(0), back.eq(self.reverse),
                         place.eq(Mux(self.reverse, place - 1, place + 1)),
                         turned.eq((turned | (self.reverse & (place == 3))) & (place != 0))]
        with m.Elif(age != 2):
            m.d.sync += age.eq(age + 1)
        with m.Elif(self.change & ((place == 0) | (place == length))
                    & (self.next_length != 0) & (self.next_magnitude <= self.next_length)):
            m.d.sync += [
                length.eq(self.next_length), magnitude.eq(self.next_magnitude),
                negative.eq(self.next_negative),
                place.eq(Mux(self.at_end, self.next_length, 0)),
                steps.eq(Mux(self.at_end, self.next_magnitude, 0)),
                turned.eq(0),
            ]

        # Twice the distance from the line, times the length.
        off, remainder = Signal(signed(2 * WIDTH + 4)), dut.remainders[0]
        m.d.comb += off.eq(2 * place * magnitude - 2 * length * now)
        before = Signal.like(off)
        m.d.comb += before.eq(Mux(back, off + 2 * magnitude, off - 2 * magnitude))
        m.d.comb += [Assert(length != 0), Assert(magnitude <= length), Assert(place <= length),
                     Assert(age <= 2), Assert(remainder == off), Assert(~dut.pi | (age == 1))]
        with m.If(age == 0):  # a pulse has been counted, its step not
            m.d.comb += Assert((before >= -length) & (before < length))
        with m.Else():        # at most half a pulse off the line
            m.d.comb += Assert((off >= -length) & (off < length))
            with m.If(place == 0):
                m.d.comb += Assert(now == 0)
            with m.If(place == length):
                m.d.comb += Assert(now == magnitude)

        odd = (length == 5) & (magnitude == 3)
        m.d.comb += [Cover(odd & turned & (place == length) & (age == 2)),
                     Cover(odd & negative & self.at_end & (place == 0) & back & (age == 2)),
                     Cover((length == 1) & (magnitude == 1) & (place == 1) & (age == 1) & dut.pi)]
        return m


def test_contract_holds(workdir):
    prove(DistributorContract(), workdir, depth=4)


def test_contract_is_reachable(workdir):
    prove(DistributorContract(), workdir, depth=40, mode="cover")
