# SPDX-License-Identifier: Apache-2.0
"""One tape on one machine: set it up as an operator would, feed the tape, watch what happens.

The order is an operator's: unlock, set the controller's parameters, declare where Z 0 is, enter the
defaults by hand (MDI), start the tape. All time is the machine's, so that the same seed gives the
same run whatever the computer is doing.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from host import alarms
from host.errors import ALARM, DONE, REJECTED, UsageError
from host.link.link import (
    HOLD,
    POLL_S,
    RESUME,
    STATUS,
    BytePipe,
    Link,
    LinkError,
    RefusedError,
    held_by,
)
from host.machines.machine import Machine
from host.run import events
from host.run.events import Event
from host.tape.tape import Tape

ALIVE_S = 1.0      # how long the controller may say nothing before it is asked for its status,
ASKED = 3          # so often: a byte may get lost
SETTLE_S = 1.0     # longest wait for the axes to come to rest after the end
AT_REST_PULSES = 1

STATUS_OF = {"end": DONE, "stopped": DONE, "alarm": ALARM, "rejected": REJECTED}


class Simulated(BytePipe, Protocol):
    """A simulated machine: a pipe with a clock, and what no real machine would tell."""

    clock_hz: int

    @property
    def cycle(self) -> int:
        """Clocks since reset."""

    def press_arm(self) -> None:
        """Press the button ``arm`` as a person would, and let the contactor close."""

    def positions(self) -> dict[str, int]:
        """Encoder positions by axis, in pulses from where the machine was switched on."""

    def errors(self) -> dict[str, int]:
        """Error counters by axis, in pulses."""

    def discharges(self) -> dict[str, int]:
        """Discharge pulses so far, by class: open, ok, dame, short."""

    def front(self) -> int:
        """Furthest path coordinate commanded, in pulses; a tape begins at 0."""

    def mean_voltage(self) -> float:
        """Mean of the gap voltage that the feed law went by last, V; 0 before the first."""


@dataclass
class Run:
    """A tape running on a machine.

    ``mdi`` are lines entered by hand before the tape. ``until_s`` of the machine's time ends it
    early: the feed is held at the first poll from then on.

    After ``execute``: ``outcome`` (end, alarm, rejected, stopped), ``alarm`` (code and text, or
    None), ``events``, ``guards_off`` (what settings have switched off of what guards the machine),
    and ``offset``: program zero at the start of the tape, in the machine's frame
    by axis, in millimetres. A G92 of the tape does not change it; events are told in the frame that
    is in force when they happen.
    ``watch`` is called now and then with the run, to show how far it is.
    """

    machine: Machine
    tape: Tape
    simulation: Simulated
    mdi: list[str] = field(default_factory=list)
    until_s: float | None = None
    watch: Callable[["Run"], None] = lambda run: None
    events: list[Event] = field(default_factory=list)
    outcome: str | None = None
    alarm: dict[str, Any] | None = None
    guards_off: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.scale = events.Scale(self.simulation.clock_hz, self.machine.pulses_per_mm,
                                  self.tape.shift)
        self.link = Link(self.simulation, self._hear)
        self._message = ""
        self._heard_s = 0.0
        self._asked = 0
        self._began = False
        # Program zero is the workpiece's.
        self.offset = {axis: 0.0 - place for axis, place in self.machine.start_mm.items()}

    def execute(self) -> str:
        """Run the tape to its end; return the outcome.

        Raises
        ------
        UsageError
            If the controller refuses a setting or a line entered by hand.
        LinkError
            If it falls silent.
        """
        self._set_up()
        self._began = True
        if self.link.send_tape(self.tape.rows, self._over):
            while not self._over():
                self.link.poll(POLL_S)
        if self.outcome is None:
            self.outcome = "stopped"
            self.link.press(HOLD)
        self._come_to_rest()
        return self.outcome

    def _set_up(self) -> None:
        self.link.await_greeting()
        self.link.command("$X")
        self.simulation.press_arm()
        self.link.command("$POSITION=HERE")
        for number, value in self.machine.settings.items():
            self._enter(f"${number}={value}", f"machine {self.machine.name}: settings.{number}")
        x, y, z = (f"{place:.4f}" if place else "0" for place in self.machine.start_mm.values())
        self.link.command(f"G92 X{x} Y{y} Z{z}")
        for line in self.mdi:
            self._enter(line.upper(), f'the line "{line}" entered by hand')
        status = self.link.status()
        self.guards_off = [name for name in status.get("Off", "").split(",") if name]
        if self.mdi:  # one of them may have declared another zero
            places = status["WCO"].split(",")
            self.offset = dict(zip(events.AXES, map(float, places), strict=True))

    def _enter(self, line: str, name: str) -> None:
        try:
            self.link.command(line)
        except RefusedError as error:
            raise UsageError(f"{name} is refused by the controller: {error.reason}") from error

    def _over(self) -> bool:
        """Whether the run is over; on the way, see that machine and controller are well."""
        now = self.simulation.time_s()
        if now - self._heard_s > ALIVE_S:
            if self._asked == ASKED:
                raise LinkError("the controller has fallen silent.")
            self._asked, self._heard_s = self._asked + 1, now
            self.link.realtime(STATUS)
        self.watch(self)
        return self.outcome is not None or (self.until_s is not None and now >= self.until_s)

    def _hear(self, line: str) -> None:
        self._heard_s, self._asked = self.simulation.time_s(), 0
        if events.is_event(line):
            self._note(events.parse(line, self.scale))
        elif line.startswith("[MSG:"):
            self._message = line[5:-1]
        elif held := held_by(line):
            self._note(self._alarm(*held))
        elif line.startswith("ALARM:"):
            code = int(line[6:])
            self._note(self._alarm(code, self._message or alarms.sentence(code)))
        elif line.startswith("Gapkeeper") and self._began:
            raise LinkError("the controller has started anew in the middle of the run.")

    def _alarm(self, code: int, text: str) -> Event:
        """An alarm of which there is no event: when and where it was heard."""
        places = self.simulation.positions().items()
        return {
            "cycle": self.simulation.cycle, "t": round(self._heard_s, 9), "event": "alarm",
            "line": self.events[-1]["line"] if self.events else 0,
            "pos": {axis: round(place / self.machine.pulses_per_mm - self.offset[axis], 6)
                    for axis, place in places},
            "code": code, "text": text}

    def _note(self, event: Event) -> None:
        if event["event"] == "pause":  # M00: there is nobody else to press the button
            self.link.press(RESUME)
            return
        if self.outcome is not None:
            return  # what follows the end is not the program's
        self.events.append(event)
        if event["event"] == "program_end":
            self.outcome = "end"
        elif event["event"] == "alarm":
            self.alarm = {"code": event["code"], "text": event["text"]}
            # What the tape did wrong before a block of it moved an axis rejects it; what the
            # machine did wrong is an alarm of the machine at any time. The path tells: encoders
            # tremble at rest, and a block's event may be that of a motion to where the machine is.
            rejected = not alarms.of_machine(event["code"]) and not self.simulation.front()
            self.outcome = "rejected" if rejected else "alarm"

    def _come_to_rest(self) -> None:
        end = self.simulation.time_s() + SETTLE_S
        while (any(abs(error) > AT_REST_PULSES for error in self.simulation.errors().values())
               and self.simulation.time_s() < end):
            self.link.poll(POLL_S)


def write_events(run_events: list[Event], path: Path) -> None:
    """Write ``events.jsonl``: one object a line."""
    path.write_text("".join(json.dumps(event) + "\n" for event in run_events), encoding="utf-8")


def count_retractions(run_events: list[Event]) -> dict[str, int]:
    """Number of retractions, and by cause."""
    causes = [event["cause"] for event in run_events if event["event"] == "retraction_start"]
    return {"count": len(causes)} | {cause: causes.count(cause)
                                     for cause in ("short", "jump", "operator")}


