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
    Realtime("stop", 0x9E, "The discharge off, in a hold and at rest (spindle stop of grbl)."),
)

# grbl's safety door. Here it is a feed hold, as if `!` had come.
DOOR = 0x84


@dataclass(frozen=True)
class Override:
    """A real-time byte that changes an override: to a value, or by so much; both in percent."""

    byte: int
    of: str     # of OVERRIDES
    to: int | None
    by: int

    @property
    def doc(self) -> str:
        """What it does, in words."""
        what = {"feed": "constant feed", "rapid": "rapids"}[self.of]
        return f"{what} to {self.to} %" if self.to is not None else f"{what} {self.by:+d} %"


# The overrides: the least and the highest percentage of each.
OVERRIDES = {"feed": (10, 200), "rapid": (25, 100)}
OVERRIDE_BYTES = (
    Override(0x90, "feed", 100, 0),
    Override(0x91, "feed", None, 10),
    Override(0x92, "feed", None, -10),
    Override(0x93, "feed", None, 1),
    Override(0x94, "feed", None, -1),
    Override(0x95, "rapid", 100, 0),
    Override(0x96, "rapid", 50, 0),
    Override(0x97, "rapid", 25, 0),
)

# Real-time bytes of grbl 1.1 that do nothing here, and why. They are taken out of the stream like
# the others, so that a line in whose midst one comes stays whole.
PASSED_OVER = {
    0x85: "cancels a jog in grbl; there is none to be cancelled",
    0x98: "grbl gives it no meaning",
    **{byte: "changes the spindle's speed in grbl; discharge pulses have none"
       for byte in range(0x99, 0x9E)},
    0x9F: "grbl gives it no meaning",
    0xA0: "switches the fluid on and off in grbl; only M08 and M09 do so here: no byte stops it "
          "while it burns",
    0xA1: "switches the mist on and off in grbl; there is none",
}

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

# What each way of the feed makes of the overrides: the way, what scales it, why.
FEEDS = (
    ("G01, G02, G03 under G94", "feed",
     "at most the highest speed of the settings, and on an arc what its radius allows"),
    ("G00, G28, G30", "rapid", "also between cuts under G95"),
    ("G95 P1", "", "the step is made at F; how often is decided by the counted pulses"),
    ("G95 P2", "", "the mean voltage sets the speed, F is its bound"),
    ("G95 P3, P4", "", "the mean voltage, or Es/Ex, sets the speed around F: a factor would be a "
     "disturbance that the law takes back"),
    ("retraction, re-advance", "", "their speeds are those of G36: they save the electrode"),
    ("jump", "", "its speeds are those of G38"),
    ("off a limit switch", "feed or rapid", "never above the creep of the build"),
)
