# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper tune``: the loops of the axes at a port, told on the terminal and drawn."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

from host.errors import UsageError, UserError
from host.link.link import Link
from host.link.lock import taken
from host.link.port import Port
from host.machines import machine as machines
from host.run.controller import Controller
from host.run.figures import ERROR, FAINT, PATH, svg
from host.touch.command import ways_of
from host.tune.drive import response
from host.tune.motions import SLOW, measuring, settings_of, speed_of
from host.tune.tune import Measured, Proposal, loop_of, measured, proposal, with_values
from softcore.tables.settings import named

__all__ = ["drawn", "moves_of", "told_of", "tune"]

WIDTH, HEIGHT = 9.0, 2.6    # inches, of the picture of one axis
SHOWN_S = 0.15              # of a motion


def tune(url: str, ways: str, *, travel_mm: float, baud: int, machine: str, picture: Path,
         unlock: bool, console: Console) -> Proposal:
    """Measure the axes of ``ways`` ("X+Z-") at ``url``; tell and draw what to set.

    A locked machine is unlocked if ``unlock`` is wanted.

    Raises
    ------
    UserError
        If the controller cannot be reached, is locked, refuses a line or is in alarm, an axis does
        not follow, or the picture cannot be written.
    """
    def say(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    chosen, moves = machines.load(machine), moves_of(ways, travel_mm)
    port = Port(url, baud)
    try:
        controller = Controller(port, chosen, clock_hz=chosen.clock_hz, say=say)
        controller.identify(reset=False)
        link = Link(controller, _quiet)
        link.await_greeting()
        with taken(link, unlock=unlock):
            settings, found = settings_of(link), []
            with measuring(link, settings) as kept:
                for axis, way in moves.items():
                    one = measured(link, settings, axis, way, travel_mm, time_s=port.time_s)
                    found.append(one)
                    say(told_of(one, settings))
    finally:
        port.close()
    wanted = proposal(settings, found)
    for note in [*kept, *wanted.notes]:
        say(note)
    say(f"Proposed; nothing {'else ' if kept else ''}has been changed. Enter what you want:")
    for name, value in wanted.values.items():
        say(f"${named(name).number}={value}   (now {settings[name]}: {named(name).title})")
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        picture.write_text(drawn(settings, found, wanted), encoding="utf-8")
    except OSError as error:
        raise UserError(f"{picture} cannot be written: {error.strerror}.") from error
    say(f"measured and predicted: {picture}")
    return wanted


def moves_of(ways: str, travel_mm: float) -> dict[str, int]:
    """Directions by axis, of a text such as "X+Z-".

    Raises
    ------
    UsageError
        If the text has none, or the travel is no number above 0.
    """
    if not 0 < travel_mm < math.inf:
        raise UsageError(f"the travel must be above 0 mm, and finite, not {travel_mm:g}.")
    return ways_of(ways)


def told_of(one: Measured, settings: Mapping[str, int]) -> str:
    """What was found of an axis, as a sentence."""
    drive, fit = one.drive, one.fit
    limit = ("unknown" if fit.least is None or fit.most is None else
             f"at least {fit.least:.0f} mm/s2" if math.isinf(fit.most) else
             f"{fit.least:.0f} to {fit.most:.0f} mm/s2")
    axis = one.axis.lower()
    set_already = [f"${named(name).number}" for name in (f"drive_offset_{axis}",
                                                         f"drive_friction_{axis}")
                   if settings[name] != named(name).default]
    beside = f" beside what {' and '.join(set_already)} make up for" if set_already else ""
    return (f"{one.axis}: loop gain {settings['loop_gain'] * drive.gain:.1f} 1/s "
            f"(set: {settings['loop_gain']}), offset {drive.offset:+.3f} mm/s, friction "
            f"{drive.friction:.3f} mm/s{beside}, lags "
            f"{1000 * drive.lag_s:.1f} and {1000 * drive.filter_s:.1f} ms, dead time "
            f"{1000 * drive.dead_s:.1f} ms, acceleration {limit}; {len(one.samples)} "
            f"reports, which this explains to {1000 * fit.left:.2f} um (rms)")


def drawn(settings: Mapping[str, int], found: Sequence[Measured], wanted: Proposal) -> str:
    """An SVG of the following error of each axis, measured and predicted."""
    return svg(_steps, WIDTH, HEIGHT * len(found), settings, found, wanted)


def _steps(figure: Figure, settings: Mapping[str, int], found: Sequence[Measured],
           wanted: Proposal) -> None:
    """Following error after the start of a motion: measured, as now, and as proposed."""
    plots = figure.subplots(len(found), 1, squeeze=False)[:, 0]
    times = np.arange(0, SHOWN_S, 1e-4)
    for one, ax in zip(found, plots, strict=True):
        speed = speed_of(settings, one.axis)
        near = [sample for sample in one.samples
                if sample.time_s < SHOWN_S and not sample.before
                and abs(sample.speed) > speed / SLOW]
        ax.plot([1000 * sample.time_s for sample in near], [1000 * sample.error for sample in near],
                ".", color=ERROR, markersize=4, label="measured")
        for drive, loop, colour, title in (
                (one.drive, loop_of(settings, one.axis), PATH, "predicted, as set"),
                (*with_values(one, settings, wanted.values), FAINT, "predicted, as proposed")):
            for way, label in (speed, title), (-speed, None):
                ax.plot(1000 * times, 1000 * response(drive, loop, way, times), color=colour,
                        label=label)
        ax.set_ylabel(f"{one.axis}: following error, µm")
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3)
    plots[-1].set_xlabel(f"ms after the start of a motion at {60 * speed:g} mm/min")


def _quiet(line: str) -> None:
    """Take a line that nobody waits for."""
