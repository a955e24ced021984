# SPDX-License-Identifier: Apache-2.0
"""Proof on the whole controller: no command leaves the soft limits, whatever firmware does."""

import pytest
from amaranth import *
from amaranth.hdl import Assume

from rtl.controller import Controller
from rtl.members import AXES
from testbench.formal.joined import joined
from testbench.formal.prover import prove


class CommandsStayWithin(Controller):
    """A command goes up only from below its upper limit, and down only from above its lower one.

    So a command within stays within. A command outside, where only ``adopt`` with ``safe`` can have
    put it, comes nearer. The limits are constant, low below high. All else is free, paths and their
    order too. ``testbench/formal/test_limits.py`` shows that pulses pass up to the limits.
    """

    def elaborate(self, platform):
        m = super().elaborate(platform)
        ready = Signal()
        m.d.sync += ready.eq(1)
        for letter, axis in zip(AXES, self.drives.axes, strict=True):
            own = getattr(self.registers, f"axis_{letter}")
            low, high = own.low, own.high
            before, low_before, high_before = (
                Signal(signed(32), name=f"{name}_before_{letter}")
                for name in ("command", "low", "high"))
            adopted = Signal(name=f"adopted_{letter}")
            m.d.sync += [before.eq(axis.command), low_before.eq(low), high_before.eq(high),
                         adopted.eq(axis.adopt & axis.safe)]
            m.d.comb += Assume(low <= high)
            with m.If(ready):
                m.d.comb += Assume((low == low_before) & (high == high_before))
            with m.If(ready & ~adopted):
                m.d.comb += [Assert((axis.command <= before) | (before < high)),
                             Assert((axis.command >= before) | (before > low))]
                with m.If((before >= low) & (before <= high)):
                    m.d.comb += Assert((axis.command >= low) & (axis.command <= high))
        return m


@pytest.mark.soak
def test_no_command_leaves_the_soft_limits(workdir):
    prove(joined(CommandsStayWithin), workdir, depth=3)
