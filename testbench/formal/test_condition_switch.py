# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.power.condition_switch``: at the depth, once, and between two pulses."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.power.condition_switch import ConditionSwitch
from rtl.power.pulse_generator import PulseGenerator
from testbench.formal.prover import prove

WIDTH = 8
FURTHEST = 60   # from the middle: so places are at most half the range of WIDTH apart
ORDERS = "arm", "disarm", "commit", "restart"


class SwitchContract(wiring.Component):
    """Switch and pulse generator, joined as in the controller.

    Positions change by single pulses, around a middle anywhere in the range that wraps. The
    specification is kept beside the switch: the furthest position by plain comparison.
    """

    origin: In(signed(WIDTH))
    position: In(signed(WIDTH))
    depth: In(signed(WIDTH))
    arm: In(1)
    disarm: In(1)
    commit: In(1)
    restart: In(1)
    enable: In(1)
    sensing: In(1)
    on_time: In(20)
    wait_time: In(20)
    ignited: In(1)
    off_time: In(20)
    sense_on: In(16)
    sense_off: In(16)
    abnormal: In(1)
    live: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.switch = switch = ConditionSwitch(width=WIDTH)
        m.submodules.pulses = pulses = PulseGenerator()
        m.d.comb += [
            switch.position.eq(self.origin + self.position),
            switch.depth.eq(self.origin + self.depth),
            switch.between.eq(pulses.between),
            pulses.cut.eq(1),
        ]
        for name in ORDERS:
            m.d.comb += getattr(switch, name).eq(getattr(self, name))
        for name in ("enable", "sensing", "on_time", "wait_time", "ignited", "off_time", "sense_on",
                     "sense_off", "abnormal", "live"):
            m.d.comb += getattr(pulses, name).eq(getattr(self, name))

        ready = Signal()
        origin, depth, before = (Signal(signed(WIDTH), name=f"was_{name}")
                                 for name in ("origin", "depth", "position"))
        m.d.sync += [ready.eq(1), origin.eq(self.origin), depth.eq(self.depth),
                     before.eq(self.position)]
        ordered = self.disarm | self.commit
        m.d.comb += [
            Assume(~ResetSignal("sync")),
            Assume((self.position <= FURTHEST) & (self.position >= -FURTHEST)),
            Assume((self.depth <= FURTHEST) & (self.depth >= -FURTHEST)),
            Assume(~self.arm | ~(ordered | self.restart)),
        ]
        with m.If(ready):
            m.d.comb += [
                Assume(self.origin == origin), Assume((self.depth == depth) | self.arm),
                Assume((self.position <= before + 1) & (self.position >= before - 1)),
            ]
        with m.Else():
            m.d.comb += Assume(self.restart)

        # The furthest position up to the clock before; and whether the switch knows the same.
        furthest = Signal(signed(WIDTH))
        with m.If(self.restart | (self.position < furthest)):
            m.d.sync += furthest.eq(self.position)
        with m.If(ready):
            m.d.comb += [
                Assert(switch.deepest == (self.origin + furthest).as_signed()[:WIDTH].as_signed()),
                Assert(switch.place == (self.origin + before).as_signed()[:WIDTH].as_signed()),
                Assert((furthest <= before) & (furthest >= -FURTHEST)),
            ]

        # It switches never before the depth, once for each arm, in the next clock if nothing
        # prevents it, and not after another order.
        due, was_due, was_take, was_count = Signal(), Signal(), Signal(), Signal(8)
        place = Signal(signed(WIDTH))
        credit = Signal()
        m.d.comb += due.eq(credit & ready & (furthest <= self.depth) & ~switch.pending
                           & ~ordered & ~self.arm)
        m.d.sync += [was_due.eq(due), was_take.eq(switch.take), was_count.eq(switch.count),
                     place.eq(before)]
        with m.If(self.arm):
            m.d.sync += credit.eq(1)
        with m.Elif(due | ordered):
            m.d.sync += credit.eq(0)
        m.d.comb += Assert(switch.armed == credit)
        with m.If(ready):
            m.d.comb += Assert(switch.switched == was_due)
            m.d.comb += Assert(switch.count == (was_count + switch.switched)[:8])

        # It switches exactly at the depth if it was armed before and nothing was pending then.
        timely = Signal()
        with m.If(self.restart | ordered):
            m.d.sync += timely.eq(0)
        with m.Elif(self.arm):
            m.d.sync += timely.eq((furthest > self.depth) & (self.position > self.depth)
                                  & ~switch.pending)
        with m.Elif(switch.pending):
            m.d.sync += timely.eq(0)
        was_timely, at = Signal(), Signal(signed(WIDTH))
        m.d.sync += [was_timely.eq(timely), at.eq(self.depth)]
        with m.If(timely & switch.armed & ~self.arm):
            m.d.comb += Assert((furthest > self.depth) | (before == self.depth))
        with m.If(ready & switch.switched & was_timely):
            m.d.comb += Assert(switch.at == (self.origin + at).as_signed()[:WIDTH].as_signed())

        # There is one take for each switch or commit, and no pulse mixes two conditions.
        owed = Signal()
        with m.If(due | self.commit):
            m.d.sync += owed.eq(1)
        with m.Elif(switch.take):
            m.d.sync += owed.eq(0)
        m.d.comb += Assert(switch.pending == owed)
        powered = pulses.on | pulses.sense
        with m.If(switch.take):
            m.d.comb += Assert(~powered)
        with m.If(was_take):
            m.d.comb += Assert(~powered)

        back = Signal()     # far above the depth of a switch, after it
        m.d.sync += back.eq(back | (switch.armed & (self.position > furthest + 3)))
        m.d.comb += [
            Cover(switch.switched & was_timely & back & (self.origin > FURTHEST)),
            Cover(switch.switched & ~was_timely & (place > at)),
            Cover(switch.take & (switch.count == 2)),
            Cover(switch.pending & pulses.on & (switch.count == 1)),
        ]
        return m


def test_contract_holds(workdir):
    prove(SwitchContract(), workdir, depth=6)


def test_contract_is_reachable(workdir):
    prove(SwitchContract(), workdir, depth=24, mode="cover")
