# SPDX-License-Identifier: Apache-2.0
"""A drive in its position loop: its response to the start and the end of a motion, and its fit.

A drive turns the velocity command u into the speed w: a dead time, a gain (1 as it should be), an
offset and a lag of first order. The controller closes the loop as ``rtl.motion.axis`` does::

    u = K (Er - T m) + f v      with feed-forward: the share f of the path's speed v
    u = K Er                    in the plain loop

m is the speed in the controller's model of the drive, of gain 1 and the lag T. Lengths are in mm,
times in seconds.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softcore.registers import DRIVE_LAG_US

__all__ = ["MODEL_LAG_S", "Drive", "Loop", "Sample", "fitted", "overshoot", "phase_margin",
           "response", "steady"]

MODEL_LAG_S = DRIVE_LAG_US / 1e6      # of the drive in the controller's model of it
STEP_S = 5e-5
LONGEST_LAG_S, LONGEST_DEAD_S = 16e-3, 6e-3
SHORTEST_LAG_S = 0.3e-3
SEARCHES, PLACES = 10, 5    # of the fit: each search looks at a grid, six tenths of the last
NARROWER = 0.6


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
    """A drive: gain as a multiple of what it should be, offset in mm/s, lag and dead time."""

    gain: float = 1.0
    offset: float = 0.0
    lag_s: float = 3e-3
    dead_s: float = 0.0


@dataclass(frozen=True)
class Sample:
    """What a status report says in a motion: time since its start, following error, its speed.

    Error and speed are positive upwards.
    """

    time_s: float
    error: float
    speed: float


def response(drive: Drive, loop: Loop, speed: float, times: NDArray[np.float64],
             until_s: float = math.inf) -> NDArray[np.float64]:
    """Following error at times after the start of a motion; its command ends at ``until_s``.

    Before it the axis is at rest, where the offset has its following error.
    """
    steps = int(times.max(initial=0.0) / STEP_S) + 2
    late = round(drive.dead_s / STEP_S)
    resting = -drive.offset / drive.gain
    command = [resting] * late              # what is on its way to the drive
    modelled, turning = resting, 0.0
    error = resting * (1 + loop.lead) / loop.gain
    found = np.empty(steps)
    for step in range(steps):
        found[step] = error
        moving = speed if step * STEP_S < until_s else 0.0
        told = loop.gain * error - loop.lead * modelled + loop.share * moving
        command.append(told)
        reached = drive.gain * command[step] + drive.offset
        modelled += (told - modelled) * -math.expm1(-STEP_S / MODEL_LAG_S)
        turning += (reached - turning) * -math.expm1(-STEP_S / drive.lag_s)
        error += (moving - turning) * STEP_S
    return np.interp(times, np.arange(steps) * STEP_S, found)


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


def fitted(loop: Loop, samples: Sequence[Sample], after_s: float) -> tuple[Drive, float]:
    """The drive that explains the samples best, and the deviation that is left (mm, rms).

    Gain and offset come from the even motion, lag and dead time from the start of it.

    Raises
    ------
    ValueError
        As ``steady``.
    """
    gain, offset = steady(loop, samples, after_s)
    ways = [[one for one in samples if (one.speed > 0) == up] for up in (True, False)]
    times = [np.array([one.time_s for one in way]) for way in ways]
    errors = np.concatenate([[one.error for one in way] for way in ways])

    def left(drive: Drive) -> float:
        away = np.concatenate([response(drive, loop, way[0].speed, at)
                               for way, at in zip(ways, times, strict=True)]) - errors
        return float(np.sqrt(np.mean(away**2)))

    best = Drive(gain, offset, LONGEST_LAG_S / 2, LONGEST_DEAD_S / 2)
    rest, half = math.inf, 1.0
    for _ in range(SEARCHES):
        middle = best
        for lag in np.linspace(-half, half, PLACES) * LONGEST_LAG_S / 2 + middle.lag_s:
            for dead in np.linspace(-half, half, PLACES) * LONGEST_DEAD_S / 2 + middle.dead_s:
                tried = replace(best, lag_s=max(SHORTEST_LAG_S, float(lag)),
                                dead_s=max(0.0, float(dead)))
                if (now := left(tried)) < rest:
                    best, rest = tried, now
        half *= NARROWER
    return best, rest


def overshoot(drive: Drive, loop: Loop, speed: float) -> float:
    """How far the axis goes beyond the place where a command from an even speed ends, in mm."""
    even = 10 / (drive.gain * loop.gain)
    times = np.arange(0, 2 * even, STEP_S)
    still = -drive.offset / drive.gain * (1 + loop.lead) / loop.gain
    return max(0.0, -float((response(drive, loop, speed, times, even) - still)[times > even].min()))


def phase_margin(drive: Drive, loop: Loop) -> float:
    """Phase margin of the position loop in degrees; below 0 it swings."""
    s = 2j * np.pi * np.geomspace(0.05, 2000, 20_000)
    opened = (loop.gain * drive.gain * np.exp(-s * drive.dead_s) / (1 + s * drive.lag_s)
              / (s * (1 + loop.lead / (1 + s * MODEL_LAG_S))))
    crossing = int(np.argmax(np.abs(opened) < 1))
    return float(180 + np.degrees(np.unwrap(np.angle(opened))[crossing]))
