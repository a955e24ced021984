# SPDX-License-Identifier: Apache-2.0
"""Bytes of the link that mean something by themselves: the only place where they are written down.

The gateware's decoder, the firmware's header and the host take them from here. Plain data: imports
nothing from Amaranth. The protocol is told in ``host.link``.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Realtime:
    """A real-time byte: the gateware takes it out of the stream, whatever came before."""

    name: str
    byte: int
    doc: str


REALTIME = (
    Realtime("status", 0x3F, "A status report is wanted (`?`)."),
    Realtime("hold", 0x21, "Feed hold (`!`)."),
    Realtime("resume", 0x7E, "Go on (`~`)."),
    Realtime("reset", 0x18, "The operator's reset (Ctrl-X)."),
    Realtime("retract", 0xB0, "Retract now."),
)

# grbl's safety door. Here it is a feed hold, as if `!` had come.
DOOR = 0x84
# Real-time bytes of grbl 1.1 that senders use and that do nothing here: end of a jog, overrides of
# feed, rapids and spindle. They are taken out of the stream like the others, so that a line in
# whose midst one comes stays whole.
PASSED_OVER = frozenset({0x85, *range(0x90, 0xA2)})

# What stands in the receive queue at the place where no byte could, by its number.
MARKS = (
    ("framing", "a byte came without its stop bit"),
    ("overrun", "bytes came with the queue full"),
    ("reset", "Ctrl-X came: what was in the queue is gone"),
)

FRAME_START = 0x02
FRAME_END = 0x03
FRAME_ESCAPE = 0x10     # the byte behind it is meant but for FRAME_FLIP
FRAME_FLIP = 0x40
# Never sent bare within a frame: what begins and ends one, what escapes, real-time bytes, and the
# range in which all of them beyond ASCII lie, those that are still to come among them.
STUFFED = frozenset({FRAME_START, FRAME_END, FRAME_ESCAPE, *range(0x80, 0xC0),
                     *(realtime.byte for realtime in REALTIME)})
