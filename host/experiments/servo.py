# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment servo``: the gap servo P1 with velocity feed-forward and without it.

The tape ``sink_servo_table`` runs on the machine ``small`` with the same seeds. The servo's step
and the time between two steps are varied in both loops: with feed-forward an axis follows a step
with the lag of its drive, 4 ms, and not with that of the loop, 20 ms, so that the next step may
come sooner. With half the time the presets are half as high, so that the same shares of the pulses
are asked for; they are whole numbers, so the shares are only nearly the same.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

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
    with_settings,
    write_results,
)
from host.experiments.fluid import FIGURES, measure
from host.machines import machine as machines
from host.machines.machine import Machine
from host.places import ROOT
from host.run.run import count_retractions
from host.tape.tape import encode
from host.words import counted

__all__ = ["MACHINE", "TAPE", "VARIANTS", "Trial", "run", "servo", "statistics", "table",
           "tape_of"]

MACHINE, TAPE = "small", "sink_servo_table"
STEP = "L0.004"         # of the tape's condition, in mm
LONGEST_S = 120.0       # of the machine's time; a run that takes longer counts as stopped
# Step in um, time between steps in ms, and the presets of class 0 for it; the first is the tape's.
VARIANTS: dict[str, tuple[int, int, tuple[str, ...]]] = {
    "4 µm in 20 ms": (4, 20, ()),
    "2 µm in 20 ms": (2, 20, ()),
    "8 µm in 20 ms": (8, 20, ()),
    "2 µm in 10 ms": (2, 10, ("G10 W0 X2 Y3 Z7",)),
    "4 µm in 10 ms": (4, 10, ("G10 W0 X2 Y3 Z7",)),
}


@dataclass(frozen=True)
class Trial:
    """One run: one of ``VARIANTS``, loop, seed."""

    variant: str
    loop: str
    seed: int


def tape_of(variant: str) -> str:
    """Text of the tape with the step of a variant."""
    text = (ROOT / "tapes" / f"{TAPE}.nc").read_text(encoding="ascii")
    step, *_ = VARIANTS[variant]
    return text.replace(STEP, f"L{step / 1000:g}")


def _machine(trial: Trial) -> Machine:
    """The machine with a loop, and a time between steps."""
    _, period_ms, _ = VARIANTS[trial.variant]
    return with_settings(in_loop(machines.load(MACHINE), trial.loop),
                         {"servo_period_us": period_ms * 1000})


def run(trial: Trial) -> Record:
    """Run a trial; return its figures and how it ended."""
    machine = _machine(trial)
    with executed(machine, encode(tape_of(trial.variant)), trial.seed, until_s=LONGEST_S,
                  mdi=[*VARIANTS[trial.variant][2]]) as (job, machine_on):
        return asdict(trial) | {
            "outcome": job.outcome, "alarm": job.alarm and job.alarm["text"],
            **measure(machine_on.trace(), machine), **machine_on.servo_steps(),
            "retractions": count_retractions(job.events)["count"]}


def _order(one: Record) -> tuple[int, int, int]:
    return list(VARIANTS).index(one["variant"]), list(LOOPS).index(one["loop"]), one["seed"]


def statistics(runs: Iterable[Record]) -> list[Record]:
    """One row for every variant and loop: ``outcomes``, and mean and spread of each figure.

    ``times``: deviation of the gap and removal, as multiples of the first row's of the other loop,
    the plain one, in the tape's variant; None if that was not run.
    """
    groups: dict[tuple[str, str], list[Record]] = {}
    for one in sorted(runs, key=_order):
        groups.setdefault((one["variant"], one["loop"]), []).append(one)
    rows: list[Record] = [{"variant": variant, "loop": loop, **summed_up(group, FIGURES)}
                          for (variant, loop), group in groups.items()]
    usual = next((row for row in rows if (row["variant"], row["loop"])
                  == (next(iter(VARIANTS)), "plain loop")), None)
    for row in rows:
        row["times"] = usual and [row[name][0] / usual[name][0]
                                  for name in ("gap_deviation_um", "removal_mm3_min")]
    return rows


def table(rows: list[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Figures down, variants and loops across; mean and spread over the seeds."""
    made = Table(box=style)
    made.add_column("steps", no_wrap=True)
    for row in rows:
        made.add_column(row["variant"], justify="right", no_wrap=True)
    made.add_row("loop", *(row["loop"] for row in rows))
    add_figures(made, rows, FIGURES)
    made.add_row("deviation; removal, times", *(
        "; ".join(f"{one:.2f}" for one in row["times"]) if row["times"] else "" for row in rows))
    return made


def _page(rows: list[Record], seeds: int) -> str:
    """The tables, as Markdown."""
    lines = ["# The gap servo in both loops", "",
             f"Tape {TAPE} on the machine {MACHINE}, {counted(seeds, 'seed')}: mean ± sample "
             "standard deviation. The last row", "compares with the tape's steps in the plain "
             "loop.", ""]
    for loop in LOOPS:
        lines += [*markdown(table([row for row in rows if row["loop"] == loop], box.MARKDOWN)), ""]
    return "\n".join(lines)


def servo(*, seeds: int, folder: Path, console: Console) -> None:
    """Make the experiment; write ``runs.json`` and ``table.md``, print the tables."""
    make_folder(folder)
    build_simulator(machines.load(MACHINE), console)
    trials = [Trial(variant, loop, seed)
              for seed, variant, loop in product(range(1, seeds + 1), VARIANTS, LOOPS)]
    with Progress(console=console) as bar:
        task = bar.add_task("runs", total=len(trials))

        def tell(one: Record) -> None:
            bar.advance(task)
            bar.console.print(f"{one['variant']}, {one['loop']}, seed {one['seed']}: "
                              f"{one['outcome']} after {one['time_s']:.1f} s, gap "
                              f"{one['gap_um']:.1f} ± {one['gap_deviation_um']:.1f} um",
                              soft_wrap=True)
        runs = sorted(in_parallel(run, trials, tell), key=_order)
    rows = statistics(runs)
    write_results(folder, runs, _page(rows, seeds))
    for loop in LOOPS:
        console.print(table([row for row in rows if row["loop"] == loop]))
    console.print(f"{folder}: runs.json, table.md", soft_wrap=True)
