# SPDX-License-Identifier: Apache-2.0
"""The link: its registers and the bytes with a meaning of their own, written down only here.

The gateware's decoder, the firmware's header and the host take them from here. Plain data: imports
nothing from Amaranth. ``host.link`` describes the protocol.
"""

from dataclasses import dataclass

from softcore.registers import Block, Field
from softcore.registers import registers as _registers
from softcore.registers import value as _value


@dataclass(frozen=True)
class Realtime:
    """A real-time byte. The gateware takes it out of the stream, whatever came before."""

    name: str
    byte: int
    doc: str


REALTIME = (
    Realtime("status", 0x3F, "Ask for a status report (`?`)."),
    Realtime("hold", 0x21, "Feed hold (`!`)."),
    Realtime("resume", 0x7E, "Go on (`~`)."),
    Realtime("reset", 0x18, "The operator's reset (Ctrl-X)."),
    Realtime("retract", 0xB0, "Retract now."),
    Realtime("stop", 0x9E, "Switch the discharge off; only in a hold and at rest (spindle stop of "
             "grbl)."),
    Realtime("cancel", 0x85, "End a jog: slow down, and forget the jogs that wait."),
)

# grbl's safety door. Here it is a feed hold, like `!`.
DOOR = 0x84


@dataclass(frozen=True)
class Override:
    """A real-time byte that sets an override to a value or changes it by an amount, in percent."""

    byte: int
    of: str     # a key of OVERRIDES
    to: int | None
    by: int

    @property
    def doc(self) -> str:
        """Its effect, in words."""
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
# the others, so that a line is not damaged if one of them comes in the middle of it.
PASSED_OVER = {
    0x98: "grbl gives it no meaning",
    **{byte: "changes the spindle's speed in grbl; discharge pulses have none"
       for byte in range(0x99, 0x9E)},
    0x9F: "grbl gives it no meaning",
    0xA0: "switches the fluid on and off in grbl; here only M08 and M09 do, so that no byte can "
          "stop the fluid during the discharge",
    0xA1: "switches the mist on and off in grbl; there is none",
}

# Marks in the receive queue, by their numbers. A mark stands where something other than a good byte
# came.
MARKS = (
    ("framing", "a byte came without its stop bit"),
    ("overrun", "bytes came when the queue was full"),
    ("reset", "Ctrl-X came, and the queue was cleared"),
)

FRAME_START = 0x02
FRAME_END = 0x03
FRAME_ESCAPE = 0x10     # the next byte was sent with the bits of FRAME_FLIP turned over
FRAME_FLIP = 0x40
# Bytes that must be escaped within a frame: start, end and escape, the real-time bytes in ASCII,
# and the whole range in which all other real-time bytes lie, including future ones.
STUFFED = frozenset({FRAME_START, FRAME_END, FRAME_ESCAPE, *range(0x80, 0xC0),
                     *(realtime.byte for realtime in REALTIME)})

# How overrides act on each kind of motion: the motion, the override that scales it, a remark.
FEEDS = (
    ("G01, G02, G03 under G94", "feed",
     "up to the highest speed of the settings, and on an arc up to what its radius allows"),
    ("G00, G28, G30", "rapid", "also between cuts under G95"),
    ("G95 P1", "", "a step is made at F; the counted pulses decide how often"),
    ("G95 P2", "", "the mean voltage sets the speed, up to F"),
    ("G95 P3, P4, P5", "", "the mean voltage, or Es/Ex, sets the speed around F; the feed mode "
     "would only compensate an override"),
    ("retraction, re-advance", "", "the speeds of G36 always hold: they save the electrode"),
    ("jump", "", "the speeds of G38 always hold"),
    ("jog (`$J=`)", "", "the F of its line always holds, as in grbl"),
    ("off a limit switch", "feed or rapid", "never above the creep speed of the build"),
)

_MARKS = "; ".join(f"{number} `{name}`, {doc}" for number, (name, doc) in enumerate(MARKS))

LINK = Block(name="link", base=0x100, doc="Bytes to and from the host; see "
             "``softcore.link_decoder``.", registers=_registers(
    ("receive", "Oldest entry of the receive queue. Reading takes it.", (
        Field(name="data", bits=8, access="r", doc=f"The byte, or the mark's number: {_MARKS}."),
        Field(name="mark", bits=1, access="r", doc="The entry is a mark, not a byte."),
        Field(name="valid", bits=1, access="r", doc="There was an entry.")), "read"),
    ("transmit", "Send a byte. Lost if the transmitter is not ready.",
     _value(8, "The byte.", access="w"), "write"),
    ("status", "State of the link.", (
        Field(name="ready", bits=1, access="r", doc="The transmit queue has room for a byte."),
        Field(name="hold", bits=1, access="r", doc="A `!` holds the feed."),
        Field(name="reset", bits=1, access="r",
              doc="Ctrl-X stops motion and discharge until the firmware has carried it out."))),
    ("notes", "Real-time bytes that came since the last read. Reading clears them.", tuple(
        Field(name=realtime.name, bits=1, access="r", doc=realtime.doc)
        for realtime in REALTIME if realtime.name != "reset"), "read"),
    ("release", "End the effect of a real-time byte, unless the byte has come again and the "
     "firmware has not seen that yet.", (
        Field(name="hold", bits=1, access="w", doc="The feed may go on."),
        Field(name="reset", bits=1, access="w", doc="The reset has been carried out."),
        Field(name="override", bits=1, access="w", doc="Overrides back to 100 %.")), "write"),
    ("override", "Overrides as set by their real-time bytes.", (
        Field(name="feed", bits=8, access="r", unit="%", doc="Of the constant feed."),
        Field(name="rapid", bits=7, access="r", unit="%", doc="Of rapids."))),
    ("waiting", "Length of the receive queue.",
     _value(9, "Entries.", access="r", unit="entry")),
))
