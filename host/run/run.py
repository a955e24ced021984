# SPDX-License-Identifier: Apache-2.0
"""One tape on one machine: set it up as an operator would, feed the tape, watch what happens.

The order is an operator's: unlock, set the controller's parameters, declare where Z 0 is, enter the
defaults by hand (MDI), start the tape. A run on a simulated machine uses the machine's time: the
same seed gives the same run whatever the computer is doing. A run on a controller at a port uses
the computer's time.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from host import alarms
from host.errors import ALARM, DONE, REJECTED, UsageError, UserError
from host.link.link import (
    GREETING,
    HOLD,
    POLL_S,
    RESET,
    RESUME,
    STATUS,
    BytePipe,
    Link,
    LinkError,
    RefusedError,
    Sent,
    held_by,
)
from host.machines.machine import Machine
from host.run import events
from host.run.controller import SAMPLE_S, Controller
from host.run.events import Event
from host.scope.acquire import Acquisition
from host.tape.start import STARTS_AT
from host.tape.tape import Tape

ALIVE_S = 1.0      # longest silence of the controller before it is asked for its status,
ASKED = 3          # so many times: a byte may get lost
SCOPE_S = 5.0      # longest wait for the rest of a record of the oscilloscope
SETTLE_S = 1.0     # longest wait for the axes to come to rest after the end
AT_REST_PULSES = 1
ZERO_MM = 2e-4     # by which program zero may differ from where it was: the report's last digit

VOLTAGE = "voltage"  # what tells a short unless the status says otherwise

STATUS_OF = {"end": DONE, "stopped": DONE, "alarm": ALARM, "rejected": REJECTED}


class Simulated(BytePipe, Protocol):
    """A simulated machine: a pipe with a clock, and values that no real machine gives."""

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

    def measured_share(self) -> float:
        """Ex that G95 P5 measured last: share of the time with discharge, at the feed F."""

    def mean_voltage(self) -> float:
        """Mean gap voltage that the feed mode used last, V; 0 before the first."""


@dataclass
class Run:
    """A tape running on a machine.

    ``simulation`` is a simulated machine, or a controller at a port. ``mdi`` are lines entered by
    hand before the tape. ``until_s`` of the machine's time ends the run early: the feed is held at
    the next poll. ``interrupt`` does the same. ``at_start`` declares that the machine stands at the
    start of its file; without it both position and program zero must have been declared. With
    ``arm`` the run waits until the discharge is armed. With ``from_block`` the tape begins at this
    block, counted from 1: those before it are reckoned only, and the machine stops before it goes
    there. With ``from_record`` the controller itself is asked where the tape was interrupted, and
    ``from_block`` is the block that it has told; if it does not know, ``from_block`` counts as it
    was given. ``zero`` is where program zero must be at the start, as ``offset``, if that is known.
    ``at_block`` is called with the number of every block that begins. ``goes_on`` is called at this
    stop, and at a programmed one, until it returns True; it is given what the controller asks for,
    or nothing at M00 and M01. ``say`` gets what a user should know. ``watch`` is called now and
    then with the run, to show its progress. ``scope`` is a record of the gap oscilloscope, which is
    armed as the tape starts; ``scope_failed`` says why there is none.

    After ``execute``: ``outcome`` (end, alarm, rejected, stopped), ``alarm`` (code and text, or
    None), ``events``, ``guards_off`` (guards of the machine that settings have switched off),
    ``short_by`` (what tells a short: voltage, current, mean or "mean,current"), and ``offset``:
    program zero at the start of the tape, in the machine's frame, in millimetres by axis. A G92 of
    the tape does not change ``offset``. Events are in the frame that is in force when they happen.
    """

    machine: Machine
    tape: Tape
    simulation: Simulated | Controller
    mdi: list[str] = field(default_factory=list)
    until_s: float | None = None
    at_start: bool = True
    arm: bool = True
    from_block: int = 0
    from_record: bool = False
    zero: dict[str, float] = field(default_factory=dict)
    at_block: Callable[[int], None] = lambda block: None
    goes_on: Callable[[str], bool] = lambda asked: True
    say: Callable[[str], None] = lambda text: None
    watch: Callable[["Run"], None] = lambda run: None
    scope: Acquisition | None = None
    events: list[Event] = field(default_factory=list)
    outcome: str | None = None
    alarm: dict[str, Any] | None = None
    guards_off: list[str] = field(default_factory=list)
    short_by: str = VOLTAGE

    def __post_init__(self) -> None:
        self.scale = events.Scale(self.simulation.clock_hz, self.machine.pulses_per_mm,
                                  self.tape.line, self.tape.told)
        self.link = Link(self.simulation, self._hear)
        self._message = self._asks = ""
        self._heard_s = 0.0
        self._asked = 0
        self._sampled_s = 0.0
        self._interrupted = self._paused = False
        self._scope_sent: Sent | None = None
        self.scope_failed = ""
        self._heard_at: list[tuple[float, float]] = []  # for each event: time heard, its own time
        self.began = False      # the tape has been begun
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
        try:
            self.set_up()
        except UsageError:
            self._leave()
            raise
        self.began = True
        if self.from_block > 1 and not self.from_record:
            self.link.command(f"$FROM={self.from_block}")
        if self.link.send_tape(self.tape.rows, self._over):
            while not self._over():
                self.link.poll(POLL_S)
        if self.outcome is None:
            self.outcome = "stopped"
            self.link.press(HOLD)
        self._come_to_rest()
        self._end_scope()
        self._leave()
        return self.outcome

    def _leave(self) -> None:
        """Leave a controller to whoever comes next.

        The discharge goes off, nothing is left to be resumed, and lines need no number any more.
        """
        if isinstance(self.simulation, Controller):
            self.link.press(RESET)

    def interrupt(self) -> None:
        """End the run soon, as ``until_s`` does; may be called at any time."""
        self._interrupted = True

    def controllers_s(self, heard_s: NDArray[Any]) -> NDArray[Any]:
        """Times at which something was heard, s, converted to the time of the events.

        Between two events the conversion is linear; before the first and after the last the two
        times differ by a constant.
        """
        if not self._heard_at:
            return heard_s
        heard, told = np.array(self._heard_at).T
        found: NDArray[Any] = (np.interp(heard_s, heard, told) + np.minimum(heard_s - heard[0], 0)
                               + np.maximum(heard_s - heard[-1], 0))
        return found

    def set_up(self) -> None:
        """Do what an operator does before the tape; ``execute`` begins with it."""
        self.link.await_greeting()
        self.link.command("$X")
        if isinstance(self.simulation, Controller):
            if self.arm:
                self.simulation.press_arm(self.link.status)
        else:
            self.simulation.press_arm()
        # Before the position: one that changes a drive loses it.
        for number, value in self.machine.settings.items():
            self._enter(f"${number}={value}", f"machine {self.machine.name}: settings.{number}")
        if self.at_start:
            self.link.command("$POSITION=HERE")
        elif "Lost" in self.link.status():
            raise UsageError("the controller does not know where its axes are: give --at-start, or "
                             "--mdi '$POSITION=HERE' if what it counts is true.")
        if self.at_start:
            self.link.command(self.machine.start_line)
        for line in self.mdi:
            self._enter(line.upper(), f'the line "{line}" entered by hand')
        status = self.link.status()
        self.guards_off = [name for name in status.get("Off", "").split(",") if name]
        self.short_by = status.get("Ss", VOLTAGE)
        if self.mdi or not self.at_start:  # a line by hand may have declared another zero
            places = status["WCO"].split(",")
            self.offset = dict(zip(events.AXES, map(float, places), strict=True))
        self._check_zero(status)
        if self.from_record:
            self._ask_record()

    def _ask_record(self) -> None:
        """Let the tape begin where the controller says, or else at ``from_block``."""
        if not self.from_block:
            self._enter("$FROM=LAST", "the tape that is to go on (--from last)")
            return
        try:
            self.link.command("$FROM=LAST")
        except RefusedError as error:   # as after power-off without homing
            self.from_record = False
            self.say(f"the controller does not go on by its own record ({error.reason}): block "
                     f"{self.from_block} counts, of the last run's folder")

    def _check_zero(self, status: dict[str, str]) -> None:
        """Refuse a program zero that is not where it was; tell the line that sets it there."""
        if all(abs(self.offset[axis] - place) <= ZERO_MM for axis, place in self.zero.items()):
            return
        now, then = (" ".join(f"{axis.upper()}{place:.4f}" for axis, place in zero.items())
                     for zero in (self.offset, self.zero))
        stands = zip(self.zero.items(), status["MPos"].split(","), strict=True)
        line = " ".join(f"{axis.upper()}{round(float(place) - zero, 4) + 0.0:.4f}"
                        for (axis, zero), place in stands)
        raise UsageError(f"program zero is at {now} of the machine's frame, and was at {then} when "
                         "the interrupted run began: the tape, a line by hand or power-off has "
                         f"moved it. Where the axes now stand, --mdi 'G92 {line}' sets it there "
                         "again.")

    def _enter(self, line: str, name: str) -> None:
        try:
            self.link.command(line)
        except RefusedError as error:
            raise UsageError(f"{name} is refused by the controller: {error.reason}") from error

    def _over(self) -> bool:
        """Whether the run is over; also checks that the controller still answers."""
        now = self.simulation.time_s()
        if now - self._heard_s > ALIVE_S:
            if self._asked == ASKED:
                raise LinkError("the controller has fallen silent.")
            self._asked, self._heard_s = self._asked + 1, now
            self.link.realtime(STATUS)
        if isinstance(self.simulation, Controller) and now - self._sampled_s >= SAMPLE_S:
            self._sampled_s = now
            self.link.realtime(STATUS)
        if self._paused and self.goes_on(self._asks):
            self._paused = False
            self.link.press(RESUME)
        self._tend_scope()
        self.watch(self)
        return (self.outcome is not None or self._interrupted
                or (self.until_s is not None and now >= self.until_s))

    def _tend_scope(self) -> None:
        """Send the next line to the oscilloscope if the last one has been answered."""
        sent = self._scope_sent
        if self.scope is None or self.scope_failed or (sent is not None and sent.answer is None):
            return
        try:
            if sent is not None:
                self._scope_sent = None
                assert sent.answer is not None
                self.scope.answered(sent.answer, self._message)
            line = self.scope.line(self.simulation.time_s())
        except UserError as error:
            self.scope_failed = str(error)
            return
        if line is not None:
            self._scope_sent = self.link.send_line(line)

    def _end_scope(self) -> None:
        """Read a record that has begun; a trigger that has not come is waited for no longer."""
        if self.scope is None:
            return
        end = self.simulation.time_s() + SCOPE_S
        while (self.scope.record is None and not self.scope_failed
               and self.scope.state in ("triggered", "full") and self.simulation.time_s() < end):
            self._tend_scope()
            self.link.poll(POLL_S)
        if self.scope.record is None and not self.scope_failed:
            self.scope_failed = "the trigger has not come."

    def _hear(self, line: str) -> None:
        self._heard_s, self._asked = self.simulation.time_s(), 0
        if self.scope is not None and self.scope.hear(line):
            return
        if events.is_event(line):
            event = events.parse(line, self.scale)
            if event["event"] == "block" and self.outcome is None and (
                    block := events.block_of(line)):
                self.at_block(block)
            self._heard_at.append((self._heard_s, event["t"]))
            self._note(event)
        elif line.startswith("<"):
            if isinstance(self.simulation, Controller) and line.endswith(">"):
                self.simulation.report(line)
        elif line.startswith("[MSG:"):
            self._message = line[5:-1]
        elif held := held_by(line):
            self._note(self._alarm(*held))
        elif line.startswith("ALARM:"):
            code = int(line[6:])
            self._note(self._alarm(code, self._message or alarms.sentence(code)))
        elif line.startswith(GREETING) and self.began:
            raise LinkError("the controller has started anew in the middle of the run.")

    def _alarm(self, code: int, text: str) -> Event:
        """Event for an alarm that came without one, with the time and place of its hearing."""
        places = self.simulation.positions().items()
        last = self.events[-1] if self.events else {"cycle": 0, "line": 0}
        cycle = self.simulation.cycle
        heard_s = float(self.controllers_s(np.array([self._heard_s]))[0])
        return {
            "cycle": last["cycle"] if cycle is None else cycle,
            "t": round(self._heard_s if cycle is not None else heard_s, 9), "event": "alarm",
            "line": last["line"],
            "pos": {axis: round(place / self.machine.pulses_per_mm - self.offset[axis], 6)
                    for axis, place in places},
            "code": code, "text": text}

    def _note(self, event: Event) -> None:
        if event["event"] == "pause":  # M00
            starts = STARTS_AT.match(self._message)
            self._asks = self._message if starts else ""
            if starts and self.from_record:
                self.from_block = int(starts[1])
            self._message = ""
            self._paused = not self.goes_on(self._asks)
            if not self._paused:
                self.link.press(RESUME)
            return
        if self.outcome is not None:
            return  # events after the end do not belong to the program
        self.events.append(event)
        if event["event"] == "program_end":
            self.outcome = "end"
        elif event["event"] == "alarm":
            self.alarm = {"code": event["code"], "text": event["text"]}
            # A fault of the tape rejects it if no block has moved an axis yet. A fault of the
            # machine is always an alarm. The path tells whether an axis has moved: encoders tremble
            # at rest, and the event of a block may belong to a motion of length 0.
            rejected = not alarms.of_machine(event["code"]) and not self.simulation.front()
            self.outcome = "rejected" if rejected else "alarm"

    def _come_to_rest(self) -> None:
        end = self.simulation.time_s() + SETTLE_S
        while (any(abs(error) > AT_REST_PULSES for error in self.simulation.errors().values())
               and self.simulation.time_s() < end):
            if isinstance(self.simulation, Controller):
                self.link.status()
            self.link.poll(POLL_S)


def write_events(run_events: list[Event], path: Path) -> None:
    """Write ``events.jsonl``: one object a line."""
    path.write_text("".join(json.dumps(event) + "\n" for event in run_events), encoding="utf-8")


def count_retractions(run_events: list[Event]) -> dict[str, int]:
    """Number of retractions, and by cause."""
    causes = [event["cause"] for event in run_events if event["event"] == "retraction_start"]
    return {"count": len(causes)} | {cause: causes.count(cause)
                                     for cause in ("short", "jump", "operator")}


