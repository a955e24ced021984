# SPDX-License-Identifier: Apache-2.0
"""The processor's clock, which the firmware stops while it has nothing to do."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ClockGate", "Sleep"]

# For the simulator. The enable is sampled on the falling edge, so that there are no short pulses.
GATE = """\
module gapkeeper_clock_gate(input clock, input enable, output gated);
  reg open = 1'b1;
  always @(negedge clock) open <= enable;
  assign gated = clock & open;
endmodule
"""


class ClockGate(wiring.Component):
    """Clock of another domain: ``clock`` without the pulses that follow a low ``enable``.

    On ECP5 the clock is not gated. The gates of this device are in front of its clock nets, so a
    gated clock would be a net of its own, and the layout would not time the paths between it and
    ``clock``. There the processor sleeps by waiting for its next access of the register bus.

    Members
    -------
    clock : In(1)
        The clock; a clock net.
    enable : In(1)
        Let the next pulse through.
    gated : Out(1)
        The clock of the other domain, in phase with ``clock``.
    """

    clock: In(1)
    enable: In(1)
    gated: Out(1)

    def elaborate(self, platform):
        m = Module()
        if getattr(platform, "device", "").startswith("LFE5"):
            m.d.comb += self.gated.eq(self.clock)
        else:
            m.submodules.gate = Instance("gapkeeper_clock_gate", i_clock=self.clock,
                                         i_enable=self.enable, o_gated=self.gated)
            if platform is not None and hasattr(platform, "add_file"):
                platform.add_file("gapkeeper_clock_gate.v", GATE)
        return m


class Sleep(wiring.Component):
    """Decides when the processor's clock runs.

    ``strobe`` puts the processor to sleep in the next clock, for at most ``clocks`` clocks.
    ``wake`` ends or prevents the sleep in the same clock. A sleep never interrupts an access of the
    register bus: ``ack`` keeps the clock running, and no access is taken while ``running`` is low.

    Members
    -------
    strobe : In(1)
        Order to sleep.
    clocks : In(16)
        Longest sleep. Read with ``strobe``.
    wake : In(1)
        There is something to do.
    ack : In(1)
        An access of the register bus ends.
    running : Out(1)
        The processor sees the next clock.
    """

    strobe: In(1)
    clocks: In(16)
    wake: In(1)
    ack: In(1)
    running: Out(1, init=1)

    def elaborate(self, platform):
        m = Module()
        left = Signal(16)
        m.d.comb += self.running.eq((left == 0) | self.wake | self.ack)
        with m.If(self.wake):
            m.d.sync += left.eq(0)
        with m.Elif(self.strobe):
            m.d.sync += left.eq(self.clocks)
        with m.Elif(left != 0):
            m.d.sync += left.eq(left - 1)
        return m
