# SPDX-License-Identifier: Apache-2.0
"""Plots of a run, as SVG text for the report's page.

A trace has far more samples than a page has columns. So a line is drawn as the envelope of the
samples that fall into each column: every retraction shows, however short it is.
"""

import io
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator, StrMethodFormatter
from matplotlib.typing import RcKeyType
from numpy.typing import NDArray

from host.run.events import Event
from host.run.retractions import Retraction
from host.run.workpiece import Columns, coarser

COLUMNS = 1400
PLAN_CELLS = 700  # on a side of the plan of a workpiece
INK, FAINT, GRID = "#1f2933", "#7b8794", "#e4e7eb"
PATH, FEED, ERROR, GAP, WIDTH = "#1d5d9b", "#3b7a57", "#8a5a83", "#b7791f", "#5b7083"
CAUSES = {"short": "#c0392b", "jump": "#2a9d8f", "operator": "#6c5ce7"}
CLASSES = {"ok": ("good", "#3b7a57"), "open": ("open", "#9fb3c8"), "dame": ("arc", "#dd8a2e"),
           "short": ("short", "#c0392b")}
PHASES = {"retract": ("R: retraction", "#f6d5d1"), "high": ("H: high re-advance", "#d6e8f7"),
          "low": ("E: low re-advance", "#d9efe3")}

STYLE: dict[RcKeyType, Any] = {
    "font.family": "sans-serif", "font.size": 9, "axes.edgecolor": FAINT, "axes.labelcolor": INK,
    "axes.linewidth": 0.7, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "grid.color": GRID, "grid.linewidth": 0.7, "axes.axisbelow": True,
    "xtick.color": FAINT, "ytick.color": FAINT, "xtick.labelcolor": INK, "ytick.labelcolor": INK,
    "legend.frameon": False, "legend.fontsize": 8.5, "lines.linewidth": 1.1,
    "svg.fonttype": "none",         # the page's own font, and text that can be searched
    "svg.hashsalt": "gapkeeper",    # the same run gives the same page
}


def svg(draw: Callable[..., None], width: float, height: float, *arguments: Any) -> str:
    """SVG of a figure in inches, drawn by ``draw(figure, *arguments)``."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure, *arguments)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None}, transparent=True)
    return text.getvalue()[text.getvalue().index("<svg"):]


def envelope(t: NDArray[Any], values: NDArray[Any],
             columns: int = COLUMNS) -> tuple[NDArray[Any], NDArray[Any]]:
    """Thin out a line to the least and the greatest value of each of ``columns`` stretches."""
    step = len(t) // columns
    if step < 4:
        return t, values
    whole = len(t) // step * step
    blocks = values[:whole].reshape(-1, step)
    starts = np.arange(0, whole, step)
    picked = np.sort(np.concatenate([[0, len(t) - 1], starts + blocks.argmin(axis=1),
                                     starts + blocks.argmax(axis=1)]))
    return t[picked], values[picked]


def averages(t: NDArray[Any], values: NDArray[Any],
             columns: int = COLUMNS // 4) -> tuple[NDArray[Any], NDArray[Any]]:
    """Means of ``values`` over each of ``columns`` stretches of time."""
    step = max(1, len(t) // columns)
    whole = len(t) // step * step
    return t[:whole].reshape(-1, step).mean(axis=1), values[:whole].reshape(-1, step).mean(axis=1)


def _smoothed(values: NDArray[Any], samples: int = 10) -> NDArray[Any]:
    """Running mean."""
    return np.convolve(values, np.ones(samples) / samples, mode="same")[:len(values)]


def overview(trace: Columns, events: list[Event], retractions: list[Retraction],
             letters: str = "z") -> str:
    """Position, feed, following error, gap and pulse classes against time.

    ``letters`` are the axes to draw: Z of a sinker, X and Y of a wire machine.
    """
    return svg(_overview, 11.6, 10.2, trace, events, retractions, letters)


def _overview(figure: Figure, trace: Columns, events: list[Event],
              retractions: list[Retraction], letters: str) -> None:
    def position(ax: Axes) -> None:
        if letters == "z":
            _position(ax, trace, events, retractions)
        else:
            _positions(ax, trace, retractions, letters)

    # Height of a panel, the column that it needs, and the function that draws it.
    panels: list[tuple[float, str, Callable[[Axes], None]]] = [
        (3.2, "t", position), (1.2, "feed", lambda ax: _feed(ax, trace)),
        (1.0, "t", lambda ax: _errors(ax, trace, letters)),
        (1.0, "gap_v", lambda ax: _voltage(ax, trace)),
        (1.0, "gap_um", lambda ax: _width(ax, trace)), (1.5, "t", lambda ax: _classes(ax, trace))]
    panels = [panel for panel in panels if panel[1] in trace]
    axes = figure.subplots(len(panels), 1, sharex=True,
                           height_ratios=[height for height, _, _ in panels])
    for ax, (_, _, draw) in zip(axes, panels, strict=True):
        draw(ax)
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(trace["t"][0], max(trace["t"][-1], events[-1]["t"] if events else 0))
    figure.align_ylabels(axes)


def _errors(ax: Axes, trace: Columns, letters: str) -> None:
    for letter, colour in zip(letters, (ERROR, GAP), strict=False):
        ax.plot(*envelope(trace["t"], trace[f"error_{letter}"]), color=colour,
                label=letter.upper())
    ax.set_ylabel(f"Er of {' and '.join(letters.upper())}\n(pulses)")
    if len(letters) > 1:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)


def _voltage(ax: Axes, trace: Columns) -> None:
    ax.plot(*averages(trace["t"], trace["gap_v"]), color=GAP)
    ax.set_ylabel("mean gap\nvoltage (V)")
    ax.set_ylim(bottom=0)


def _width(ax: Axes, trace: Columns) -> None:
    ax.plot(*averages(trace["t"], trace["gap_um"]), color=WIDTH)
    ax.set_ylabel("true gap\n(µm)")
    ax.set_ylim(0, _typical(trace["gap_um"]))


def _typical(values: NDArray[Any]) -> float:
    """Top of a scale for the usual values; retractions go far beyond."""
    return max(2.5 * float(np.median(values)), 10.0) if len(values) else 10.0


def _position(ax: Axes, trace: Columns, events: list[Event],
              retractions: list[Retraction]) -> None:
    t, z = envelope(trace["t"], trace["z"])
    ax.axhline(0, color=FAINT, linewidth=0.8)
    ax.plot(t, z, color=PATH, linewidth=1.0, zorder=3)
    for cause, colour in CAUSES.items():
        ends = [one.end["t"] for one in retractions if one.cause == cause and one.end]
        if not ends:
            continue
        ax.plot(ends, _height(trace, ends), "^", color=colour, markersize=4.5, zorder=4,
                label=f"end of a retraction ({cause})")
    low, high = min(z.min(), 0), max(z.max(), 0.001)
    bounded = [one for one in retractions if one.limit]
    if bounded:
        starts = [one.start["t"] for one in bounded]
        limits = _height(trace, starts) + [one.limit for one in bounded]
        ax.plot(starts, limits, "_", color=INK, markersize=7,
                markeredgewidth=1.0, zorder=2, label="its retractable limit L")
        high = max(high, limits.max())
    _data_changes(ax, trace, events)
    _condition_changes(ax, trace, events)
    ax.set_ylabel("Z (mm)")
    if retractions:
        ax.legend(*ax.get_legend_handles_labels(), loc="upper right", ncols=4)
    ax.set_ylim(low - 0.05 * (high - low), high + 0.16 * (high - low))


def _positions(ax: Axes, trace: Columns, retractions: list[Retraction], letters: str) -> None:
    for letter, colour in zip(letters, (PATH, FEED), strict=True):
        ax.plot(*envelope(trace["t"], trace[letter]), color=colour, label=letter.upper())
        for cause, mark in CAUSES.items():
            ends = [one.end["t"] for one in retractions if one.cause == cause and one.end]
            ax.plot(ends, np.interp(ends, trace["t"], trace[letter]), "^", color=mark,
                    markersize=4.5, zorder=4)
    ax.set_ylabel("position (mm)")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(letters))


def above(trace: Columns, retractions: list[Retraction], plan: Columns | None,
          parameters: dict[str, Any]) -> str:
    """Path of X and Y from above; with a wire's ``plan`` also the remaining workpiece."""
    radius = parameters["wire"]["diameter_mm"] / 2 if plan else 0.0
    margin = max(1.5 * radius, 0.05)
    wide, high = (float(np.ptp(trace[axis])) + 2 * margin for axis in "xy")
    height = min(max(10.6 * high / wide, 0.8), 7.0) + 0.8
    return svg(_above, 11.6, height, trace, retractions, plan, radius, margin)


def _above(figure: Figure, trace: Columns, retractions: list[Retraction], plan: Columns | None,
           radius: float, margin: float) -> None:
    ax = figure.subplots()
    if plan:
        coarse = coarser(plan, PLAN_CELLS)
        ax.contourf(coarse["x"], coarse["y"], coarse["left"], [0.5, 1.5], colors=[GRID])
        ax.contour(coarse["x"], coarse["y"], coarse["left"], [0.5], colors=[FAINT],
                   linewidths=0.8)
        ax.add_patch(Circle((trace["x"][-1], trace["y"][-1]), radius, fill=False, color=INK))
    x, y = _bends(trace)
    ax.plot(x, y, color=PATH, linewidth=1.0, zorder=3)
    for cause, colour in CAUSES.items():
        begins = [one.start["t"] for one in retractions if one.cause == cause]
        if begins:
            ax.plot(*(np.interp(begins, trace["t"], trace[axis]) for axis in "xy"), ".",
                    color=colour, zorder=4, label=f"retraction ({cause})")
    if retractions:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(CAUSES))
    ax.set_aspect("equal")
    for axis, bound in (("x", ax.set_xlim), ("y", ax.set_ylim)):
        bound(trace[axis].min() - margin, trace[axis].max() + margin)
    ax.set_xlabel("X (mm)")
    ax.set_ylabel("Y (mm)")


def _bends(trace: Columns) -> NDArray[Any]:
    """Points of the path, without those that are very near the one before."""
    points = np.column_stack([trace["x"], trace["y"]])
    least = max(float(np.ptp(points, axis=0).max()) / COLUMNS, 1e-4)
    keep, last = [0], points[0]
    for index, point in enumerate(points):
        if np.abs(point - last).max() >= least:
            keep.append(index)
            last = point
    keep.append(len(points) - 1)
    bends: NDArray[Any] = points[keep].T
    return bends


def _height(trace: Columns, times: Any) -> NDArray[Any]:
    """Z at some times. That of events is in the program's frame, which G92 may have moved."""
    heights: NDArray[Any] = np.interp(times, trace["t"], trace["z"])
    return heights


def _data_changes(ax: Axes, trace: Columns, events: list[Event]) -> None:
    """Mark where retraction data came into force, and at which depth."""
    changes = [event for event in events if event["event"] == "retraction_set"
               and event["source"] == "tape"]
    for index, event in enumerate(changes):
        ax.axvline(event["t"], color=FAINT, linewidth=0.8, linestyle=(0, (4, 3)))
        since = f", from Zr = {event['pos']['z']:.2f}" if index else ""
        name = f"G36 L{event['limit']:g}{since}"
        ax.annotate(name, (event["t"], 0), xytext=(4, 4), xycoords=("data", "axes fraction"),
                    textcoords="offset points", color=INK, fontsize=8.5).set_in_layout(False)
        if index:
            ax.axhline(float(_height(trace, event["t"])), color=FAINT, linewidth=0.8,
                       linestyle=(0, (4, 3)))


def _condition_changes(ax: Axes, trace: Columns, events: list[Event]) -> None:
    """Mark where the depth has switched the condition."""
    for event in _switches(events):
        place = event["t"], float(_height(trace, event["t"]))
        ax.plot(*place, "D", color=INK, markersize=4, zorder=5)
        ax.annotate(f"C{event['number']}, {event['ip']:g} IP", place, xytext=(6, 3),
                    textcoords="offset points", color=INK, fontsize=8.5).set_in_layout(False)


def _switches(events: list[Event]) -> list[Event]:
    return [event for event in events if event["event"] == "condition" and event["by"] == "series"]


def staircase(trace: Columns, events: list[Event]) -> str:
    """Current against the depth reached, if a depth series has switched it; else nothing."""
    if not _switches(events):
        return ""
    return svg(_staircase, 11.6, 2.6, trace, events)


def _staircase(figure: Figure, trace: Columns, events: list[Event]) -> None:
    ax = figure.subplots()
    changes = [event for event in events if event["event"] == "condition"]
    reached = np.minimum.accumulate(trace["z"])
    depths = [-float(np.interp(event["t"], trace["t"], reached)) for event in changes]
    ends = [*depths, -float(reached[-1])]
    ax.step(ends, [event["ip"] for event in [*changes, changes[-1]]], where="post", color=PATH)
    for event, depth in zip(changes, depths, strict=True):
        ax.annotate(f"C{event['number']}", (depth, event["ip"]), xytext=(3, 3),
                    textcoords="offset points", color=INK, fontsize=8.5)
    ax.set_ylim(0, 1.25 * max(event["ip"] for event in changes))
    ax.set_xlabel("depth reached (mm)")
    ax.set_ylabel("current (IP)")


def cavity(walls: dict[str, Any]) -> str:
    """Section of a cavity's wall: by how much it is wider than the electrode, by depth."""
    return svg(_cavity, 11.6, 3.4, walls)


def _cavity(figure: Figure, walls: dict[str, Any]) -> None:
    ax = figure.subplots()
    wall(ax, walls, color=PATH)
    widest = walls["widest_um"]
    ax.axvline(widest, color=CAUSES["short"], linewidth=0.9, linestyle=(0, (4, 3)),
               label=f"widest, {widest:.1f} µm")
    ax.axvline(0, color=INK, linewidth=1.2, label="side of the electrode")
    ax.set(xlabel="opening on each side (µm)", ylabel="depth (mm)",
           xlim=(-0.05 * widest, 1.15 * widest), ylim=(1.04 * walls["depth_mm"][-1], 0))
    ax.legend(loc="lower left", bbox_to_anchor=(1.0, 0.0))


def wall(ax: Axes, walls: dict[str, Any], **style: Any) -> None:
    """Draw the layers of a cavity's wall, opening against depth."""
    depths = [0.0, *np.repeat(walls["depth_mm"], 2)[:-1]]
    ax.plot(np.repeat(walls["opening_um"], 2), depths, **style)


def _feed(ax: Axes, trace: Columns) -> None:
    # Machining feeds are a hundred times slower than retractions, and both must be visible. In a
    # millisecond a machining feed makes a pulse or two, so ten samples are taken together.
    ax.plot(*envelope(trace["t"], _smoothed(trace["feed"])), color=FEED, linewidth=0.9)
    ax.set_yscale("symlog", linthresh=10)
    ax.set_yticks([-1000, -100, -10, 0, 10, 100, 1000])
    ax.yaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    ax.minorticks_off()
    ax.axhline(0, color=FAINT, linewidth=0.7)
    ax.set_ylabel("feed\n(mm/min)")


def _classes(ax: Axes, trace: Columns) -> None:
    step_s = trace["t"][1] - trace["t"][0] if len(trace["t"]) > 1 else 1.0
    stack = {name: averages(trace["t"], trace[name] / step_s / 1000) for name in CLASSES}
    ax.stackplot(stack["ok"][0], [rate for _, rate in stack.values()], linewidth=0,
                 labels=[title for title, _ in CLASSES.values()],
                 colors=[colour for _, colour in CLASSES.values()])
    ax.set_ylabel("pulses\n(1000/s)")
    ax.legend(loc="upper right", ncols=4)
    total = np.sum([rate for _, rate in stack.values()], axis=0)
    ax.set_ylim(0, max(total.max() * 1.35, 0.1))


def close_up(trace: Columns, one: Retraction, pulses_per_mm: int) -> str:
    """Distance to the start point against time over one retraction, phase by phase.

    Raises
    ------
    ValueError
        If it has not ended.
    """
    return svg(_close_up, 11.6, 4.0, trace, one, pulses_per_mm)


def _close_up(figure: Figure, trace: Columns, one: Retraction, pulses_per_mm: int) -> None:
    if one.end is None:
        raise ValueError("only a retraction that has ended can be drawn")
    ax = figure.subplots()
    begin, end = one.start["t"], one.resume["t"] if one.resume else one.end["t"]
    margin = 0.12 * (end - begin)
    near = (trace["t"] >= begin - margin) & (trace["t"] <= end + margin)
    t = (trace["t"][near] - begin) * 1000
    if np.ptp(trace["z"]) > 0.001:
        ax.plot(t, trace["z"][near] - _height(trace, begin), color=FAINT, linewidth=1.0, zorder=3,
                label="electrode, by its encoder")
    # The start point lies between two samples, so it is computed from a place that is a sample.
    front = np.interp(end, trace["t"], trace["path"])
    if not one.resume:
        front += one.distance * pulses_per_mm
    ax.plot(t, (front - trace["path"][near]) / pulses_per_mm, color=PATH, linewidth=1.6, zorder=4,
            label="commanded path")
    edges = [("retract", begin, one.end["t"])]
    marks = [*((event["phase"], event["t"]) for event in one.advances), (None, end)]
    edges += [(name, at, until) for (name, at), (_, until) in pairwise(marks)]
    for name, at, until in edges:
        title, colour = PHASES[name]
        ax.axvspan((at - begin) * 1000, (until - begin) * 1000, color=colour, linewidth=0,
                   zorder=0, label=title)
    ax.axhline(0, color=FAINT, linewidth=0.9)
    low = one.phase("low")
    if low and one.phase("high"):
        ax.axhline(low["from"], color=INK, linewidth=0.9, linestyle=(0, (4, 3)),
                   label=f"changeover Q = {low['from']:g} mm")
    ax.plot((one.end["t"] - begin) * 1000, one.distance, "^", color=CAUSES[one.cause], zorder=5,
            label=f"end BE, {one.distance:.4f} mm ({one.end['reason']})")
    if one.limit and one.distance > one.limit / 3:
        ax.axhline(one.limit, color=CAUSES["short"], linewidth=0.9,
                   label=f"limit L = {one.limit:g} mm")
    ax.set_xlabel("time since the short (ms)" if one.cause == "short"
                  else f"time since the {one.cause} (ms)")
    ax.set_ylabel("distance from the\nstart point BS (mm)")
    ax.set_xlim(-margin * 1000, (end - begin + margin) * 1000)
    ax.yaxis.set_major_locator(MaxNLocator(6))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
