# SPDX-License-Identifier: Apache-2.0
"""The campaign's page: one HTML file that needs nothing else, in the look of a run's report."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from testbench.faults.campaign import ClassResult
from testbench.faults.flips import Flips
from testbench.faults.outcome import Outcome
from testbench.faults.stops import Figure

__all__ = ["is_good", "render"]

COLOURS = {Outcome.NO_EFFECT: "none", Outcome.SAFE_TOLD: "good", Outcome.SAFE_UNTOLD: "fair",
           Outcome.WRONG: "bad"}
THIN_SPACE, DASH = "\u202f", "\u2013"


def _number(value) -> str:
    return DASH if value is None else f"{value:,}".replace(",", THIN_SPACE)


def _tiles(done, figures):
    total = {outcome: sum(one.outcomes[outcome] for one in done) for outcome in Outcome}
    tried = sum(total.values())
    return [("classes", len(done), f"{sum(not one.results for one in done)} not injected here"),
            ("trials", tried, f"in {sum(one.seconds for one in done):.0f} s"),
            *((outcome.value, total[outcome],
               f"{100 * total[outcome] / tried:.1f} %" if tried else "none tried")
              for outcome in Outcome),
            ("stops", len(figures or ()), "measured at the pins")]


def is_good(done: Sequence[ClassResult], figures: Sequence[Figure] | None,
            flips: Flips | None) -> bool:
    """Whether all is as it must be; None stands for a part that could not be tried."""
    return figures is not None and flips is not None and all(
        one.good for one in (*done, *figures, flips))


def render(done: Sequence[ClassResult], figures: Sequence[Figure] | None, seed: int,
           flips: Flips | None) -> str:
    """HTML of a campaign: classes, figures of the stops, changed bits."""
    good = is_good(done, figures, flips)
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, trim_blocks=True,
        lstrip_blocks=True, undefined=StrictUndefined)
    environment.filters["number"] = _number
    return environment.get_template("report.html.j2").render(
        done=done, figures=figures, seed=seed, good=good, flips=flips, tiles=_tiles(done, figures),
        outcomes=list(Outcome), colours=COLOURS, version=version("gapkeeper"))
