# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment shorts``: how soon the electrode is clear of a short, in both loops.

The tape ``sink_shallow_deep`` runs with the velocity feed-forward and in the plain loop of the
first patent, with the same seeds. The shorts of all seeds are put together by retraction speed, and
compared with what the drive takes by itself when the speed is given to its input as a step.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from host.experiments.common import (
    LOOPS,
    Record,
    add_figures,
    build_simulator,
    executed,
    in_loop,
    in_parallel,
    make_folder,
    markdown,
    summed_up,
    write_results,
)
from host.machines import machine as machines
from host.places import ROOT
from host.run import clearing
from host.run.run import count_retractions
from host.run.workpiece import Columns
from host.scope.record import STATES
from host.tape.tape import load
from host.words import counted

__all__ = ["FIGURES", "Trial", "beyond_um", "run", "shorts", "statistics", "table",
           "table_of_runs"]

MACHINE, TAPE = "sinker", "sink_shallow_deep"
BACK = STATES.index("retracting"), STATES.index("at_limit")
FIGURES = {
    "time_s": ("time on the machine, s", 2), "retractions": ("retractions", 1),
    "arcs": ("arcs", 0), "shorted_s": ("gap shorted (Ss), s", 3),
    "beyond_um": ("furthest beyond the command while it goes back, µm", 1),
}


@dataclass(frozen=True)
class Trial:
    """One run: loop, seed."""

    loop: str
    seed: int


def beyond_um(trace: Columns, pulses_per_mm: float) -> float:
    """How far the electrode was above its command at most, on the way back and at its end."""
    back = np.isin(trace["state"], BACK)
    return max(0.0, -float(trace["error_z"][back].min(initial=0.0)) * 1000 / pulses_per_mm)


def run(trial: Trial) -> Record:
    """Run a trial; return its figures, and the chain of each short.

    ``chains`` has for every retraction ordered by a short its ``speed`` in mm/min and its times in
    seconds, as in ``clearing.Chain``.
    """
    machine = in_loop(machines.load(MACHINE), trial.loop)
    with executed(machine, load(ROOT / "tapes" / f"{TAPE}.nc"), trial.seed) as (job, machine_on):
        trace = machine_on.trace()
        found = clearing.chains(machine_on.shorts(), clock_hz=machine.clock_hz,
                                pulses_per_mm=machine.pulses_per_mm)
        arcs = machine_on.discharges()["dame"]
        time_s = machine_on.time_s()
    step_s = np.diff(trace["t"], prepend=0)
    return asdict(trial) | {
        "outcome": job.outcome, "alarm": job.alarm and job.alarm["text"],
        "time_s": time_s, "retractions": count_retractions(job.events)["count"],
        "arcs": arcs,
        "shorted_s": float(step_s[trace["shorted"] > 0].sum()),
        "beyond_um": beyond_um(trace, machine.pulses_per_mm),
        "chains": [{"speed": speed} | asdict(one) for one, speed in
                   zip(found, clearing.speeds(job.events), strict=True)]}


def _order(one: Record) -> tuple[int, int]:
    return list(LOOPS).index(one["loop"]), one["seed"]


def _spread(values: Iterable[float | None], unit: float) -> Record | None:
    """Median, 99th percentile and worst of the values that are known."""
    known = [one * unit for one in values if one is not None]
    return {"median": float(np.median(known)), "p99": float(np.percentile(known, 99)),
            "worst": max(known), "shorts": len(known)} if known else None


def statistics(runs: Iterable[Record]) -> list[Record]:
    """One row for each loop and retraction speed, the shorts of all its runs together.

    For every link of ``clearing.LINKS`` median, 99th percentile, worst and number of ``shorts``.
    For a distance also ``drive``, what the drive takes alone in ms, and ``times``: median and 99th
    percentile as multiples of it.
    """
    tables = machines.load(MACHINE).tables
    chains: dict[tuple[float, str], list[Record]] = {}
    for one in sorted(runs, key=_order):
        for chain in one["chains"]:
            chains.setdefault((chain["speed"], one["loop"]), []).append(chain)
    rows: list[Record] = []
    for (speed, loop), some in sorted(chains.items(),
                                      key=lambda item: (item[0][0], _order(
                                          {"loop": item[0][1], "seed": 0}))):
        own = clearing.alone(tables["axis"], speed, tables["tick_us"] * 1e-6)
        row = {"speed": speed, "loop": loop, "shorts": len(some),
               "sample_ms": _spread((one["touched"] for one in some), 1e3),
               "forward_us": _spread((one["forward"] for one in some), 1e6),
               "back_us": _spread((one["back"] for one in some), 1e6),
               "turn_ms": _spread((one["turn"] for one in some), 1e3)}
        for um in clearing.CLEAR_UM:
            # JSON has turned the keys of a run that was stored into text.
            figure = _spread((one["clear"].get(um, one["clear"].get(str(um))) for one in some), 1e3)
            drive = own[um]
            if figure and drive:
                figure |= {"drive": drive * 1e3, "times": [
                    figure["median"] / drive / 1e3, figure["p99"] / drive / 1e3]}
            row[f"clear_{um}_um_ms"] = figure
        rows.append(row)
    return rows


def _of(figure: Record, row: Record) -> str:
    """How many shorts got so far, unless all did: a retraction may be shorter than a distance."""
    return "" if figure["shorts"] == row["shorts"] else f" (of {figure['shorts']})"


def table(rows: list[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Links down, retraction speeds and loops across: median, 99th percentile and worst."""
    made = Table(box=style)
    made.add_column("median; 99 of 100; worst", no_wrap=True)
    for row in rows:
        made.add_column(f"R{row['speed']:g}, {row['loop']}", justify="right", no_wrap=True)
    made.add_row("shorts", *(str(row["shorts"]) for row in rows))
    for link, (title, unit) in clearing.LINKS.items():
        made.add_row(f"{title}, {unit}", *(
            f"{one['median']:.2f}; {one['p99']:.2f}; {one['worst']:.2f}" + _of(one, row)
            if (one := row[link]) else "" for row in rows))
    for um in clearing.CLEAR_UM:
        cleared = [row[f"clear_{um}_um_ms"] for row in rows]
        made.add_row(f"the drive alone, {um} µm, ms", *(
            f"{one['drive']:.2f}" if one else "" for one in cleared))
        made.add_row(f"{um} µm clear, times the drive alone", *(
            "; ".join(f"{times:.2f}" for times in one["times"]) if one else "" for one in cleared))
    return made


def table_of_runs(runs: list[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Figures of whole runs down, loops across; mean and spread over the seeds."""
    made = Table(box=style)
    made.add_column("mean ± deviation of the runs", no_wrap=True)
    groups = {loop: [one for one in runs if one["loop"] == loop] for loop in LOOPS}
    for loop in LOOPS:
        made.add_column(loop, justify="right", no_wrap=True)
    add_figures(made, [summed_up(group, FIGURES) for group in groups.values()], FIGURES)
    return made


def _page(runs: list[Record], seeds: int) -> str:
    """The tables, as Markdown."""
    lines = ["# Clear of a short", "",
             f"Tape {TAPE} on the machine {MACHINE}, {counted(seeds, 'seed')}.", ""]
    for made in (table(statistics(runs), box.MARKDOWN), table_of_runs(runs, box.MARKDOWN)):
        lines += [*markdown(made), ""]
    return "\n".join(lines)


def shorts(*, seeds: int, folder: Path, console: Console) -> None:
    """Make the experiment; write ``runs.json`` and ``table.md``, print the tables."""
    make_folder(folder)
    build_simulator(machines.load(MACHINE), console)
    trials = [Trial(loop, seed) for seed, loop in product(range(1, seeds + 1), LOOPS)]
    with Progress(console=console) as bar:
        task = bar.add_task("runs", total=len(trials))

        def tell(one: Record) -> None:
            bar.advance(task)
            bar.console.print(f"{one['loop']}, seed {one['seed']}: {one['outcome']} after "
                              f"{one['time_s']:.1f} s, {counted(one['retractions'], 'retraction')}",
                              soft_wrap=True)
        runs = sorted(in_parallel(run, trials, tell), key=_order)
    write_results(folder, runs, _page(runs, seeds))
    console.print(table(statistics(runs)))
    console.print(table_of_runs(runs))
    console.print(f"{folder}: runs.json, table.md", soft_wrap=True)
