# SPDX-License-Identifier: Apache-2.0
"""Pictures of the panel as SVG; colours are classes of ``panel.css``, so both themes fit.

Every function gives a whole ``<svg>`` element. Places are in mm and times in seconds.
"""

import itertools
import math
from collections.abc import Iterable, Sequence

from host.panel.heard import CLASSES, Sample
from host.panel.outline import Outline

__all__ = ["VOLTS", "depth", "line_of", "number_of", "plan", "strip", "svg_of", "text_of",
           "ticks"]

Place = tuple[float, ...]
SHOWN_S = 30.0      # of the strips
TRAIL = 600         # points of a trail that are drawn
VOLTS = (25.0, 50.0, 100.0, 200.0, 400.0)  # ends of the voltage's scale


def ticks(low: float, high: float, most: int = 5) -> list[float]:
    """Round numbers between two ends, at most ``most`` and one more."""
    span = max(high - low, 1e-9)
    raw = span / most
    step = 10.0 ** math.floor(math.log10(raw))
    step *= next(factor for factor in (1, 2, 5, 10) if factor * step >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [round(index * step, 9) for index in range(first, math.floor(high / step + 1e-9) + 1)]


def svg_of(width: float, height: float, parts: Iterable[str]) -> str:
    """A picture of so many units, of its parts."""
    return (f'<svg viewBox="0 0 {width:g} {height:g}" preserveAspectRatio="xMidYMid meet" '
            f'role="img">{"".join(parts)}</svg>')


def line_of(points: Iterable[tuple[float, float]], kind: str) -> str:
    """A line through points; nothing without points."""
    joined = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline class="{kind}" points="{joined}"/>' if joined else ""


def text_of(x: float, y: float, said: str, anchor: str = "start", kind: str = "label") -> str:
    """A text at a place."""
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{said}</text>'


def number_of(value: float) -> str:
    """A number with a true minus sign."""
    return f"{value:g}".replace("-", "\N{MINUS SIGN}")


def _thin(trail: Sequence[Place]) -> Sequence[Place]:
    """At most some ``TRAIL`` places of a trail, the last one among them."""
    step = -(-len(trail) // TRAIL) or 1
    return [*trail[::step], *trail[-1:]]


def _frame(values: Iterable[float], least: float) -> tuple[float, float]:
    """Ends that hold all values with some room, at least ``least`` apart."""
    known = list(values) or [0.0]
    low, high = min(known), max(known)
    room = max((high - low) * 0.08, (least - (high - low)) / 2)
    return low - room, high + room


def plan(way: Outline, trail: Sequence[Place], place: Place, line: int) -> str:
    """The path from above, X to the right and Y up: programmed, gone, and the place on it.

    Parts of the block under way (``line`` of the source) are bright.
    """
    width, height, edge = 420.0, 300.0, 34.0
    points = [(x, y) for x, y, _, _ in way.points]
    seen = [(one[0], one[1]) for one in _thin(trail)]
    here = [(place[0], place[1])] if len(place) > 1 else []
    x0, x1 = _frame((x for x, _ in points + seen + here), 0.2)
    y0, y1 = _frame((y for _, y in points + seen + here), 0.2)
    scale = min((width - edge - 8) / (x1 - x0), (height - edge + 4) / (y1 - y0))
    middle = (x0 + x1) / 2, (y0 + y1) / 2
    centre = (edge + width - 8) / 2, (height - edge + 10) / 2

    def at(x: float, y: float) -> tuple[float, float]:
        return centre[0] + (x - middle[0]) * scale, centre[1] - (y - middle[1]) * scale

    half = (width - edge - 8) / scale / 2, (height - edge - 2) / scale / 2
    parts = []
    for value in ticks(middle[0] - half[0], middle[0] + half[0], 6):
        x, _ = at(value, 0)
        parts += [f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="6" y2="{height - edge + 8}"/>',
                  text_of(x, height - 10, number_of(value), "middle")]
    for value in ticks(middle[1] - half[1], middle[1] + half[1], 5):
        _, y = at(0, value)
        parts += [f'<line class="grid" x1="{edge}" x2="{width - 6}" y1="{y:.1f}" y2="{y:.1f}"/>',
                  text_of(edge - 5, y + 4, number_of(value), "end")]
    parts.append(line_of((at(x, y) for x, y in points), "planned"))
    now = [index for index, point in enumerate(way.points) if point[3] == line and index]
    if now:
        parts.append(line_of((at(*points[index])
                              for index in range(now[0] - 1, now[-1] + 1)), "now"))
    parts.append(line_of((at(x, y) for x, y in seen), "trail"))
    parts += [f'<circle class="place" cx="{x:.1f}" cy="{y:.1f}" r="6"/>'
              for x, y in (at(*one) for one in here)]
    return svg_of(width, height, [*parts, text_of(width - 8, 18, "plan: X, Y in mm", "end",
                                                  "title")])


def depth(way: Outline, trail: Sequence[Place], place: Place) -> str:
    """Depth: the programmed lowest Z, how deep it has been, and where the electrode is."""
    width, height, edge = 150.0, 300.0, 44.0
    planned = [z for (_, _, z, _), rapid in zip(way.points, way.rapid, strict=True) if not rapid]
    gone = [one[2] for one in trail if len(one) > 2]
    here = place[2] if len(place) > 2 else 0.0
    low, high = _frame([*planned, *gone, here, 0.0], 0.2)

    def at(z: float) -> float:
        return 26 + (high - z) / (high - low) * (height - 40)

    parts = [f'<rect class="stock" x="{edge}" y="{at(0):.1f}" width="{width - edge - 6}" '
             f'height="{max(0.0, height - 8 - at(0)):.1f}"/>']
    if gone and min(gone) < 0:
        parts.append(f'<rect class="cut" x="{edge + 22}" y="{at(0):.1f}" width="56" '
                     f'height="{at(min(gone)) - at(0):.1f}"/>')
    for value in ticks(low, high, 7):
        parts += [f'<line class="grid" x1="{edge}" x2="{width - 6}" y1="{at(value):.1f}" '
                  f'y2="{at(value):.1f}"/>',
                  text_of(edge - 5, at(value) + 4, number_of(value), "end")]
    if planned and min(planned) < 0:
        goal = at(min(planned))
        parts.append(f'<line class="goal" x1="{edge}" x2="{width - 6}" y1="{goal:.1f}" '
                     f'y2="{goal:.1f}"/>')
    tip = at(here)
    parts.append(f'<path class="electrode" d="M{edge + 22} {min(20.0, tip - 8):.1f}H{edge + 78}'
                 f'V{tip:.1f}H{edge + 22}Z"/>')
    return svg_of(width, height, [*parts, text_of(width - 8, 16, "depth: Z in mm", "end", "title")])


def strip(samples: Sequence[Sample], wire: bool) -> str:
    """The last half minute: gap voltage, classes of the pulses, and the way with its retractions.

    The way is Z; of a wire machine it is the speed, as its Z stands.
    """
    width, edge, right = 640.0, 52.0, 8.0
    shown = [one for one in samples if one.t >= samples[-1].t - SHOWN_S]
    end = shown[-1].t if shown else SHOWN_S

    def at(t: float) -> float:
        return width - right - (end - t) / SHOWN_S * (width - edge - right)

    parts: list[str] = []

    def axes(top: float, high: float, low: float, title: str, values: Sequence[float]) -> None:
        def y(value: float) -> float:
            return top + 60 - (value - low) / ((high - low) or 1) * 60

        parts.append(f'<rect class="field" x="{edge}" y="{top}" width="{width - edge - right}" '
                     'height="60"/>')
        for value in values:
            parts.append(f'<line class="grid" x1="{edge}" x2="{width - right}" y1="{y(value):.1f}" '
                         f'y2="{y(value):.1f}"/>')
            parts.append(text_of(edge - 5, y(value) + 4, number_of(value), "end"))
        parts.append(text_of(edge, top - 6, title, "start", "title"))

    volts = [(one.t, one.volts) for one in shown if one.volts is not None]
    highest = max((v for _, v in volts), default=0.0)
    most = next((end_v for end_v in VOLTS if end_v >= highest), VOLTS[-1])
    axes(22, most, 0.0, "mean gap voltage, V", (0, most / 2, most))
    if volts:
        parts.append(line_of(((at(t), 82 - min(v, most) / most * 60) for t, v in volts), "volts"))
    else:
        parts.append(text_of((edge + width) / 2, 56, "the controller does not tell it", "middle"))
    axes(110, 100.0, 0.0, "pulses by class, %", (0, 50, 100))
    parts += _classes(shown, at)
    values = [one.feed if wire else one.place for one in shown]
    low, high = _frame(values, 1.0 if wire else 0.1)
    axes(198, high, low, "speed, mm/min" if wire else "servo and retractions: Z, mm",
         ticks(low, high, 3))
    for before, after in itertools.pairwise(shown):
        if after.motion not in (0, 6):
            parts.append(f'<rect class="back" x="{at(before.t):.1f}" y="198" '
                         f'width="{max(1.5, at(after.t) - at(before.t)):.1f}" height="60"/>')
    parts.append(line_of(((at(one.t), 258 - (value - low) / (high - low) * 60)
                        for one, value in zip(shown, values, strict=True)), "way"))
    for ago in (30, 20, 10, 0):
        parts.append(text_of(at(end - ago), 274, f"{number_of(-ago)} s" if ago else "now",
                           "end" if not ago else "middle"))
    return svg_of(width, 280, parts)


def _classes(shown: Sequence[Sample], at: object) -> list[str]:
    """Shares of the classes as bands upon each other; moments without a pulse are empty."""
    assert callable(at)
    parts = []
    for before, after in itertools.pairwise(shown):
        if not after.pulses:
            continue
        base, left = 170.0, at(before.t)
        for name, share in zip(CLASSES, after.shares, strict=True):
            if share:
                base -= share * 60
                parts.append(f'<rect class="class-{name}" x="{left:.1f}" y="{base:.1f}" width='
                             f'"{at(after.t) - left + 0.4:.1f}" height="{share * 60:.1f}"/>')
    return parts
