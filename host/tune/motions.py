# SPDX-License-Identifier: Apache-2.0
"""Small motions with the discharge off, and the samples of them.

A status report has an axis's place by its coder and its following error; their sum is where the
command was in that moment. At an even speed this is a clock: the report needs no stamp, and a slow
link does no harm. No setting is changed for good; some are different while the axes move.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Protocol

from host.alarms import refusal
from host.errors import UserError
from host.link.link import ANSWER_TIMEOUT_S, HOLD, RESET, BytePipe, RefusedError, Sent
from host.tune.drive import RESTING, Sample
from softcore.tables.settings import PULSES_PER_MM, assign, named

__all__ = ["AXES", "CORNERS", "FASTEST_MM_S", "LATE_S", "LEGS", "SLOW", "TURNS", "WINDOW",
           "Controlled", "TuneError", "meanwhile", "measuring", "model_lag", "sampled",
           "settings_of", "speed_of"]

AXES = "XYZ"
FASTEST_MM_S = 10.0
PAIRS = 4                   # motions there and back
SLOW_PAIRS, SLOW = 1, 4     # those at a speed that is so many times slower
TURNS, LEGS = 4, 4          # motions that turn without a stop, and the parts of each
UNSURE_S = 2e-3             # after a turn, in which a report may name the leg that comes
LATE_S = 0.03               # before a turn: a report may name the leg before for so long
SPREAD_S = 0.02             # over which the first reports of the motions are spread
MOTION_S = 10.0             # beyond twice its time, after which a motion is given up
SETTLED_S = 1.0             # longest wait for an axis to come to rest before a motion
LIST_S, POLL_S = 15.0, 0.05     # of the list of settings
CORNERS, WINDOW, DRY = (named(name) for name in ("corner_deviation_nm", "window",
                                                 "dry_run_mm_min"))
REST_S = 3.0                # longest wait for rest before these are put back


class Controlled(Protocol):
    """What is asked of the controller: the part of ``host.link.link.Link`` that is needed."""

    pipe: BytePipe
    on_line: Callable[[str], None]

    def send_line(self, line: str) -> Sent:
        """Send a line; its answer comes later."""

    def command(self, line: str) -> None:
        """Send a line, and wait until it is taken."""

    def press(self, button: bytes) -> None:
        """Press a button of the operator's."""

    def await_greeting(self) -> None:
        """Wait until it has started."""

    def poll(self, timeout_s: float) -> None:
        """Hear what comes, for so long at most."""

    def status(self) -> dict[str, str]:
        """Fields of a status report, by name."""


class TuneError(UserError):
    """An axis cannot be measured."""


def settings_of(link: Controlled) -> dict[str, int]:
    """The controller's settings by name."""
    inner, found = link.on_line, {}

    def hear(line: str) -> None:
        number, _, value = line.removeprefix("$").partition("=")
        if line.startswith("$") and number.isdecimal() and value.isdecimal():
            found[int(number)] = int(value)
        else:
            inner(line)
    link.on_line = hear
    # The list is long: a slow line takes longer than an answer may.
    sent, end = link.send_line("$$"), link.pipe.time_s() + LIST_S
    try:
        while sent.answer is None and link.pipe.time_s() < end:
            link.poll(POLL_S)
    finally:
        link.on_line = inner
    wanted = ("loop_gain", "feed_forward", "drive_lag_us", CORNERS.name, WINDOW.name, DRY.name,
              "start_speed_um_s", "highest_speed_mm_min", "step_axes", "follow_moving",
              "follow_stopped", "back_acceleration_mm_s2", "acceleration_mm_s2",
              *(f"{name}_{axis.lower()}" for axis in AXES for name in (
                  "highest_speed", "drive_offset", "drive_friction")),
              *(model_lag(axis) for axis in AXES))
    missing = [name for name in wanted if named(name).number not in found]
    if missing:
        raise TuneError(f"the controller does not list its settings {', '.join(missing)}.")
    return {name: found[named(name).number] for name in wanted}


def model_lag(axis: str) -> str:
    """Name of the setting that has the lag of the controller's model of an axis's drive."""
    return f"model_lag_{axis.lower()}_us"


def speed_of(settings: Mapping[str, int], axis: str) -> float:
    """Speed of the motions in mm/s: the machine reaches it at once, without a ramp."""
    bounds = [FASTEST_MM_S, settings["start_speed_um_s"] / 1000,
              settings["highest_speed_mm_min"] / 60]
    own = settings[f"highest_speed_{axis.lower()}"]
    return min([*bounds, own / 60] if own else bounds)


def meanwhile(settings: Mapping[str, int]) -> dict[str, int]:
    """Settings while the axes move.

    The bound of the speed at corners would slow down each turn, and offset and friction may hold an
    axis beside its place.
    """
    return {CORNERS.name: 0, WINDOW.name: max(RESTING, settings[WINDOW.name])}


@contextmanager
def measuring(link: Controlled, settings: Mapping[str, int]) -> Iterator[list[str]]:
    """Settings are as the measurement needs them (``meanwhile``), and what they were after it.

    A window that an axis stands outside of is not put back, as the supervision of its coder would
    trip: a sentence in the list says so then.

    Whatever ends it early holds the machine. What is left of a motion on hold is given up, by a
    reset at rest: the position stays.

    Raises
    ------
    UserError
        If the controller does not take one; the text says what to enter then.
    """
    changed: list[str] = []
    kept: list[str] = []
    moved = ended = False
    try:
        for name, value in meanwhile(settings).items():
            if settings[name] != value:
                changed.append(assign(name, settings[name]))    # it may be taken unanswered
                link.command(assign(name, value))
        moved = True
        yield kept
        ended = True
    except BaseException as error:  # Ctrl-C, too: nobody looks any more at what has been ordered
        if moved:
            link.press(HOLD)
        elif isinstance(error, RefusedError):
            changed.pop()
        raise
    finally:
        _put_back(link, changed, moved=moved, kept=kept if ended else None)


def _put_back(link: Controlled, changed: Sequence[str], *, moved: bool,
              kept: list[str] | None) -> None:
    """Enter the lines ``changed``; at rest, and with nothing left to move, if it has moved.

    With ``kept``, not a window that an axis stands outside of, and say so there.
    """
    away = 0        # pulses
    try:
        if moved:
            end = link.pipe.time_s() + REST_S
            while _moves(told := link.status()) and link.pipe.time_s() < end:
                link.poll(POLL_S)
            if told["state"] == "Hold":
                link.press(RESET)
                link.await_greeting()
            away = max(abs(int(error)) for error in told.get("Er", "0").split(","))
        for line in changed:
            number, value = line[1:].split("=")
            if kept is not None and int(number) == WINDOW.number and away > int(value):
                kept.append(f"an axis stands {away} pulses from its place, so ${number} is left as "
                            "it was while measuring: else the supervision of its coder would trip. "
                            f"Enter {line} once offset and friction are made up for.")
                continue
            link.command(line)
    except UserError as error:
        if not changed:
            raise
        raise TuneError(f"settings are still those of the measurement: enter "
                        f"{' and '.join(changed)}. {str(error)[:1].upper()}{str(error)[1:]}"
                        ) from error


def _moves(told: Mapping[str, str]) -> bool:
    return told["state"] == "Run" or told.get("substate") == "1"


def sampled(link: Controlled, settings: Mapping[str, int], axis: str, way: int,
            travel_mm: float, *, time_s: Callable[[], float]) -> list[Sample]:
    """Move an axis there and back, also slowly; what the status reports say meanwhile.

    Raises
    ------
    LinkError
        If the controller refuses a motion, or does not answer.
    TuneError
        If the axis has a stepping drive, does not come to an end, or does not go at the speed that
        was ordered.
    """
    index = AXES.index(axis)
    if settings[DRY.name]:
        raise TuneError(f"a dry run is on, which sets the speed: enter {assign(DRY.name, 0)}.")
    if settings["step_axes"] >> index & 1:
        raise TuneError(f"axis {axis} is driven by steps: it has no position loop to tune.")
    speed = speed_of(settings, axis)
    samples: list[Sample] = []
    for pairs, pace in ((PAIRS, speed), (SLOW_PAIRS, speed / SLOW)):
        for number in range(2 * pairs):
            samples += _motion(link, index, -way if number % 2 else way, pace, travel_mm, time_s,
                               number / (2 * pairs) * SPREAD_S)
    for number in range(TURNS):
        samples += _turns(link, index, way, speed, travel_mm, time_s, number / TURNS * SPREAD_S,
                          1 + LEGS * number)
    return samples


def _place(told: Mapping[str, str], index: int) -> tuple[float, float]:
    """Command and following error, in mm."""
    error = int(told["Er"].split(",")[index]) / PULSES_PER_MM
    return float(told["MPos"].split(",")[index]) + error, error


def _rested(link: Controlled, index: int, time_s: Callable[[], float]) -> tuple[float, float]:
    """Command and following error, in mm, once the latter stays; or after some time."""
    end, (command, error) = time_s() + SETTLED_S, _place(link.status(), index)
    while time_s() < end:
        link.poll(POLL_S)
        before, (command, error) = error, _place(link.status(), index)
        if abs(error - before) < 1.5 / PULSES_PER_MM:
            break
    return command, error


def _motion(link: Controlled, index: int, sign: int, speed: float, travel_mm: float,
            time_s: Callable[[], float], wait_s: float) -> list[Sample]:
    """Samples of one motion, from ``wait_s`` after its line has been accepted."""
    start, error = _rested(link, index, time_s)
    link.command(_line(index, sign * travel_mm, speed))
    found = [Sample(0.0, error, sign * speed, rest=error)]
    for told, command, now in _reports(link, index, time_s, wait_s, travel_mm / speed):
        gone = (command - start) * sign
        if 0 < gone < travel_mm - 1 / PULSES_PER_MM:
            found.append(Sample(gone / speed, now, sign * speed, rest=error))
        elif told["state"] == "Idle":
            break
    return found


def _turns(link: Controlled, index: int, sign: int, speed: float, travel_mm: float,
           time_s: Callable[[], float], wait_s: float, first: int) -> list[Sample]:
    """Samples after the turns of a motion to and fro, in which the axis does not stop.

    At a turn the speed changes by twice its amount, which no start from rest can do. The reports
    name the part of the motion by the number of its line, ``first`` and those that follow. That may
    be earlier than the place by the time that the firmware takes to hear of a block, so what could
    be of the next part is left out. There are no samples if the lines came so late that the axis
    may have stopped between them.

    The lines name places of the machine: one that is refused leads nowhere else.
    """
    start, _ = _place(link.status(), index)
    lines = [_place_line(index, start + (0 if leg % 2 else sign * travel_mm), speed, first + leg)
             for leg in range(LEGS)]
    link.command(lines[0])
    # The others at once, so that an answer that takes long costs its time only twice.
    sent = [link.send_line(line) for line in lines[1:-1]]
    link.command(lines[-1])
    then = link.status()
    _taken(link, sent)
    # Before its end, by so much that no later part can be under way yet.
    in_time = (int(then["Ln"]) not in range(first + 1, first + LEGS)
               and (_place(then, index)[0] - start) * sign < travel_mm - LATE_S * speed)
    found: list[Sample] = []
    long_s = LEGS * travel_mm / speed
    for told, command, error in _reports(link, index, time_s, wait_s, long_s):
        gone, leg = (command - start) * sign, int(told["Ln"]) - first
        if told["state"] == "Idle":
            return found if in_time else []
        if leg % 2:
            gone = travel_mm - gone
        if 0 < leg < LEGS and UNSURE_S < gone / speed < travel_mm / speed - LATE_S:
            moved = sign * speed * (1 - leg % 2 * 2)
            found.append(Sample(gone / speed, error, moved, before=-moved))
    return found


def _taken(link: Controlled, sent: Sequence[Sent]) -> None:
    """Wait until lines have been answered; an answer that was lost comes again."""
    end = link.pipe.time_s() + ANSWER_TIMEOUT_S
    while any(one.answer is None for one in sent) and link.pipe.time_s() < end:
        link.poll(POLL_S)
    for one in sent:
        if one.answer is None:
            raise TuneError(f'the controller does not answer to "{one.text}".')
        if one.answer != "ok":
            raise RefusedError(one.text, refusal(int(one.answer.removeprefix("error:")))
                               if one.answer.startswith("error:") else one.answer)


def _line(index: int, way_mm: float, speed: float) -> str:
    """A straight line along an axis."""
    return f"G21 G91 G94 G01 {AXES[index]}{way_mm:.4f} F{60 * speed:g}"


def _place_line(index: int, place_mm: float, speed: float, number: int) -> str:
    """A straight line to a place of the machine."""
    return f"N{number} G53 G21 G90 G94 G01 {AXES[index]}{place_mm:.4f} F{60 * speed:g}"


def _reports(link: Controlled, index: int, time_s: Callable[[], float], wait_s: float,
             long_s: float) -> Iterator[tuple[Mapping[str, str], float, float]]:
    """Reports of a motion of ``long_s``: each as told, with command and following error in mm.

    A motion that does not end is held.
    """
    first = time_s() + wait_s
    while (left := first - time_s()) > 0:
        link.poll(left)
    end = time_s() + 2 * long_s + MOTION_S
    while True:
        told = link.status()
        if told["state"] == "Alarm":
            raise TuneError(f"axis {AXES[index]}: an alarm came while it moved.")
        if told["state"] == "Hold":
            raise TuneError(f"axis {AXES[index]}: it was held while it moved.")
        if (share := told.get("Ov", "100").partition(",")[0]) != "100":
            raise TuneError(f"axis {AXES[index]}: the override of the feed is {share} %; it must "
                            "be 100 %.")
        if time_s() > end:
            link.press(HOLD)
            raise TuneError(f"axis {AXES[index]}: its motion has not ended within "
                            f"{2 * long_s + MOTION_S:.0f} s, and is held now.")
        yield told, *_place(told, index)
