# SPDX-License-Identifier: Apache-2.0
"""What the gateware did, in one queue of events for firmware."""

from amaranth import *

from rtl.lib.event_queue import EventQueue
from rtl.members import AXES
from rtl.motion.retraction import Event
from rtl.safety.interlock import Cause

__all__ = ["report"]

CROWD = 3  # events that firmware has not taken: forward motion waits


def report(m, machine, retraction, entered, fluid, interlock, condition):
    """Join the queue to ``machine``: the retraction first, the others when it has nothing."""
    m.submodules.events = queue = EventQueue(width=152 + 32 * machine.axes, depth=16)
    m.d.comb += retraction.crowded.eq(queue.level >= CROWD)
    positions = [getattr(machine, f"axis_{letter}_position") for letter in AXES]

    pushed, head = ([Signal(shape, name=f"{side}_{name}") for name, shape in (
        ("kind", 8), ("detail", 8), ("slot", 8), ("cycle", 32), ("path", signed(32)),
        ("first", 32), ("second", 32), *((letter, signed(32)) for letter in AXES))]
        for side in ("pushed", "head"))
    kind, detail, slot, cycle, path, first, second, *axes = pushed
    m.d.comb += [
        slot.eq(machine.path_slot), cycle.eq(machine.cycle), path.eq(machine.path_position),
        *(into.eq(position) for into, position in zip(axes, positions, strict=True)),
    ]
    # What is told is made up in one clock and stored in the next: the way is long.
    push = Signal()
    m.d.sync += queue.push.eq(push)
    with m.If(push):
        m.d.sync += queue.data.eq(Cat(*pushed))

    segment = Signal()  # a segment was entered: to be told
    trip = Signal()     # the interlock has tripped: to be told
    stuck = Signal()    # ... a stuck gate later than another cause: to be told as well
    news = Signal()     # the fluid has changed: to be told
    switch = Signal()   # the condition was switched by depth: to be told
    segment_cycle = Signal(32)
    segment_slot = Signal(8)
    trip_cycle, stuck_cycle = Signal(32), Signal(32)
    switch_cycle = Signal(32)
    with m.If(retraction.event != Event.NONE):
        m.d.comb += [
            push.eq(1), kind.eq(retraction.event), detail.eq(retraction.event_detail),
            cycle.eq(retraction.event_cycle), first.eq(retraction.event_first),
            second.eq(retraction.event_second),
        ]
    with m.Elif(segment):
        m.d.comb += [push.eq(1), kind.eq(Event.SEGMENT), cycle.eq(segment_cycle),
                     slot.eq(segment_slot)]
        m.d.sync += segment.eq(0)
    with m.Elif(trip):
        m.d.comb += [push.eq(1), kind.eq(Event.TRIP), cycle.eq(trip_cycle),
                     detail.eq(interlock.first), first.eq(interlock.blamed)]
        m.d.sync += trip.eq(0)
    with m.Elif(stuck):
        m.d.comb += [push.eq(1), kind.eq(Event.TRIP), cycle.eq(stuck_cycle),
                     detail.eq(Cause.GATE)]
        m.d.sync += stuck.eq(0)
    with m.Elif(news):
        # What is told is the state as it is now; of several changes the last.
        m.d.comb += [push.eq(1), kind.eq(Event.FLUID), detail.eq(machine.fluid_status_class),
                     first.eq(Cat(machine.fluid_status_broken_low, machine.fluid_status_broken_high,
                                  machine.fluid_status_disordered, machine.fluid_status_fault,
                                  machine.fluid_status_measured)),
                     second.eq(machine.fluid_level)]
        m.d.sync += news.eq(0)
    with m.Elif(switch):
        m.d.comb += [push.eq(1), kind.eq(Event.CONDITION), cycle.eq(switch_cycle),
                     detail.eq(condition.count), first.eq(condition.at)]
        m.d.sync += switch.eq(0)
    with m.If(fluid):
        m.d.sync += news.eq(1)
    with m.If(condition.switched):
        m.d.sync += [switch.eq(1), switch_cycle.eq(machine.cycle)]
    with m.If(entered):
        m.d.sync += [segment.eq(1), segment_cycle.eq(machine.cycle),
                     segment_slot.eq(machine.path_slot)]
    with m.If(interlock.tripped):
        m.d.sync += [trip.eq(1), trip_cycle.eq(machine.cycle)]
    gates = Signal(2)   # stuck a clock ago, and two
    m.d.sync += gates.eq(Cat(interlock.gate, gates))
    with m.If((gates == 1) & ~(interlock.tripped & (interlock.first == Cause.GATE.value))):
        m.d.sync += [stuck.eq(1), stuck_cycle.eq(machine.cycle)]

    m.d.comb += [
        Cat(*head).eq(queue.head),
        queue.pop.eq(machine.event_pop_strobe),
        machine.event_head_valid.eq(queue.valid),
        machine.event_status.eq(queue.lost),
    ]
    for name, value in zip(
            ("head_kind", "head_detail", "head_slot", "cycle", "path", "first", "second",
             *AXES), head, strict=True):
        m.d.comb += getattr(machine, f"event_{name}").eq(value)
