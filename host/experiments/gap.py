# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment gap``: every way to count pulses and every criterion, side by side.

JP S60-10852 B counts arcs, open and good pulses, and names other ways to make a servo signal of
them. Each way that this controller has stands in a tape of its own, which sinks the same cavity
with the same pulse on the machine ``small``. The first, ``sink_servo_table``, counts as the
controller does by default; the deviation of the gap of all others is compared with its.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

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
from host.experiments.fluid import FIGURES as SERVO_FIGURES
from host.experiments.fluid import measure
from host.machines import machine as machines
from host.places import ROOT
from host.run import figures
from host.run.run import count_retractions
from host.tape.tape import encode
from host.words import counted

__all__ = ["DEPTH_MM", "FIGURES", "MACHINE", "RULES", "Trial", "gap", "plot",
           "run", "sentences", "statistics", "table", "tape_of"]

MACHINE = "small"
DEPTH_MM = 0.25     # of the tapes
LONGEST_S = 120.0   # of the machine's time for 1 mm; a run that takes longer counts as stopped
# Rules, with their tapes; the first is the default.
RULES = {
    "accumulate": "sink_servo_table", "own gate": "sink_own_gate",
    "consecutive": "sink_consecutive", "total": "sink_total", "relative": "sink_relative",
    "good alone": "sink_good_alone", "delay": "sink_delay", "noise": "sink_noise",
}
FIGURES = {"depth_mm": ("depth, mm", 4), **SERVO_FIGURES}


@dataclass(frozen=True)
class Trial:
    """One run: rule, seed, depth in mm."""

    rule: str
    seed: int
    depth_mm: float = DEPTH_MM


def tape_of(trial: Trial) -> str:
    """Text of the rule's tape, with the depth of the trial."""
    text = (ROOT / "tapes" / f"{RULES[trial.rule]}.nc").read_text(encoding="ascii")
    return text.replace(f"Z-{DEPTH_MM}", f"Z-{trial.depth_mm}")


def run(trial: Trial) -> Record:
    """Run a trial; return its figures and how it ended."""
    machine = machines.load(MACHINE)
    with executed(machine, encode(tape_of(trial)), trial.seed,
                  until_s=LONGEST_S * max(1, trial.depth_mm)) as (job, machine_on):
        trace, steps = machine_on.trace(), machine_on.servo_steps()
    return asdict(trial) | {
        "outcome": job.outcome, "alarm": job.alarm and job.alarm["text"],
        **measure(trace, machine), **steps,
        "depth_mm": float(-trace["z"].min() / machine.pulses_per_mm - machine.initial_gap_mm),
        "retractions": count_retractions(job.events)["count"]}


def _order(one: Record) -> tuple[int, int]:
    return list(RULES).index(one["rule"]), one["seed"]


def statistics(runs: Iterable[Record]) -> list[Record]:
    """One row for every rule that was run.

    ``outcomes``: how many ended how. For each of ``FIGURES`` mean and spread over the seeds; the
    spread is the sample's standard deviation, or None for a single run. ``times``: deviation of the
    gap, as a multiple of the default rule's, of the means over the seeds.
    """
    groups: dict[str, list[Record]] = {}
    for one in sorted(runs, key=_order):
        groups.setdefault(one["rule"], []).append(one)
    rows: list[Record] = [{"rule": rule, **summed_up(group, FIGURES)}
                          for rule, group in groups.items()]
    usual = rows[0]["gap_deviation_um"][0]
    for row in rows:
        row["times"] = row["gap_deviation_um"][0] / usual
    return rows


def table(rows: list[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Figures down, rules across; mean and spread over the seeds."""
    made = Table(box=style)
    made.add_column("rule", no_wrap=True)
    for row in rows:
        made.add_column(row["rule"], justify="right", no_wrap=True)
    add_figures(made, rows, FIGURES)
    made.add_row("deviation, times", *(f"{row['times']:.2f}" for row in rows))
    return made


def sentences(rows: list[Record]) -> list[str]:
    """What each rule changed against the default, for better or worse."""
    usual, *others = rows
    return [f"{row['rule']}: the gap's deviation is {row['times']:.2f} times that of "
            f"{usual['rule']}, the removal "
            f"{row['removal_mm3_min'][0] / usual['removal_mm3_min'][0]:.2f} times, the gap "
            f"{row['gap_um'][0]:.1f} against {usual['gap_um'][0]:.1f} um."
            for row in others]


def _page(rows: list[Record], seeds: int, depth_mm: float) -> str:
    """The table and the sentences, as Markdown."""
    return "\n".join([
        "# Ways to count and to judge pulses", "",
        f"Machine {MACHINE}, to {depth_mm:g} mm, {counted(seeds, 'seed')}: mean ± sample standard "
        "deviation over the seeds.", "",
        *markdown(table(rows, box.MARKDOWN)), "",
        *(f"* {one}" for one in sentences(rows)), ""])


def plot(rows: list[Record], path: Path) -> None:
    """Draw the gap with its deviation, and the shares of the classes, by rule."""
    names = [row["rule"] for row in rows]
    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(9.6, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        left.errorbar([row["gap_um"][0] for row in rows], names,
                      xerr=[row["gap_deviation_um"][0] for row in rows], color=figures.PATH,
                      marker="o", capsize=3, linestyle="none")
        left.set(title="gap and its deviation, µm", xlim=(0, None))
        base = np.zeros(len(rows))
        for kind, (title, colour) in figures.CLASSES.items():
            share = np.array([row[kind][0] for row in rows])
            right.barh(names, share, left=base, color=colour, label=title)
            base += share
        right.set(title="pulse classes, %", xlim=(0, 100))
        right.invert_yaxis()
        figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncol=4)
        figure.savefig(path, dpi=120)


def gap(*, seeds: int, depth_mm: float, folder: Path, console: Console) -> None:
    """Make the experiment; write ``runs.json``, ``table.md`` and ``plot.png``, print the table."""
    make_folder(folder)
    build_simulator(machines.load(MACHINE), console)
    trials = [Trial(rule, seed, depth_mm) for seed, rule in product(range(1, seeds + 1), RULES)]
    with Progress(console=console) as bar:
        task = bar.add_task("runs", total=len(trials))

        def tell(one: Record) -> None:
            bar.advance(task)
            bar.console.print(f"{one['rule']}, seed {one['seed']}: {one['outcome']} at "
                              f"{one['depth_mm']:.4f} mm after {one['time_s']:.1f} s, gap "
                              f"{one['gap_um']:.1f} ± {one['gap_deviation_um']:.1f} um",
                              soft_wrap=True)
        runs = sorted(in_parallel(run, trials, tell), key=_order)
    rows = statistics(runs)
    write_results(folder, runs, _page(rows, seeds, depth_mm))
    plot(rows, folder / "plot.png")
    for part in (rows[:4], rows[4:]):
        console.print(table(part))
    for one in sentences(rows):
        console.print(one, soft_wrap=True)
    console.print(f"{folder}: runs.json, table.md, plot.png", soft_wrap=True)
