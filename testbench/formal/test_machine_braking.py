# SPDX-License-Identifier: Apache-2.0
"""Proof on the whole controller: above the start/stop speed, motion only slows after a short."""

import pytest
from amaranth import *
from amaranth.hdl import Assert, Assume, Cover

from rtl.controller import Controller
from rtl.motion.motion import Motion
from rtl.states import State
from testbench.formal.joined import joined, motion_alone
from testbench.formal.prover import prove

STEP = 4        # clocks of a step of the ramp


class OnlySlowerAfterShort(Motion):
    """From the second clock after the one that completes a short on, the rate only falls.

    While the short lasts and the machine has not set out backwards, the rate never rises, falls by
    the ramp's step every 4 clocks, and once at the start/stop speed stays there. Meanwhile the
    generator makes no pulse by itself, only those that the ramp pulls to come to rest. Start/stop
    speed and acceleration change only at rest (the ramp's contract); all else is free.
    """

    def elaborate(self, platform):
        m = super().elaborate(platform)
        gap, ramp, retraction, feed = self.gap, self.ramp, self.retraction, self.feed
        start, acceleration, fast, ready = Signal(30), Signal(30), Signal(), Signal()
        rates = [Signal(32, name=f"rate_{ago}") for ago in range(1, STEP + 1)]
        m.d.sync += [
            start.eq(ramp.start_rate), acceleration.eq(ramp.acceleration), fast.eq(ramp.fast),
            ready.eq(1),
            *(older.eq(newer) for older, newer in zip(rates, [ramp.rate, *rates[:-1]],
                                                      strict=True)),
        ]
        m.d.comb += Assume(ramp.rest | ~ready | (
            (start == ramp.start_rate) & (acceleration == ramp.acceleration)))
        begins, over = Signal(), Signal()
        m.d.comb += [
            begins.eq(gap.completed & gap.shorted & retraction.run
                      & ((retraction.state == State.FRONT) | (retraction.state == State.HIGH)
                         | (retraction.state == State.LOW))),
            over.eq(~gap.shorted | retraction.load | (retraction.state == State.RETRACTING)),
        ]
        since = Signal(range(STEP + 3))     # clocks since it was completed; the last for more
        with m.If(over):
            m.d.sync += since.eq(0)
        with m.Elif((since != 0) & (since != STEP + 2)):
            m.d.sync += since.eq(since + 1)
        with m.Elif(begins):
            m.d.sync += since.eq(1)
        with m.If(since > 1):
            m.d.comb += [Assert(~ramp.fast | (fast & (ramp.rate <= rates[0]))),
                         Assert(over | ~feed.go)]
        with m.If((since > STEP + 1) & ramp.fast):
            m.d.comb += Assert(ramp.rate + (ramp.acceleration >> 2) <= rates[-1])
        m.d.comb += [Cover((since > STEP + 1) & ramp.fast & (ramp.rate < rates[-1])),
                     Cover((since > STEP + 1) & fast & ~ramp.fast & feed.ps)]
        return m


class Braking(Controller):
    """The controller with the property in its motion."""

    MOTION = OnlySlowerAfterShort


@pytest.mark.soak
def test_the_rate_only_falls_after_a_short(workdir):
    prove(joined(Braking), workdir, depth=STEP + 3)


@pytest.mark.soak
def test_a_machine_is_fast_at_a_short(workdir):
    prove(motion_alone(OnlySlowerAfterShort), workdir, depth=48, mode="cover")
