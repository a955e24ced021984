# SPDX-License-Identifier: Apache-2.0
"""A drive in its position loop: its response to the start and the end of a motion, and its fit.

A drive turns the velocity command u into the speed w: a dead time, a gain (1 as it should be), an
offset, two lags of first order, Coulomb friction, and a limit of the acceleration by the second
lag. The controller closes the loop as ``rtl.motion.axis`` does::

    k = K (Er - T m) + f v      with feed-forward: the share f of the path's speed v
    k = K Er                    in the plain loop
    u = k + o + c sign(m)       with the offset and the friction that are made up for

m is the speed in the controller's model of the drive, of gain 1 and the lag T. It follows k, or 0
while the axis counts as at rest. For the sign the controller has another model, whose lag is 4.1
ms, and takes the direction 1 ms later; here it is the same m. Lengths are in mm, times in seconds.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares

from softcore.tables.settings import PULSES_PER_MM, named

__all__ = ["RESTING", "STILL", "Drive", "Even", "Fit", "Loop", "Sample", "best_model_s", "fitted",
           "overshoot", "phase_margin", "response", "steady"]

Numbers = NDArray[np.float64]

STILL, RESTING = 15, 63     # pulses up to which a command in position is none: in motion, at rest
LEAST_SPEED = 1e-3          # of the model in mm/s, below which it stands
STEP_S = 5e-5
FITTED_S = 0.05             # of the begin of a motion, for the fit
SEEN = 0.9                  # deviation with a limit of the acceleration, of that without, at most
SURE = 3.0                  # standard deviations of the limit that is told
WELL_MM = 1e-3              # deviation up to which the drive explains its motion well
NEAR = 1.5                  # of the highest and the lowest limit that the samples allow, at most
BOUND = 0.9                 # of the acceleration that a drive without a limit has shown

END_SHARE = 1 / 3           # of the way from the best lag for circles to the best for ends

DECAYS = np.geomspace(0.3, 4, 24)   # rates at which a start may decay, of the gain that is set

# Of the fit, by parameter: lag, filter and dead time in ms, and the logarithm to base 2 of the
# limit of the acceleration as a share of what the lag alone would have.
LOWEST, HIGHEST = (0.3, 0.0, 0.0, -6.0), (16.0, 6.0, 6.0, 1.0)
BEGUN = ((3.0, 0.5, 0.5, -0.5), (6.0, 0.5, 0.5, -3.0))
STEPS = (1e-3, 1e-3, 1e-3, 1e-3)    # of their derivatives


@dataclass(frozen=True)
class Loop:
    """The controller's part: gain in 1/s as it is set, and share of the feed-forward, 0 to 1.

    ``model_s`` is the lag T of the controller's model. ``friction`` in mm/s is what is added to the
    command in the direction of the model. The offset that is made up for needs no place here: it is
    a part of the drive's. ``window`` is the following error in mm up to which an axis is in
    position.
    """

    gain: float
    share: float
    model_s: float = named("model_lag_x_us").default / 1e6
    friction: float = 0.0
    window: float = named("window").default / PULSES_PER_MM

    @property
    def lead(self) -> float:
        """What the model's lag takes away: K T, 0 in the plain loop."""
        return self.gain * self.model_s if self.share else 0.0

    def speed(self, pulses: float) -> float:
        """Velocity command of so many pulses, or steps of the DAC, in mm/s."""
        return self.gain * pulses / PULSES_PER_MM


@dataclass(frozen=True)
class Drive:
    """A drive: gain as a multiple of what it should be, offset in mm/s, lags, dead time, limit.

    ``friction`` in mm/s is what the speed falls short by. It and the offset are those that are not
    made up for by the loop: below 0, the friction is made up for by too much. ``filter_s`` is the
    lag before the other, ``acceleration`` the limit of the latter, in mm/s2.
    """

    gain: float = 1.0
    offset: float = 0.0
    lag_s: float = 3e-3
    dead_s: float = 0.0
    filter_s: float = 0.0
    acceleration: float = math.inf
    friction: float = 0.0

    @property
    def late_s(self) -> float:
        """How late it follows an even ramp."""
        return self.lag_s + self.filter_s + self.dead_s


@dataclass(frozen=True)
class Sample:
    """What a status report says in a motion: time since its start, following error, its speed.

    ``before`` is the speed before that start: 0, or that of a motion the other way. ``rest`` is the
    following error at rest before a start from there, which friction may hold anywhere. Errors and
    speeds are positive upwards.
    """

    time_s: float
    error: float
    speed: float
    before: float = 0.0
    rest: float = 0.0


@dataclass(frozen=True)
class Even:
    """What even motion tells: gain, offset and friction as in ``Drive``.

    ``scatter`` is the deviation of the samples from that, mm/s rms of the command.
    """

    gain: float
    offset: float
    friction: float
    scatter: float


@dataclass(frozen=True)
class Fit:
    """The drive that explains samples best, and the deviation that is left, in mm rms.

    The limit of its acceleration lies from ``least`` to ``most`` mm/s2; ``most`` is infinite if
    the drive reached ``least`` without a limit. Both are None if the samples do not tell.
    ``scatter`` is that of the even motion.
    """

    drive: Drive
    left: float
    least: float | None
    most: float | None
    scatter: float = 0.0


# Where a motion begins: speed after it, speed before it, and following error at rest before it;
# None for the one in which nothing pushes the drive.
_Start = tuple[float, float, float | None]


def response(drive: Drive, loop: Loop, speed: float, times: Numbers, until_s: float = math.inf,
             before: float = 0.0) -> Numbers:
    """Following error at times after a change of the commanded speed; it ends at ``until_s``.

    Up to the change the axis has moved evenly with the speed ``before``. At rest, the offset has
    its following error.
    """
    return _responses([drive], loop, [(speed, before, None)], times, np.zeros(len(times), int),
                      until_s)[:, 0]


def _responses(drives: Sequence[Drive], loop: Loop, starts: Sequence[_Start], times: Numbers,
               which: NDArray[np.int_], until_s: float = math.inf) -> Numbers:
    """The same of several drives, in columns; each time is one after the start ``which``."""
    steps = int(times.max(initial=0.0) / STEP_S) + 2
    found = _simulated(drives, loop, starts, steps, until_s)
    places = times / STEP_S
    rows = places.astype(int)
    between = (places - rows)[:, None]
    after = np.minimum(rows + 1, steps - 1)
    return np.asarray(found[rows, :, which] * (1 - between) + found[after, :, which] * between)


def _simulated(drives: Sequence[Drive], loop: Loop, starts: Sequence[_Start], steps: int,
               until_s: float) -> Numbers:
    """Following errors by step, drive and start."""
    def each(value: Callable[[Drive], float]) -> Numbers:
        return np.array([[value(drive)] for drive in drives])

    def follows(lags: Numbers) -> Numbers:
        return -np.expm1(-STEP_S / np.maximum(lags, 1e-9))

    gain, offset = each(lambda drive: drive.gain), each(lambda drive: drive.offset)
    filtering, turns = (follows(each(lambda drive: drive.filter_s)),
                        follows(each(lambda drive: drive.lag_s)))
    most = each(lambda drive: drive.acceleration) * STEP_S
    lost = each(lambda drive: drive.friction)
    brakes = np.maximum(0.0, lost + gain * loop.friction) * turns
    late = each(lambda drive: drive.dead_s) / STEP_S
    whole = late.astype(int)
    part, longest = late - whole, int(whole.max()) + 1
    whole, columns = whole[:, 0], np.arange(len(drives))

    speeds, before = (np.array([start[at] for start in starts], float) for at in (0, 1))
    told = (before - offset + lost * np.sign(before)) / gain
    modelled, errors = _begun(loop, starts, told)
    told = np.where(before, told, loop.gain * errors - loop.lead * modelled)
    pushed = told + loop.friction * np.sign(modelled)
    commands = np.empty((longest + steps, *told.shape))     # the first are on their way already
    commands[:longest] = pushed
    filtered, turning = gain * pushed + offset, np.broadcast_to(before, told.shape)
    model = -math.expm1(-STEP_S / loop.model_s)
    found = np.empty((steps, *told.shape))
    for step in range(steps):
        found[step] = errors
        ended = step * STEP_S >= until_s
        moving = np.zeros_like(speeds) if ended else speeds
        told = loop.gain * errors - loop.lead * modelled + loop.share * moving
        now = longest + step - whole
        commands[longest + step] = told
        if loop.friction:
            commands[longest + step] += loop.friction * np.sign(modelled) * (
                np.abs(modelled) > LEAST_SPEED)
        reached = commands[now, columns] * (1 - part) + commands[now - 1, columns] * part
        if ended:       # at these speeds, an axis that moves on does not count as at rest
            told = np.where((np.abs(told) <= loop.speed(RESTING))
                            & (np.abs(errors) <= loop.window), 0.0, told)
        modelled = modelled + (told - modelled) * model
        filtered = filtered + (gain * reached + offset - filtered) * filtering
        turning = turning + np.minimum(np.maximum((filtered - turning) * turns, -most), most)
        turning = turning - np.minimum(np.maximum(turning, -brakes), brakes)    # or it is held
        errors = errors + (moving - turning) * STEP_S
    return found


def _begun(loop: Loop, starts: Sequence[_Start], told: Numbers) -> tuple[Numbers, Numbers]:
    """Speed of the model, and following error, with the command ``told`` in a lasting state."""
    modelled, errors = np.empty_like(told), np.empty_like(told)
    for at, (_, before, rest) in enumerate(starts):
        moved = told[:, at]
        if before:
            modelled[:, at] = moved
            errors[:, at] = (moved * (1 + loop.lead) - loop.share * before) / loop.gain
            continue
        stands = np.abs(moved) / loop.gain <= loop.window
        error = (np.full_like(moved, rest) if rest is not None else
                 np.where(stands, moved, moved * (1 + loop.lead)) / loop.gain)
        errors[:, at] = error
        modelled[:, at] = np.where(np.abs(error) <= loop.window, 0.0,
                                   loop.gain * error / (1 + loop.lead))
    return modelled, errors


def steady(loop: Loop, samples: Sequence[Sample], after_mm: float) -> Even:
    """Gain, offset and friction, from even motion at two speeds in both directions.

    Motion counts as even after ``after_mm`` of its way.

    Raises
    ------
    ValueError
        If there is no such sample of a direction and speed, or the axis goes against its command.
    """
    taken = [one for one in samples if one.time_s * abs(one.speed) >= after_mm]
    for way in (1, -1):
        if len({one.speed for one in taken if way * one.speed > 0}) < 2:
            raise ValueError("there is no even motion at two speeds in both directions")
    times, errors, speeds, before, rests = np.array([
        (one.time_s, one.error, one.speed, one.before, one.rest) for one in taken]).T
    commands = (loop.gain * errors + loop.share * speeds) / (1 + loop.lead)
    known = np.stack([speeds, np.ones_like(speeds), np.sign(speeds)], axis=1)
    # What is left of the start decays: with the change of the speed, and with the error before it.
    begun = np.stack([speeds - before, rests], axis=1)
    best: tuple[float, Numbers] = math.inf, np.zeros(3)
    for rate in loop.gain * DECAYS:
        fading = begun * np.exp(-rate * (times - times.min()))[:, None]
        all_known = np.concatenate([known, fading], axis=1)
        found = np.linalg.lstsq(all_known, commands, rcond=None)[0]
        away = float(np.sqrt(np.mean((commands - all_known @ found)**2)))
        best = min(best, (away, found), key=lambda one: one[0])
    scatter, (slope, still, lost, *_) = best
    if slope <= 0:
        raise ValueError("the drive goes against its command")
    return Even(float(1 / slope), float(-still / slope), float(lost / slope), scatter)


def fitted(loop: Loop, samples: Sequence[Sample], after_mm: float) -> Fit:
    """The drive that explains the samples best.

    Gain, offset and friction come from the even motion; lags, dead time and the limit of the
    acceleration from the begin of each fast motion, by least squares.

    Raises
    ------
    ValueError
        As ``steady``.
    """
    even = steady(loop, samples, after_mm)
    jump = max(abs(one.speed - one.before) for one in samples)
    turned_round = any(one.before for one in samples)   # a start alone tells no acceleration
    fast = max(abs(one.speed) for one in samples)
    taken = [one for one in samples if one.time_s <= FITTED_S and abs(one.speed) == fast]
    starts: dict[_Start, int] = {}
    which = np.array([starts.setdefault((one.speed, one.before, one.rest), len(starts))
                      for one in taken])
    times, errors = np.array([(one.time_s, one.error) for one in taken]).T

    def drive(lag: float, second: float, dead: float, share: float | None = None) -> Drive:
        limit = math.inf if share is None else jump / (lag * 1e-3) * 2**share
        return Drive(even.gain, even.offset, lag * 1e-3, dead * 1e-3, second * 1e-3, limit,
                     even.friction)

    def of(drives: Sequence[Drive]) -> Numbers:
        """Their responses in um."""
        return 1000 * _responses(drives, loop, list(starts), times, which)

    def away(values: Numbers) -> Numbers:
        """Deviations in um."""
        return np.asarray(of([drive(*values)])[:, 0] - 1000 * errors)

    def slopes(values: Numbers) -> Numbers:
        """Their derivatives by each parameter."""
        found = of([drive(*values), *(drive(*(values + np.eye(len(values))[at] * STEPS[at]))
                                      for at in range(len(values)))])
        return np.asarray((found[:, 1:] - found[:, :1]) / np.array(STEPS[:len(values)]))

    def best(begun: Sequence[float]) -> OptimizeResult:
        return least_squares(away, begun, jac=slopes, xtol=1e-4, ftol=1e-4,
                             bounds=(LOWEST[:len(begun)], HIGHEST[:len(begun)]))

    free = best(BEGUN[0][:3])
    limited = min((best(begun) for begun in BEGUN), key=lambda one: one.cost)
    count = len(taken)
    if limited.cost > SEEN**2 * free.cost:
        # It has shown an acceleration without a limit: that after the greatest jump.
        shown, times = drive(*free.x), np.arange(0, FITTED_S, STEP_S)
        turned = response(shown, loop, jump / 2, times, before=-jump / 2)
        peak = float(np.abs(np.diff(turned, 2)).max()) / STEP_S**2
        left = _rms(free, count)
        known = turned_round and left <= WELL_MM
        return Fit(shown, left, BOUND * peak if known else None, math.inf if known else None,
                   even.scatter)
    found, left = drive(*limited.x), _rms(limited, count)
    spread = 2 * limited.cost / max(1, count - 4) * np.linalg.pinv(limited.jac.T @ limited.jac)
    octaves = SURE * math.sqrt(spread[3, 3])
    if not turned_round or left > WELL_MM or 2 * octaves > math.log2(NEAR):
        return Fit(found, left, None, None, even.scatter)
    factor = 2**octaves
    return Fit(found, left, found.acceleration / factor, found.acceleration * factor,
               even.scatter)


def _rms(found: OptimizeResult, count: int) -> float:
    """Deviation in mm."""
    return float(math.sqrt(2 * found.cost / count)) / 1000


def overshoot(drive: Drive, loop: Loop, speed: float) -> float:
    """How far the axis goes beyond the place where a command from an even speed ends, in mm."""
    even = 10 / (drive.gain * loop.gain)
    times = np.arange(0, 2 * even, STEP_S)
    still = response(drive, loop, 0.0, times[:1])
    return max(0.0, -float((response(drive, loop, speed, times, even) - still)[times > even].min()))


def best_model_s(drive: Drive, loop: Loop) -> float:
    """A lag of the controller's model with which the axis keeps to circles, in s.

    A drive of the gain g and the lag L leaves a circle of the radius R, to the inside, by
    c R (w / K)**2 / 2. With the frequency w in 1/s, feed-forward of the share f and x = K T::

        c = ((1 + x) / g)**2 - 2 (K L (1 + x) - x**2) / g - f**2

    The result lies between the x for which c is 0, or smallest, and the lag of the drive, nearer to
    the first: with it alone an axis that stops at once would go beyond the end by some tenths of a
    micrometre, with the lag it does not.
    """
    g, behind = drive.gain, loop.gain * drive.late_s
    square, linear = 1 / g**2 + 2 / g, 2 / g**2 - 2 * behind / g
    constant = 1 / g**2 - 2 * behind / g - loop.share**2
    root = math.sqrt(max(0.0, linear**2 - 4 * square * constant))
    least = (root - linear) / (2 * square) / loop.gain
    return least + END_SHARE * (drive.late_s - least)


def phase_margin(drive: Drive, loop: Loop) -> float:
    """Phase margin of the position loop in degrees; below 0 it swings."""
    s = 2j * np.pi * np.geomspace(0.05, 2000, 20_000)
    opened = (loop.gain * drive.gain * np.exp(-s * drive.dead_s)
              / ((1 + s * drive.lag_s) * (1 + s * drive.filter_s))
              / (s * (1 + loop.lead / (1 + s * loop.model_s))))
    crossing = int(np.argmax(np.abs(opened) < 1))
    return float(180 + np.degrees(np.unwrap(np.angle(opened))[crossing]))
