# SPDX-License-Identifier: Apache-2.0
"""How soon the electrode is clear of a short, from the simulated machine's own record.

The chain of a short begins with the contact of electrode and work. Its links: the sample that
completes the short; the last command forwards and the first one backwards; the electrode turns; the
electrode is 20 and 100 um away from where it was at the sample.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.run.events import Event
from host.run.workpiece import Columns

__all__ = ["CLEAR_UM", "LINKS", "SAMPLE", "Chain", "alone", "chains", "figures", "speeds"]

CLEAR_UM = (20, 100)
SAMPLE = 2      # clocks from the completing sample to the first row of its short
LONGEST_S = 0.5  # that a drive is followed

# Name of a link in the summary, its title and its unit.
LINKS = {
    "sample_ms": ("contact to completing sample", "ms"),
    "forward_us": ("sample to last forward command", "µs"),
    "back_us": ("sample to first backward command", "µs"),
    "turn_ms": ("sample to electrode turns", "ms"),
    "clear_20_um_ms": ("sample to 20 µm clear", "ms"),
    "clear_100_um_ms": ("sample to 100 µm clear", "ms"),
}


@dataclass(frozen=True)
class Chain:
    """One short: seconds from its completing sample; None for what was not reached.

    ``touched`` is the time before the sample; None if electrode and work did not touch at the
    sample. ``forward`` is at most ``SAMPLE`` clocks if no pulse came later.
    """

    t: float                    # s, of the sample
    touched: float | None
    forward: float | None
    back: float | None
    turn: float | None
    clear: dict[int, float | None]  # by distance in um


def chains(shorts: Columns, *, clock_hz: int, pulses_per_mm: float) -> list[Chain]:
    """The chain of every short, from the columns of ``Simulation.shorts``."""
    borders = np.flatnonzero(np.diff(shorts["short"])) + 1
    names = "cycle", "contact", "forward", "path", "x", "y", "z"
    rows = zip(*(np.split(shorts[name], borders) for name in names),
               strict=True) if len(shorts["short"]) else ()
    return [_chain(cycle, contact[0], forward, path,
                   np.stack(place, axis=1) * 1000 / pulses_per_mm, clock_hz)
            for cycle, contact, forward, path, *place in rows]


def _chain(cycle: NDArray[Any], contact: float, forward: NDArray[Any], path: NDArray[Any],
           place: NDArray[Any], clock_hz: int) -> Chain:
    sample = cycle[0] - SAMPLE
    after = (cycle - sample) / clock_hz
    advance = (path - path[0] + 2**31) % 2**32 - 2**31      # the coordinate wraps
    backward = np.flatnonzero(np.diff(advance) < 0)
    away = np.sqrt(((place - place[0])**2).sum(axis=1))
    clear = {um: _when(after, away, um) for um in CLEAR_UM}
    turn = None
    reached = np.flatnonzero(away >= min(CLEAR_UM))
    if len(reached):
        # Progress along the way out; the electrode turns where it is least, for the last time.
        out = place[reached[0]] - place[0]
        along = place[:reached[0] + 1] @ out
        turn = float(after[len(along) - 1 - along[::-1].argmin()])
    touched = None if contact < 0 else float(max(0, sample - contact) / clock_hz)
    back = last = None
    if len(backward):
        back = float(after[backward[0] + 1])
        last = float(max(SAMPLE, forward[backward[0] + 1] - sample) / clock_hz)
    return Chain(t=float(sample / clock_hz), touched=touched, forward=last, back=back, turn=turn,
                 clear=clear)


def _when(after: NDArray[Any], away: NDArray[Any], um: int) -> float | None:
    """When a distance is reached first, between two rows."""
    reached = np.flatnonzero(away >= um)
    if not len(reached) or not reached[0]:
        return None
    at = reached[0]
    share = (um - away[at - 1]) / (away[at] - away[at - 1])
    return float(after[at - 1] + share * (after[at] - after[at - 1]))


def alone(axis: dict[str, Any], speed_mm_min: float, tick_s: float) -> dict[int, float | None]:
    """What a drive takes by itself if a speed is given to its input as a step at the sample.

    Equations and numbers are those of the simulated drive: ``testbench/plant/motor.hpp``. Its
    offset is left out, and so is a scale of its input that differs from what is commanded.
    """
    wanted = min(speed_mm_min / 60, axis["max_speed_mm_s"])
    follow = 1 - math.exp(-tick_s / (axis["filter_ms"] * 1e-3))
    torque = 1 - math.exp(-tick_s / (axis["current_loop_ms"] * 1e-3))
    most, lag = axis["max_acceleration_mm_s2"], axis["speed_loop_ms"] * 1e-3
    late = [0.0] * round(axis.get("dead_time_ms", 0.0) * 1e-3 / tick_s)
    friction = axis.get("friction_mm_s", 0.0) / lag * tick_s
    command = speed = acceleration = way = 0.0
    found: dict[int, float | None] = dict.fromkeys(CLEAR_UM)
    for tick in range(1, round(LONGEST_S / tick_s) + 1):
        command += (wanted - command) * follow
        late.append(command)
        pull = max(-most, min(most, (late[tick - 1] - speed) / lag))
        acceleration += (pull - acceleration) * torque
        speed = max(0.0, speed + acceleration * tick_s - friction)
        way += speed * tick_s * 1000
        for um in CLEAR_UM:
            if found[um] is None and way >= um:
                found[um] = tick * tick_s
    return found


def speeds(events: Iterable[Event]) -> Iterator[float]:
    """Retraction speed of each short, mm/min."""
    speed = 0.0
    for event in events:
        if event["event"] == "retraction_set":
            speed = event["speed"]
        elif event["event"] == "retraction_start" and event["cause"] == "short":
            yield speed


def figures(found: list[Chain], events: Iterable[Event], axis: dict[str, Any],
            tick_s: float) -> list[dict[str, Any]]:
    """Figures of each retraction speed of a run, for ``summary.json`` and the report.

    Every link has ``median``, ``worst`` and the ``shorts`` that reached it, or None if none did;
    and for a distance what the ``drive`` takes alone. Only shorts whose retraction began count. The
    ``shorts`` of the first link are those at whose sample electrode and work touched.
    """
    by_speed: dict[float, list[Chain]] = {}
    for one, speed in zip(found, speeds(events), strict=False):
        by_speed.setdefault(speed, []).append(one)
    rows = []
    for speed, some in sorted(by_speed.items()):
        own = alone(axis, speed, tick_s)
        links = {"sample_ms": _figure([one.touched for one in some], 1e3),
                 "forward_us": _figure([one.forward for one in some], 1e6),
                 "back_us": _figure([one.back for one in some], 1e6),
                 "turn_ms": _figure([one.turn for one in some], 1e3)}
        for um in CLEAR_UM:
            figure, drive = _figure([one.clear[um] for one in some], 1e3), own[um]
            if figure:
                figure["drive"] = None if drive is None else round(drive * 1e3, 3)
            links[f"clear_{um}_um_ms"] = figure
        rows.append({"speed": speed, "shorts": len(some)} | links)
    return rows


def _figure(seconds: list[float | None], unit: float) -> dict[str, Any] | None:
    known = [one * unit for one in seconds if one is not None]
    return {"median": round(float(np.median(known)), 3), "worst": round(max(known), 3),
            "shorts": len(known)} if known else None
