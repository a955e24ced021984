# SPDX-License-Identifier: Apache-2.0
"""Serial link to the host: bytes in and out, with a queue each way."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.wiring import In, Out

from rtl.lib.event_queue import EventQueue
from softcore.link_decoder import ENTRY, NOTES, LinkDecoder

__all__ = ["Receiver", "Transmitter", "Uart"]

RECEIVE_DEPTH = 256  # entries: room for a whole stuffed tape frame and bytes before it
TRANSMIT_DEPTH = 64  # bytes: room for a line of an answer


def _check(divisor):
    if divisor < 4:
        raise ValueError(f"there must be at least 4 clocks per bit, not {divisor!r}")
    return divisor


class Receiver(wiring.Component):
    """Receives bytes: one start bit, eight bits with the lowest first, one stop bit.

    Each bit is read once, in its middle: ``divisor // 2`` clocks after the first clock in which the
    start bit was seen, and then every ``divisor`` clocks. A start bit that is no longer there in
    its middle is noise and is ignored. In the clock after the middle of the stop bit, ``done`` is
    high with ``data`` if the stop bit is high; ``framing`` is high if it is low, and nothing more
    is received until the line has been high. The next start bit may come right after the middle of
    the stop bit.

    A sender may be slower by 4 %, and faster by 5 % less 10 % / ``divisor``. These bounds allow for
    a start bit that is seen up to one clock late.

    Parameters
    ----------
    divisor : int
        Clocks per bit, at least 4.

    Members
    -------
    rx : In(1)
        The line, synchronised. Idles high.
    data : Out(8)
        The byte. Valid with ``done``.
    done : Out(1)
        A byte was received: high for one clock.
    framing : Out(1)
        A byte had no stop bit and was dropped: high for one clock.

    Raises
    ------
    ValueError
        If ``divisor`` is too small.
    """

    def __init__(self, *, divisor):
        self.divisor = _check(divisor)
        super().__init__({"rx": In(1, init=1), "data": Out(8), "done": Out(1), "framing": Out(1)})

    def elaborate(self, platform):
        m = Module()

        timer = Signal(range(self.divisor))  # clocks to the middle of the next bit
        bits = Signal(range(9))              # bits received, the start bit included
        middle = Signal()
        m.d.comb += middle.eq(timer == 0)

        m.d.sync += [self.done.eq(0), self.framing.eq(0)]
        m.d.sync += timer.eq(Mux(middle, self.divisor - 1, timer - 1))
        with m.FSM():
            with m.State("Idle"), m.If(~self.rx):
                m.d.sync += [timer.eq(self.divisor // 2 - 1), bits.eq(0)]
                m.next = "Start"
            with m.State("Start"), m.If(middle):
                with m.If(self.rx):
                    m.next = "Idle"
                with m.Else():
                    m.next = "Data"
            with m.State("Data"), m.If(middle):
                m.d.sync += [self.data.eq(Cat(self.data[1:], self.rx)), bits.eq(bits + 1)]
                with m.If(bits == 7):
                    m.next = "Stop"
            with m.State("Stop"), m.If(middle):
                m.d.sync += [self.done.eq(self.rx), self.framing.eq(~self.rx)]
                with m.If(self.rx):
                    m.next = "Idle"
                with m.Else():
                    m.next = "Broken"
            with m.State("Broken"), m.If(self.rx):
                m.next = "Idle"

        return m


class Transmitter(wiring.Component):
    """Sends bytes in the format of ``Receiver``.

    A byte is taken in a clock in which ``valid`` and ``ready`` are high; its start bit begins in
    the next clock. It lasts exactly ``10 * divisor`` clocks. The next byte follows without a gap if
    it is offered in the last of these clocks.

    Parameters
    ----------
    divisor : int
        Clocks per bit, at least 4.

    Members
    -------
    data : In(8), valid : In(1)
        A byte to send.
    ready : Out(1)
        It is taken.
    tx : Out(1)
        The line. Idles high.

    Raises
    ------
    ValueError
        If ``divisor`` is too small.
    """

    def __init__(self, *, divisor):
        self.divisor = _check(divisor)
        super().__init__({
            "data": In(8), "valid": In(1), "ready": Out(1), "tx": Out(1, init=1),
        })

    def elaborate(self, platform):
        m = Module()

        timer = Signal(range(self.divisor))  # clocks left of this bit
        frame = Signal(9)                    # bits after the one on the line; ends with a one
        m.d.comb += self.ready.eq((timer == 0) & ~frame.any())

        with m.If(timer != 0):
            m.d.sync += timer.eq(timer - 1)
        with m.Elif(frame.any()):
            # Shifting in zeros marks the end: the last one to leave is the stop bit.
            m.d.sync += [Cat(self.tx, frame).eq(frame), timer.eq(self.divisor - 1)]
        with m.Elif(self.valid):
            m.d.sync += [self.tx.eq(0), frame.eq(Cat(self.data, 1)), timer.eq(self.divisor - 1)]

        return m


class Uart(wiring.Component):
    """The registers of block ``link``: a receive queue of 256 entries, a transmit queue of 64.

    ``receive_data`` and ``receive_mark`` show the oldest entry while ``receive_valid`` is high.
    ``receive_strobe`` takes it; the next one is shown in the next clock. A byte is shown 3 clocks
    after the middle of its stop bit. ``softcore.link_decoder`` describes bytes and marks, ``hold``,
    ``reset``, the notes and their release. ``hold`` and ``reset`` are high 2 clocks after the
    middle of their byte's stop bit.

    ``transmit`` is queued with ``transmit_strobe`` if ``ready`` is high, else it is lost.

    Parameters
    ----------
    divisor : int
        Clocks per bit, at least 4.

    Members
    -------
    rx : In(1), tx : Out(1)
        The lines; idle high.
    receive_data : Out(8), receive_mark : Out(1), receive_valid : Out(1), receive_strobe : In(1)
        Register ``receive``.
    transmit : In(8), transmit_strobe : In(1)
        Register ``transmit``.
    ready : Out(1)
        The transmit queue has room.
    noted : Out(1)
        There is a note.
    waiting : Out(range(RECEIVE_DEPTH + 1))
        Entries in the receive queue.
    taken : In(1)
        After the present byte, the line to the host sends the notice; queued bytes stay queued.
    notice_data : In(8), notice_valid : In(1), notice_ready : Out(1)
        Bytes of the notice, as for ``Transmitter``.

    The others are those of ``LinkDecoder``.

    Raises
    ------
    ValueError
        If ``divisor`` is too small.
    """

    def __init__(self, *, divisor):
        self.divisor = _check(divisor)
        super().__init__({
            "rx": In(1, init=1), "tx": Out(1, init=1),
            "receive_data": Out(8), "receive_mark": Out(1), "receive_valid": Out(1),
            "receive_strobe": In(1),
            "transmit": In(8), "transmit_strobe": In(1), "ready": Out(1),
            "taken": In(1), "notice_data": In(8), "notice_valid": In(1), "notice_ready": Out(1),
            "hold": Out(1), "reset": Out(1), "noted": Out(1), "notes_strobe": In(1),
            "release_hold": In(1), "release_reset": In(1), "release_override": In(1),
            "release_strobe": In(1), "override_feed": Out(8, init=100),
            "override_rapid": Out(7, init=100), "waiting": Out(range(RECEIVE_DEPTH + 1)),
        } | {f"notes_{name}": Out(1) for name in NOTES})

    def elaborate(self, platform):
        m = Module()

        m.submodules.receiver = receiver = Receiver(divisor=self.divisor)
        m.submodules.decoder = decoder = LinkDecoder()
        received = SyncFIFOBuffered(width=ENTRY, depth=RECEIVE_DEPTH)
        m.submodules.received = ResetInserter(decoder.flush)(received)
        m.d.comb += [
            receiver.rx.eq(self.rx),
            decoder.data.eq(receiver.data),
            decoder.done.eq(receiver.done),
            decoder.framing.eq(receiver.framing),
            decoder.room.eq(received.level < RECEIVE_DEPTH - 1),
            received.w_data.eq(decoder.entry),
            received.w_en.eq(decoder.push),
            Cat(self.receive_data, self.receive_mark).eq(received.r_data),
            self.receive_valid.eq(received.r_rdy),
            received.r_en.eq(self.receive_strobe),
            decoder.head.eq(received.r_data),
            decoder.taken.eq(received.r_rdy & self.receive_strobe),
            self.hold.eq(decoder.hold),
            self.reset.eq(decoder.reset),
            decoder.notes_strobe.eq(self.notes_strobe),
            self.noted.eq(Cat(getattr(self, f"notes_{name}") for name in NOTES).any()),
        ]
        for name in NOTES:
            m.d.comb += getattr(self, f"notes_{name}").eq(getattr(decoder, f"notes_{name}"))
        for name in ("hold", "reset", "override", "strobe"):
            m.d.comb += getattr(decoder, f"release_{name}").eq(getattr(self, f"release_{name}"))
        m.d.comb += [
            self.override_feed.eq(decoder.override_feed),
            self.override_rapid.eq(decoder.override_rapid),
            self.waiting.eq(received.level),
        ]

        m.submodules.transmitter = transmitter = Transmitter(divisor=self.divisor)
        m.submodules.waiting = waiting = EventQueue(width=8, depth=TRANSMIT_DEPTH)
        m.d.comb += [
            waiting.push.eq(self.transmit_strobe & ~waiting.full),
            waiting.data.eq(self.transmit),
            self.ready.eq(~waiting.full),
            transmitter.data.eq(Mux(self.taken, self.notice_data, waiting.head)),
            transmitter.valid.eq(Mux(self.taken, self.notice_valid, waiting.valid)),
            waiting.pop.eq(transmitter.ready & ~self.taken),
            self.notice_ready.eq(transmitter.ready & self.taken),
            self.tx.eq(transmitter.tx),
        ]

        return m
