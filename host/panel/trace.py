# SPDX-License-Identifier: Apache-2.0
"""The picture of the gap oscilloscope: voltage over time, pulses by class, comparators, as SVG."""

import numpy as np
from numpy.typing import NDArray

from host.panel.draw import VOLTS, line_of, number_of, svg_of, text_of, ticks
from host.scope.record import PULSES, Record

__all__ = ["LANES", "trace"]

# Levels in the picture, from the top down, with what stands at their left.
LANES = (("on", "gate"), ("sense", "sensing"), ("high", "open"), ("arc", "&lt; arc"),
         ("short", "&lt; short"), ("current", "current"), ("noise", "noise"), ("shorted", "Ss"))
# Class in the style sheet of each number in ``PULSES``; those of sensing pulses are pale.
CLASSES = {"open": "open", "ok": "good", "dame": "arc", "short": "short",
           "sensed_open": "open pale", "sensed_short": "short pale"}
WIDTH, EDGE, RIGHT = 640.0, 62.0, 8.0
TOP, HIGH, LANE = 22.0, 96.0, 14.0
NEAR = 0.6          # pixels; what lies closer is one

Spans = list[tuple[float, float]]


def _spans(on: NDArray[np.bool_], begins: NDArray[np.float64],
           ends: NDArray[np.float64]) -> Spans:
    """Where a level is high, as pixels from and to; spans with hardly a gap between are one."""
    found: Spans = []
    for begin, end in zip(begins[on], ends[on], strict=True):
        if found and begin - found[-1][1] < NEAR:
            found[-1] = found[-1][0], float(end)
        else:
            found.append((float(begin), float(end)))
    return found


def _pulses(record: Record) -> dict[str, list[tuple[int, int]]]:
    """First and last entry of each pulse with a class, by the class in the style sheet."""
    gate = record.levels["on"] | record.levels["sense"]
    rises = np.flatnonzero(gate & ~np.concatenate(([False], gate[:-1])))
    found: dict[str, list[tuple[int, int]]] = {}
    for at in np.flatnonzero(record.pulse):
        before = np.searchsorted(rises, at) - 1
        if before >= 0:
            kind = CLASSES[PULSES[record.pulse[at]]]
            found.setdefault(kind, []).append((int(rises[before]), int(at)))
    return found


def trace(record: Record, share: float = 1.0) -> str:
    """A record, or the ``share`` of it around the trigger, with a lane for each comparator."""
    us = record.time_us
    low, high = us[0] * share, max(us[-1] * share, us[0] * share + 1e-3)
    top_of_lanes = TOP + HIGH + 14
    height = top_of_lanes + LANE * len(LANES) + 22

    def at(time_us: NDArray[np.float64]) -> NDArray[np.float64]:
        return EDGE + (np.clip(time_us, low, high) - low) / (high - low) * (WIDTH - EDGE - RIGHT)

    begins = at(us)
    ends = np.append(begins[1:], at(us[-1:] + us[-1] - us[-2] if len(us) > 1 else us))
    shown = ends > begins
    volts = record.volts[record.samples]
    most = next((end for end in VOLTS if end >= np.max(volts, initial=0.0)), VOLTS[-1])
    parts = [f'<rect class="field" x="{EDGE}" y="{TOP}" width="{WIDTH - EDGE - RIGHT}" '
             f'height="{HIGH}"/>']
    parts += [f'<rect class="back" x="{a:.1f}" y="{TOP}" width="{b - a:.1f}" height="{HIGH}"/>'
              for a, b in _spans((record.state != 0) & shown, begins, ends)]
    for kind, pulses in _pulses(record).items():
        first, last = np.array(pulses).T
        inside = begins[last] > begins[first]
        path = "".join(f"M{a:.1f} {TOP + HIGH:.0f}H{b:.1f}v-9H{a:.1f}Z" for a, b in _spans(
            inside, begins[first], begins[last]))
        parts.append(f'<path class="pulse class-{kind}" d="{path}"/>')
    for value in (0.0, most / 2, most):
        y = TOP + HIGH - value / most * HIGH
        parts += [f'<line class="grid" x1="{EDGE}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" '
                  f'y2="{y:.1f}"/>', text_of(EDGE - 5, y + 4, number_of(value), "end")]
    parts.append(text_of(EDGE, TOP - 6, "gap voltage, V", "start", "title"))
    seen = (us[record.samples] >= low) & (us[record.samples] <= high)
    points = zip(at(us[record.samples][seen]), TOP + HIGH - np.minimum(volts[seen], most)
                 / most * HIGH, strict=True)
    parts.append(line_of(points, "volts thin") if seen.any() else text_of(
        (EDGE + WIDTH) / 2, TOP + HIGH / 2, "no sample of the voltage", "middle"))
    for row, (name, title) in enumerate(LANES):
        y = top_of_lanes + LANE * row
        path = "".join(f"M{a:.1f} {y + 2:.0f}H{max(b, a + NEAR):.1f}v8H{a:.1f}Z" for a, b in _spans(
            record.levels[name] & shown, begins, ends))
        parts += [f'<line class="grid" x1="{EDGE}" x2="{WIDTH - RIGHT}" y1="{y + 10}" '
                  f'y2="{y + 10}"/>', text_of(EDGE - 5, y + 10, title, "end"),
                  f'<path class="lane lane-{name}" d="{path}"/>']
    scale, unit = (1e-3, "ms") if high - low > 3000 else (1.0, "µs")
    for value in ticks(low * scale, high * scale, 6):
        x = float(at(np.array([value / scale]))[0])
        parts += [f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" '
                  f'y2="{height - 18}"/>',
                  text_of(x, height - 4, f"{number_of(value)} {unit}", "middle")]
    zero = float(at(np.array([0.0]))[0])
    parts.append(f'<line class="trigger" x1="{zero:.1f}" x2="{zero:.1f}" y1="{TOP - 8}" '
                 f'y2="{height - 18}"/>')
    return svg_of(WIDTH, height, parts)
