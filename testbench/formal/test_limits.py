# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.motion.limits``: no command leaves the soft limits, for any pulses."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.error_counter import ErrorCounter
from rtl.motion.limits import SoftLimits
from testbench.formal.prover import prove

TRAVEL = 8


class LimitsContract(wiring.Component):
    """The limits before the error counter of their axis, for any pulses and any limits.

    The limits are constant, low below high. A command within stays within; a command outside, where
    ``adopt`` may have left it, never goes further away. Positions do not wrap.
    """

    pi: In(1)
    pi_reverse: In(1)
    fp: In(1)
    fp_reverse: In(1)
    adopt: In(1)
    low: In(signed(TRAVEL))
    high: In(signed(TRAVEL))
    barred_low: In(1)
    barred_high: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = SoftLimits(travel=TRAVEL)
        m.submodules.counter = counter = ErrorCounter(width=5, travel=TRAVEL)
        for name in ("pi", "pi_reverse", "low", "high", "barred_low", "barred_high"):
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += [
            dut.command.eq(counter.command), dut.clear.eq(self.adopt),
            counter.pi.eq(dut.passed), counter.pi_reverse.eq(self.pi_reverse),
            counter.fp.eq(self.fp), counter.fp_reverse.eq(self.fp_reverse),
            counter.adopt.eq(self.adopt),
            Assume(~ResetSignal("sync")), Assume(self.low <= self.high),
        ]
        ready = Signal()
        low, high, command = (Signal(signed(TRAVEL)) for _ in range(3))
        adopted, beyond, onto = Signal(), Signal(2), Signal(2)
        m.d.sync += [ready.eq(1), low.eq(self.low), high.eq(self.high),
                     command.eq(counter.command), adopted.eq(self.adopt)]
        with m.If(ready):
            m.d.comb += Assume((low == self.low) & (high == self.high))

        # A step up is from below the upper limit, one down from above the lower one.
        up, down = counter.command > command, counter.command < command
        with m.If(ready & ~adopted):
            m.d.comb += [Assert(~up | (command < high)), Assert(~down | (command > low))]
            with m.If((command >= low) & (command <= high)):
                m.d.comb += Assert((counter.command >= low) & (counter.command <= high))

        # Nothing is lost unnoticed, and nothing in a barred direction passes.
        refused = self.pi & ~dut.passed
        barred = Mux(self.pi_reverse, self.barred_low, self.barred_high)
        m.d.comb += Assert(~(dut.passed & barred))
        m.d.sync += [
            beyond.eq(Cat(refused & ~barred & ~self.adopt & self.pi_reverse,
                          refused & ~barred & ~self.adopt & ~self.pi_reverse)),
            onto.eq(Cat(refused & barred)),
        ]
        m.d.comb += [Assert(~beyond[0] | dut.beyond_low), Assert(~beyond[1] | dut.beyond_high),
                     Assert(~onto[0] | dut.onto)]

        m.d.comb += [Cover(dut.beyond_high & (counter.command == 3) & (self.high == 3)),
                     Cover(dut.beyond_low & up & (command == self.low) & ready),
                     Cover((counter.command > self.high) & down & ready & ~adopted)]
        return m


def test_contract_holds(workdir):
    prove(LimitsContract(), workdir, depth=3)


def test_contract_is_reachable(workdir):
    prove(LimitsContract(), workdir, depth=20, mode="cover")
