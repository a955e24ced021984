# SPDX-License-Identifier: Apache-2.0
"""One queue of events, by which the gateware reports to firmware."""

from collections.abc import Mapping

from amaranth import *
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from rtl.events import Event, Happened, Queued
from rtl.lib.event_queue import EventQueue
from rtl.safety.interlock import Cause

__all__ = ["Report"]

QUEUE_HIGH = 3  # waiting events from which on forward motion stops
DEPTH = 16      # events that the queue holds


class Report(wiring.Component):
    """Makes events, each with the machine's place, and keeps them for firmware.

    The retraction has priority; other sources wait until it has no event. Of several changes of the
    fluid only the last becomes an event; every change of the other kinds does. A stuck gate becomes
    an event even if another cause tripped first. An event is in the queue two clocks after it
    happened, unless others come before it.

    Parameters
    ----------
    registers : mapping of str to wiring.Signature
        Register blocks, as their owner on the bus has them: ``event``.
    letters : str
        The axes.

    Members
    -------
    registers : In(Signature of the block)
        The oldest event, see ``softcore/regmap.py``.
    cycle : In(32), slot : In(8), path : In(signed(32)), position : In(signed(32)) x axes
        The present clock and place.
    retraction : In(Happened)
        See ``rtl.motion.motion``.
    entered : In(1)
        The front has entered the segment in ``slot``.
    tripped : In(1), first : In(5), blamed : In(axes)
        A trip of the interlock, its cause and axes.
    gate : In(1)
        A gate is stuck.
    indexed : In(axes)
        The index of a coder has come. The event has the place of the clock after, or of one that is
        later by a clock for each event that is before it.
    switched : In(1), count : In(8), depth : In(signed(32))
        The condition was switched by depth, how often, and where.
    fluid_news : In(1), fluid_class : In(2), fluid_state : In(6), fluid_level : In(12)
        The fluid has changed, and its state.
    backpressure : Out(1)
        Firmware is behind: forward motion must stop.
    """

    def __init__(self, *, registers: Mapping[str, wiring.Signature], letters: str):
        self.letters = letters
        axes = len(letters)
        self.layout = data.StructLayout({
            "event": Queued, "position": data.ArrayLayout(signed(32), axes)})
        super().__init__({
            "registers": In(registers["event"]),
            "cycle": In(32), "slot": In(8), "path": In(signed(32)),
            "position": In(signed(32)).array(axes),
            "retraction": In(Happened), "entered": In(1),
            "tripped": In(1), "first": In(5), "blamed": In(axes), "gate": In(1),
            "indexed": In(axes),
            "switched": In(1), "count": In(8), "depth": In(signed(32)),
            "fluid_news": In(1), "fluid_class": In(2), "fluid_state": In(6),
            "fluid_level": In(12),
            "backpressure": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.queue = queue = EventQueue(width=self.layout.size, depth=DEPTH)
        entry = Signal(self.layout)
        event = entry.event
        m.d.comb += [
            event.slot.eq(self.slot), event.cycle.eq(self.cycle), event.path.eq(self.path),
            *(entry.position[axis].eq(position) for axis, position in enumerate(self.position)),
        ]
        # An event is registered before it is queued, to meet timing.
        push = Signal()
        m.d.sync += queue.push.eq(push)
        with m.If(push):
            m.d.sync += queue.data.eq(entry)

        # High while an event waits to be made:
        segment = Signal()  # a segment was entered
        trip = Signal()     # the interlock has tripped
        stuck = Signal()    # a gate is stuck, after another cause had tripped
        news = Signal()     # the fluid has changed
        index = Signal.like(self.indexed)     # the index of these axes has come
        told = Signal()     # ... is an event in this clock
        switch = Signal()   # the condition was switched by depth
        segment_cycle = Signal(32)
        segment_slot = Signal(8)
        trip_cycle, stuck_cycle, switch_cycle = Signal(32), Signal(32), Signal(32)
        with m.If(self.retraction.kind != Event.NONE):
            m.d.comb += [
                push.eq(1), event.kind.eq(self.retraction.kind),
                event.detail.eq(self.retraction.detail), event.cycle.eq(self.retraction.cycle),
                event.first.eq(self.retraction.first), event.second.eq(self.retraction.second),
            ]
        with m.Elif(segment):
            m.d.comb += [push.eq(1), event.kind.eq(Event.SEGMENT), event.cycle.eq(segment_cycle),
                         event.slot.eq(segment_slot)]
            m.d.sync += segment.eq(0)
        with m.Elif(trip):
            m.d.comb += [push.eq(1), event.kind.eq(Event.TRIP), event.cycle.eq(trip_cycle),
                         event.detail.eq(self.first), event.first.eq(self.blamed)]
            m.d.sync += trip.eq(0)
        with m.Elif(stuck):
            m.d.comb += [push.eq(1), event.kind.eq(Event.TRIP), event.cycle.eq(stuck_cycle),
                         event.detail.eq(Cause.GATE)]
            m.d.sync += stuck.eq(0)
        with m.Elif(index.any()):
            m.d.comb += [push.eq(1), event.kind.eq(Event.INDEX), event.first.eq(index), told.eq(1)]
        with m.Elif(news):
            m.d.comb += [push.eq(1), event.kind.eq(Event.FLUID_CLASS),
                         event.detail.eq(self.fluid_class), event.first.eq(self.fluid_state),
                         event.second.eq(self.fluid_level)]
            m.d.sync += news.eq(0)
        with m.Elif(switch):
            m.d.comb += [push.eq(1), event.kind.eq(Event.CONDITION), event.cycle.eq(switch_cycle),
                         event.detail.eq(self.count), event.first.eq(self.depth)]
            m.d.sync += switch.eq(0)

        # Requests of this clock count from the next one on.
        m.d.sync += index.eq(Mux(told, 0, index) | self.indexed)
        with m.If(self.fluid_news):
            m.d.sync += news.eq(1)
        with m.If(self.switched):
            m.d.sync += [switch.eq(1), switch_cycle.eq(self.cycle)]
        with m.If(self.entered):
            m.d.sync += [segment.eq(1), segment_cycle.eq(self.cycle), segment_slot.eq(self.slot)]
        with m.If(self.tripped):
            m.d.sync += [trip.eq(1), trip_cycle.eq(self.cycle)]
        gates = Signal(2)   # stuck one clock ago, and two clocks ago
        m.d.sync += gates.eq(Cat(self.gate, gates))
        with m.If((gates == 1) & ~(self.tripped & (self.first == Cause.GATE.value))):
            m.d.sync += [stuck.eq(1), stuck_cycle.eq(self.cycle)]

        head = Signal(self.layout)
        registers, oldest = self.registers, head.event
        m.d.comb += [
            head.as_value().eq(queue.head),
            queue.pop.eq(registers.pop_strobe),
            registers.head_valid.eq(queue.valid), registers.status.eq(queue.lost),
            registers.head_kind.eq(oldest.kind), registers.head_detail.eq(oldest.detail),
            registers.head_slot.eq(oldest.slot), registers.cycle.eq(oldest.cycle),
            registers.path.eq(oldest.path), registers.first.eq(oldest.first),
            registers.second.eq(oldest.second),
            *(getattr(registers, letter).eq(head.position[axis])
              for axis, letter in enumerate(self.letters)),
            self.backpressure.eq(queue.level >= QUEUE_HIGH),
        ]
        return m
