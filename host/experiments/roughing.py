# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment roughing``: one current all the way, against the planned staircase.

The job is a cavity of 70 mm² with 110 um of undersize, copper on steel, by the synthetic basic
data, on the machine ``sinker`` with an electrode of that area. Arm ``constant``: the planner's
alpha, the current of its last step, from the surface to the end. Arm ``staircase``: the planned
currents, switched by the machine at their depths (G39). Seeds, condition rows, servo (G95 P1),
limit and periodic jumps are the same in both arms.

The simulated machine does not model how wide a cavity becomes. So the undersize that a run consumes
is computed: the greatest value of the basic data for a current in force at the depth reached.
"""

import copy
import io
import json
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
from host.experiments.common import Record, add_figures, in_parallel, summed_up
from host.machines import machine as machines
from host.machines.machine import Machine
from host.roughing.basic import BasicData, read_all
from host.roughing.roughing import AMPERES, program
from host.roughing.staircase import Job, Staircase, Step, neighbours, plan, undersize_cell
from host.run import figures, simulation
from host.run.events import Event
from host.run.run import Run, count_retractions
from host.run.workpiece import Columns
from host.tape.tape import Tape, encode
from host.words import counted

__all__ = ["ARMS", "FIGURES", "Trial", "consumed", "machine_for", "measure", "plot", "roughing",
           "sentences", "staircase_for", "statistics", "table", "tape_for"]

MACHINE, ELECTRODE, WORKPIECE = "sinker", "copper", "steel"
AREA_MM2, UNDERSIZE_UM, DEPTH_MM = 70.0, 110.0, 8.0
SEED = 1                    # of the networks
ARMS = ("constant", "staircase")
JUMP = "G38 P400 L1. R900 H900"     # a deep cavity without flushing needs it
LONGEST_S = 1200.0          # of the machine's time; a run that takes longer counts as stopped
KINDS = ("ok", "open", "dame", "short")

# Figure: its name in the table, and digits.
FIGURES = {
    "time_s": ("time, s", 1), "unscaled_min": ("unscaled, min", 0),
    "consumed_um": ("undersize consumed, um", 1),
    "ok": ("good, %", 1), "open": ("open, %", 1), "dame": ("arc, %", 1), "short": ("short, %", 2),
    "retractions": ("retractions from shorts", 1),
}
COLOURS = {"constant": figures.FAINT, "staircase": figures.PATH}


@dataclass(frozen=True)
class Trial:
    """One run: arm, seed, depth in mm."""

    arm: str
    seed: int
    depth_mm: float = DEPTH_MM


def _job(depth_mm: float) -> Job:
    return Job(AREA_MM2, UNDERSIZE_UM, depth_mm)


def staircase_for(trial: Trial, data: list[BasicData]) -> Staircase:
    """The planner's staircase; for the arm ``constant`` only its last step."""
    found = plan(data, _job(trial.depth_mm), SEED)
    if trial.arm == "constant":
        found = replace(found, steps=(Step(found.alpha, found.steps[-1].depth_um),))
    return found


def machine_for() -> Machine:
    """The sinker, with an electrode of the job's area."""
    tables = copy.deepcopy(machines.load(MACHINE).tables)
    tables["gap"]["area_mm2"] = AREA_MM2
    return Machine(MACHINE, tables)


def tape_for(trial: Trial, data: list[BasicData]) -> Tape:
    """The program as the planner writes it, one block behind its depth series, with jumps."""
    near = neighbours(data, AREA_MM2)
    text = program(staircase_for(trial, data), near, depth_series=True)
    lines = text.splitlines()
    begin = next(index for index, line in enumerate(lines) if line.endswith(" M03"))
    end = next(index for index, line in enumerate(lines) if line.endswith(" M05"))
    return encode("\n".join([*lines[:begin + 1], JUMP, *lines[begin + 1:end], "G38 P0",
                             *lines[end:], ""]))


def run(trial: Trial) -> Record:
    """Run a trial; return its figures and how it ended."""
    machine, data = machine_for(), read_all(ELECTRODE, WORKPIECE)
    machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=trial.seed, waves=None,
                                  progress=lambda _: None)
    job = Run(machine, tape_for(trial, data), machine_on, until_s=LONGEST_S)
    try:
        job.execute()
    finally:
        machine_on.close()
    causes = count_retractions(job.events)
    return asdict(trial) | {
        "outcome": job.outcome, "alarm": job.alarm and job.alarm["text"],
        **measure(machine_on.trace(), job.events, machine, neighbours(data, AREA_MM2)),
        "retractions": causes["short"]}


def consumed(t: NDArray[Any], deepest_mm: NDArray[Any], events: list[Event],
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
            "consumed_um": consumed(t, deepest, events, near),
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
    steps = ", ".join(f"IP {step.ip:g} to {step.depth_um / 1000:.2f} mm" for step in found.steps)
    said = [f"Planned: {steps}; constant: IP {found.alpha:g} ({found.alpha * AMPERES:g} A). The "
            f"electrode has {found.undersize_um:g} um of undersize, of which the last step needs "
            f"{found.beta_um:.1f} um."]
    by_seed: dict[int, dict[str, Record]] = {}
    for one in runs:
        if one["outcome"] == "end":
            by_seed.setdefault(one["seed"], {})[one["arm"]] = one
    pairs = [pair for pair in by_seed.values() if set(pair) == set(ARMS)]
    if pairs:
        ratio = (sum(pair["staircase"]["time_s"] for pair in pairs)
                 / sum(pair["constant"]["time_s"] for pair in pairs))
        sooner = sum(pair["staircase"]["time_s"] < pair["constant"]["time_s"] for pair in pairs)
        said.append(f"The staircase takes {ratio:.2f} times as long as the constant current (less "
                    f"with {sooner} of {counted(len(pairs), 'seed')}).")
    return said


def plot(runs: list[Record], found: Staircase, path: Path) -> None:
    """Draw depth against time of every run, and the shares of the classes."""
    rows = statistics(runs)
    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(9.6, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[3, 2])
        for one in sorted(runs, key=_order):
            left.plot(one["profile"]["time_s"], one["profile"]["depth_mm"], linewidth=1.4,
                      color=COLOURS[one["arm"]], label=one["arm"] if one["seed"] == 1 else "")
        for step in found.steps[:-1]:
            left.axhline(step.depth_um / 1000, color=figures.INK, linewidth=0.8,
                         linestyle=(0, (4, 3)))
            left.annotate(f"IP {step.ip:g} until here", (1, step.depth_um / 1000), ha="right",
                          xycoords=("axes fraction", "data"), xytext=(-4, 4), fontsize=8,
                          textcoords="offset points")
        left.set(xlabel="time, s", ylabel="depth, mm", title="furthest depth",
                 ylim=(found.steps[-1].depth_um / 1000, 0), xlim=(0, None))
        left.legend(loc="lower left")
        mine = [row for row in rows if row["ok"]]
        base = np.zeros(len(mine))
        for kind, (title, colour) in figures.CLASSES.items():
            share = np.array([row[kind][0] for row in mine])
            right.bar([row["arm"] for row in mine], share, bottom=base, color=colour, label=title)
            base += share
        right.set(title="pulse classes, %", ylim=(0, 100))
        right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), ncol=4, columnspacing=1)
        figure.savefig(path, dpi=120)


def _page(rows: list[Record], said: list[str], seeds: int, depth_mm: float) -> str:
    """The table and the sentences, as Markdown."""
    page = Console(width=400, file=io.StringIO())
    with page.capture() as text:
        page.print(table(rows, box.MARKDOWN))
    return "\n".join([
        "# Roughing with one current, and with the planned staircase", "",
        f"Machine {MACHINE} with {AREA_MM2:g} mm², to {depth_mm:g} mm, {counted(seeds, 'seed')}: "
        "mean ± sample standard deviation over the seeds. The basic data are synthetic.", "",
        *(f"* {one}" for one in said), "",
        *filter(None, map(str.strip, text.get().splitlines())), ""])


def roughing(*, seeds: int, depth_mm: float, folder: Path, console: Console) -> None:
    """Make the experiment; write ``runs.json``, ``table.md`` and ``plot.png``, print the table."""
    data = read_all(ELECTRODE, WORKPIECE)
    found = staircase_for(Trial("staircase", 1, depth_mm), data)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder} cannot be written: {error.strerror}.") from error
    # The simulator is built once here, not by every process.
    machine = machine_for()
    simulation.start(machine, clock_hz=machine.clock_hz, seed=1, waves=None,
                     progress=lambda text: console.print(text, soft_wrap=True)).close()
    trials = [Trial(arm, seed, depth_mm) for seed, arm in product(range(1, seeds + 1), ARMS)]
    with Progress(console=console) as bar:
        task = bar.add_task("runs", total=len(trials))

        def tell(one: Record) -> None:
            bar.advance(task)
            bar.console.print(f"{one['arm']}, seed {one['seed']}: {one['outcome']} after "
                              f"{one['time_s']:.1f} s at {one['depth_mm']:.3f} mm", soft_wrap=True)
        runs = sorted(in_parallel(run, trials, tell), key=_order)
    rows, said = statistics(runs), sentences(runs, found)
    (folder / "runs.json").write_text(json.dumps(runs, indent=2) + "\n", encoding="utf-8")
    (folder / "table.md").write_text(_page(rows, said, seeds, depth_mm), encoding="utf-8")
    plot(runs, found, folder / "plot.png")
    console.print(table(rows))
    for one in said:
        console.print(one, soft_wrap=True)
    console.print(f"{folder}: runs.json, table.md, plot.png", soft_wrap=True)
