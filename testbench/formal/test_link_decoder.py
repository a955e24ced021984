# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``softcore.link_decoder``: bytes that act, bytes that are queued, ends of stops."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from softcore.link_decoder import ENTRY, NOTES, LinkDecoder, mark
from softcore.linkmap import REALTIME
from testbench.formal.prover import prove

DEPTH = 4    # entries of the queue; the argument does not depend on it
BYTE = {realtime.name: realtime.byte for realtime in REALTIME}


def _is(data, name):
    """Whether a byte is that of a name; the safety door's (0x84) is a hold too."""
    return (data == BYTE[name]) | ((data == 0x84) if name == "hold" else 0)


class DecoderContract(wiring.Component):
    """The decoder with a queue of plain registers.

    The solver picks two of the bytes that come, an older and a younger one (``pick``): they stand
    for any two. The stops begun by `!` and Ctrl-X are kept beside, from the inputs alone.
    """

    data: In(8)
    done: In(1)
    framing: In(1)
    take: In(1)
    release_hold: In(1)
    release_reset: In(1)
    release_override: In(1)
    release_strobe: In(1)
    notes_strobe: In(1)
    pick: In(2)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = LinkDecoder()
        m.d.comb += Assume(~ResetSignal("sync"))
        for name in ("data", "done", "framing", "release_hold", "release_reset", "release_override",
                     "release_strobe", "notes_strobe"):
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        # A serial line's: not both, nor in the next clock.
        came_before = Signal()
        came = self.done | self.framing
        m.d.sync += came_before.eq(came)
        m.d.comb += [Assume(~(self.done & self.framing)), Assume(~(came & came_before))]
        realtime = Signal()
        passed = (self.data >= 0x90) & (self.data <= 0xA1)     # overrides, coolant, mist of grbl
        m.d.comb += realtime.eq(Cat(self.data == byte for byte in (
            *BYTE.values(), 0x84, 0x85)).any() | passed)
        queue, level, taken = self._queue(m, dut)

        self._entries(m, dut, queue, level, taken, realtime)
        self._stops(m, dut, queue, level, taken)
        self._overrides(m, dut)
        return m

    def _queue(self, m, dut):
        queue = [Signal(ENTRY, name=f"entry_{index}") for index in range(DEPTH)]
        level = Signal(range(DEPTH + 1))
        taken = Signal()
        stored = Signal()
        m.d.comb += [
            dut.room.eq(level < DEPTH - 1),
            dut.head.eq(queue[0]),
            taken.eq(self.take & (level != 0)),
            dut.taken.eq(taken),
            stored.eq(dut.push & (level != DEPTH)),
            Assert(level <= DEPTH),
        ]
        for index in range(DEPTH):
            after = queue[index + 1] if index + 1 < DEPTH else queue[index]
            with m.If(stored & (level - taken == index)):
                m.d.sync += queue[index].eq(dut.entry)
            with m.Elif(taken):
                m.d.sync += queue[index].eq(after)
        m.d.sync += level.eq(Mux(dut.flush, 0, level + stored - taken))
        return queue, level, taken

    def _entries(self, m, dut, queue, level, taken, realtime):
        """No real-time byte is queued; every other is, once and in order, or a mark replaces it."""
        is_mark = dut.entry[8]
        flushed = Signal()  # in the clock before
        m.d.sync += flushed.eq(self.done & (self.data == BYTE["reset"]))
        m.d.comb += [
            Assert(~dut.push | is_mark | (self.done & ~realtime & (dut.entry[:8] == self.data))),
            Assert(~(self.done & ~realtime) | dut.push),
            Assert(~(self.done & ~realtime & dut.room) | ~is_mark),
            Assert(~self.framing | (dut.push & (dut.entry == mark("framing")))),
            Assert(~(dut.push & is_mark) | (dut.entry == Mux(
                flushed, mark("reset"), Mux(self.framing, mark("framing"), mark("overrun"))))),
            Assert(~(dut.push & is_mark) | flushed | self.framing | (self.done & ~dut.room)),
            Assert(dut.flush == (self.done & (self.data == BYTE["reset"]))),
            # A byte that finds no room is lost only if a mark already says so.
            Assert((level != DEPTH) | queue[DEPTH - 1][8]),
        ]

        places = []
        for index in range(2):
            follows = Signal(name=f"follows_{index}")
            place = Signal(range(DEPTH), name=f"place_{index}")
            value = Signal(8, name=f"value_{index}")
            picked = self.done & ~realtime & dut.room & self.pick[index] & ~follows
            with m.If(picked):
                m.d.sync += [follows.eq(1), place.eq(level - taken), value.eq(self.data)]
            with m.Elif(follows & taken):
                m.d.sync += [place.eq(place - 1), follows.eq(place != 0)]
            with m.If(dut.flush):
                m.d.sync += follows.eq(0)
            m.d.comb += [
                Assert(~follows | (place < level)),
                Assert(~follows | (Array(queue)[place] == value)),
                Assert(~(follows & taken & (place == 0)) | (queue[0] == value)),
            ]
            places.append((follows, place))
        # They are two: the younger is picked while the older one waits.
        (older, first), (younger, second) = places
        m.d.comb += [
            Assume(~(self.pick[0] & (younger | self.pick[1]))),
            Assume(~self.pick[1] | older),
            Assert(~(older & younger) | (first < second)),
        ]
        m.d.comb += [Cover(older & younger & (second == 2)), Cover(level == DEPTH)]

    def _stops(self, m, dut, queue, level, taken):
        """Each stop lasts until firmware releases it, having seen the last byte that began it."""
        begun = {name: Signal(name=f"begun_{name}") for name in ("hold", "reset")}
        seen = {name: Signal(name=f"seen_{name}") for name in begun}
        ended = Signal(2)
        for index, (name, sees) in enumerate((("hold", self.notes_strobe), ("reset", taken))):
            release = self.release_strobe & getattr(self, f"release_{name}") & seen[name]
            with m.If(self.done & _is(self.data, name)):
                m.d.sync += [begun[name].eq(1), seen[name].eq(0)]
            with m.Else():
                with m.If(sees):
                    m.d.sync += seen[name].eq(1)
                with m.If(release):
                    m.d.sync += begun[name].eq(0)
                with m.If(release & begun[name]):
                    m.d.sync += ended[index].eq(1)
            m.d.comb += Assert(getattr(dut, name) == begun[name])
        m.d.comb += Cover(ended.all())

        notes = {}
        for name in NOTES:
            notes[name] = note = Signal(name=f"note_{name}")
            with m.If(self.done & _is(self.data, name)):
                m.d.sync += note.eq(1)
            with m.Elif(self.notes_strobe):
                m.d.sync += note.eq(0)
            m.d.comb += Assert(getattr(dut, f"notes_{name}") == note)

        # Firmware sees a `!` by its note, and a Ctrl-X by its mark: the next entry, or to be it.
        flushed = Signal()
        m.d.sync += flushed.eq(dut.flush)
        m.d.comb += [
            Assert(notes["hold"] == (begun["hold"] & ~seen["hold"])),
            Assert(~begun["reset"] | (dut.told == seen["reset"])),
            Assert(~begun["reset"] | seen["reset"] | Mux(
                flushed, level == 0, (level != 0) & (queue[0] == mark("reset")))),
        ]

    def _overrides(self, m, dut):
        """The overrides stay within their bounds, and change only with their bytes or a release."""
        feed, rapid = dut.override_feed, dut.override_rapid
        before = Signal.like(Cat(feed, rapid))
        may = Signal()
        m.d.sync += [before.eq(Cat(feed, rapid)), may.eq(
            (self.release_strobe & self.release_override)
            | (self.done & (self.data >= 0x90) & (self.data <= 0x97)))]
        started = Signal()
        m.d.sync += started.eq(1)
        m.d.comb += [
            Assert((feed >= 10) & (feed <= 200)),
            Assert((rapid == 25) | (rapid == 50) | (rapid == 100)),
            Assert(~started | may | (before == Cat(feed, rapid))),
            Cover(feed == 121),
        ]


def test_contract_holds(workdir):
    prove(DecoderContract(), workdir, depth=6)


def test_contract_is_reachable(workdir):
    prove(DecoderContract(), workdir, depth=20, mode="cover")
