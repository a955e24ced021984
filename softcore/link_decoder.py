# SPDX-License-Identifier: Apache-2.0
"""Real-time bytes out of the stream that comes from the host, before its queue."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from softcore.linkmap import DOOR, MARKS, OVERRIDE_BYTES, OVERRIDES, PASSED_OVER, REALTIME

__all__ = ["ENTRY", "NOTES", "LinkDecoder", "mark"]

ENTRY = 9   # bits of the queue: a byte, or a mark's number, and whether it is a mark
NOTES = [realtime.name for realtime in REALTIME if realtime.name != "reset"]
NUMBER = {name: number for number, (name, _) in enumerate(MARKS)}


def mark(name: str) -> int:
    """Entry of the queue that is the mark of a name of ``linkmap.MARKS``."""
    return 1 << 8 | NUMBER[name]


class LinkDecoder(wiring.Component):
    """Takes real-time bytes (``linkmap.REALTIME``) out of what is received.

    It looks at one byte at a time and remembers none: whatever came before, a real-time byte acts,
    and never enters the queue. Every other byte enters it, in its order. Where one is missing a
    mark (``linkmap.MARKS``) stands in its place: ``framing`` for a byte without its stop bit,
    ``overrun`` for bytes that found no ``room``. If the queue has no place even for a mark, its
    newest entry is one already, of bytes lost at the same place.

    ``done`` and ``framing`` come at most in every other clock, as a serial line's do. From ``done``
    to ``push``: the same clock. From ``done`` to ``hold``, ``reset`` or a note: the next.

    * Each byte but that of the reset leaves a note, until firmware reads the notes. ``DOOR`` counts
      as a `!`. ``PASSED_OVER`` leave nothing.
    * ``OVERRIDE_BYTES`` change ``override_feed`` and ``override_rapid`` within their bounds, each
      as it comes, so that none is lost; a release brings both back to 100. A byte in the clock of
      the release counts from there.
    * ``hold`` is up from a `!` on, until firmware releases it.
    * ``reset`` is up from a Ctrl-X on, until firmware releases it. The queue is emptied
      (``flush``), and gets the mark ``reset`` in the next clock: what came before is gone, and what
      follows comes after the mark.

    A release does nothing while firmware has not seen the last `!` (its note is unread) or the last
    Ctrl-X (its mark is in the queue): it was meant for an earlier one.

    Members
    -------
    data : In(8), done : In(1), framing : In(1)
        What the receiver says.
    room : In(1)
        The queue can take a byte, and a mark after it.
    entry : Out(ENTRY), push : Out(1), flush : Out(1)
        Into the queue, unless it is full; or empty it.
    head : In(ENTRY), taken : In(1)
        The queue's oldest entry, and whether firmware takes it.
    hold, reset : Out(1)
        What the gateware has begun by itself.
    override_feed : Out(8), override_rapid : Out(7)
        Overrides in percent.
    release_hold, release_reset, release_override, release_strobe : In(1)
        Register ``release``.
    notes_strobe : In(1)
        The notes are being read.

    Beside these a note ``notes_<name>`` : Out(1) for each real-time byte but the reset.
    """

    def __init__(self):
        super().__init__({
            "data": In(8), "done": In(1), "framing": In(1), "room": In(1),
            "entry": Out(ENTRY), "push": Out(1), "flush": Out(1),
            "head": In(ENTRY), "taken": In(1), "hold": Out(1), "reset": Out(1),
            "release_hold": In(1), "release_reset": In(1), "release_override": In(1),
            "release_strobe": In(1), "notes_strobe": In(1),
            "override_feed": Out(8, init=100), "override_rapid": Out(7, init=100),
        } | {f"notes_{name}": Out(1) for name in NOTES})
        self.told = Signal()  # the mark of the last reset has been taken

    def elaborate(self, platform):
        m = Module()

        came = {}  # by name: such a byte has just come
        for realtime in REALTIME:
            came[realtime.name] = Signal(name=f"came_{realtime.name}")
            also = [DOOR] if realtime.name == "hold" else []
            m.d.comb += came[realtime.name].eq(self.done & self.data.matches(realtime.byte, *also))
        plain = Signal()
        m.d.comb += plain.eq(self.done & ~Cat(came.values()).any() & ~self.data.matches(
            *sorted(PASSED_OVER), *(one.byte for one in OVERRIDE_BYTES)))
        self._overrides(m)

        flushed = Signal()
        m.d.sync += flushed.eq(self.flush)
        m.d.comb += [
            self.flush.eq(came["reset"]),
            self.push.eq(plain | self.framing | flushed),
            self.entry.eq(Mux(flushed, mark("reset"), Mux(self.framing, mark("framing"), Mux(
                self.room, self.data, mark("overrun"))))),
        ]

        for name in NOTES:
            note = getattr(self, f"notes_{name}")
            m.d.sync += note.eq(came[name] | (note & ~self.notes_strobe))

        with m.If(came["hold"]):
            m.d.sync += self.hold.eq(1)
        with m.Elif(self.release_strobe & self.release_hold & ~self.notes_hold):
            m.d.sync += self.hold.eq(0)
        with m.If(came["reset"]):
            m.d.sync += [self.reset.eq(1), self.told.eq(0)]
        with m.Else():
            with m.If(self.taken & (self.head == mark("reset"))):
                m.d.sync += self.told.eq(1)
            with m.If(self.release_strobe & self.release_reset & self.told):
                m.d.sync += self.reset.eq(0)

        return m

    def _overrides(self, m):
        """Each override by its bytes, within its bounds."""
        for name, (least, most) in OVERRIDES.items():
            value = getattr(self, f"override_{name}")
            mine = [one for one in OVERRIDE_BYTES if one.of == name]
            before, after = Signal.like(value), Signal.like(value)
            step = Signal(signed(5), name=f"step_{name}")
            total = Signal(signed(len(value) + 2), name=f"total_{name}")
            m.d.comb += [
                before.eq(Mux(self.release_strobe & self.release_override, 100, value)),
                total.eq(before + step),
                after.eq(Mux(total > most, most, Mux(total < least, least, total))),
            ]
            with m.If(self.done), m.Switch(self.data):
                for one in mine:
                    with m.Case(one.byte):
                        m.d.comb += step.eq(one.by) if one.to is None else after.eq(one.to)
            m.d.sync += value.eq(after)
