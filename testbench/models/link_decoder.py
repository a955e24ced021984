# SPDX-License-Identifier: Apache-2.0
"""Reference model of the link's decoder: clock by clock, and over whole streams of bytes."""

from collections import deque
from dataclasses import dataclass, field

STATUS, HOLD, RESUME, RESET, RETRACT = 0x3F, 0x21, 0x7E, 0x18, 0xB0
DOOR = 0x84             # as a hold
STOP = 0x9E
CANCEL = 0x85           # of a jog
NOTHING = {*range(0x98, 0x9E), 0x9F, 0xA0, 0xA1}         # of grbl: spindle, coolant
NOTES = {"status": STATUS, "hold": HOLD, "resume": RESUME, "retract": RETRACT, "stop": STOP,
         "cancel": CANCEL}
FEED = {0x91: 10, 0x92: -10, 0x93: 1, 0x94: -1}     # override of the feed, in percent; 0x90: to 100
RAPID = {0x95: 100, 0x96: 50, 0x97: 25}
OVERRIDES = {0x90, *FEED, *RAPID}
FRAMING, OVERRUN, RESET_MARK = 256, 257, 258  # entries that are no bytes


@dataclass
class LinkDecoder:
    """What the decoder remembers, and ``clock``."""

    hold: bool = False
    reset: bool = False
    notes: set = field(default_factory=set)
    mark_due: bool = False       # the queue was emptied in the clock before
    mark_unread: bool = False    # firmware has not come to the mark of the last reset
    feed: int = 100
    rapid: int = 100

    def clock(self, *, byte=None, framing=False, room=True, head=None, taken=False,
              release=(), read_notes=False):
        """Return ``(entry or None, flush)`` of this clock, and go to the next.

        ``release`` holds some of ``"hold"``, ``"reset"`` and ``"override"``.
        """
        entry = None
        byte = HOLD if byte == DOOR else byte
        if self.mark_due:
            entry = RESET_MARK
        elif framing:
            entry = FRAMING
        elif byte is not None and byte not in {
                RESET, *NOTES.values()} | NOTHING | OVERRIDES:
            entry = byte if room else OVERRUN
        flush = byte == RESET
        came = {name for name, value in NOTES.items() if byte == value}

        if "hold" in came:
            self.hold = True
        elif "hold" in release and "hold" not in self.notes:
            self.hold = False
        if flush:
            self.reset = self.mark_unread = True
        else:
            if "reset" in release and not self.mark_unread:
                self.reset = False
            if taken and head == RESET_MARK:
                self.mark_unread = False
        if "override" in release:
            self.feed = self.rapid = 100
        if byte == 0x90:
            self.feed = 100
        self.feed = min(200, max(10, self.feed + FEED.get(byte, 0)))
        self.rapid = RAPID.get(byte, self.rapid)
        self.notes = came | (set() if read_notes else self.notes)
        self.mark_due = flush
        return entry, flush


class Receiver:
    """Decoder and queue, byte by byte: what firmware finds, however late it looks."""

    def __init__(self, depth=256):
        self.depth = depth
        self.queue = deque()
        self.decoder = LinkDecoder()

    def byte(self, byte=None, *, framing=False):
        """Take a byte from the line, or one without its stop bit."""
        entry, flush = self.decoder.clock(byte=byte, framing=framing,
                                          room=len(self.queue) < self.depth - 1)
        if flush:
            self.queue.clear()
            entry, _ = self.decoder.clock()
        if entry is not None and len(self.queue) < self.depth:
            self.queue.append(entry)

    def take(self):
        """Oldest entry, or None."""
        if not self.queue:
            return None
        entry = self.queue.popleft()
        self.decoder.clock(head=entry, taken=True)
        return entry

    def read_notes(self):
        """Take the notes."""
        notes = self.decoder.notes
        self.decoder.clock(read_notes=True)
        return notes
