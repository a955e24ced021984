# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment networks``: the planner's networks on poor data, beside interpolation.

The least undersize is known here, as a formula; the planner sees only basic data made from it,
which are as in ``DATA``: whole, with gaps, with noise, few, without the area next to the job, or
all of that together. For random jobs it plans three times: as it always does, with the answer of
every network whether it is trusted or not, and with the interpolation alone. Each staircase is then
judged by the formula.

There are two formulas. ``straight`` is that of the shipped data: nearly linear in the current. In
``bent`` the undersize rises with the power 0.6 of the current; that is a choice, so that the
interpolation has something to miss.
"""

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from host.errors import UserError
from host.experiments.common import (
    Record,
    in_parallel,
    make_folder,
    markdown,
    write_results,
)
from host.roughing import synthetic
from host.roughing.basic import BasicData
from host.roughing.staircase import Answers, Job, Staircase, plan
from host.words import counted

__all__ = ["DATA", "FIGURES", "TRUTHS", "Trial", "basic_data", "judge", "networks", "run",
           "statistics", "table"]

Truth = Callable[[float, float, float], float]  # area (mm2), IP, depth (mm): least undersize, um


def _bent(area_mm2: float, ip: float, depth_mm: float) -> float:
    spread = 1 + 0.2 * math.log2(area_mm2 / 50)
    return float(10 + 40 * ip**0.6 + 0.9 * ip**0.8 * depth_mm**0.7 * spread)


TRUTHS: dict[str, Truth] = {"straight": synthetic.undersize_um, "bent": _bent}
GAPS, NOISE = 0.5, 0.02             # share of the currents left out; deviation of a value
FEW_CURRENTS, FEW_DEPTHS = (1, 4, 9, 15), (0, 5, 15, 40)
LEAST_UM = 0.1                      # by which a value rises over its neighbours
ALLOWED_UM = 1.0                    # beyond the undersize, so that rounding is no fault

# Kind of data: gaps, noise, few, without the next area.
DATA = {
    "whole": (False, False, False, False), "gaps": (True, False, False, False),
    "noise": (False, True, False, False), "few": (False, False, True, False),
    "area left out": (False, False, False, True), "all of these": (True, True, True, True),
}
FIGURES = {
    "right": ("current of the last step right, %", 0),
    "excess": (f"more than {ALLOWED_UM:g} um beyond the undersize, % of jobs", 0),
    "worst_um": ("worst excess, um", 1),
    "time": ("time, times that of the true staircase", 3),
    "refused": ("job refused, %", 0),
}


@dataclass(frozen=True)
class Trial:
    """A job on data of one kind; all three answers."""

    truth: str
    data: str
    seed: int


def _job(truth: Truth, rng: random.Random) -> Job:
    """A job whose undersize some current from 2 to 14 IP just needs."""
    area = round(math.exp(rng.uniform(math.log(21), math.log(399))), 1)
    depth = round(rng.uniform(1, 39), 2)
    return Job(area, round(truth(area, rng.uniform(2, 14), depth), 1), depth)


def _risen(rows: np.ndarray) -> np.ndarray:
    """Values that rise with the current and the depth, as basic data must."""
    for row, column in product(range(rows.shape[0]), range(rows.shape[1])):
        before = [rows[row - 1, column]] * (row > 0) + [rows[row, column - 1]] * (column > 0)
        rows[row, column] = max([rows[row, column], *(one + LEAST_UM for one in before)])
    return np.round(rows, 1)


def basic_data(truth: Truth, kind: str, area_mm2: float, rng: random.Random) -> list[BasicData]:
    """Data of a kind, for a job on an area."""
    gaps, noise, few, held_out = DATA[kind]
    areas = list(synthetic.AREAS_MM2)
    if held_out:    # of those between the first and the last, so that the job stays inside
        areas.remove(min(areas[1:-1], key=lambda one: abs(math.log(one / area_mm2))))
    depths = FEW_DEPTHS if few else synthetic.DEPTHS_MM
    made = []
    for area in areas:
        every = FEW_CURRENTS if few else synthetic.CURRENTS
        inner = every[1:-1]
        kept = rng.sample(inner, round(len(inner) * (1 - GAPS))) if gaps else inner
        currents = [every[0], *sorted(kept), every[-1]]
        rows = np.array([[truth(area, ip, depth) * (1 + NOISE * rng.gauss(0, 1) * noise)
                          for depth in depths] for ip in currents])
        made.append(BasicData(
            name=f"{area} mm2", electrode="copper", workpiece="steel", area_mm2=area,
            source="experiment", depth_mm=tuple(map(float, depths)),
            ip=tuple(map(float, currents)), bottom_um=(10.0,) * len(currents),
            side_um=(10.0,) * len(currents),
            undersize_um=tuple(tuple(map(float, row)) for row in _risen(rows)),
            finish_um=((1.0, 0.0),)))
    return made


def _deepest(truth: Truth, job: Job, ip: float) -> float:
    """Depth to which a current may go, at most the job's."""
    low, high = 0.0, job.depth_mm
    if truth(job.area_mm2, ip, high) <= job.undersize_um:
        return high
    for _ in range(40):
        middle = (low + high) / 2
        fits = truth(job.area_mm2, ip, middle) <= job.undersize_um
        low, high = (middle, high) if fits else (low, middle)
    return low


def _true_time(truth: Truth, job: Job) -> float:
    """Time of the best staircase of whole IP, with removal in proportion to the current."""
    total, above = 0.0, 0.0
    for ip in reversed(synthetic.CURRENTS):
        deepest = max(above, _deepest(truth, job, ip))
        total, above = total + (deepest - above) / ip, deepest
    return total


def judge(truth: Truth, found: Staircase) -> Record:
    """Figures of a staircase by the formula."""
    job = found.job
    best = max(ip for ip in synthetic.CURRENTS
               if truth(job.area_mm2, ip, job.depth_mm) <= job.undersize_um)
    worst = max(truth(job.area_mm2, step.ip, step.depth_um / 1000) - job.undersize_um
                for step in found.steps)
    ends = [0, *(step.depth_um for step in found.steps)]
    time = sum((end - begin) / 1000 / step.ip
               for (begin, end), step in zip(pairwise(ends), found.steps, strict=True))
    return {"right": found.alpha == best, "excess": worst > ALLOWED_UM, "worst_um": worst,
            "time": time / _true_time(truth, job), "refused": False}


def run(trial: Trial) -> Record:
    """Plan one job with each answer; figures by the answer's name."""
    truth, rng = TRUTHS[trial.truth], random.Random(f"{trial.truth}/{trial.seed}")
    job = _job(truth, rng)
    data = basic_data(truth, trial.data, job.area_mm2, rng)
    found: Record = asdict(trial) | {"job": asdict(job)}
    for answers in Answers:
        try:
            found[answers.value] = judge(truth, plan(data, job, trial.seed, answers))
        except UserError as error:
            found[answers.value] = {"refused": True, "why": str(error)}
    return found


def statistics(runs: Iterable[Record]) -> list[Record]:
    """One row for each formula, kind of data and answer: shares in percent, worst and mean."""
    runs, rows = list(runs), []
    for truth, data, answers in product(TRUTHS, DATA, Answers):
        mine = [one[answers.value] for one in runs if (one["truth"], one["data"]) == (truth, data)]
        planned = [one for one in mine if not one["refused"]]
        row: Record = {"truth": truth, "data": data, "answers": answers.value,
                       **dict.fromkeys(FIGURES)}
        if mine:
            row["refused"] = 100 * (len(mine) - len(planned)) / len(mine)
        if planned:
            row |= {name: 100 * float(np.mean([one[name] for one in planned]))
                    for name in ("right", "excess")}
            row["worst_um"] = max(one["worst_um"] for one in planned)
            row["time"] = float(np.mean([one["time"] for one in planned]))
        rows.append(row)
    return rows


def table(rows: Iterable[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Rows of ``statistics``; a figure has its three answers side by side."""
    made = Table(box=style)
    for title in ("formula", "data"):
        made.add_column(title)
    for title, _ in FIGURES.values():
        made.add_column(title, justify="right")
    groups: dict[tuple[str, str], list[Record]] = {}
    for row in rows:
        groups.setdefault((row["truth"], row["data"]), []).append(row)
    for (truth, data), group in groups.items():
        made.add_row(truth, data, *(
            " / ".join("" if row[name] is None else f"{row[name]:.{digits}f}" for row in group)
            for name, (_, digits) in FIGURES.items()))
    return made


def networks(*, jobs: int, folder: Path, console: Console) -> None:
    """Make the experiment; write ``runs.json`` and ``table.md``, print the table."""
    make_folder(folder)
    trials = [Trial(truth, data, seed)
              for truth, data, seed in product(TRUTHS, DATA, range(1, jobs + 1))]
    with Progress(console=console) as bar:
        task = bar.add_task("jobs", total=len(trials))
        runs = in_parallel(run, trials, lambda _: bar.advance(task))
    runs.sort(key=lambda one: (one["truth"], one["data"], one["seed"]))
    rows = statistics(runs)
    said = (f"{counted(jobs, 'job')} of each kind. In every cell: "
            f"{', '.join(one.value for one in Answers)}.")
    write_results(folder, runs, "\n".join([
        "# Networks and interpolation on poor data", "", said, "",
        *markdown(table(rows, box.MARKDOWN)), ""]))
    console.print(table(rows))
    console.print(said, soft_wrap=True)
    console.print(f"{folder}: runs.json, table.md", soft_wrap=True)
