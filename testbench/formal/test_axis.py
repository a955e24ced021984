# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.motion.axis``: together its blocks lose no pulse, and ``safe`` is safe."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.axis import Axis
from testbench.formal.prover import prove


class AxisContract(wiring.Component):
    """The invariant in every clock for any inputs, the effect of ``safe``, and ``adopt``."""

    pi: In(1)
    pi_reverse: In(1)
    enc_a: In(1)
    enc_b: In(1)
    safe: In(1)
    adopt: In(1)
    mode_step: In(1)
    mode_reverse: In(1)
    step_time_width: In(8)
    step_time_space: In(8)
    step_time_setup: In(8)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Axis(error_bits=17, rest_clocks=3, travel=20)
        for name in self.signature.members:
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += Assume(~ResetSignal("sync"))

        difference = Signal(signed(20))
        m.d.comb += difference.eq(dut.command - dut.position)
        with m.If(~dut.status_saturated):
            m.d.comb += Assert(difference == dut.error)

        ready, safe, adopt, pi, fp = (Signal(name=f"{name}_before")
                                      for name in ("ready", "safe", "adopt", "pi", "fp"))
        position, command = Signal(signed(20)), Signal(signed(20))
        m.d.sync += [ready.eq(1), safe.eq(self.safe), adopt.eq(self.adopt), pi.eq(self.pi),
                     fp.eq(dut.fp), position.eq(dut.position), command.eq(dut.command)]
        with m.If(ready & safe):
            m.d.comb += Assert(~dut.dac & ~dut.step & ~dut.dac_negative)
        with m.If(ready & safe & adopt):
            m.d.comb += Assert((dut.error == 0) & (dut.command == dut.position))
        with m.Elif(ready):
            # In one clock each position changes by its pulse and by nothing else.
            m.d.comb += [Assert((dut.command != command) == pi),
                         Assert((dut.position != position) == fp)]

        m.d.comb += [Cover(dut.dac_negative & (dut.error < -1)), Cover(dut.step & dut.dir),
                     Cover(safe & adopt & fp & (dut.position == -2))]
        return m


def test_contract_holds(workdir):
    prove(AxisContract(), workdir, depth=3)


def test_contract_is_reachable(workdir):
    prove(AxisContract(), workdir, depth=30, mode="cover")
