# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment roughing``: one current all the way, against the planned staircase.

The job is a cavity of 70 mm² with 110 um of undersize, copper on steel, by the synthetic basic
data, on the machine ``cavity`` with a square electrode of that area. Arm ``constant``: the
planner's alpha, the current of its last step, from the surface to the end. Arm ``staircase``: the
planned currents, switched by the machine at their depths (G39). Arm ``highest``: the current of the
first step all the way. Seeds, condition rows, servo (G95 P1), limit and periodic jumps are the same
in all arms.

The undersize that a run consumes is measured on the simulated cavity: the greatest opening of its
walls. The plant's numbers are not those of the basic data, which are synthetic, so the two agree in
kind at best. For comparison there is the greatest value of the basic data for a current in force at
the depth reached. To show how the plant's constants change the outcome, the walls are computed
again from each run's discharges with other constants (``SWEEP``).
"""

import copy
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from host.errors import UserError
from host.experiments.common import (
    Record,
    add_figures,
    build_simulator,
    executed,
    in_parallel,
    make_folder,
    markdown,
    summed_up,
    write_results,
)
from host.machines import machine as machines
from host.machines.machine import Machine
from host.roughing.basic import BasicData, read_all
from host.roughing.roughing import AMPERES, parts_of_step, program
from host.roughing.staircase import Job, Staircase, Step, neighbours, plan, undersize_cell
from host.run import figures
from host.run.events import Event
from host.run.run import count_retractions
from host.run.workpiece import Columns
from host.tape.tape import Tape, encode
from host.words import counted
from softcore.tables.settings import named

__all__ = ["ARMS", "FIGURES", "SWEEP", "Trial", "machine_for", "measure", "needed", "opened",
           "plot", "roughing", "sentences", "staircase_for", "statistics", "sweep_table", "table",
           "tape_for"]

MACHINE, ELECTRODE, WORKPIECE = "cavity", "copper", "steel"
AREA_MM2, UNDERSIZE_UM, DEPTH_MM = 70.0, 110.0, 8.0
SEED = 1                    # of the networks
ARMS = ("constant", "staircase", "highest")
LONGEST_S = 1200.0          # of the machine's time; a run that takes longer counts as stopped
KINDS = ("ok", "open", "dame", "short")

# Figure: its name in the table, and digits.
FIGURES = {
    "time_s": ("time, s", 1), "unscaled_min": ("unscaled, min", 0),
    "consumed_um": ("consumed in the cavity, um", 1),
    "bottom_um": ("near its bottom, um", 1),
    "by_data_um": ("by the basic data, um", 1),
    "ok": ("good, %", 1), "open": ("open, %", 1), "dame": ("arc, %", 1), "short": ("short, %", 2),
    "retractions": ("retractions from shorts", 1),
}
COLOURS = {"constant": figures.FAINT, "staircase": figures.PATH, "highest": figures.GAP}

# Other constants of the walls than the machine's: the plant's choices, halved and doubled or more.
SWEEP: tuple[dict[str, float], ...] = (
    {}, {"overcut_um": 20.0}, {"overcut_um": 80.0}, {"current_power": 0.0, "time_power": 0.0},
    {"current_power": 0.58, "time_power": 0.76}, {"wall_debris": 0.01}, {"wall_debris": 0.25},
    {"slope_um": 4.0}, {"slope_um": 36.0})


@dataclass(frozen=True)
class Trial:
    """One run: arm, seed, depth in mm, and the parts into which the supply divides one IP."""

    arm: str
    seed: int
    depth_mm: float = DEPTH_MM
    parts: int = 1


def staircase_for(trial: Trial, data: list[BasicData]) -> Staircase:
    """The planner's staircase; for a constant arm only one step, of its last or first current."""
    found = plan(data, Job(AREA_MM2, UNDERSIZE_UM, trial.depth_mm, steps=trial.parts), SEED)
    if trial.arm == "staircase":
        return found
    first, last = found.steps[0], found.steps[-1]
    one = last if trial.arm == "constant" else first
    return replace(found, steps=(Step(one.ip, last.depth_um),))


def machine_for(parts: int = 1) -> Machine:
    """The machine, with a square electrode of the job's area and a supply of so many parts."""
    tables = copy.deepcopy(machines.load(MACHINE).tables)
    tables["gap"]["area_mm2"] = AREA_MM2
    tables["cavity"]["perimeter_mm"] = 4 * AREA_MM2**0.5
    if parts > 1:
        tables["source"]["step_a"] = AMPERES / parts
        setting = str(named("current_step_ma").number)
        tables["settings"] = tables.get("settings", {}) | {setting: round(1000 * AMPERES / parts)}
    return Machine(MACHINE, tables)


def tape_for(trial: Trial, data: list[BasicData]) -> Tape:
    """The program as the planner writes it, one block behind its depth series, with jumps."""
    near = neighbours(data, AREA_MM2)
    return encode(program(staircase_for(trial, data), near, depth_series=True, jumps=True))


def run(trial: Trial) -> Record:
    """Run a trial; return its figures and how it ended."""
    machine, data = machine_for(trial.parts), read_all(ELECTRODE, WORKPIECE)
    with executed(machine, tape_for(trial, data), trial.seed, until_s=LONGEST_S,
                  prepare=lambda one: one.keep_discharges()) as (job, machine_on):
        swept = [_widest(machine_on.cavity_with(numbers)) for numbers in SWEEP]
        return asdict(trial) | {
            "outcome": job.outcome, "alarm": job.alarm and job.alarm["text"],
            **measure(machine_on.trace(), job.events, machine, neighbours(data, AREA_MM2)),
            **opened(machine_on.cavity()), "swept_um": swept,
            "retractions": count_retractions(job.events)["short"]}


def _widest(walls: Columns) -> float:
    return float(walls["opening_um"].max(initial=0.0))


def opened(walls: Columns) -> Record:
    """Figures of a cavity: ``consumed_um``, its greatest opening; that of the lowest whole layer.

    ``walls`` has both by layer.
    """
    whole = max(0, len(walls["opening_um"]) - 2)   # the lowest is not cut through yet
    return {"consumed_um": _widest(walls), "bottom_um": float(walls["opening_um"][whole]),
            "walls": {name: column.tolist() for name, column in walls.items()}}


def needed(t: NDArray[Any], deepest_mm: NDArray[Any], events: list[Event],
             near: list[BasicData]) -> float:
    """Least undersize that a run needs, um, by the basic data.

    It is the greatest value of the data for the current in force at the depth reached, over all
    moments ``t`` (s). ``events`` give the currents.
    """
    changes = [event for event in events if event["event"] == "condition"]
    most = 0.0
    for event, after in zip(changes, [*(one["t"] for one in changes[1:]), np.inf], strict=True):
        held = deepest_mm[(t >= event["t"]) & (t < after)]
        if held.size and held[-1] > 0:
            cell = undersize_cell(near, AREA_MM2, float(held[-1]), event["ip"])
            most = max(most, float(cell.between))
    return most


def measure(trace: Columns, events: list[Event], machine: Machine,
            near: list[BasicData]) -> Record:
    """Figures of a trace whose ``z`` is in pulses.

    ``time_s``: from the first discharge to the last, jumps and retractions included;
    ``unscaled_min`` without the plant's scaling of the removal. Shares of the classes in percent of
    the main pulses. ``profile``: time at the first moment of each depth.

    Raises
    ------
    UserError
        If there was no discharge.
    """
    t = trace["t"]
    sparks = np.flatnonzero(trace["ok"] + trace["dame"])
    if not sparks.size:
        raise UserError("a run of the experiment had no discharge.")
    # The trace counts from where the machine was switched on, above the workpiece.
    deepest = np.maximum.accumulate(
        -trace["z"] / machine.pulses_per_mm - machine.start_mm["z"])
    pulses = {kind: float(trace[kind].sum()) for kind in KINDS}
    time_s = float(t[sparks[-1]] - t[sparks[0]])
    depths = np.arange(0, deepest[-1], 0.05)
    return {"time_s": time_s, "unscaled_min": time_s * machine.removal_scale / 60,
            "depth_mm": float(deepest[-1]),
            "by_data_um": needed(t, deepest, events, near),
            **{kind: 100 * number / sum(pulses.values()) for kind, number in pulses.items()},
            "profile": {"depth_mm": depths.tolist(),
                        "time_s": (t[np.searchsorted(deepest, depths)] - t[sparks[0]]).tolist()}}


def _order(one: Record) -> tuple[int, int]:
    return ARMS.index(one["arm"]), one["seed"]


def statistics(runs: Iterable[Record]) -> list[Record]:
    """One row for every arm.

    ``outcomes``: how many ended how. For each of ``FIGURES`` mean and spread over the seeds of the
    runs that ended; the spread is the sample's standard deviation, or None for a single run. A
    figure that no run has is None.
    """
    rows = []
    for arm in ARMS:
        group = [one for one in sorted(runs, key=_order) if one["arm"] == arm]
        ended = [one for one in group if one["outcome"] == "end"]
        rows.append({"arm": arm, **summed_up(ended, FIGURES),
                     "outcomes": summed_up(group, ())["outcomes"]})
    return rows


def table(rows: list[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Figures down, arms across; mean and spread over the seeds."""
    made = Table(box=style)
    made.add_column("current", no_wrap=True)
    for row in rows:
        made.add_column(row["arm"], justify="right", no_wrap=True)
    add_figures(made, rows, FIGURES)
    return made


def sentences(runs: list[Record], found: Staircase) -> list[str]:
    """Sentences on what was compared, and on what the staircase changed, for better or worse."""
    steps = ", ".join(f"IP {step.ip:.4g} to {step.depth_um / 1000:.2f} mm" for step in found.steps)
    said = [f"Planned: {steps}; constant: IP {found.alpha:.4g} ({found.alpha * AMPERES:g} A); "
            f"highest: IP {found.steps[0].ip:.4g}. By the basic data the "
            f"electrode has {found.undersize_um:g} um of undersize, of which the last step needs "
            f"{found.beta_um:.1f} um."]
    by_seed: dict[int, dict[str, Record]] = {}
    for one in runs:
        if one["outcome"] == "end":
            by_seed.setdefault(one["seed"], {})[one["arm"]] = one
    pairs = [pair for pair in by_seed.values() if set(pair) == set(ARMS)]
    if pairs:
        seeds = counted(len(pairs), "seed")
        for other, title in (("constant", "the constant current"), ("highest", "the highest one")):
            ratio = (sum(pair["staircase"]["time_s"] for pair in pairs)
                     / sum(pair[other]["time_s"] for pair in pairs))
            sooner = sum(pair["staircase"]["time_s"] < pair[other]["time_s"] for pair in pairs)
            wider = [pair["staircase"]["consumed_um"] - pair[other]["consumed_um"]
                     for pair in pairs]
            said.append(f"The staircase takes {ratio:.3f} times as long as {title} (less with "
                        f"{sooner} of {seeds}) and consumes {np.mean(wider):+.2f} um of undersize "
                        f"more than it in the cavity (more with {sum(one > 0 for one in wider)}).")
    return said


def sweep_table(runs: Iterable[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Undersize consumed with other constants of the walls: means over the seeds that ended."""
    ended = [one for one in runs if one["outcome"] == "end"]
    made = Table(box=style)
    made.add_column("consumed, um, with", no_wrap=True)
    for title in (*ARMS, "2nd - 1st"):
        made.add_column(title, justify="right", no_wrap=True)
    for row, numbers in enumerate(SWEEP):
        by_arm = [[one["swept_um"][row] for one in ended if one["arm"] == arm] for arm in ARMS]
        means = [float(np.mean(group)) if group else None for group in by_arm]
        less = (f"{means[1] - means[0]:+.2f}" if means[0] is not None and means[1] is not None
                else "-")
        name = ", ".join(f"{key} {value:g}" for key, value in numbers.items())
        made.add_row(name or "the machine's constants",
                     *("-" if mean is None else f"{mean:.1f}" for mean in means), less)
    return made


def plot(runs: list[Record], found: Staircase, path: Path) -> None:
    """Draw depth against time of every run, and the shares of the classes."""
    rows = statistics(runs)
    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(13.2, 4.6), layout="constrained")
        left, middle, right = figure.subplots(1, 3, width_ratios=[3, 3, 2])
        for one in sorted(runs, key=_order):
            left.plot(one["profile"]["time_s"], one["profile"]["depth_mm"], linewidth=1.4,
                      color=COLOURS[one["arm"]], label=one["arm"] if one["seed"] == 1 else "")
        for step in found.steps[:-1]:
            left.axhline(step.depth_um / 1000, color=figures.INK, linewidth=0.8,
                         linestyle=(0, (4, 3)))
            left.annotate(f"IP {step.ip:.4g} until here", (1, step.depth_um / 1000), ha="right",
                          xycoords=("axes fraction", "data"), xytext=(-4, 4), fontsize=8,
                          textcoords="offset points")
        left.set(xlabel="time, s", ylabel="depth, mm", title="furthest depth",
                 ylim=(found.steps[-1].depth_um / 1000, 0), xlim=(0, None))
        left.legend(loc="lower left")
        for one in sorted(runs, key=_order):
            figures.wall(middle, one["walls"], linewidth=1.2, color=COLOURS[one["arm"]],
                         label=one["arm"] if one["seed"] == 1 else "")
        middle.set(xlabel="opening on each side, um", title="walls of the cavity",
                   ylim=(found.steps[-1].depth_um / 1000, 0))
        middle.legend(loc="lower right")
        mine = [row for row in rows if row["ok"]]
        base = np.zeros(len(mine))
        for kind, (title, colour) in figures.CLASSES.items():
            share = np.array([row[kind][0] for row in mine])
            right.bar([row["arm"] for row in mine], share, bottom=base, color=colour, label=title)
            base += share
        right.set(title="pulse classes, %", ylim=(0, 100))
        right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), ncol=4, columnspacing=1)
        figure.savefig(path, dpi=120)


def _page(runs: list[Record], said: list[str], seeds: int, depth_mm: float) -> str:
    """The tables and the sentences, as Markdown."""
    return "\n".join([
        "# Roughing with one current, and with the planned staircase", "",
        f"Machine {MACHINE} with {AREA_MM2:g} mm², to {depth_mm:g} mm, {counted(seeds, 'seed')}: "
        "mean ± sample standard deviation over the seeds. The basic data are synthetic.", "",
        *(f"* {one}" for one in said), "",
        *markdown(table(statistics(runs), box.MARKDOWN)), "",
        "Undersize consumed if the same discharges had made walls with other constants:", "",
        *markdown(sweep_table(runs, box.MARKDOWN)), ""])


def roughing(*, seeds: int, depth_mm: float, folder: Path, console: Console,
             step_ip: float = 1.0) -> None:
    """Make the experiment; write ``runs.json``, ``table.md`` and ``plot.png``, print the tables."""
    parts = parts_of_step(step_ip)
    data = read_all(ELECTRODE, WORKPIECE)
    found = staircase_for(Trial("staircase", 1, depth_mm, parts), data)
    make_folder(folder)
    build_simulator(machine_for(parts), console)
    trials = [Trial(arm, seed, depth_mm, parts) for seed, arm in product(range(1, seeds + 1), ARMS)]
    with Progress(console=console) as bar:
        task = bar.add_task("runs", total=len(trials))

        def tell(one: Record) -> None:
            bar.advance(task)
            bar.console.print(f"{one['arm']}, seed {one['seed']}: {one['outcome']} after "
                              f"{one['time_s']:.1f} s at {one['depth_mm']:.3f} mm", soft_wrap=True)
        runs = sorted(in_parallel(run, trials, tell), key=_order)
    said = sentences(runs, found)
    write_results(folder, runs, _page(runs, said, seeds, depth_mm))
    plot(runs, found, folder / "plot.png")
    console.print(table(statistics(runs)))
    console.print(sweep_table(runs))
    for one in said:
        console.print(one, soft_wrap=True)
    console.print(f"{folder}: runs.json, table.md, plot.png", soft_wrap=True)
