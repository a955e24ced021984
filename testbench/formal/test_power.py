# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.power``: no register makes a pulse longer, denser or stronger than allowed.

No register lets a source be on when it may not, or hides a stuck gate.
"""

from amaranth import *
from amaranth.hdl import Assert, Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.power.power import Power
from testbench.formal.prover import prove

LEVEL, LONGEST, SHORTEST = 20, 4, 3
DEAD, LIMIT, SETTLE = 2, 4, 3   # clocks of the read-back


class PowerContract(wiring.Component):
    """Both sources joined as in the controller; every input is free in every clock."""

    machining: In(1)
    sensing: In(1)
    look: In(1)
    safe: In(1)
    quiet: In(1)
    latched: In(1)
    settled: In(1)
    on_time: In(20)
    wait_time: In(20)
    ignited: In(1)
    off_time: In(20)
    sense_on: In(16)
    sense_off: In(16)
    level: In(6)
    cut: In(1)
    abnormal: In(1)
    off_extra: In(20)
    current: In(1)
    short: In(1)
    reference: In(10)

    def elaborate(self, platform):
        m = Module()
        m.submodules.power = power = Power(
            clock_hz=1_000_000, level_max=LEVEL, on_max=LONGEST, off_min=SHORTEST,
            dead_ns=1000 * DEAD, limit_us=LIMIT, settle_us=SETTLE)
        m.d.comb += Assume(~ResetSignal("sync"))
        for name, member in self.signature.members.items():
            if member.flow is In:
                m.d.comb += getattr(power, name).eq(getattr(self, name))
        m.d.comb += Assert(~(power.on & power.sense))
        self._allowed(m, power)
        self._limits(m, power)
        self._stuck(m, power)
        return m

    def _allowed(self, m, power):
        """Which source may be on."""
        before = Signal()
        m.d.sync += before.eq(self.machining)
        with m.If(self.safe | self.quiet | (self.machining != before)):
            m.d.comb += Assert(~power.on & ~power.sense)
        with m.If(power.on):
            m.d.comb += Assert(self.machining)
        with m.If(power.sense):
            m.d.comb += Assert(self.machining | self.look)
        m.d.comb += [Cover(power.sense & self.machining), Cover(power.sense & ~self.machining)]

        # None begins before the outside follows the condition.
        was, latched, settled = Signal(2), Signal(), Signal()
        m.d.sync += [was.eq(Cat(power.on, power.sense)), latched.eq(self.latched),
                     settled.eq(self.settled)]
        with m.If((power.on & ~was[0]) | (power.sense & ~was[1])):
            m.d.comb += Assert(latched)
        with m.If(power.on):
            m.d.comb += Assert(settled)
        m.d.comb += Cover(power.sense & self.machining & ~settled)

    def _limits(self, m, power):
        """Pulses by their times. The signal of the ignition may come at any time, or never."""
        burning = Signal(range(LONGEST + 2))              # clocks of this pulse before this one
        resting = Signal(range(SHORTEST + 1))             # clocks since the last main pulse
        m.d.sync += burning.eq(Mux(power.on, burning + (burning <= LONGEST), 0))
        m.d.sync += resting.eq(Mux(power.on, 0, resting + (resting < SHORTEST)))
        before, probe, level = Signal(), Signal(), Signal(6)
        cut, sensing = Signal(), Signal()
        m.d.sync += [before.eq(power.on), probe.eq(power.sense), level.eq(power.level_out),
                     cut.eq(self.cut & self.abnormal), sensing.eq(self.sensing | ~self.settled)]
        waited, lit = Signal(), Signal()    # the pulse began so; it has ignited before
        with m.If(~power.on):
            m.d.sync += [waited.eq(self.wait_time != 0), lit.eq(0)]
        with m.Else():
            m.d.sync += lit.eq(lit | self.ignited)
        m.d.comb += [Cover((burning == LONGEST) & waited & lit),
                     Cover((burning == LONGEST - 1) & waited & ~lit & ~power.on)]
        with m.If(power.on):
            m.d.comb += [Assert(burning < LONGEST), Assert(power.level_out <= LEVEL),
                         Assert(~probe)]
        with m.Else():
            m.d.comb += Assert(power.level_out == 0)
        with m.If((power.on & ~before) | (power.sense & ~probe)):
            m.d.comb += Assert(resting == SHORTEST)
        with m.If(power.on & before):
            m.d.comb += [Assert(power.level_out == level), Assert(~cut), Assert(~sensing)]
        m.d.comb += [Cover(burning == LONGEST), Cover(before & cut), Cover(before & self.safe),
                     Cover(power.level_out == LEVEL)]
        after_main, after_sense = Signal(), Signal()  # what the last pulse was
        with m.If(power.on | power.sense):
            m.d.sync += [after_main.eq(power.on), after_sense.eq(power.sense)]
        m.d.comb += [Cover(power.sense & after_main), Cover(power.on & after_sense)]

    def _stuck(self, m, power):
        """A gap that stays live is detected, and gets no pulse meanwhile."""
        reference = Signal(10)
        trusted = Signal(range(SETTLE + 1))  # clocks of the short level
        m.d.sync += reference.eq(self.reference)
        with m.If(self.reference != reference):
            m.d.sync += trusted.eq(0)
        with m.Elif(trusted != SETTLE):
            m.d.sync += trusted.eq(trusted + 1)
        gate, life = Signal(), Signal()
        m.d.comb += [
            gate.eq(power.on | power.sense),
            life.eq(self.current | (~self.short & (trusted == SETTLE))),
        ]

        # Clocks with life and both gates off, in a row, before this one.
        silent = Signal(range(LIMIT + 2))
        with m.If(gate | ~life):
            m.d.sync += silent.eq(0)
        with m.Elif(silent <= LIMIT):
            m.d.sync += silent.eq(silent + 1)
        with m.If(silent == LIMIT + 1):
            m.d.comb += Assert(power.stuck)

        # Clocks before this one without life or gate: DEAD of them precede every pulse, not
        # counting the clock in which it was decided.
        since = Signal(range(DEAD + 1))
        with m.If(gate | life):
            m.d.sync += since.eq(0)
        with m.Elif(since != DEAD):
            m.d.sync += since.eq(since + 1)
        was, decided = Signal(), Signal(range(DEAD + 1))
        begun = Signal(init=1)   # a gate or life has been seen since reset, with which it is dead
        m.d.sync += [was.eq(gate), decided.eq(since)]
        with m.If(gate | life):
            m.d.sync += begun.eq(0)
        fresh = Signal(init=1)
        m.d.sync += fresh.eq(begun)
        with m.If(gate & ~was):
            m.d.comb += Assert((decided == DEAD) | fresh)

        # No false alarm: there was life without a gate for LIMIT clocks, pauses below DEAD aside.
        quiet = Signal(range(LIMIT + 1))
        with m.If(gate | (since == DEAD)):
            m.d.sync += quiet.eq(0)
        with m.Elif(quiet != LIMIT):
            m.d.sync += quiet.eq(quiet + 1)
        with m.If(power.stuck):
            m.d.comb += Assert(quiet == LIMIT)
        m.d.comb += [Cover(power.stuck & self.current), Cover(power.stuck & ~self.current & life),
                     Cover(power.stuck & self.safe), Cover(power.on & (silent == 0))]


def test_contract_holds(workdir):
    prove(PowerContract(), workdir, depth=LONGEST + SHORTEST + LIMIT + SETTLE + 2)


def test_contract_is_reachable(workdir):
    prove(PowerContract(), workdir, depth=20, mode="cover")
