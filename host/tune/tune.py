# SPDX-License-Identifier: Apache-2.0
"""Tuning of the position loops: small motions with the discharge off, and what they tell.

A status report has an axis's place by its coder and its following error; their sum is where the
command was in that moment. At an even speed this is a clock: the report needs no stamp, and a slow
link does no harm. No setting is changed for good; while the axes move, the bound of the speed at
corners is off, as it would slow down each turn.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from host.errors import UserError
from host.link.link import HOLD, RESET, BytePipe, Sent
from host.tune.drive import (
    Drive,
    Fit,
    Loop,
    Sample,
    fitted,
    overshoot,
    phase_margin,
    response,
)
from softcore.tables.settings import PULSES_PER_MM, assign, named

__all__ = ["AXES", "Controlled", "Measured", "Proposal", "TuneError", "corners_unbound",
           "explained", "loop_of", "measured", "proposal", "sampled", "settings_of", "speed_of"]

AXES = "XYZ"
FASTEST_MM_S = 10.0
PAIRS = 4                   # motions there and back
TURNS, LEGS = 4, 4          # motions that turn without a stop, and the parts of each
IN_TIME = 0.9               # of a part, within which the lines of all parts must have been taken
UNSURE_S = 2e-3             # after a turn, in which a report may name the leg that comes
LATE_S = 0.03               # before a turn: a report may name the leg before for so long
SPREAD_S = 0.02             # over which the first reports of the motions are spread
EVEN = 0.6                  # share of a motion after which its speed is taken for even
FEWEST = 5                  # samples of even motion in each direction
MOTION_S = 10.0             # beyond twice its time, after which a motion is given up
LIST_S, POLL_S = 15.0, 0.05     # of the list of settings
MARGIN_DEG = 60.0           # of phase, of the highest gain that is recommended
SHARES = 100, 75, 50, 25, 0     # of feed-forward that are tried, %
BACK = 0.8                  # of the drives' acceleration is proposed for the way back
LAG_MARGIN = 1.2            # of the lag that corners and arcs rest on: the fit is a tenth too low
ERROR_MARGIN = 1.5          # of the bounds of following error over the greatest that is known
REST_PULSES = 20            # of the bound at rest, beside what offset and friction have
DIFFERENT = 0.05            # between axes, above which one gain for all does not do
CORNERS, DRY = named("corner_deviation_nm"), named("dry_run_mm_min")
REST_S = 3.0                # longest wait for rest before the bound at corners is on again
GAIN_ACCEPTED, LAG_ACCEPTED = (0.7, 1.3), (2e-3, 6e-3)  # by the supervision of the coders


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


@dataclass(frozen=True)
class Measured:
    """An axis: its samples, and the drive that explains them."""

    axis: str
    samples: tuple[Sample, ...]
    fit: Fit

    @property
    def drive(self) -> Drive:
        """The drive that was found."""
        return self.fit.drive


@dataclass(frozen=True)
class Proposal:
    """Values of settings by name, and sentences on what they rest on."""

    values: dict[str, int]
    notes: list[str]

    @property
    def loop(self) -> Loop:
        """The loop with these values."""
        return Loop(self.values["loop_gain"], self.values["feed_forward"] / 100)


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
    wanted = ("loop_gain", "feed_forward", "drive_lag_us", CORNERS.name, DRY.name,
              "start_speed_um_s", "highest_speed_mm_min", "step_axes", "follow_moving",
              "follow_stopped", "back_acceleration_mm_s2", "acceleration_mm_s2",
              *(f"highest_speed_{axis.lower()}" for axis in AXES))
    missing = [name for name in wanted if named(name).number not in found]
    if missing:
        raise TuneError(f"the controller does not list its settings {', '.join(missing)}.")
    return {name: found[named(name).number] for name in wanted}


def loop_of(settings: Mapping[str, int]) -> Loop:
    """The loop that is in force."""
    return Loop(settings["loop_gain"], settings["feed_forward"] / 100)


def speed_of(settings: Mapping[str, int], axis: str) -> float:
    """Speed of the motions in mm/s: the machine reaches it at once, without a ramp."""
    bounds = [FASTEST_MM_S, settings["start_speed_um_s"] / 1000,
              settings["highest_speed_mm_min"] / 60]
    own = settings[f"highest_speed_{axis.lower()}"]
    return min([*bounds, own / 60] if own else bounds)


@contextmanager
def corners_unbound(link: Controlled, settings: Mapping[str, int]) -> Iterator[None]:
    """Motions whose speed no corner bounds: ``$540`` is 0 meanwhile, and what it was after.

    Whatever ends it early holds the machine. What is left of a motion on hold is given up, by a
    reset at rest: the position stays.

    Raises
    ------
    UserError
        If the controller does not take it; the text says what to enter then.
    """
    before = assign(CORNERS.name, settings[CORNERS.name])
    link.command(assign(CORNERS.name, 0))
    try:
        yield
    except BaseException:   # Ctrl-C, too: nobody looks any more at what has been ordered
        link.press(HOLD)
        raise
    finally:
        try:
            end = link.pipe.time_s() + REST_S
            while _moves(told := link.status()) and link.pipe.time_s() < end:
                link.poll(POLL_S)
            if told["state"] == "Hold":
                link.press(RESET)
                link.await_greeting()
            link.command(before)
        except UserError as error:
            raise TuneError(f"the bound of the speed at corners is still off: enter {before}. "
                            f"{str(error)[:1].upper()}{str(error)[1:]}") from error


def _moves(told: Mapping[str, str]) -> bool:
    return told["state"] == "Run" or told.get("substate") == "1"


def measured(link: Controlled, settings: Mapping[str, int], axis: str, way: int,
             travel_mm: float, *, time_s: Callable[[], float]) -> Measured:
    """Move an axis there and back, and find its drive.

    Raises
    ------
    LinkError, TuneError
        As ``sampled`` and ``explained``.
    """
    return explained(settings, axis, travel_mm,
                     sampled(link, settings, axis, way, travel_mm, time_s=time_s))


def sampled(link: Controlled, settings: Mapping[str, int], axis: str, way: int,
            travel_mm: float, *, time_s: Callable[[], float]) -> list[Sample]:
    """Move an axis there and back; what the status reports say meanwhile.

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
    for number in range(2 * PAIRS):
        samples += _motion(link, index, -way if number % 2 else way, speed, travel_mm, time_s,
                           number / (2 * PAIRS) * SPREAD_S)
    for number in range(TURNS):
        samples += _turns(link, index, way, speed, travel_mm, time_s, number / TURNS * SPREAD_S)
    return samples


def explained(settings: Mapping[str, int], axis: str, travel_mm: float,
              samples: Sequence[Sample]) -> Measured:
    """The drive that explains samples of an axis; takes some seconds.

    Raises
    ------
    TuneError
        If the samples are too few, or no drive has them.
    """
    after = EVEN * travel_mm / speed_of(settings, axis)
    for up in (True, False):
        if sum(one.time_s >= after and (one.speed > 0) == up for one in samples) < FEWEST:
            raise TuneError(f"axis {axis}: {travel_mm:g} mm are too short for the reports that "
                            "come; give more travel.")
    try:
        return Measured(axis, tuple(samples), fitted(loop_of(settings), samples, after))
    except ValueError as error:
        raise TuneError(f"axis {axis}: {error}.") from error


def _place(told: Mapping[str, str], index: int) -> tuple[float, float]:
    """Command and following error, in mm."""
    error = int(told["Er"].split(",")[index]) / PULSES_PER_MM
    return float(told["MPos"].split(",")[index]) + error, error


def _motion(link: Controlled, index: int, sign: int, speed: float, travel_mm: float,
            time_s: Callable[[], float], wait_s: float) -> list[Sample]:
    """Samples of one motion, from ``wait_s`` after its line has been accepted."""
    start, error = _place(link.status(), index)
    link.command(_line(index, sign * travel_mm, speed))
    found = [Sample(0.0, error, sign * speed)]
    for told, command, now in _reports(link, index, time_s, wait_s, travel_mm / speed):
        gone = (command - start) * sign
        if 0 < gone < travel_mm - 1 / PULSES_PER_MM:
            found.append(Sample(gone / speed, now, sign * speed))
        elif told["state"] == "Idle":
            break
    return found


def _turns(link: Controlled, index: int, sign: int, speed: float, travel_mm: float,
           time_s: Callable[[], float], wait_s: float) -> list[Sample]:
    """Samples after the turns of a motion to and fro, in which the axis does not stop.

    At a turn the speed changes by twice its amount, which no start from rest can do. The reports
    name the part of the motion by the number of its line. That may be earlier than the place by
    the time that the firmware takes to hear of a block, so what could be of the next part is left
    out. There are no samples if the lines came so late that the axis may have stopped between them.
    """
    start, _ = _place(link.status(), index)
    begun = time_s()
    for leg in range(LEGS):
        way = sign * (1 - leg % 2 * 2)
        link.command(_line(index, way * travel_mm, speed, number=leg + 1))
    in_time = time_s() - begun <= IN_TIME * travel_mm / speed
    found: list[Sample] = []
    long_s = LEGS * travel_mm / speed
    for told, command, error in _reports(link, index, time_s, wait_s, long_s):
        gone, leg = (command - start) * sign, int(told["Ln"]) - 1
        if told["state"] == "Idle":
            return found if in_time else []
        if leg % 2:
            gone = travel_mm - gone
        if leg > 0 and UNSURE_S < gone / speed < travel_mm / speed - LATE_S:
            moved = sign * speed * (1 - leg % 2 * 2)
            found.append(Sample(gone / speed, error, moved, before=-moved))
    return found


def _line(index: int, way_mm: float, speed: float, *, number: int | None = None) -> str:
    """A straight line along an axis."""
    name = "" if number is None else f"N{number} "
    return f"{name}G21 G91 G94 G01 {AXES[index]}{way_mm:.4f} F{60 * speed:g}"


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


def proposal(settings: Mapping[str, int], axes: Sequence[Measured]) -> Proposal:
    """Settings for the drives that were measured, all axes together, with their margins."""
    notes: list[str] = []
    if not settings[CORNERS.name]:
        notes.append(f"${CORNERS.number} is 0: nothing bounds the speed at corners. If power or "
                     "the cable failed in a measurement, enter what it was; as delivered it is "
                     f"{CORNERS.default}.")
    gains = {one.axis: settings["loop_gain"] * one.drive.gain for one in axes}
    gain = round(float(np.mean(list(gains.values()))))
    least, most = named("loop_gain").lowest, named("loop_gain").highest
    if gain < least:
        raise TuneError(f"the loops have a gain of {gain} 1/s; $456 takes {least} at least. Raise "
                        "the scale of the velocity command at the amplifiers.")
    if gain > most:
        raise TuneError(f"the loops have a gain of {gain} 1/s; $456 takes {most} at most. Lower "
                        "the scale of the velocity command at the amplifiers.")
    # Beside a loop whose gain is set right, a drive has the gain that its axis differs by.
    drives = {one.axis: replace(one.drive, gain=gains[one.axis] / gain) for one in axes}
    for axis, drive in drives.items():
        if abs(drive.gain - 1) > DIFFERENT:
            notes.append(f"{axis} has {gains[axis]:.1f} 1/s, not {gain}: $456 is for all axes, so "
                         "adjust the scale of the velocity command at its amplifier.")
        if not GAIN_ACCEPTED[0] <= drive.gain <= GAIN_ACCEPTED[1]:
            notes.append(f"{axis}: a gain of {drive.gain:.2f} times the one that is set trips the "
                         "supervision of its coder.")
        late = drive.late_s
        if not LAG_ACCEPTED[0] <= late <= LAG_ACCEPTED[1]:
            notes.append(f"{axis}: its drive is {1000 * late:.1f} ms late; the supervision of the "
                         "coders expects 2 to 6.")
    top = max(FASTEST_MM_S, settings["highest_speed_mm_min"] / 60)
    start = settings["start_speed_um_s"] / 1000
    share = next(share for share in SHARES if not share or all(
        overshoot(drive, Loop(gain, share / 100), start) <= start * drive.late_s
        and phase_margin(drive, Loop(gain, share / 100)) >= MARGIN_DEG / 2
        for drive in drives.values()))
    loop = Loop(gain, share / 100)
    times = np.arange(0, 10 / gain, 1e-4)
    furthest = 0.0
    rest = max(abs(sample.error) for one in axes for sample in one.samples if not sample.time_s)
    for axis, drive in drives.items():
        furthest = max(furthest, *(abs(float(error)) for way in (top, -top)
                                   for error in response(drive, loop, way, times)))
        margin = phase_margin(drive, loop)
        notes.append(
            f"{axis}: phase margin {margin:.0f} degrees; at the end of a motion at "
            f"{60 * start:g} mm/min it goes {1000 * overshoot(drive, loop, start):.1f} um beyond.")
        if margin < MARGIN_DEG:
            notes.append(f"{axis}: with 60 degrees of phase margin its loop could have "
                         f"{_highest_gain(drive, loop):.0f} 1/s: lower the scale of the velocity "
                         "command at its amplifier.")
    late_us = round(LAG_MARGIN * 1e6 * max(drive.late_s for drive in drives.values()))
    lag = named("drive_lag_us")
    values = {"loop_gain": gain, "feed_forward": share,
              lag.name: min(lag.highest, max(lag.lowest, late_us)),
              "follow_moving": _pulses(ERROR_MARGIN * furthest),
              "follow_stopped": _pulses(ERROR_MARGIN * rest) + REST_PULSES}
    return Proposal(values | _back(settings, axes, notes), notes)


def _back(settings: Mapping[str, int], axes: Sequence[Measured],
          notes: list[str]) -> dict[str, int]:
    """Acceleration on the way back, if the drives tell one; else a note says why there is none."""
    setting, forward = named("back_acceleration_mm_s2"), named("acceleration_mm_s2")
    sure = {one.axis: BACK * one.fit.least for one in axes if one.fit.least is not None}
    limited = {one.axis for one in axes if one.fit.most is not None and one.fit.most < math.inf}
    for axis in sorted(limited):
        if settings[forward.name] > sure[axis]:
            notes.append(f"{axis}: ${forward.number}={settings[forward.name]} mm/s2 is more than "
                         f"{sure[axis]:.0f}, which is {BACK:g} times what its drive can do.")
    unsure = [one.axis for one in axes if one.axis not in sure]
    looped = [axis for at, axis in enumerate(AXES) if not settings["step_axes"] >> at & 1]
    missing = [axis for axis in looped if axis not in {one.axis for one in axes}]
    if unsure:
        notes.append(f"${setting.number} is not proposed: friction, a very slow drive or a slow "
                     f"link hides the acceleration of {', '.join(unsure)}.")
        return {}
    if missing:
        notes.append(f"${setting.number} is not proposed: it is for all axes, so measure "
                     f"{', '.join(missing)}, too.")
        return {}
    found, now = min(setting.highest, int(min(sure.values()))), settings[setting.name]
    if now > found and not limited:
        notes.append(f"${setting.number}={now} is more than the turns have shown ({found}), but no "
                     "drive has come to a limit: it may stay.")
        return {}
    return {setting.name: found}


def _pulses(way_mm: float) -> int:
    return math.ceil(way_mm * PULSES_PER_MM)


def _highest_gain(drive: Drive, loop: Loop) -> float:
    """The highest true gain, in 1/s, with the phase margin that is recommended."""
    tried = np.geomspace(1, loop.gain, 60)
    good = [one for one in tried if phase_margin(drive, Loop(float(one), loop.share)) >= MARGIN_DEG]
    return float(max(good, default=tried[0])) * drive.gain
