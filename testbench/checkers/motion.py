# SPDX-License-Identifier: Apache-2.0
"""The motion blocks joined as in ``rtl.machine``, without axes, gap and registers."""

from amaranth import *
from amaranth.hdl import Assert
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.conservation import Conservation
from rtl.motion.distribution import Distributor
from rtl.motion.feed import PathPulseGenerator
from rtl.motion.path import SegmentWindow
from rtl.motion.ramp import Ramp
from rtl.motion.retraction import Retraction

__all__ = ["Motion"]

# Members of the retraction that registers, gap or interlock drive.
SETTINGS = ("rate", "limit", "high_rate", "low_rate", "changeover", "low_lead", "jump_distance",
            "jump_rate", "jump_high_rate", "commit_valid", "commit_strobe", "jump_period", "gain",
            "repeats", "settle", "run", "hold", "retract", "release", "safe", "shorted",
            "completed", "discharging", "in_position", "cycle", "ahead", "behind", "floor",
            "fast_ahead", "fast_behind", "servo", "up", "down", "step", "crowded", "wait",
            "contact")


class Motion(wiring.Component):
    """Zc to axis pulses Pi, and the retraction that steers them.

    What holds in every clock, whatever the inputs, is asserted: a pulse commanded is stored, on its
    way or in the position; pulses Ps are 4 clocks apart; the direction changes at rest only; and
    no pulse Ps follows ``shorted``, ``wait`` or ``contact`` forwards.

    The submodules are attributes too, so that a bench can look at what it wants.

    Parameters
    ----------
    axes : int
        Number of axes.

    Members
    -------
    load : In(1), load_slot : In(6)
        As ``path_origin`` of the machine: obeyed at rest only.
    start_rate, acceleration : In(30)
        Of the ramp.
    axis : Out(signed(32)) x axes
        Sum of the axis pulses Pi.
    contact : In(1)
        For one clock, and not while going back, as ``rtl.gap.contact`` and this give it together.
    The others are the members of ``Retraction`` and of ``SegmentWindow`` by the same name.
    """

    def __init__(self, *, axes=1):
        self.axes = axes
        self.feed = PathPulseGenerator()
        self.ramp = Ramp()
        self.path = SegmentWindow(axes=axes)
        self.distributor = Distributor(axes=axes)
        self.retraction = Retraction()
        self.conservation = Conservation()
        members = {name: In(self.retraction.signature.members[name].shape) for name in SETTINGS}
        members |= {name: self.path.signature.members[name] for name in (
            "select", "select_strobe", "data", "data_strobe")}
        super().__init__(members | {
            "load": In(1), "load_slot": In(6), "start_rate": In(30), "acceleration": In(30),
            "axis": Out(signed(32)).array(axes),
        })

    def elaborate(self, platform):
        m = Module()
        feed, ramp, path = self.feed, self.ramp, self.path
        distributor, retraction = self.distributor, self.retraction
        m.submodules.feed = feed
        m.submodules.ramp = ramp
        m.submodules.path = path
        m.submodules.distributor = distributor
        m.submodules.retraction = retraction
        m.submodules.conservation = conservation = self.conservation

        load, drop = Signal(), Signal()
        m.d.comb += load.eq(self.load & ramp.rest)
        m.d.comb += [getattr(retraction, name).eq(getattr(self, name)) for name in SETTINGS]
        m.d.comb += [
            feed.rate.eq(retraction.target),
            feed.go.eq(retraction.go),
            feed.reverse.eq(retraction.reverse),
            feed.bound.eq(retraction.bound),
            feed.pull.eq(ramp.pull),
            drop.eq(self.safe | self.contact),
            feed.load.eq(load | drop),
            feed.load_value.eq(Mux(load, 0, path.position)),

            ramp.start_rate.eq(self.start_rate),
            ramp.acceleration.eq(self.acceleration),
            ramp.target.eq(retraction.target),
            ramp.brake.eq(retraction.brake),
            ramp.ps.eq(feed.ps),
            ramp.room.eq(feed.room),
            ramp.ready.eq(path.ready),
            ramp.drop.eq(drop),

            *(getattr(path, name).eq(getattr(self, name)) for name in (
                "select", "select_strobe", "data", "data_strobe")),
            path.pulse.eq(ramp.pp & ~drop),
            path.reverse.eq(retraction.reverse),
            path.ahead.eq(self.ahead),
            path.load.eq(load),
            path.load_slot.eq(self.load_slot),

            *distributor.follow(path),
            distributor.restart.eq(load),

            retraction.ready.eq(path.ready),
            retraction.load.eq(load),
            retraction.feed.eq(path.rate),
            retraction.highest.eq(path.highest),
            retraction.command.eq(feed.command),
            retraction.position.eq(path.position),
            retraction.front.eq(path.front),
            retraction.pp.eq(ramp.pp),
            retraction.rest.eq(ramp.rest),
            retraction.steady.eq(ramp.steady),
            retraction.distance.eq(ramp.distance),

            conservation.command.eq(feed.command),
            conservation.position.eq(path.position),
            conservation.stored.eq(ramp.stored),
            conservation.ps.eq(feed.ps),
            conservation.pp.eq(ramp.pp),
            conservation.reverse.eq(retraction.reverse),
            conservation.drop.eq(drop),
        ]
        for index in range(self.axes):
            with m.If(distributor.pi[index]):
                m.d.sync += self.axis[index].eq(
                    Mux(distributor.pi_reverse[index], self.axis[index] - 1, self.axis[index] + 1))

        self._check(m)
        return m

    def _check(self, m):
        """Assert what always holds."""
        feed, ramp, path, retraction = self.feed, self.ramp, self.path, self.retraction

        under_way = Signal(signed(32))
        m.d.comb += under_way.eq(Mux(retraction.reverse, path.position - feed.command,
                                     feed.command - path.position))
        since = Signal(range(4), init=3)
        reverse = Signal()
        rest = Signal(init=1)
        shorted = Signal()
        m.d.sync += [
            reverse.eq(retraction.reverse),
            rest.eq(ramp.rest),
            shorted.eq((self.shorted | self.wait | self.contact) & ~retraction.reverse
                       & (ramp.rate == self.start_rate)),
        ]
        with m.If(feed.ps):
            m.d.sync += since.eq(0)
        with m.Elif(since != 3):
            m.d.sync += since.eq(since + 1)
        with m.If(~self.safe):
            m.d.sync += [
                Assert(under_way == ramp.stored + feed.ps + ramp.pp, "a pulse lost or invented"),
                Assert(~feed.ps | (since == 3), "pulses Ps less than 4 clocks apart"),
                Assert((reverse == retraction.reverse) | rest, "reversed in motion"),
                Assert(~(shorted & feed.ps), "a pulse Ps follows the short"),
            ]
        m.d.sync += [
            Assert(~self.conservation.damaged, "a guard sees a pulse lost or made"),
            Assert(~(path.damaged_word | path.damaged_segment | path.damaged_place),
                   "a guard sees damage in the window"),
        ]
