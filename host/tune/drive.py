# SPDX-License-Identifier: Apache-2.0
"""A drive in its position loop: its response to the start and the end of a motion, and its fit.

A drive turns the velocity command u into the speed w: a dead time, a gain (1 as it should be), an
offset, two lags of first order, and a limit of the acceleration by the second. The controller
closes the loop as ``rtl.motion.axis`` does::

    u = K (Er - T m) + f v      with feed-forward: the share f of the path's speed v
    u = K Er                    in the plain loop

m is the speed in the controller's model of the drive, of gain 1 and the lag T. Lengths are in mm,
times in seconds.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares

from softcore.registers import DRIVE_LAG_US

__all__ = ["MODEL_LAG_S", "Drive", "Fit", "Loop", "Sample", "fitted", "overshoot",
           "phase_margin", "response", "steady"]

Numbers = NDArray[np.float64]

MODEL_LAG_S = DRIVE_LAG_US / 1e6      # of the drive in the controller's model of it
STEP_S = 5e-5
FITTED_S = 0.05             # of the begin of a motion, for the fit
SEEN = 0.9                  # deviation with a limit of the acceleration, of that without, at most
SURE = 3.0                  # standard deviations of the limit that is told
WELL_MM = 1e-3              # deviation up to which the drive explains its motion well
NEAR = 1.5                  # of the highest and the lowest limit that the samples allow, at most
BOUND = 0.9                 # of the acceleration that a drive without a limit has shown

# Of the fit, by parameter: lag, filter and dead time in ms, and the logarithm to base 2 of the
# limit of the acceleration as a share of what the lag alone would have.
LOWEST, HIGHEST = (0.3, 0.0, 0.0, -6.0), (16.0, 6.0, 6.0, 1.0)
BEGUN = ((3.0, 0.5, 0.5, -0.5), (6.0, 0.5, 0.5, -3.0))
STEPS = (1e-3, 1e-3, 1e-3, 1e-3)    # of their derivatives


@dataclass(frozen=True)
class Loop:
    """The controller's part: gain in 1/s as it is set, and share of the feed-forward, 0 to 1."""

    gain: float
    share: float

    @property
    def lead(self) -> float:
        """What the model's lag takes away: K T, 0 in the plain loop."""
        return self.gain * MODEL_LAG_S if self.share else 0.0


@dataclass(frozen=True)
class Drive:
    """A drive: gain as a multiple of what it should be, offset in mm/s, lags, dead time, limit.

    ``filter_s`` is the lag before the other, ``acceleration`` the limit of the latter, in mm/s2.
    """

    gain: float = 1.0
    offset: float = 0.0
    lag_s: float = 3e-3
    dead_s: float = 0.0
    filter_s: float = 0.0
    acceleration: float = math.inf

    @property
    def late_s(self) -> float:
        """How late it follows an even ramp."""
        return self.lag_s + self.filter_s + self.dead_s


@dataclass(frozen=True)
class Sample:
    """What a status report says in a motion: time since its start, following error, its speed.

    ``before`` is the speed before that start: 0, or that of a motion the other way. Error and
    speeds are positive upwards.
    """

    time_s: float
    error: float
    speed: float
    before: float = 0.0


@dataclass(frozen=True)
class Fit:
    """The drive that explains samples best, and the deviation that is left, in mm rms.

    The limit of its acceleration lies from ``least`` to ``most`` mm/s2; ``most`` is infinite if
    the drive reached ``least`` without a limit. Both are None if the samples do not tell.
    """

    drive: Drive
    left: float
    least: float | None
    most: float | None


def response(drive: Drive, loop: Loop, speed: float, times: Numbers, until_s: float = math.inf,
             before: float = 0.0) -> Numbers:
    """Following error at times after a change of the commanded speed; it ends at ``until_s``.

    Up to the change the axis has moved evenly with the speed ``before``. At rest, the offset has
    its following error.
    """
    return _responses([drive], loop, speed, times, until_s, before)[:, 0]


def _responses(drives: Sequence[Drive], loop: Loop, speed: float, times: Numbers,
               until_s: float = math.inf, before: float = 0.0) -> Numbers:
    """The same of several drives, in columns."""
    def each(value: Callable[[Drive], float]) -> Numbers:
        return np.array([value(drive) for drive in drives])

    def follows(lags: Numbers) -> Numbers:
        return -np.expm1(-STEP_S / np.maximum(lags, 1e-9))

    gain, offset = each(lambda drive: drive.gain), each(lambda drive: drive.offset)
    filtering, turns = (follows(each(lambda drive: drive.filter_s)),
                        follows(each(lambda drive: drive.lag_s)))
    most = each(lambda drive: drive.acceleration) * STEP_S
    late = each(lambda drive: drive.dead_s) / STEP_S
    whole, columns = late.astype(int), np.arange(len(drives))
    part, longest = late - whole, int(whole.max()) + 1
    steps = int(times.max(initial=0.0) / STEP_S) + 2
    evenly = (before - offset) / gain
    commands = np.empty((longest + steps, len(drives)))     # the first are on their way already
    commands[:longest] = evenly
    model = -math.expm1(-STEP_S / MODEL_LAG_S)
    modelled, filtered, turning = evenly, np.full_like(evenly, before), np.full_like(evenly, before)
    errors = (evenly * (1 + loop.lead) - loop.share * before) / loop.gain
    found = np.empty((steps, len(drives)))
    for step in range(steps):
        found[step] = errors
        moving = speed if step * STEP_S < until_s else 0.0
        told = loop.gain * errors - loop.lead * modelled + loop.share * moving
        now = longest + step - whole
        commands[longest + step] = told
        reached = commands[now, columns] * (1 - part) + commands[now - 1, columns] * part
        modelled = modelled + (told - modelled) * model
        filtered = filtered + (gain * reached + offset - filtered) * filtering
        turning = turning + np.clip((filtered - turning) * turns, -most, most)
        errors = errors + (moving - turning) * STEP_S
    places = times / STEP_S
    rows = places.astype(int)
    between = (places - rows)[:, None]
    after = np.minimum(rows + 1, steps - 1)
    return np.asarray(found[rows] * (1 - between) + found[after] * between)


def steady(loop: Loop, samples: Sequence[Sample], after_s: float) -> tuple[float, float]:
    """Gain and offset of a drive, from even motion in both directions, later than ``after_s``.

    Raises
    ------
    ValueError
        If no sample of a direction is so late, or the axis goes against its command.
    """
    commands: dict[bool, list[float]] = {True: [], False: []}
    speeds: dict[bool, float] = {}
    for one in samples:
        if one.time_s >= after_s:
            commands[one.speed > 0].append(
                (loop.gain * one.error + loop.share * one.speed) / (1 + loop.lead))
            speeds[one.speed > 0] = one.speed
    if len(speeds) < 2:
        raise ValueError("there is no even motion in both directions")
    up, down = float(np.mean(commands[True])), float(np.mean(commands[False]))
    if up <= down:
        raise ValueError("the drive goes against its command")
    gain = (speeds[True] - speeds[False]) / (up - down)
    return gain, (speeds[True] + speeds[False] - gain * (up + down)) / 2


def fitted(loop: Loop, samples: Sequence[Sample], after_s: float) -> Fit:
    """The drive that explains the samples best.

    Gain and offset come from the even motion; lags, dead time and the limit of the acceleration
    from the begin of each motion, by least squares.

    Raises
    ------
    ValueError
        As ``steady``.
    """
    gain, offset = steady(loop, samples, after_s)
    ways: dict[tuple[float, float], list[Sample]] = {}
    for one in samples:
        if one.time_s <= FITTED_S:
            ways.setdefault((one.before, one.speed), []).append(one)
    taken = [(before, speed, np.array([one.time_s for one in way]),
              np.array([one.error for one in way])) for (before, speed), way in ways.items()]
    jump = max(abs(speed - before) for before, speed in ways)
    turned_round = any(before for before, _ in ways)    # a start alone tells no acceleration

    def drive(lag: float, second: float, dead: float, share: float | None = None) -> Drive:
        limit = math.inf if share is None else jump / (lag * 1e-3) * 2**share
        return Drive(gain, offset, lag * 1e-3, dead * 1e-3, second * 1e-3, limit)

    def away(values: Numbers) -> Numbers:
        """Deviations in um."""
        return np.concatenate([1000 * (response(drive(*values), loop, speed, times, before=before)
                                       - errors) for before, speed, times, errors in taken])

    def slopes(values: Numbers) -> Numbers:
        """Their derivatives by each parameter."""
        drives = [drive(*values), *(drive(*(values + np.eye(len(values))[at] * STEPS[at]))
                                    for at in range(len(values)))]
        found = np.concatenate([1000 * _responses(drives, loop, speed, times, before=before)
                                for before, speed, times, errors in taken])
        return np.asarray((found[:, 1:] - found[:, :1]) / np.array(STEPS[:len(values)]))

    def best(begun: Sequence[float]) -> OptimizeResult:
        return least_squares(away, begun, jac=slopes, xtol=1e-4, ftol=1e-4,
                             bounds=(LOWEST[:len(begun)], HIGHEST[:len(begun)]))

    free = best(BEGUN[0][:3])
    limited = min((best(begun) for begun in BEGUN), key=lambda one: one.cost)
    count = sum(len(errors) for *_, errors in taken)
    if limited.cost > SEEN**2 * free.cost:
        # It has shown an acceleration without a limit: that after the greatest jump.
        shown, times = drive(*free.x), np.arange(0, FITTED_S, STEP_S)
        turned = response(shown, loop, jump / 2, times, before=-jump / 2)
        peak = float(np.abs(np.diff(turned, 2)).max()) / STEP_S**2
        left = _rms(free, count)
        known = turned_round and left <= WELL_MM
        return Fit(shown, left, BOUND * peak if known else None, math.inf if known else None)
    found, left = drive(*limited.x), _rms(limited, count)
    spread = 2 * limited.cost / max(1, count - 4) * np.linalg.pinv(limited.jac.T @ limited.jac)
    octaves = SURE * math.sqrt(spread[3, 3])
    if not turned_round or left > WELL_MM or 2 * octaves > math.log2(NEAR):
        return Fit(found, left, None, None)
    factor = 2**octaves
    return Fit(found, left, found.acceleration / factor, found.acceleration * factor)


def _rms(found: OptimizeResult, count: int) -> float:
    """Deviation in mm."""
    return float(math.sqrt(2 * found.cost / count)) / 1000


def overshoot(drive: Drive, loop: Loop, speed: float) -> float:
    """How far the axis goes beyond the place where a command from an even speed ends, in mm."""
    even = 10 / (drive.gain * loop.gain)
    times = np.arange(0, 2 * even, STEP_S)
    still = -drive.offset / drive.gain * (1 + loop.lead) / loop.gain
    return max(0.0, -float((response(drive, loop, speed, times, even) - still)[times > even].min()))


def phase_margin(drive: Drive, loop: Loop) -> float:
    """Phase margin of the position loop in degrees; below 0 it swings."""
    s = 2j * np.pi * np.geomspace(0.05, 2000, 20_000)
    opened = (loop.gain * drive.gain * np.exp(-s * drive.dead_s)
              / ((1 + s * drive.lag_s) * (1 + s * drive.filter_s))
              / (s * (1 + loop.lead / (1 + s * MODEL_LAG_S))))
    crossing = int(np.argmax(np.abs(opened) < 1))
    return float(180 + np.degrees(np.unwrap(np.angle(opened))[crossing]))
