# SPDX-License-Identifier: Apache-2.0
"""The window of path segments, and the machine's place in it."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from rtl.lib.arithmetic import sum_or_difference
from rtl.motion.arc import ArcState
from rtl.motion.distributor import Travel

__all__ = ["WORDS", "SegmentWindow"]

WORDS = 16  # of a segment


class SegmentWindow(wiring.Component):
    """Where the machine is on the path: the window of segments around it, walked both ways.

    The window is a ring of ``slots``; the segment with sequence number n is in slot ``n % slots``.
    Firmware writes segments on either side before they are reached. Upstream, path pulses are
    bounded by what is loaded, so that this block can rely on the slot that it enters.

    The words of a slot are written one after the other, from word 0 on. A line has the first six:

    ====== ==========================================================================
    0, 1   length, 1 to 2**30 - 1 pulses; rate, 2**-32 pulse/clock
    2 to 4 travel of each axis: magnitude in pulses, bit 31 downwards
    5      shape: bit 0 arc, bits 1 and 2 major axis, bits 3 and 4 minor axis, bit 5 outward, or
           of a line that it leads away from the work; bits 6 to 31 highest rate either way,
           2**-28 pulse/clock, 0 for no bound
    6, 7   change of pace, signed; divisor
    8 - 11 state at the start: pace, error, along, across (``rtl.motion.arc``)
    12-15  state at the end
    ====== ==========================================================================

    A pulse moves ``position`` by one. At the end of a segment the window enters the next one as
    soon as ``ahead`` shows that there is one; going back, it enters the previous one with the first
    pulse into it. To fetch a line then takes 5 clocks, an arc 9; ``ready`` is low meanwhile.
    ``distribute`` repeats the pulse one clock later, or when the segment has been fetched, with the
    words of the segment in which the pulse lies. ``enter`` passes the state of an arc on.

    ``front`` is the furthest position reached since ``load``. ``entered`` is high for one clock
    when a segment is entered at the front for the first time: never again after a retraction.

    ``fast_ahead`` and ``fast_behind`` are the next places, ahead and behind, at which the machine
    must be slow, each with a bound of the rate from there on. Firmware's values are accepted if
    they were made for the segment in which the machine is. When the window enters a segment
    backwards (forwards), the border becomes the next such place ahead (behind), without a bound,
    until firmware has written a better one.

    The segment at work has its feed from the ring. A new feed that is written there reaches it by
    ``pace``: in the clock after the strobe, or after a fetch under way. Nothing else of the segment
    changes, so the path is the same, and the ramp follows the new feed as it does any other.

    The block detects a bit that changes by itself. Each word of the ring has a parity, checked
    whenever it is fetched: ``damaged_word`` is high in the 2nd clock after the one that has the
    word, before a pulse can be made of it. The words of the segment at work are checked all the
    time: ``damaged_segment``. ``position``, ``front`` and the place in the segment are kept twice,
    once inverted: ``damaged_place``. The last two come 2 clocks after the change and last as long
    as it does; ``load`` ends them.

    Parameters
    ----------
    axes : int
        Number of axes, 1 to 3.
    slots : int
        Segments in the window, a power of two.

    Members
    -------
    select : In(range(slots)), select_strobe : In(1)
        The slot to write.
    data : In(32), data_strobe : In(1)
        Its next word.
    pulse, reverse : In(1)
        Ramped path pulse Pp and its direction; at most one every 4 clocks, and none in the clock
        after one without ``ready``.
    ahead : In(signed(32))
        End of the path that may be machined.
    load : In(1), load_slot : In(range(slots))
        Put the machine at coordinate 0, at the start of the segment in a slot. That slot must be
        written before ``ahead`` passes 0. Only at rest, and with ``ahead`` at 0.
    fast_ahead_new, fast_behind_new : In(signed(32)), fast_slot : In(range(slots)),
    fast_ahead_rate_new, fast_behind_rate_new : In(26), fast_strobe : In(1)
        Next places at which the machine must be slow, valid for the segment in this slot.
    pace : In(30), pace_slot : In(range(slots)), pace_strobe : In(1)
        A feed to put in force at once, if the machine is in the segment in this slot. It must not
        change for 12 clocks from the strobe on.
    position, front : Out(signed(32))
        Path coordinates. They wrap.
    slot : Out(range(slots))
        Slot of the segment in which the machine is.
    rate : Out(30)
        Its feed, 2**-32 pulse/clock.
    highest : Out(26)
        The highest rate either way, 2**-28 pulse/clock; 0 for no bound.
    away : Out(1)
        The segment leads away from the work.
    ready : Out(1)
        The segment has been fetched.
    distribute, distribute_reverse : Out(1)
        The pulse, for the distributors.
    length : Out(30), travel : Out(Travel) x axes
        The segment of that pulse.
    arc, outward : Out(1), major, minor : Out(2), divisor : Out(30), change : Out(signed(32))
        The segment is an arc, and its words.
    enter : Out(1), state : Out(ArcState)
        State in which the machine has entered it.
    entered : Out(1)
        The front has entered the segment in ``slot``: the first one as soon as there is a path,
        the others in the clock in which ``slot`` changes.
    fast_ahead, fast_behind : Out(signed(32))
        Path coordinates.
    fast_ahead_rate, fast_behind_rate : Out(26)
        Bound of the rate from there on, 2**-28 pulse/clock; 0 for none.
    damaged_word, damaged_segment, damaged_place : Out(1)
        See above.

    Raises
    ------
    ValueError
        If the number of slots is no power of two, or there are not 1 to 3 axes.
    """

    def __init__(self, *, axes=3, slots=64):
        if slots < 2 or slots & (slots - 1):
            raise ValueError(f"slots of the window must be a power of two, not {slots!r}")
        if not 1 <= axes <= 3:
            raise ValueError(f"a segment has 1 to 3 axes, not {axes!r}")
        self.axes = axes
        self.slots = slots
        self.offset = Signal(30)  # path pulses into the segment
        # The second copies are inverted, so that synthesis does not merge them with the first.
        self.again = {name: Signal(bits, init=-1, name=f"{name}_again") for name, bits in (
            ("position", 32), ("front", 32), ("offset", 30), ("slot", exact_log2(slots)))}
        self.banks = [memory.Memory(shape=33, depth=slots * WORDS // 2, init=[]) for _ in range(2)]
        super().__init__({
            "select": In(range(slots)),
            "select_strobe": In(1),
            "data": In(32),
            "data_strobe": In(1),
            "pulse": In(1),
            "reverse": In(1),
            "ahead": In(signed(32)),
            "load": In(1),
            "load_slot": In(range(slots)),
            "fast_ahead_new": In(signed(32)),
            "fast_behind_new": In(signed(32)),
            "fast_ahead_rate_new": In(26),
            "fast_behind_rate_new": In(26),
            "fast_slot": In(range(slots)),
            "fast_strobe": In(1),
            "pace": In(30),
            "pace_slot": In(range(slots)),
            "pace_strobe": In(1),
            "position": Out(signed(32)),
            "front": Out(signed(32)),
            "slot": Out(range(slots)),
            "rate": Out(30),
            "highest": Out(26),
            "away": Out(1),
            "ready": Out(1, init=1),
            "distribute": Out(1),
            "distribute_reverse": Out(1),
            "length": Out(30),
            "travel": Out(Travel()).array(axes),
            "arc": Out(1),
            "outward": Out(1),
            "major": Out(2),
            "minor": Out(2),
            "divisor": Out(30),
            "change": Out(signed(32)),
            "enter": Out(1),
            "state": Out(ArcState()),
            "entered": Out(1),
            "fast_ahead": Out(signed(32)),
            "fast_behind": Out(signed(32)),
            "fast_ahead_rate": Out(26),
            "fast_behind_rate": Out(26),
            "damaged_word": Out(1),
            "damaged_segment": Out(1),
            "damaged_place": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        fetch, fetched = self._fetch(m, self._words(m))

        offset = self.offset
        position_again, front_again, offset_again, slot_again = self.again.values()
        returned = Signal()    # stepped back into a segment: the offset is its length, less one
        at_start, at_end = Signal(), Signal()
        more = Signal()        # the path goes on beyond the position
        at_front = Signal()
        front_slot = Signal(range(self.slots))
        begun = Signal()       # the first segment has been entered

        m.d.sync += [
            self.distribute.eq(self.pulse & ~(self.reverse & at_start)),
            self.entered.eq(0),
            at_start.eq(offset == 0),
            at_end.eq(offset == self.length),
            more.eq((self.ahead - self.position)[:32].as_signed() > 0),
            at_front.eq(self.front == self.position),
        ]
        with m.If(self.pulse):
            m.d.sync += self.distribute_reverse.eq(self.reverse)
        with m.If(self.fast_strobe & (self.fast_slot == self.slot)):
            m.d.sync += [self.fast_ahead.eq(self.fast_ahead_new),
                         self.fast_behind.eq(self.fast_behind_new),
                         self.fast_ahead_rate.eq(self.fast_ahead_rate_new),
                         self.fast_behind_rate.eq(self.fast_behind_rate_new)]

        moved = sum_or_difference(self.position, C(1), self.reverse)
        moved_again = sum_or_difference(position_again, C(1), ~self.reverse)
        with m.If(self.pulse):
            m.d.sync += [
                self.position.eq(moved), position_again.eq(moved_again),
                offset.eq(sum_or_difference(offset, C(1), self.reverse)),
                offset_again.eq(sum_or_difference(offset_again, C(1), ~self.reverse)),
            ]
            with m.If(~self.reverse):
                with m.If(at_front):
                    m.d.sync += [self.front.eq(moved), front_again.eq(moved_again)]
            with m.Else():
                with m.If(at_start):
                    m.d.comb += fetch.eq(1)
                    m.d.sync += [self.slot.eq(self.slot - 1), slot_again.eq(slot_again + 1),
                                 returned.eq(1), self.fast_ahead.eq(self.position),
                                 self.fast_ahead_rate.eq(0)]
        with m.Elif(fetched):
            m.d.sync += [self.distribute.eq(returned), returned.eq(0)]
            with m.If(returned):
                m.d.sync += [offset.eq(self.length - 1), offset_again.eq(-self.length)]
        with m.Elif(self.ready & more):
            with m.If(~begun & at_front & (self.slot == front_slot)):
                # Not before: only now the first slot has certainly been written.
                m.d.comb += fetch.eq(1)
                m.d.sync += [self.entered.eq(1), begun.eq(1)]
            with m.Elif(at_end):
                m.d.comb += fetch.eq(1)
                m.d.sync += [self.slot.eq(self.slot + 1), slot_again.eq(slot_again - 1),
                             offset.eq(0), offset_again.eq(-1),
                             self.fast_behind.eq(self.position), self.fast_behind_rate.eq(0)]
                with m.If(at_front & (self.slot == front_slot)):
                    m.d.sync += front_slot.eq(self.slot + 1)
                    m.d.sync += self.entered.eq(1)
                with m.If(~begun & at_front & ((self.slot + 1)[:len(self.slot)] == front_slot)):
                    # The machine comes back from before the first slot, which was not written yet.
                    m.d.sync += [self.entered.eq(1), begun.eq(1)]

        with m.If(self.load):
            m.d.sync += [
                self.position.eq(0), self.front.eq(0), offset.eq(0), self.slot.eq(self.load_slot),
                front_slot.eq(self.load_slot), begun.eq(0), returned.eq(0), self.distribute.eq(0),
                self.fast_ahead.eq(0), self.fast_behind.eq(0),
                self.fast_ahead_rate.eq(0), self.fast_behind_rate.eq(0),
                position_again.eq(-1), front_again.eq(-1), offset_again.eq(-1),
                slot_again.eq(~self.load_slot),
            ]

        differ = Signal(len(self.again))
        m.d.sync += [
            differ.eq(Cat(one[:] != ~other for one, other in zip(
                (self.position, self.front, offset, self.slot), self.again.values(),
                strict=True))),
            self.damaged_place.eq(differ.any()),
        ]

        return m

    def _words(self, m):
        """The ring, written word by word, and read by pairs; returns its address and its data.

        Bit 32 of a word is its parity: the number of ones in bits 0 to 32 is even.
        """
        word = Signal(range(WORDS))
        pair = Signal(range(WORDS // 2))
        with m.If(self.select_strobe):
            m.d.sync += word.eq(0)
        with m.Elif(self.data_strobe):
            m.d.sync += word.eq(word + 1)
        banks = []
        for odd, bank in enumerate(self.banks):
            m.submodules[f"bank_{odd}"] = bank
            write, read = bank.write_port(), bank.read_port()
            m.d.comb += [
                write.addr.eq(Cat(word[1:], self.select)),
                write.data.eq(Cat(self.data, self.data.xor())),
                write.en.eq(self.data_strobe & (word[0] == odd)),
                read.addr.eq(Cat(pair, self.slot)),
            ]
            banks.append(read.data)
        return pair, banks

    def _fetch(self, m, words):
        """Fetch the segment in ``slot``; returns the order to fetch, and that it is done."""
        pair, (even, odd) = words
        fetch = Signal()
        backward = Signal()
        step = Signal(range(9))
        fetched = Signal()
        line, arc = 4, 8  # last steps
        m.d.comb += fetched.eq(~self.ready & Mux(self.arc, step == arc, step == line))
        m.d.sync += self.enter.eq(0)
        with m.If(fetch):
            m.d.sync += [self.ready.eq(0), step.eq(0), backward.eq(self.pulse & self.reverse)]
        with m.Elif(fetched):
            m.d.sync += self.ready.eq(1)
        with m.Elif(~self.ready):
            m.d.sync += step.eq(step + 1)

        travel = [Cat(axis.magnitude, axis.negative) for axis in self.travel]
        travel += [Signal(32, name=f"no_axis_{index}") for index in range(len(travel), 3)]
        shape = Cat(self.arc, self.major, self.minor, self.outward, self.highest)
        m.d.comb += self.away.eq(self.outward & ~self.arc)
        with m.If(~self.ready), m.Switch(step):
            with m.Case(0):
                m.d.comb += pair.eq(2)
            with m.Case(1):
                m.d.comb += pair.eq(0)
                m.d.sync += [travel[2].eq(even), shape.eq(odd)]
            with m.Case(2):
                m.d.comb += pair.eq(1)
                m.d.sync += [self.length.eq(even), self.rate.eq(odd)]
            with m.Case(3):
                m.d.comb += pair.eq(3)
                m.d.sync += [travel[0].eq(even), travel[1].eq(odd)]
            with m.Case(4):
                m.d.comb += pair.eq(Mux(backward, 6, 4))
                m.d.sync += [self.change.eq(even), self.divisor.eq(odd)]
            with m.Case(5):
                m.d.comb += pair.eq(Mux(backward, 7, 5))
                m.d.sync += [self.state.pace.eq(even), self.state.error.eq(odd)]
            with m.Case(6):
                m.d.sync += [self.state.along.eq(even), self.state.across.eq(odd)]
                m.d.sync += self.enter.eq(1)

        fetching = Signal()  # the banks give words of this segment
        m.d.comb += fetching.eq(~self.ready & (step != 0))
        m.d.sync += self.damaged_word.eq(fetching & (even.xor() | odd.xor()))
        # The parity of words 0 to 7 as registers hold them: unused bits do not count.
        kept = Cat(self.length, self.rate, *travel, shape, self.change, self.divisor)
        parity, known = Signal(name="segment_parity"), Signal()
        paces = Signal()  # a new feed waits for the end of a fetch
        with m.If(paces & self.ready & ~fetch):
            m.d.sync += paces.eq(0)
            with m.If(self.pace_slot == self.slot):
                m.d.sync += [self.rate.eq(self.pace),
                             parity.eq(parity ^ self.rate.xor() ^ self.pace.xor())]
        with m.If(self.pace_strobe):
            m.d.sync += paces.eq(1)
        with m.If(fetching & (step <= line)):
            cut_even, cut_odd = (Mux(step == at, word[30:].xor(), word[32])
                                 for word, at in ((even, 2), (odd, 2)))
            m.d.sync += parity.eq(Mux(step == 1, 0, parity) ^ cut_even ^ Mux(
                step == line, odd[30:].xor(), cut_odd))
        with m.If(fetch | self.load):
            m.d.sync += known.eq(0)
        with m.Elif(fetched):
            m.d.sync += known.eq(1)
        ones, expected, looked = Signal(), Signal(), Signal()
        m.d.sync += [ones.eq(kept.xor()), expected.eq(parity), looked.eq(known & ~fetch),
                     self.damaged_segment.eq(looked & (ones != expected))]
        return fetch, fetched
