# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.power``: no register makes a pulse longer, denser or stronger than allowed."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.power.limiter import Limiter
from rtl.power.pulse_generator import PulseGenerator
from testbench.formal.prover import prove

LEVEL, LONGEST, SHORTEST = 20, 4, 3


class PowerContract(wiring.Component):
    """Limiter and pulse generator, joined as in the machine; every input is free in every clock."""

    enable: In(1)
    sensing: In(1)
    on_time: In(20)
    off_time: In(20)
    sense_on: In(16)
    sense_off: In(16)
    level: In(6)
    cut: In(1)
    abnormal: In(1)
    off_extra: In(20)

    def elaborate(self, platform):
        m = Module()
        m.submodules.limiter = limiter = Limiter(level_max=LEVEL, on_max=LONGEST, off_min=SHORTEST)
        m.submodules.pulses = pulses = PulseGenerator()
        m.d.comb += Assume(~ResetSignal("sync"))
        m.d.comb += [
            limiter.level.eq(self.level), limiter.on_time.eq(self.on_time),
            limiter.off_time.eq(self.off_time),
            pulses.level.eq(limiter.allowed_level), pulses.on_time.eq(limiter.allowed_on),
            pulses.off_time.eq(limiter.allowed_off),
        ]
        for name in "enable", "sensing", "sense_on", "sense_off", "cut", "abnormal", "off_extra":
            m.d.comb += getattr(pulses, name).eq(getattr(self, name))

        burning = Signal(range(LONGEST + 2))              # clocks of this pulse before this one
        resting = Signal(range(SHORTEST + 1))             # clocks since the last main pulse
        m.d.sync += burning.eq(Mux(pulses.on, burning + (burning <= LONGEST), 0))
        m.d.sync += resting.eq(Mux(pulses.on, 0, resting + (resting < SHORTEST)))
        before, probe, level = Signal(), Signal(), Signal(6)
        cut, sensing = Signal(), Signal()
        m.d.sync += [before.eq(pulses.on), probe.eq(pulses.sense), level.eq(pulses.level_out),
                     cut.eq(self.cut & self.abnormal), sensing.eq(self.sensing)]

        m.d.comb += Assert(~(pulses.on & pulses.sense))
        with m.If(~self.enable):
            m.d.comb += Assert(~pulses.on & ~pulses.sense)
        with m.If(pulses.on):
            m.d.comb += [Assert(burning < LONGEST), Assert(pulses.level_out <= LEVEL),
                         Assert(~probe)]
        with m.Else():
            m.d.comb += Assert(pulses.level_out == 0)
        with m.If(pulses.on & ~before):
            m.d.comb += Assert(resting == SHORTEST)
        with m.If(pulses.sense & ~probe):
            m.d.comb += Assert(resting == SHORTEST)
        with m.If(pulses.on & before):
            m.d.comb += [Assert(pulses.level_out == level), Assert(~cut), Assert(~sensing)]
        m.d.comb += [Cover(burning == LONGEST), Cover(before & cut), Cover(before & ~self.enable),
                     Cover(pulses.level_out == LEVEL)]
        after_main, after_sense = Signal(), Signal()  # what the last pulse was
        with m.If(pulses.on | pulses.sense):
            m.d.sync += [after_main.eq(pulses.on), after_sense.eq(pulses.sense)]
        m.d.comb += [Cover(pulses.sense & after_main), Cover(pulses.on & after_sense)]
        return m


def test_contract_holds(workdir):
    prove(PowerContract(), workdir, depth=LONGEST + SHORTEST + 2)


def test_contract_is_reachable(workdir):
    prove(PowerContract(), workdir, depth=16, mode="cover")
