# SPDX-License-Identifier: Apache-2.0
"""Tuning of the position loops: what small motions tell of the drives, and what to set for them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.tune.drive import (
    STILL,
    Drive,
    Fit,
    Loop,
    Sample,
    best_model_s,
    fitted,
    overshoot,
    phase_margin,
    response,
)
from host.tune.motions import (
    AXES,
    CORNERS,
    FASTEST_MM_S,
    SLOW,
    WINDOW,
    Controlled,
    TuneError,
    meanwhile,
    model_lag,
    sampled,
    speed_of,
)
from softcore.tables.settings import PULSES_PER_MM, named

__all__ = ["Measured", "Proposal", "explained", "loop_of", "measured", "proposal", "with_values"]

EVEN = 0.6                  # share of a motion after which its speed is taken for even
FEWEST = 5                  # samples of even motion at each speed in each direction
MARGIN_DEG = 60.0           # of phase, of the highest gain that is recommended
SHARES = 100, 75, 50, 25, 0     # of feed-forward that are tried, %
BACK = 0.8                  # of the drives' acceleration is proposed for the way back
ERROR_MARGIN = 1.5          # of the bounds of following error over the greatest that is known
REST_PULSES = 20            # of the bound at rest, beside what offset and friction have
LEFT = 0.25                 # of a friction that may be another than was found, once made up for
SURE_STEPS, SURE = 3, 3.0   # friction that is told from none: steps, and times the scatter
DIFFERENT = 0.05            # between axes, above which one gain for all does not do
GAIN_ACCEPTED, LAG_ACCEPTED = (0.7, 1.3), (2e-3, 6e-3)  # by the supervision of the coders


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


def loop_of(settings: Mapping[str, int], axis: str) -> Loop:
    """The loop of an axis with the settings."""
    loop = Loop(settings["loop_gain"], settings["feed_forward"] / 100)
    return replace(loop, friction=loop.speed(settings[_friction(axis)]),
                   model_s=settings[model_lag(axis)] / 1e6,
                   window=settings[WINDOW.name] / PULSES_PER_MM)


def with_values(one: Measured, settings: Mapping[str, int],
                values: Mapping[str, int]) -> tuple[Drive, Loop]:
    """The drive of an axis, as its loop has it, and the loop, with the values proposed."""
    after = {**settings, **values}
    step = _step(one, settings)
    offset = _offset_of(after, one.axis) - _offset_of(settings, one.axis)
    friction = after[_friction(one.axis)] - settings[_friction(one.axis)]
    drive = one.drive
    return replace(drive, gain=drive.gain * settings["loop_gain"] / after["loop_gain"],
                   offset=drive.offset + step * offset,
                   friction=drive.friction - step * friction), loop_of(after, one.axis)


def _step(one: Measured, settings: Mapping[str, int]) -> float:
    """Speed of the drive by a step of the DAC, mm/s: the same with any loop gain that is set."""
    return one.drive.gain * loop_of(settings, one.axis).speed(1)


def _friction(axis: str) -> str:
    return f"drive_friction_{axis.lower()}"


def _offset(axis: str) -> str:
    return f"drive_offset_{axis.lower()}"


def _offset_of(settings: Mapping[str, int], axis: str) -> int:
    """Offset that is made up for, with its sign."""
    return settings[_offset(axis)] - named(_offset(axis)).default


def measured(link: Controlled, settings: Mapping[str, int], axis: str, way: int,
             travel_mm: float, *, time_s: Callable[[], float]) -> Measured:
    """Move an axis there and back, and find its drive. ``settings`` are those before ``measuring``.

    Raises
    ------
    LinkError, TuneError
        As ``sampled`` and ``explained``.
    """
    return explained(settings, axis, travel_mm,
                     sampled(link, settings, axis, way, travel_mm, time_s=time_s))


def explained(settings: Mapping[str, int], axis: str, travel_mm: float,
              samples: Sequence[Sample]) -> Measured:
    """The drive that explains samples of an axis; takes some seconds.

    Raises
    ------
    TuneError
        If the samples are too few, or no drive has them.
    """
    after_mm, fast = EVEN * travel_mm, speed_of(settings, axis)
    for speed in (fast, -fast, fast / SLOW, -fast / SLOW):
        if sum(one.speed == speed and one.time_s * abs(speed) >= after_mm
               for one in samples) < FEWEST:
            raise TuneError(f"axis {axis}: {travel_mm:g} mm are too short for the reports that "
                            "come; give more travel.")
    try:
        return Measured(axis, tuple(samples), fitted(
            loop_of({**settings, **meanwhile(settings)}, axis), samples, after_mm))
    except ValueError as error:
        raise TuneError(f"axis {axis}: {error}.") from error


def proposal(settings: Mapping[str, int], axes: Sequence[Measured]) -> Proposal:
    """Settings for the drives that were measured, all axes together, with their margins."""
    notes: list[str] = []
    if not settings[CORNERS.name]:
        notes.append(f"${CORNERS.number} is 0: nothing bounds the speed at corners. If power or "
                     "the cable failed in a measurement, enter what it was; as delivered it is "
                     f"{CORNERS.default}.")
    notes += _held(settings, axes)
    gains = {one.axis: settings["loop_gain"] * one.drive.gain for one in axes}
    gain = round(float(np.mean(list(gains.values()))))
    least, most = named("loop_gain").lowest, named("loop_gain").highest
    if gain < least:
        raise TuneError(f"the loops have a gain of {gain} 1/s; $456 takes {least} at least. Raise "
                        "the scale of the velocity command at the amplifiers.")
    if gain > most:
        raise TuneError(f"the loops have a gain of {gain} 1/s; $456 takes {most} at most. Lower "
                        "the scale of the velocity command at the amplifiers.")
    values = {"loop_gain": gain} | _made_up(settings, axes, notes)

    def with_share(share: int) -> dict[str, tuple[Drive, Loop]]:
        shared = values | {"feed_forward": share} | _modelled(settings, values, axes, share)
        return {one.axis: with_values(one, settings, shared) for one in axes}

    # Beside a loop whose gain is set right, a drive has the gain that its axis differs by.
    drives = {axis: drive for axis, (drive, _) in with_share(0).items()}
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
        overshoot(drive, loop, start) <= start * drive.late_s
        and phase_margin(drive, loop) >= MARGIN_DEG / 2
        for drive, loop in with_share(share).values()))
    times = np.arange(0, 10 / gain, 1e-4)
    furthest = rest = 0.0
    for one in axes:
        axis, (drive, loop) = one.axis, with_share(share)[one.axis]
        # What may be left of a friction stops the axis short of its place, too.
        short = max(0.0, drive.friction) + LEFT * max(
            0.0, drive.friction + drive.gain * loop.friction)
        stands = min(loop.window, STILL / PULSES_PER_MM)
        rest = max(rest, stands + (abs(drive.offset) + short) / drive.gain
                   * (1 + loop.lead) / loop.gain)
        held = replace(drive, friction=short)
        furthest = max(furthest, *(stands + float(np.abs(response(held, loop, way, times)).max())
                                   for way in (top, -top)))
        margin = phase_margin(drive, loop)
        notes.append(
            f"{axis}: phase margin {margin:.0f} degrees; at the end of a motion at "
            f"{60 * start:g} mm/min it goes {1000 * overshoot(drive, loop, start):.1f} um beyond.")
        if margin < MARGIN_DEG:
            notes.append(f"{axis}: with 60 degrees of phase margin its loop could have "
                         f"{_highest_gain(drive, loop):.0f} 1/s: lower the scale of the velocity "
                         "command at its amplifier.")
    late_us = round(1e6 * max(drive.late_s for drive in drives.values()))
    lag = named("drive_lag_us")
    values |= {"feed_forward": share, **_modelled(settings, values, axes, share),
               lag.name: min(lag.highest, max(lag.lowest, late_us)),
               "follow_moving": _pulses(ERROR_MARGIN * furthest),
               "follow_stopped": _pulses(ERROR_MARGIN * rest) + REST_PULSES}
    return Proposal(values | _back(settings, axes, notes), notes)


def _modelled(settings: Mapping[str, int], values: Mapping[str, int], axes: Sequence[Measured],
              share: int) -> dict[str, int]:
    """Lag of the controller's model of each axis with a share of feed-forward, in us."""
    if not share:       # the plain loop does without the model
        return {}
    found = {}
    for one in axes:
        drive, loop = with_values(one, settings, values)
        setting = named(model_lag(one.axis))
        wanted = round(1e6 * best_model_s(drive, replace(loop, share=share / 100)))
        found[setting.name] = min(setting.highest, max(setting.lowest, wanted))
    return found


def _held(settings: Mapping[str, int], axes: Sequence[Measured]) -> list[str]:
    """What there is to say of the window, and of axes that rest beside their place."""
    notes = []
    if settings[WINDOW.name] == meanwhile(settings)[WINDOW.name]:
        notes.append(f"${WINDOW.number} is {settings[WINDOW.name]}, as while an axis is measured. "
                     "Once offset and friction are made up for, enter what it was; as delivered it "
                     f"is {WINDOW.default}.")
    for one in axes:
        drive = one.drive
        furthest = (abs(drive.offset) + max(0.0, drive.friction)) / _step(one, settings)
        if round(furthest) > settings[WINDOW.name]:
            notes.append(f"{one.axis}: it may rest up to {furthest:.0f} pulses from its place. "
                         f"With ${WINDOW.number}={settings[WINDOW.name]} the supervision of its "
                         "coder trips then, until offset and friction are made up for.")
    return notes


def _made_up(settings: Mapping[str, int], axes: Sequence[Measured],
             notes: list[str]) -> dict[str, int]:
    """Offset and friction of each axis in steps of the DAC: what is set, and what is left."""
    values = {}
    for one in axes:
        left = round(one.drive.offset / _step(one, settings))
        wanted = {_offset(one.axis): _offset_of(settings, one.axis) - left,
                  _friction(one.axis): _friction_steps(one, settings, notes)}
        for name, steps in wanted.items():
            setting = named(name)       # as delivered it makes up for nothing
            values[name] = min(max(setting.default + steps, setting.lowest), setting.highest)
            if values[name] != setting.default + steps:
                notes.append(f"{one.axis}: {abs(steps)} steps are needed for ${setting.number}, "
                             f"which takes {abs(values[name] - setting.default)} at most: lower "
                             "what the drive has at its amplifier.")
    return values


def _friction_steps(one: Measured, settings: Mapping[str, int], notes: list[str]) -> int:
    """Steps that make up for the friction; as set if what is left cannot be told from none."""
    now, lost = settings[_friction(one.axis)], one.drive.friction
    step = _step(one, settings)
    sure = max(SURE_STEPS * step, SURE * one.fit.scatter * one.drive.gain)
    if abs(lost) <= sure:
        if round(lost / step):
            notes.append(f"{one.axis}: a friction of {lost:+.3f} mm/s beside what is made up for "
                         f"cannot be told from none (up to {sure:.3f}); more travel tells more.")
        return now
    steps = now + round(lost / step)
    if steps < 0:
        notes.append(f"{one.axis}: slow motion is faster than the gain says, by {-lost:.3f} mm/s. "
                     "That is no friction: none is made up for.")
    return max(0, steps)


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
    good = [one for one in tried
            if phase_margin(drive, replace(loop, gain=float(one))) >= MARGIN_DEG]
    return float(max(good, default=tried[0])) * drive.gain
