# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.motion.conservation``: between command and position no path pulse is lost.

Generator, ramp and guard have their full width and are joined as in the controller.
"""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.conservation import Conservation
from rtl.motion.feed import PathPulseGenerator
from rtl.motion.ramp import Ramp
from testbench.formal.prover import prove


class PulsesContract(wiring.Component):
    """The guard checks the generator, the ramp and a window that counts the pulses.

    The direction changes at rest only, and so does the origin. All else is free: rates, bounds,
    stops, and when pulses on their way are dropped.
    """

    rate: In(30)
    go: In(1)
    reverse: In(1)
    bound: In(signed(32))
    start_rate: In(30)
    acceleration: In(30)
    target: In(30)
    brake: In(1)
    ready: In(1)
    drop: In(1)
    load: In(1)
    load_value: In(signed(32))
    damaged: Out(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.feed = feed = PathPulseGenerator()
        m.submodules.ramp = ramp = Ramp()
        m.submodules.guard = guard = Conservation()
        for name in ("rate", "go", "reverse", "bound"):
            m.d.comb += getattr(feed, name).eq(getattr(self, name))
        for name in ("start_rate", "acceleration", "target", "brake", "ready"):
            m.d.comb += getattr(ramp, name).eq(getattr(self, name))
        load = Signal()
        position = Signal(signed(32))
        m.d.comb += [
            load.eq(self.load & ramp.rest),
            feed.load.eq(load | self.drop), feed.pull.eq(ramp.pull),
            feed.load_value.eq(Mux(load, self.load_value, position)),
            ramp.ps.eq(feed.ps), ramp.room.eq(feed.room), ramp.drop.eq(self.drop),
            guard.command.eq(feed.command), guard.position.eq(position),
            guard.stored.eq(ramp.stored), guard.ps.eq(feed.ps), guard.pp.eq(ramp.pp),
            guard.reverse.eq(self.reverse), guard.drop.eq(self.drop),
            self.damaged.eq(guard.damaged),
            Assume(~ResetSignal("sync")),
        ]
        with m.If(load):
            m.d.sync += position.eq(self.load_value)
        with m.Elif(ramp.pp & ~self.drop):
            m.d.sync += position.eq(Mux(self.reverse, position - 1, position + 1))

        ready, reverse = Signal(), Signal()
        m.d.sync += [ready.eq(1), reverse.eq(self.reverse)]
        m.d.comb += Assume(~ready | (self.reverse == reverse) | ramp.rest)
        # The guard's claim, in the same clock; and facts that the induction needs.
        apart, under_way = Signal(32), Signal(25)
        m.d.comb += [
            apart.eq(Mux(self.reverse, position - feed.command, feed.command - position)),
            under_way.eq(ramp.stored + feed.ps + ramp.pp),
        ]
        m.d.comb += [Assert(apart == under_way), Assert(~guard.damaged)]
        # No more pulses come than the ramp can store.
        m.d.comb += Assume(~feed.ps | (ramp.stored != (1 << 24) - 1))
        m.d.comb += [Cover((ramp.stored == 2) & ramp.pp & feed.ps & self.reverse),
                     Cover(ready & ~self.drop & (feed.command == 5) & (position == 3))]
        return m


def test_no_path_pulse_is_lost_or_made(workdir):
    prove(PulsesContract(), workdir, depth=4)


def test_pulses_pass(workdir):
    prove(PulsesContract(), workdir, depth=24, mode="cover")
