# SPDX-License-Identifier: Apache-2.0
"""Takes real-time bytes out of the stream from the host, before the receive queue."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from softcore.linkmap import DOOR, MARKS, OVERRIDE_BYTES, OVERRIDES, PASSED_OVER, REALTIME

__all__ = ["ENTRY", "NOTES", "LinkDecoder", "mark"]

ENTRY = 9   # bits of an entry: a byte or a mark's number, and a bit that says which
NOTES = [realtime.name for realtime in REALTIME if realtime.name != "reset"]
NUMBER = {name: number for number, (name, _) in enumerate(MARKS)}


def mark(name: str) -> int:
    """Entry of the queue for a mark, by its name in ``linkmap.MARKS``."""
    return 1 << 8 | NUMBER[name]


class LinkDecoder(wiring.Component):
    """Takes real-time bytes (``linkmap.REALTIME``) out of the received stream.

    A real-time byte acts whatever came before it, and never enters the queue. All other bytes enter
    the queue in their order. Where a byte is missing, a mark (``linkmap.MARKS``) takes its place:
    ``framing`` for a byte without its stop bit, ``overrun`` for bytes for which there was no
    ``room``. If there is no room even for a mark, the newest entry is already the mark of bytes
    lost at the same place.

    ``done`` and ``framing`` come at most in every other clock, as on a serial line. ``push`` comes
    in the clock of ``done``; ``hold``, ``reset`` and the notes change in the next clock.

    * Each real-time byte except the reset sets a note, until the firmware reads the notes. ``DOOR``
      acts like `!`. The bytes of ``PASSED_OVER`` have no effect.
    * Each of ``OVERRIDE_BYTES`` changes ``override_feed`` or ``override_rapid`` at once, within its
      bounds, so that none is lost. A release sets both to 100; a byte in the same clock then
      changes this value.
    * ``hold`` is high from a `!` until the firmware releases it.
    * ``reset`` is high from a Ctrl-X until the firmware releases it. The queue is emptied
      (``flush``) and gets the mark ``reset`` in the next clock, before all later bytes.

    A release has no effect while the firmware has not seen the last `!` (its note is unread) or the
    last Ctrl-X (its mark is in the queue): the release was meant for an earlier one.

    Members
    -------
    data : In(8), done : In(1), framing : In(1)
        Outputs of the receiver.
    room : In(1)
        The queue can take a byte, and a mark after it.
    entry : Out(ENTRY), push : Out(1), flush : Out(1)
        Put an entry into the queue, unless it is full; empty the queue.
    head : In(ENTRY), taken : In(1)
        The queue's oldest entry; the firmware takes it.
    hold, reset : Out(1)
        Feed hold by `!`; stop by Ctrl-X.
    override_feed : Out(8), override_rapid : Out(7)
        Overrides in percent.
    release_hold, release_reset, release_override, release_strobe : In(1)
        Register ``release``.
    notes_strobe : In(1)
        The notes are being read.

    There is also a note ``notes_<name>`` : Out(1) for each real-time byte except the reset.
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
        """Change each override by its bytes, within its bounds."""
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
