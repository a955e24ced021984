# SPDX-License-Identifier: Apache-2.0
"""What the controller has said so far, as the panel shows it."""

import re
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from host import alarms
from host.errors import UserError
from host.link.link import GREETING, fields_of, held_by
from host.run import events
from host.run.events import Event
from host.tape.start import INTERRUPTED, LAST, STARTS_AT
from softcore.tables.conditions import CONDITIONS, IP_MA
from softcore.tables.settings import FIRST, named, of_number

__all__ = ["CLASSES", "MOTION", "STATES", "Heard", "Sample", "condition_words", "on_beginning",
           "sentence"]

CLASSES = ("open", "good", "arc", "short")      # of pulses, in the report's order
KEPT = 4000         # events and places; a tape of an hour has fewer retractions
SAMPLES = 600       # a minute,
SAMPLE_S = 0.08     # with a moment so often, or oftener if the retraction has changed
STATES = {
    "Idle": "at rest, discharge off, nothing left to do",
    "Run": "a program runs, an axis moves, or the discharge is on",
    "Hold:0": "held, at rest; resume goes on",
    "Hold:1": "held; still coming to rest, or retracting",
    "Jog": "an axis moves: as long as its button is pressed, or as a line has told it",
    "Home": "an axis looks for its reference",
    "Alarm": "locked, or the position is not known; nothing moves",
}
MOTION = ("at the front", "coming to rest", "retracting", "at the limit, still short",
          "forward again, fast", "forward again, slowly", "halted")
FEED_MODES = {"1": "servo steps by counted pulses", "2": "speed by the mean gap voltage",
              "3": "constant removal, by the voltage", "4": "constant removal, by the ratio"}
_ASSIGNED = re.compile(r"\$(\d+)=(\d+)")
_CHANGES = re.compile(r"\$(\d|RST=(?!#))")     # lines that change settings
_CAUSES = {"short": "a short", "jump": "a periodic jump", "operator": "the operator's order"}
_REASONS = {"cleared": "the short is over", "limit": "the limit is reached",
            "path_start": "the start of the path is reached"}


@dataclass(frozen=True)
class Sample:
    """A moment: its time in s, and what a status report tells.

    ``volts`` is the mean gap voltage, None if nobody tells it. ``shares`` has the share of each
    class of the ``pulses`` since the moment before. ``place`` is Z in mm, ``feed`` the speed in
    mm/min, and ``motion`` the state of the retraction.
    """

    t: float
    volts: float | None
    shares: tuple[float, ...]
    pulses: int
    place: float
    feed: float
    motion: int


@dataclass
class Heard:
    """Everything heard, from ``hear``; ``scale`` is that of the tape. Places are in mm.

    ``fields`` are those of the last status report. ``trail`` has the places so far in the frame of
    the program, ``record`` every event with its sentence, oldest first. ``settings`` has what is
    known to be in force; if ``unlisted``, the list of settings must be asked for.
    """

    scale: events.Scale
    fields: dict[str, str] = field(default_factory=dict)
    trail: deque[tuple[float, ...]] = field(default_factory=lambda: deque(maxlen=KEPT))
    samples: deque[Sample] = field(default_factory=lambda: deque(maxlen=SAMPLES))
    record: deque[tuple[Event, str]] = field(default_factory=lambda: deque(maxlen=KEPT))
    settings: dict[int, str] = field(default_factory=dict)
    unlisted: bool = False
    retractions: dict[str, int] = field(default_factory=lambda: dict.fromkeys(_CAUSES, 0))
    modal: str = ""             # words of $G
    feed_mode: str = ""         # P of the last G95
    condition: Event | None = None
    line: int = 0               # of the source, of the block under way,
    number: int = 0             # and its number by the controller's messages
    block: str = ""
    alarm: tuple[int, str] | None = None
    message: str = ""           # the controller's last
    ended: str = ""             # "end", "alarm", "stopped" or "": how the program has ended
    starts: int = 0             # times that the controller has greeted
    _counts: list[int] | None = None

    def hear(self, text: str, t: float, volts: float | None = None) -> None:
        """Take a line. ``volts`` is the mean gap voltage, if the line is a status report."""
        if text.startswith("<"):
            self._report(text, t, volts)
        elif events.is_event(text):
            self._event(text)
        elif text.startswith("[MSG:"):
            self.message = text[5:-1]
        elif text.startswith("[GC:"):
            self.modal = text[4:-1]
        elif held := held_by(text):
            self.alarm, self.ended = held, "alarm"
        elif text.startswith("ALARM:"):
            self._alarm(int(text[6:]), "")
        elif text.startswith("$") and "=" in text:
            number, _, value = text[1:].partition("=")
            if number.isdecimal():
                self.settings[int(number)] = value
        elif text.startswith(GREETING):
            self.starts += 1
            self.feed_mode = ""

    def answered(self, line: str, answer: str | None) -> None:
        """Take what the answer to a line, None if it gets none, tells of the settings in force.

        A setting that was taken has the value that it was given. Else nothing is known any more,
        unless the line was refused or changes no setting.
        """
        refused = answer is not None and answer.startswith("error:")
        if line == "$$" and (refused or answer == "ok"):
            self.unlisted = False
        elif _CHANGES.match(line) and not refused:
            given = _ASSIGNED.fullmatch(line)
            if answer == "ok" and given and _is_own(int(given[1]), int(given[2])):
                self.settings = {number: value for number, value in self.settings.items()
                                 if number >= FIRST}    # those of grbl follow from the others
                self.settings[int(given[1])] = str(int(given[2]))
            else:
                self.settings, self.unlisted = {}, True

    @property
    def state(self) -> str:
        """State of grbl, with the number that tells two holds apart."""
        name = self.fields.get("state", "")
        return f"{name}:{self.fields['substate']}" if "substate" in self.fields else name

    @property
    def meaning(self) -> str:
        """What the state means."""
        return STATES.get(self.state, STATES.get(self.fields.get("state", ""), ""))

    @property
    def ending(self) -> str:
        """How the program has ended, and where it may begin again, in a sentence."""
        if self.ended == "end":
            return "the program has ended."
        how = "with an alarm" if self.ended == "alarm" else "by the stop"
        if self.number < 2:
            return f"the program has ended {how}."
        again = f"{self.number} begins that block again"
        return (f'the program has ended {how} in block {self.number}. In "from block", '
                + (f"{again}." if self.dry else f'"{LAST}" goes on where it was left; {again}.'))

    @property
    def dry(self) -> bool:
        """Whether tapes run dry: without discharge, and without being kept as interrupted."""
        return self.settings.get(named("dry_run_mm_min").number, "0") != "0"

    def numbers(self, name: str) -> list[float]:
        """Numbers of a field of the report; empty if it has none."""
        try:
            return [float(number) for number in self.fields[name].split(",")]
        except (KeyError, ValueError):
            return []

    @property
    def place(self) -> tuple[float, ...]:
        """X, Y and Z in the frame of the program."""
        return tuple(place - offset for place, offset in zip(
            self.numbers("MPos"), self.numbers("WCO"), strict=False))

    @property
    def motion(self) -> int:
        """State of the retraction, an index of ``MOTION``."""
        return int((self.numbers("Rt") or [0])[0])

    def _report(self, text: str, t: float, volts: float | None) -> None:
        if not text.endswith(">"):
            return
        self.fields = fields_of(text)
        place, feed, counts = self.place, self.numbers("FS"), self.numbers("Gap")
        if len(place) != 3 or not feed or len(counts) != len(CLASSES):
            return      # damaged on its way: the next report comes soon
        if self.fields["state"] != "Alarm":
            self.alarm = None
        if not self.trail or max(abs(a - b) for a, b in zip(
                place, self.trail[-1], strict=True)) > 0.002:
            self.trail.append(place)
        if self.samples and (t - self.samples[-1].t < SAMPLE_S
                             and self.samples[-1].motion == self.motion):
            return      # a slow simulation reports more often
        whole = [int(count) for count in counts]
        before, self._counts = self._counts or whole, whole
        new = [(now - then) % 2**32 for now, then in zip(whole, before, strict=True)]
        pulses = sum(new)
        shares = tuple(one / pulses if pulses else 0.0 for one in new)
        self.samples.append(Sample(t, volts, shares, pulses, place[2], feed[0], self.motion))

    def _event(self, text: str) -> None:
        try:
            event = events.parse(text, self.scale)
        except UserError as error:
            self.message = str(error)
            return
        name = event["event"]
        if name == "block":
            self.line, self.block = event["line"], event["text"]
            self.number = events.block_of(text)
            for word in event["text"].split():
                if word == "G94":
                    self.feed_mode = ""
                elif word.startswith("P") and "G95" in event["text"].split():
                    self.feed_mode = word[1:]
        elif name == "condition":
            self.condition = event
        elif name == "retraction_start":
            self.retractions[event["cause"]] += 1
        elif name == "program_start":
            self.ended, self.number = "", 0
            self.trail.clear()
        elif name == "program_end":
            self.ended = "end"
        if name == "alarm":
            self._alarm(event["code"], event["text"])
        if name != "block":
            self.record.append((event, sentence(event)))

    def _alarm(self, code: int, text: str) -> None:
        if self.alarm is None or self.alarm[0] != code or text:
            self.alarm = code, text or self.message or alarms.sentence(code)
        self.ended = "alarm"


def _is_own(number: int, value: int) -> bool:
    """Whether a setting is one of ours, with a value in its range."""
    setting = of_number(number)
    return setting is not None and setting.lowest <= value <= setting.highest


def on_beginning(message: str) -> str:
    """Message of the controller on where a tape begins, in the page's words; else nothing."""
    if STARTS_AT.match(message):
        return message.replace(": ~ goes there", ": Resume goes there")
    if interrupted := INTERRUPTED.match(message):
        return (f"{interrupted[0]}: home the axes ($H), choose that tape again, and start it with "
                f'"{LAST}" in "from block".')
    return ""


def condition_words(event: Event | None) -> str:
    """A condition in words: number, current, times."""
    if event is None:
        return "none yet"
    said = f"C{event['number']}: {event['ip']:g} IP ({event['ip'] * IP_MA / 1000:g} A)"
    row = next((one for one in CONDITIONS if one.number == event["number"]), None)
    if row is None:
        return f"{said}, entered by G10"
    pole = "negative" if row.negative else "positive"
    return (f"{said}, on {row.on_us} µs, off {row.off_us} µs, {row.rest_us} µs more after an arc "
            f"or a short, electrode {pole}")


def sentence(event: Event) -> str:
    """An event of the record, in one sentence."""
    told: dict[str, Any] = event
    match event["event"]:
        case "program_start":
            return "The program has begun."
        case "program_end":
            return "The program has ended."
        case "pause":
            return "The program waits: resume goes on."
        case "retraction_start":
            return f"Retraction: {_CAUSES[told['cause']]}."
        case "retraction_end":
            return f"Back {told['distance']:.3f} mm: {_REASONS[told['reason']]}."
        case "readvance":
            return (f"Forward again at {told['speed']:g} mm/min"
                    f"{', the last bit before the start point' * (told['phase'] == 'low')}.")
        case "resume":
            return "At the front again; the feed goes on."
        case "retraction_set":
            return (f"Retraction data: R{told['speed']:g} L{told['limit']:g} H{told['high']:g} "
                    f"E{told['low']:g} Q{told['changeover']:g}.")
        case "condition":
            return f"Condition {condition_words(event)}."
        case "alarm":
            return f"Alarm {told['code']}: {told['text']}"
        case "fluid_class":
            return f"Fluid: class {told['class']}, measured as {told['measured']}."
        case "aux":
            return f"Auxiliary function {told['letter'].upper()}{told['code']}."
    return f"{event['event'].replace('_', ' ').capitalize()}."
