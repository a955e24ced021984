# SPDX-License-Identifier: Apache-2.0
"""Proofs on the whole controller: the promises of its blocks hold for all of them together."""

import pytest
from amaranth import *
from amaranth.hdl import Assume

from rtl.controller import Controller
from rtl.states import State
from testbench.formal.joined import joined
from testbench.formal.prover import prove

REACTION = 8    # clocks from the sample that completes a short to the last forward pulse
ENTRY = 4       # ... to the last that enters the ramp
LOOK = 12       # ... for which none may follow


class SafeMeansOff(Controller):
    """With ``safe`` every output is off.

    The gates of both sources, the contactor and the drives' enables in the same clock; the speed
    commands, the steps and the strobe of auxiliary functions from the next clock on.
    """

    def elaborate(self, platform):
        m = super().elaborate(platform)
        before = Signal()
        m.d.sync += before.eq(self.safe)
        with m.If(self.safe):
            m.d.comb += [Assert(~self.gap_on), Assert(~self.gap_sense), Assert(~self.contactor),
                         Assert(~self.drive_enable.any())]
        with m.If(self.safe & before):
            m.d.comb += [Assert(~self.dac.any()), Assert(~self.step.any()),
                         Assert(~self.auxiliary_strobe.any())]
        # Needed for the induction: auxiliary functions that are idle have no strobe.
        m.d.comb += Assert(self.registers.auxiliary.status_busy | ~self.auxiliary_strobe.any())
        return m


class NothingForwardAfterShort(Controller):
    """A short at or below the start/stop speed ends forward motion within ``REACTION`` clocks.

    At or below it the ramp is a delay of two clocks (its own promise, held by
    ``testbench/unit/rtl/test_ramp.py``, and assumed here while it is looked at); on an arc the
    path may keep a pulse waiting, which ``testbench/cosim`` measures.
    """

    def elaborate(self, platform):
        m = super().elaborate(platform)
        ramp, retraction, path = self.motion.ramp, self.motion.retraction, self.motion.path
        short = self.gap.short_detector
        since = Signal(range(LOOK + 1))     # clocks since the sample that completed a short
        begins = Signal()
        came = Signal(2)    # a pulse into the ramp, a clock ago and two
        m.d.sync += came.eq(Cat(ramp.ps, came))
        m.d.comb += Assume((since == 0) | (ramp.pp == came[1]))
        m.d.comb += begins.eq(short.completed & short.shorted & retraction.discharging
                              & retraction.run
                              & ~ramp.fast & (ramp.stored == came[0])
                              & ((retraction.state == State.FRONT)
                                 | (retraction.state == State.HIGH)
                                 | (retraction.state == State.LOW)))
        over = Signal()     # short no more, or the ramp had set out to be faster
        m.d.comb += over.eq(~short.shorted | ~retraction.discharging | ~retraction.run
                             | retraction.load | ramp.fast)
        with m.If(begins):
            m.d.sync += since.eq(2)     # that sample was a clock ago
        with m.Elif(over | (since == LOOK)):
            m.d.sync += since.eq(0)
        with m.Elif(since != 0):
            m.d.sync += since.eq(since + 1)
        m.d.comb += [
            Assert(~((since > ENTRY) & ramp.ps & ~retraction.reverse)),
            Assert(~((since > REACTION) & path.pulse & ~path.reverse)),
        ]
        return m


def test_safe_means_off(workdir):
    prove(joined(SafeMeansOff), workdir, depth=3)


@pytest.mark.soak
def test_no_forward_pulse_after_a_short(workdir):
    prove(joined(NothingForwardAfterShort), workdir, depth=LOOK + 2)
