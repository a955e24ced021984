# Generated from softcore/tables/events.py by `python -m softcore.generate`; do not edit.
"""Events: their kinds and details, and the structures that hold one."""

from amaranth import *
from amaranth.lib import data, enum

__all__ = ["Cause", "Event", "Halt", "Happened", "Phase", "Queued", "Reason"]


class Event(enum.Enum, shape=8):
    """Kinds of events."""

    NONE = 0
    # Detail: cause; first: latency in clocks; second: rate before.
    RETRACTION_START = 1
    # Detail: reason; first: pulses of the plateau; second: its clocks.
    RETRACTION_END = 2
    # Detail: phase; first: distance to the start point; second: distance where the phase ends.
    READVANCE = 3
    RESUME = 4
    # Detail: halt.
    HALT = 5
    SEGMENT = 6
    # Detail: number of the first cause; first: axes that raised it.
    TRIP = 7
    # Detail: class; first: faults, class measured (bits 4, 5); second: level.
    FLUID_CLASS = 8
    # Detail: number of switches by depth; first: position of the jump axis.
    CONDITION = 9
    # first: axes whose index came.
    INDEX = 10


class Cause(enum.Enum, shape=8):
    """Why a retraction starts."""

    NONE = 0
    # A short.
    SHORT = 1
    # A periodic jump (G38).
    JUMP = 2
    # The operator's order.
    OPERATOR = 3


class Reason(enum.Enum, shape=8):
    """Why a retraction ends."""

    NONE = 0
    # The short is over.
    CLEARED = 1
    # The retractable limit or the back limit was reached.
    LIMIT = 2
    # The start of the path was reached.
    PATH_START = 3


class Phase(enum.Enum, shape=8):
    """How a re-advance goes."""

    NONE = 0
    # At speed H, to the changeover.
    HIGH = 1
    # At speed E, to BS.
    LOW = 2


class Halt(enum.Enum, shape=8):
    """Why the machine halts."""

    NONE = 0
    # Still short at the retractable limit.
    LIMIT = 1
    # Still short at the back limit.
    BACK_LIMIT = 2
    # Too many shorts in a short burst.
    BURST = 3
    # A short, and no retraction data in force.
    NO_DATA = 4
    # The servo wants to go back further than a retraction may.
    SERVO = 5
    # Contact with the discharge off.
    CONTACT = 6


class Happened(data.Struct):
    """An event as its source tells it; ``cycle`` is the clock when it happened."""

    kind: Event
    detail: 8
    cycle: 32
    first: 32
    second: 32


class Queued(data.Struct):
    """An event as the firmware gets it: with the machine's place on the path."""

    kind: Event
    detail: 8
    slot: 8
    cycle: 32
    path: signed(32)
    first: 32
    second: 32
