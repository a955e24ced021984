# SPDX-License-Identifier: Apache-2.0
"""Events: what the gateware notices, what the firmware tells, and what a run's file holds.

One table for all, under the names of ``events.jsonl``. ``python -m softcore.generate`` makes the
gateware's numbers (``rtl/events.py``), the firmware's (``hal/event_kinds.h``) and the page
``docs/reference/events.md`` of it; the host's decoder reads it. Plain data: imports nothing from
Amaranth.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

__all__ = ["CAUSES", "EVENTS", "HALTS", "PHASES", "QUEUE", "REASONS", "SOURCES", "TOLD", "Choice",
           "Event", "Field", "named", "numbered"]


@dataclass(frozen=True)
class Choice:
    """One of several words: its number in the gateware, and its letter on the line."""

    number: int
    name: str
    letter: str
    doc: str


def _choices(*rows: tuple[str, str, str]) -> tuple[Choice, ...]:
    """Choices ``(name, letter, doc)``, numbered from 1 on: 0 is none."""
    return tuple(Choice(number, *row) for number, row in enumerate(rows, 1))


CAUSES = _choices(("short", "s", "A short."), ("jump", "j", "A periodic jump (G38)."),
                  ("operator", "o", "The operator's order."))
REASONS = _choices(("cleared", "c", "The short is over."),
                   ("limit", "l", "The retractable limit or the back limit was reached."),
                   ("path_start", "p", "The start of the path was reached."))
PHASES = _choices(("high", "h", "At speed H, to the changeover."),
                  ("low", "l", "At speed E, to BS."))
SOURCES = _choices(("tape", "t", "The program."), ("mdi", "m", "A line entered by hand."))
# Why the gateware halts. The firmware turns it into an alarm, so it needs no letter.
HALTS = _choices(("limit", "", "Still short at the retractable limit."),
                 ("back_limit", "", "Still short at the back limit."),
                 ("burst", "", "Too many shorts in a short burst."),
                 ("no_data", "", "A short, and no retraction data in force."),
                 ("servo", "", "The servo wants to go back further than a retraction may."),
                 ("contact", "", "Contact with the discharge off."))

# How a value stands on the line, and how in the file. ``count``: the same number in both.
# ``milli``: thousandths on the line. ``mm``: pulses on the line, mm in the file. ``speed``: um/min
# on the line, mm/min in the file. ``..._or_none``: `-` on the line, null in the file. ``text``: may
# have commas. ``resistivity``: the converter's code on the line, Ohm cm in the file. ``by``: not on
# the line; in the file ``series`` if a field follows, else ``program``.
Kind = Literal["count", "milli", "mm", "length", "mm_or_none", "speed", "speed_or_none", "letter",
               "choice", "text", "resistivity", "by"]

# Format of each kind on the line, for the firmware's ``text_print``.
FORMATS: dict[str, str] = {
    "count": "%u", "milli": "%u", "mm": "%d", "length": "%u", "mm_or_none": "%s", "speed": "%u",
    "speed_or_none": "%s", "letter": "%c", "choice": "%c", "text": "%s", "resistivity": "%u"}


@dataclass(frozen=True, kw_only=True)
class Field:
    """A value of an event. A dot in its name makes a nested table in the file.

    ``optional``: a line may end before it. ``only``: the file has it only with this choice of the
    event. ``filed``: whether the file has it at all.
    """

    name: str
    kind: Kind
    doc: str
    unit: str = ""
    choices: tuple[Choice, ...] = ()
    optional: bool = False
    only: str = ""
    filed: bool = True


@dataclass(frozen=True, kw_only=True)
class Event:
    """A kind of event.

    ``number`` is its kind in the gateware's queue, 0 if the firmware makes it; ``detail``,
    ``first`` and ``second`` describe the values that the queue holds with it. ``word`` is its name
    on the line, short because the line is slow; ``""`` if there is no line for it. ``filed``:
    ``events.jsonl`` has it.
    """

    name: str
    doc: str
    number: int = 0
    detail: str = ""
    first: str = ""
    second: str = ""
    word: str = ""
    fields: tuple[Field, ...] = ()
    filed: bool = True


def _field(name: str, kind: Kind, doc: str, *, unit: str = "", choices: tuple[Choice, ...] = (),
           optional: bool = False, only: str = "", filed: bool = True) -> Field:
    return Field(name=name, kind=kind, doc=doc, unit=unit, choices=choices, optional=optional,
                 only=only, filed=filed)


# Values of an event in the gateware's queue: number of bits, and whether they are signed. The
# positions of the axes follow.
QUEUE: dict[str, tuple[int, bool]] = {
    "detail": (8, False), "slot": (8, False), "cycle": (32, False), "path": (32, True),
    "first": (32, False), "second": (32, False)}
# Those of them that the source of an event tells. The queue adds the place.
TOLD = ("detail", "cycle", "first", "second")

EVENTS: tuple[Event, ...] = (
    Event(name="program_start", word="start", doc="The program has begun.", fields=(
        _field("program", "count", "Its number, if it has one.", optional=True, filed=False),)),
    Event(name="block", word="block", doc="The machine has entered the first segment of a block, "
          "or has reached a block without motion.", fields=(
        _field("text", "text", "The block.", optional=True),)),
    Event(name="retraction_set", word="set", doc="Retraction data come into force.", fields=(
        _field("speed", "speed", "R.", unit="mm/min"),
        _field("limit", "mm", "L.", unit="mm"),
        _field("high", "speed", "H.", unit="mm/min"),
        _field("low", "speed", "E.", unit="mm/min"),
        _field("changeover", "mm", "Q.", unit="mm"),
        _field("ceiling", "mm_or_none", "Z; null if there is none.", unit="mm"),
        _field("source", "choice", "Their source.", choices=SOURCES))),
    Event(name="retraction_start", number=1, word="retract", doc="A retraction has begun.",
          detail="cause", first="latency in clocks", second="rate before", fields=(
        _field("cause", "choice", "Its cause.", choices=CAUSES),
        _field("speed", "speed", "Speed before the retraction.", unit="mm/min"),
        _field("latency_cycles", "count", "From the sample that completed the short to the last "
               "forward path pulse, at most 65 535; 0 if none followed.",
               unit="clocks", only="short"))),
    Event(name="retraction_end", number=2, word="back", doc="The way back has ended.",
          detail="reason", first="pulses of the plateau", second="its clocks", fields=(
        _field("reason", "choice", "Why it ended.", choices=REASONS),
        _field("distance", "mm", "Commanded path from the first start point.", unit="mm"),
        _field("speed", "speed_or_none", "Speed of the plateau; null if there was none.",
               unit="mm/min"),
        _field("overshoot", "length", "How far the motors ran past the command.", unit="mm"))),
    Event(name="readvance", number=3, word="advance", doc="The re-advance has begun, or has passed "
          "the changeover.", detail="phase", first="distance to the start point",
          second="distance where the phase ends", fields=(
        _field("phase", "choice", "Its phase.", choices=PHASES),
        _field("from", "length", "Distance to the start point.", unit="mm"),
        _field("to", "length", "Distance to the start point where the phase ends.", unit="mm"),
        _field("speed", "speed", "Speed of the phase.", unit="mm/min"))),
    Event(name="resume", number=4, word="resume", doc="The machine is at the front again, and the "
          "feed goes on."),
    Event(name="halt", number=5, doc="The gateware has halted. The firmware tells it as `alarm`.",
          detail="halt", filed=False),
    Event(name="segment", number=6, doc="The machine has entered a segment. The firmware tells it "
          "as `block`.", filed=False),
    Event(name="trip", number=7, doc="The interlock has tripped. The firmware tells it as `alarm`.",
          detail="number of the first cause", first="axes that raised it", filed=False),
    Event(name="fluid_class", number=8, word="fluid", doc="The fluid's class in force or as "
          "measured has changed.", detail="class", first="faults, class measured (bits 4, 5)",
          second="level", fields=(
        _field("class", "count", "The class in force."),
        _field("measured", "count", "The class as measured."),
        _field("resistivity", "resistivity", "As measured.", unit="Ω cm"),
        _field("presets.dame", "count", "Preset of counter 5 in force, arcs and shorts."),
        _field("presets.open", "count", "Preset of counter 6."),
        _field("presets.ok", "count", "Preset of counter 7, good pulses."))),
    Event(name="condition", number=9, word="condition", doc="A machining condition has come into "
          "force.", detail="number of switches by depth",
          first="position of the jump axis", fields=(
        _field("number", "count", "Its number (C)."),
        _field("ip", "milli", "Its current.", unit="IP"),
        _field("by", "by", "`program`, or `series` if a depth of the depth series was reached."),
        _field("depth", "mm", "With `series`: the depth of the switch.", unit="mm",
               optional=True))),
    Event(name="index", number=10, doc="The index of a coder has come, as the firmware has asked "
          "in homing.", first="axes whose index came", filed=False),
    Event(name="aux", word="aux", doc="An auxiliary function has been sent to the machine side.",
          fields=(
        _field("letter", "letter", "M, S or T."),
        _field("code", "count", "Its number."))),
    Event(name="alarm", word="alarm", doc="The machine has stopped; see [alarms](alarms.md).",
          fields=(
        _field("code", "count", "Number of the alarm."),
        _field("text", "text", "The sentence of the alarm, with its place."))),
    Event(name="pause", word="pause",
          doc="M00, M01 if it stops, the end of a block in single block, or the start of a tape at "
          "one of its blocks (`$FROM`). In simulation `run` resumes by itself; at a port Enter "
          "does.", filed=False),
    Event(name="program_end", word="end", doc="The program has ended."),
)


def named(name: str, table: Iterable[Event] = EVENTS) -> Event:
    """Event of a name. ``KeyError`` if there is none."""
    for event in table:
        if event.name == name:
            return event
    raise KeyError(name)


def numbered(table: Iterable[Event] = EVENTS) -> list[Event]:
    """Events of the gateware's queue, by number."""
    return sorted((event for event in table if event.number), key=lambda event: event.number)
