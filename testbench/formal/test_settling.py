# SPDX-License-Identifier: Apache-2.0
"""Proof on ``rtl.power``: no gate of the discharge while the outside is unsettled."""

from amaranth import *
from amaranth.hdl import Assert, Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.power.condition_switch import ConditionSwitch
from rtl.power.power import Power
from rtl.power.settling import Settling
from testbench.formal.prover import prove

LATCH, SETTLE, LONGER = 3, 5, 6     # clocks


class SettlingContract(wiring.Component):
    """Switch, wait and sources, joined as in the controller; words of any value at any time.

    Outside is a record of its own: for how many clocks the words in force have stood.
    """

    commit: In(1)
    supply: In(5)
    reference: In(30)
    longer: In(1)       # whether the register asks for more
    machining: In(1)
    sensing: In(1)
    look: In(1)
    on_time: In(20)
    wait_time: In(20)
    ignited: In(1)
    off_time: In(20)
    sense_on: In(16)
    sense_off: In(16)
    current: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.switch = switch = ConditionSwitch(width=8)
        m.submodules.settling = settling = Settling(latch=LATCH, settle=SETTLE)
        m.submodules.power = power = Power(clock_hz=1_000_000, level_max=20, on_max=3, off_min=1,
                                           dead_ns=1000, limit_us=4, settle_us=3)
        supply, reference = Signal(5), Signal(30)   # in force
        longer, ready = Signal(), Signal()
        m.d.sync += [longer.eq(self.longer), ready.eq(1)]
        m.d.comb += [
            Assume(~ResetSignal("sync")),
            Assume((longer == self.longer) | ~ready),
            switch.commit.eq(self.commit), switch.between.eq(power.between),
            settling.supply.eq(supply), settling.reference.eq(reference),
            settling.longer.eq(Mux(self.longer, LONGER, 0)),
            power.latched.eq(settling.latched), power.settled.eq(settling.settled),
            power.reference.eq(reference), power.short.eq(1),
            *(getattr(power, name).eq(getattr(self, name)) for name in (
                "machining", "sensing", "look", "on_time", "wait_time", "ignited", "off_time",
                "sense_on", "sense_off", "current")),
        ]
        with m.If(switch.take):
            m.d.sync += [supply.eq(self.supply), reference.eq(self.reference)]

        # Clocks for which the words have stood before this one, since reset or a change.
        for name, word, least in (("supply", supply, LATCH), ("reference", reference, SETTLE)):
            before = Signal.like(word, name=f"{name}_then")
            changed = Signal(name=f"{name}_other")
            stood = Signal(range(LONGER + 2), name=f"{name}_stood")
            m.d.sync += before.eq(word)
            m.d.comb += changed.eq(before != word)
            moved = Signal(name=f"{name}_moved")    # the register acts from the first change on
            with m.If(changed):
                m.d.sync += [stood.eq(1), moved.eq(1)]
            with m.Elif(stood <= LONGER):
                m.d.sync += stood.eq(stood + 1)
            gate = power.on | power.sense if name == "supply" else power.on
            with m.If(gate):
                m.d.comb += [Assert(~changed), Assert(stood > least),
                             Assert(~self.longer | ~moved | (stood > LONGER))]
        again = Signal()    # a condition that came while the one before was on its way
        with m.If(switch.take & ~settling.settled):
            m.d.sync += again.eq(1)
        m.d.comb += [
            Cover(power.on & again), Cover(power.on & self.longer & again),
            Cover(power.sense & self.machining & ~self.sensing & ~settling.settled),
        ]
        return m


def test_contract_holds(workdir):
    prove(SettlingContract(), workdir, depth=LONGER + SETTLE + 9)


def test_contract_is_reachable(workdir):
    prove(SettlingContract(), workdir, depth=30, mode="cover")
