# SPDX-License-Identifier: Apache-2.0
"""The window of path segments and the machine's place in it."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.distributor import Travel

__all__ = ["SegmentWindow"]


class SegmentWindow(wiring.Component):
    """Where the machine is on the path: the window of segments around it, walked both ways.

    The window is a ring of ``slots``; the segment with sequence number n is in slot ``n % slots``.
    Firmware writes segments on either side before they are reached; what it has loaded bounds the
    path pulses upstream, so that this block may trust the slot it steps into.

    A pulse moves ``position`` by one. At the end of a segment the next one is entered as soon as
    ``ahead`` shows that there is one; going back, the previous one is entered with the first pulse
    into it. ``distribute`` repeats the pulse one clock later, with the ``length`` and ``travel`` of
    the segment that the pulse lies in.

    ``front`` is the furthest position reached since ``load``. ``entered`` is high for one clock
    when a segment is entered at the front for the first time: never again after a retraction.

    Parameters
    ----------
    axes : int
        Number of axes.
    slots : int
        Segments in the window, a power of two.

    Members
    -------
    slot_length, slot_rate, slot_travel : In
        The segment to write: length 1 to 2**30 - 1 pulses, rate 2**-32 pulse/clock, travel.
    slot_write : In(range(slots)), slot_write_strobe : In(1)
        Write it there.
    pulse, reverse : In(1)
        Ramped path pulse Pp and its direction; at most one every 4 clocks.
    ahead : In(signed(32))
        End of what may be machined.
    load : In(1), load_slot : In(range(slots))
        Stand at coordinate 0, at the start of the segment in a slot; only at rest.
    position, front : Out(signed(32))
        Path coordinates. They wrap.
    slot : Out(range(slots))
        Slot of the segment in which the machine is.
    rate : Out(30)
        Its feed, 2**-32 pulse/clock.
    distribute, distribute_reverse : Out(1)
        The pulse, for the distributor.
    length : Out(30), travel : Out(Travel) x axes
        The segment of that pulse.
    entered : Out(1)
        The front has entered the segment in ``slot``: the first one as soon as there is a path,
        the others in the clock in which ``slot`` changes.

    Raises
    ------
    ValueError
        If the number of slots is no power of two.
    """

    def __init__(self, *, axes=3, slots=16):
        if slots < 2 or slots & (slots - 1):
            raise ValueError(f"slots of the window must be a power of two, not {slots!r}")
        self.axes = axes
        self.slots = slots
        super().__init__({
            "slot_length": In(30),
            "slot_rate": In(30),
            "slot_travel": In(Travel()).array(axes),
            "slot_write": In(range(slots)),
            "slot_write_strobe": In(1),
            "pulse": In(1),
            "reverse": In(1),
            "ahead": In(signed(32)),
            "load": In(1),
            "load_slot": In(range(slots)),
            "position": Out(signed(32)),
            "front": Out(signed(32)),
            "slot": Out(range(slots)),
            "rate": Out(30),
            "distribute": Out(1),
            "distribute_reverse": Out(1),
            "length": Out(30),
            "travel": Out(Travel()).array(axes),
            "entered": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        width = 60 + 32 * self.axes
        m.submodules.ring = ring = memory.Memory(shape=width, depth=self.slots, init=[])
        write = ring.write_port()
        read = ring.read_port(domain="comb")
        m.d.comb += [
            write.addr.eq(self.slot_write),
            write.en.eq(self.slot_write_strobe),
            write.data.eq(Cat(self.slot_length, self.slot_rate, *(
                Cat(travel.magnitude, travel.negative) for travel in self.slot_travel))),
            read.addr.eq(self.slot),
            Cat(self.length, self.rate, *(
                Cat(travel.magnitude, travel.negative) for travel in self.travel)
                ).eq(read.data),
        ]

        offset = Signal(30)   # path pulses into the segment
        fresh = Signal()      # stepped back into a segment: the offset is its length, less one
        at_end = Signal()
        more = Signal()       # the path goes on beyond the position
        at_front = Signal()
        front_slot = Signal(range(self.slots))
        waiting = Signal()    # pulses come at most every 4 clocks: time to look, after each
        begun = Signal()      # the first segment has been entered

        m.d.sync += [
            self.distribute.eq(self.pulse),
            self.distribute_reverse.eq(self.reverse),
            self.entered.eq(0),
            fresh.eq(0),
            waiting.eq(self.pulse | fresh | self.load),
            at_end.eq(offset == self.length),
            more.eq((self.ahead - self.position)[:32].as_signed() > 0),
            at_front.eq(self.front == self.position),
        ]
        settled = Signal()
        m.d.comb += settled.eq(~self.pulse & ~fresh & ~waiting & ~self.distribute)

        with m.If(self.pulse):
            with m.If(~self.reverse):
                m.d.sync += self.position.eq(self.position + 1)
                m.d.sync += offset.eq(offset + 1)
                with m.If(at_front):
                    m.d.sync += self.front.eq(self.position + 1)
            with m.Else():
                m.d.sync += self.position.eq(self.position - 1)
                m.d.sync += offset.eq(offset - 1)
                with m.If(offset == 0):
                    m.d.sync += self.slot.eq(self.slot - 1)
                    m.d.sync += fresh.eq(1)
        with m.Elif(fresh):
            m.d.sync += offset.eq(self.length - 1)
        with m.Elif(settled & more):
            with m.If(at_end):
                m.d.sync += self.slot.eq(self.slot + 1)
                m.d.sync += offset.eq(0)
                m.d.sync += waiting.eq(1)
                with m.If(at_front & (self.slot == front_slot)):
                    m.d.sync += front_slot.eq(self.slot + 1)
                    m.d.sync += self.entered.eq(1)
            with m.Elif(~begun):
                m.d.sync += self.entered.eq(1)
                m.d.sync += begun.eq(1)

        with m.If(self.load):
            m.d.sync += [
                self.position.eq(0), self.front.eq(0), offset.eq(0), self.slot.eq(self.load_slot),
                front_slot.eq(self.load_slot), begun.eq(0), fresh.eq(0), self.distribute.eq(0),
            ]

        return m
