# SPDX-License-Identifier: Apache-2.0
"""Events of a run: the controller's event lines, and the objects of ``events.jsonl``.

The controller sends ``[E:name,cycle,line,x,y,z,arguments...]``, all decimal: clocks since reset,
the tape block being executed, encoder positions in pulses in the program's frame, distances in
pulses and speeds in micrometres a minute. A file holds millimetres, mm/min and seconds.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from host.errors import UserError
from host.run import cell

# An event of a run, as ``events.jsonl`` has it: values by name.
Event = dict[str, Any]

AXES = "xyz"
UM_PER_MM = 1000

_LINE = re.compile(r"\[E:(\w+),(.*)\]")
_CAUSES = {"s": "short", "j": "jump", "o": "operator"}
_REASONS = {"c": "cleared", "l": "limit", "p": "path_start"}
_PHASES = {"h": "high", "l": "low"}
_SOURCES = {"t": "tape", "m": "mdi"}
_BLOCK_NUMBER = re.compile(r"\b(block|line) (\d+)", re.IGNORECASE)


class EventError(UserError):
    """The controller sent an event line that makes no sense."""


@dataclass(frozen=True)
class Scale:
    """What turns the controller's numbers into a user's.

    ``shift`` is what is added to a tape block's number to get its line in the source text.
    """

    clock_hz: int
    pulses_per_mm: int = 10_000
    shift: int = 0

    def mm(self, pulses: str) -> float:
        """Millimetres of a distance or position."""
        return int(pulses) / self.pulses_per_mm

    def line(self, block: int) -> int:
        """Line of the source of a tape block; 0 for what is no block of the tape."""
        return block + self.shift if block > 0 else 0

    def text(self, sentence: str) -> str:
        """A sentence of the controller, with block numbers of the tape made lines of the source."""
        return _BLOCK_NUMBER.sub(lambda m: f"{m[1]} {self.line(int(m[2]))}", sentence)


def _speed(um_per_min: str) -> float:
    return int(um_per_min) / UM_PER_MM


def _program_start(scale: Scale, program: str = "") -> Event:
    return {"event": "program_start"}


def _block(scale: Scale, text: str = "") -> Event:
    return {"event": "block", "text": text}


def _set(scale: Scale, speed: str, limit: str, high: str, low: str, changeover: str, ceiling: str,
         source: str) -> Event:
    return {"event": "retraction_set", "speed": _speed(speed), "limit": scale.mm(limit),
            "high": _speed(high), "low": _speed(low), "changeover": scale.mm(changeover),
            "ceiling": None if ceiling == "-" else scale.mm(ceiling), "source": _SOURCES[source]}


def _condition(scale: Scale, number: str, milli_ip: str, depth: str | None = None) -> Event:
    ip, rest = divmod(int(milli_ip), 1000)
    told = {"event": "condition", "number": int(number), "ip": ip + rest / 1000 if rest else ip,
            "by": "program" if depth is None else "series"}
    return told if depth is None else told | {"depth": scale.mm(depth)}


def _fluid(scale: Scale, number: str, measured: str, code: str, dame: str, opened: str,
           ok: str) -> Event:
    return {"event": "fluid_class", "class": int(number), "measured": int(measured),
            "resistivity": cell.resistivity(int(code)),
            "presets": {"dame": int(dame), "open": int(opened), "ok": int(ok)}}


def _aux(scale: Scale, letter: str, code: str) -> Event:
    return {"event": "aux", "letter": letter, "code": int(code)}


def _retract(scale: Scale, cause: str, speed: str, latency: str = "0") -> Event:
    event: Event = {"event": "retraction_start", "cause": _CAUSES[cause], "speed": _speed(speed)}
    if cause == "s":
        event["latency_cycles"] = int(latency)
    return event


def _back(scale: Scale, reason: str, distance: str, speed: str, overshoot: str) -> Event:
    return {"event": "retraction_end", "reason": _REASONS[reason], "distance": scale.mm(distance),
            "speed": None if speed == "-" else _speed(speed), "overshoot": scale.mm(overshoot)}


def _advance(scale: Scale, phase: str, begin: str, end: str, speed: str) -> Event:
    return {"event": "readvance", "phase": _PHASES[phase], "from": scale.mm(begin),
            "to": scale.mm(end), "speed": _speed(speed)}


def _resume(scale: Scale) -> Event:
    return {"event": "resume"}


def _alarm(scale: Scale, code: str, text: str) -> Event:
    return {"event": "alarm", "code": int(code), "text": scale.text(text)}


def _pause(scale: Scale) -> Event:
    return {"event": "pause"}


def _end(scale: Scale) -> Event:
    return {"event": "program_end"}


# Name on the line: how its arguments are read, and how many commas divide them at most (the last
# argument of some is a text that may hold more).
_READERS: dict[str, tuple[Callable[..., Event], int]] = {
    "start": (_program_start, 0), "block": (_block, 0), "set": (_set, 6),
    "condition": (_condition, 2), "aux": (_aux, 1), "fluid": (_fluid, 5),
    "retract": (_retract, 2), "back": (_back, 3),
    "advance": (_advance, 3), "resume": (_resume, 0), "alarm": (_alarm, 1), "pause": (_pause, 0),
    "end": (_end, 0),
}


def is_event(line: str) -> bool:
    """Whether a line of the controller is an event line."""
    return line.startswith("[E:")


def parse(line: str, scale: Scale) -> Event:
    """Read an event line.

    Raises
    ------
    EventError
        If its name, the number of its fields or a field is not as agreed.
    """
    match = _LINE.fullmatch(line)
    try:
        if match is None:
            raise ValueError(line)
        name, rest = match.groups()
        reader, commas = _READERS[name]
        cycle, block, x, y, z, *given = rest.split(",", 5)
        arguments = given[0].split(",", commas) if given and given[0] else []
        event: Event = {
            "cycle": int(cycle), "t": round(int(cycle) / scale.clock_hz, 9), "event": "",
            "line": scale.line(int(block)),
            "pos": {axis: scale.mm(p) for axis, p in zip(AXES, (x, y, z), strict=True)}}
        event.update(reader(scale, *arguments))
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise EventError(f"the controller sent an event that cannot be read: {line!r}.") from error
    return event
