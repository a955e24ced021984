# SPDX-License-Identifier: Apache-2.0
"""The report of a run: one HTML file that needs nothing else."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from host import alarms
from host.run import clearing, figures
from host.run.events import Event
from host.run.retractions import Retraction, collect, most_telling
from host.run.run import VOLTAGE
from host.run.summary import discharged
from host.run.workpiece import Columns
from softcore.tables.settings import of_number

DASH, MINUS, THIN_SPACE = "\u2013", "\u2212", "\u202f"

OUTCOMES = {
    "end": ("program end", "good"),
    "stopped": ("stopped", "fair"),
    "alarm": ("alarm", "bad"),
    "rejected": ("tape rejected", "bad"),
}
REASONS = {"cleared": "cleared", "limit": "at the limit", "path_start": "at the path's start"}
PHASES = {"high": "forward at H", "low": "forward at E"}
MOVED_MM = 0.001    # more than the trembling of an axis at rest
PRESSED_MM = 0.005  # contact alone is at most some micrometres; anything more was pushed in
# The listing shows blocks and conditions, so the table of events leaves them out.
QUIET = {"block"}
SHORTS_BY = {
    "voltage": "Shorts (Ss) by the gap voltage of each pulse.",
    "current": "Shorts (Ss) by the current without an ignition delay.",
    "mean": "Shorts (Ss) by the mean gap voltage; they end by the voltage of sensing pulses.",
    "mean,current": "Shorts (Ss) by the mean gap voltage; they end by the current of sensing "
                    "pulses.",
}


def _number(value: float | None, digits: int = 3) -> str:
    """A number for a sentence: without trailing zeros, with a true minus sign."""
    if value is None:
        return DASH
    text = f"{value:,.{digits}f}" if isinstance(value, float) else f"{value:,}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace(",", THIN_SPACE).replace("-", MINUS)


def _fixed(value: float | None, digits: int) -> str:
    """A number for a column: a fixed number of digits, a true minus sign."""
    return DASH if value is None else f"{value:.{digits}f}".replace("-", MINUS)


def _flat(parameters: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the leaves of nested tables, named with dots."""
    for name, value in parameters.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _parameter(name: str) -> str:
    """Name of a machine's number; of a setting of the controller its number and its name."""
    table, _, key = name.partition(".")
    setting = of_number(int(key)) if table == "settings" else None
    return f"${setting.number} {setting.name}" if setting else name


def _details(event: Event) -> str:
    """Values of an event beside its time and place."""
    common = {"cycle", "t", "event", "line", "pos"}
    said = {name.replace("_", " "): value if isinstance(value, str) else _number(value, 4)
            for name, value in _flat({name: value for name, value in event.items()
                                      if name not in common and value is not None})}
    return ", ".join(f"{name} {value}" for name, value in said.items())


def guards_off(summary: dict[str, Any]) -> str:
    """Sentence on guards of the machine that settings have switched off; empty if none is."""
    names = ", ".join(summary["guards_off"])
    return f"Switched off by settings: {names}." if names else ""


def shorts_by(summary: dict[str, Any]) -> str:
    """Sentence on what tells a short."""
    # A summary of an earlier version has no word on it: there was only the voltage to go by.
    return SHORTS_BY[summary.get("short_by", VOLTAGE)]


def begun_at(summary: dict[str, Any]) -> str:
    """Sentence on a tape that was not run from its beginning; empty if it was."""
    block = summary.get("from_block", 0)
    return (f"Begun at block {block}: the blocks before it only set modes and places."
            if block > 1 else "")


def collision(summary: dict[str, Any]) -> str:
    """Sentence on an electrode that was pushed into solid work; empty if it was not."""
    pressed = summary.get("pressed_mm", 0.0)
    return "" if pressed <= PRESSED_MM else (
        f"The electrode was pressed {pressed:.3f} mm into the workpiece: on a real machine, a "
        "collision.")


def _story(one: Retraction, last: bool) -> str:
    """Sentence on what a retraction did, as far as it came."""
    steps = ["Back at R of the jump" if one.cause == "jump" else "Back at R"]
    steps += [PHASES[event["phase"]] for event in one.advances]
    if one.resume:
        steps.append("then the feed resumed at the start point BS")
    else:
        steps.append(f"but {'the run ended' if last else 'the next one began'} before the feed "
                     "resumed")
    return ", ".join(steps) + "."


def _tiles(summary: dict[str, Any], retractions: list[Retraction],
           wire: bool) -> list[tuple[str, str, str]]:
    shorts = [one.start["latency_cycles"] for one in retractions if one.cause == "short"]
    pulses = summary["discharges"]
    burnt, total = discharged(pulses), sum(pulses.values())
    counts = summary["retractions"]
    cut = ([("deepest", f"{_number(summary['max_depth_mm'])} mm",
             "below Z 0 at the program's start")] if not wire else
           [("removed", f"{_number(summary['removed_mm3'])} mm³", "cut from the workpiece")]
           if "removed_mm3" in summary else [])
    speed = [("simulated in", f"{_number(summary['wall_s'], 1)} s",
              f"{_number(summary['cycles_per_s'] / 1e6, 2)} million clocks a second")
             ] if "wall_s" in summary else []
    return [
        *cut,
        ("time on the machine", f"{_number(summary['time_s'], 2)} s",
         f"{_number(summary['cycles'])} clocks at {_number(summary['clock_hz'] / 1e6)} MHz"
         if "cycles" in summary else "since the connection, by the computer's clock"),
        ("retractions", _number(counts["count"]),
         ", ".join(f"{_number(counts[cause])} {cause}" for cause in ("short", "jump", "operator")
                   if counts[cause]) or "none was needed"),
        ("slowest reaction", f"{_number(max(shorts))} clocks" if shorts else DASH,
         "from the sample that completed a short to the last forward pulse"),
        ("discharges", _number(burnt),
         (f"{_number(100 * pulses['ok'] / burnt, 1)} % good; " if burnt else "")
         + f"of {_number(total)} pulses {_number(pulses['open'])} were open and "
           f"{_number(pulses['short'])} short" if total else "no pulse was given"),
        *speed,
    ]


def render(*, title: str, listing: Sequence[tuple[int, str]], machine: str,
           parameters: dict[str, Any], summary: dict[str, Any], events: list[Event],
           trace: Columns, plan: Columns | None = None) -> str:
    """HTML of a run.

    ``listing`` is the tape's text with its line numbers, ``parameters`` the machine's nested
    tables, ``plan`` the remaining workpiece of a wire machine. The others are the files of the
    run's folder. There is a view from above if X or Y has moved. Columns that the trace lacks, as
    it does for a controller at a port, are not drawn.
    """
    lateral = any(np.ptp(trace[axis]) > MOVED_MM for axis in "xy" if len(trace[axis]))
    wire = bool(plan) or parameters.get("kind") == "wire"
    axes = "xy" if wire else "z"
    retractions = collect(events)
    telling = most_telling([one for one in retractions if one.end])
    drawn = len(trace["t"]) > 1
    close_up = story = ""
    if drawn and telling and "path" in trace:
        close_up = figures.close_up(trace, telling, parameters["pulses_per_mm"])
        story = _story(telling, telling is retractions[-1])
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    environment.filters |= {"number": _number, "fixed": _fixed}
    code = summary["alarm"]["code"] if summary["alarm"] else 0
    outcome, colour = OUTCOMES[summary["outcome"]]
    return environment.get_template("report.html.j2").render(
        title=title, machine=machine, summary=summary, outcome=outcome, colour=colour,
        cause=alarms.cause(code), remedy=alarms.remedy(code),
        tiles=_tiles(summary, retractions, wire), listing=listing,
        guards_off=guards_off(summary), begun_at=begun_at(summary), shorts_by=shorts_by(summary),
        collision=collision(summary), axes=axes, wire=wire,
        overview=figures.overview(trace, events, retractions, axes) if drawn else "",
        staircase=figures.staircase(trace, events) if drawn else "",
        cavity=figures.cavity(summary["cavity"]) if "cavity" in summary else "",
        above=figures.above(trace, retractions, plan, parameters) if drawn and lateral else "",
        plan=bool(plan), telling=telling, close_up=close_up,
        story=story,
        retractions=retractions, reasons=REASONS,
        cleared=summary.get("clear_of_shorts", []), links=clearing.LINKS,
        events=[event for event in events if event["event"] not in QUIET],
        details=_details,
        parameters=sorted((_parameter(name), str(value) if isinstance(value, list) else value)
                          for name, value in _flat(parameters)),
    )
