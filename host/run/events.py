# SPDX-License-Identifier: Apache-2.0
"""Events of a run: the controller's event lines, and the objects of ``events.jsonl``.

The controller sends ``[E:word,cycle,line,x,y,z,arguments...]``, all decimal: clocks since reset,
the tape block being executed, encoder positions in pulses in the program's frame, distances in
pulses and speeds in micrometres a minute. A file holds millimetres, mm/min and seconds. Which
events there are, and with which arguments, stands in ``softcore.tables.events``.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from host.errors import UserError
from host.run import cell
from softcore.tables import events as table

# An event of a run, as ``events.jsonl`` has it: values by name.
Event = dict[str, Any]

AXES = "xyz"
UM_PER_MM = 1000

_LINE = re.compile(r"\[E:(\w+),(.*)\]")


class EventError(UserError):
    """The controller sent an event line that makes no sense."""


@dataclass(frozen=True)
class Scale:
    """Converts the controller's numbers into a user's.

    ``source`` gives the line of the source text for the number of a tape block. ``told`` adds that
    line to a sentence of the controller.
    """

    clock_hz: int
    pulses_per_mm: int = 10_000
    source: Callable[[int], int] = int
    told: Callable[[str], str] = str

    def mm(self, pulses: str) -> float:
        """Millimetres of a distance or position."""
        return int(pulses) / self.pulses_per_mm

    def line(self, block: int) -> int:
        """Line of the source for a tape block; 0 for anything else."""
        return self.source(block) if block > 0 else 0


def _speed(um_per_min: str) -> float:
    return int(um_per_min) / UM_PER_MM


def _milli(text: str) -> int | float:
    whole, remainder = divmod(int(text), 1000)
    return whole + remainder / 1000 if remainder else whole


# Functions from a value of the line to that of the file, by the kind of the field.
_VALUES: dict[str, Callable[[Scale, str], Any]] = {
    "count": lambda scale, text: int(text),
    "milli": lambda scale, text: _milli(text),
    "mm": lambda scale, text: scale.mm(text),
    "length": lambda scale, text: scale.mm(text),
    "mm_or_none": lambda scale, text: None if text == "-" else scale.mm(text),
    "speed": lambda scale, text: _speed(text),
    "speed_or_none": lambda scale, text: None if text == "-" else _speed(text),
    "letter": lambda scale, text: text,
    "text": lambda scale, text: text,
    "resistivity": lambda scale, text: cell.resistivity(int(text)),
}


def _value(field: table.Field, scale: Scale, text: str) -> Any:
    if field.kind == "choice":
        return {choice.letter: choice.name for choice in field.choices}[text]
    return _VALUES[field.kind](scale, text)


def _read(kind: table.Event, scale: Scale, rest: str | None) -> Event:
    """Values of an event, from the part of the line behind its place."""
    fields = [field for field in kind.fields if field.kind != "by"]
    # The last field may be a text with commas.
    given = rest.split(",", max(0, len(fields) - 1)) if rest else []
    if not sum(not field.optional for field in fields) <= len(given) <= len(fields):
        raise ValueError(rest)
    event: Event = {"event": kind.name}
    left = list(given)
    for field in kind.fields:
        if field.kind == "by":
            event[field.name] = "series" if left else "program"
            continue
        if not left and field.kind != "text":
            continue
        text = left.pop(0) if left else ""
        if field.filed and (not field.only or field.only in event.values()):
            *place, name = field.name.split(".")
            holder = event
            for part in place:
                holder = holder.setdefault(part, {})
            holder[name] = _value(field, scale, text)
    if kind.name == "alarm":
        event["text"] = scale.told(event["text"])
    return event


def is_event(line: str) -> bool:
    """Whether a line of the controller is an event line."""
    return line.startswith("[E:")


def block_of(line: str) -> int:
    """Block of the tape that an event line belongs to, counted from 1; 0 for a line by hand."""
    return int(line.split(",")[2])


def parse(line: str, scale: Scale, kinds: Sequence[table.Event] = table.EVENTS) -> Event:
    """Read an event line, one of ``kinds``.

    Raises
    ------
    EventError
        If its name, the number of its fields or a field is wrong.
    """
    match = _LINE.fullmatch(line)
    try:
        if match is None:
            raise ValueError(line)
        word, rest = match.groups()
        kind = next(one for one in kinds if one.word == word)
        cycle, block, x, y, z, *given = rest.split(",", 5)
        event: Event = {
            "cycle": int(cycle), "t": round(int(cycle) / scale.clock_hz, 9), "event": "",
            "line": scale.line(int(block)),
            "pos": {axis: scale.mm(p) for axis, p in zip(AXES, (x, y, z), strict=True)}}
        event.update(_read(kind, scale, given[0] if given else None))
    except (KeyError, StopIteration, ValueError) as error:
        raise EventError(f"the controller sent an event that cannot be read: {line!r}.") from error
    return event
