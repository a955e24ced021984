# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment fluid``: fixed presets against presets that follow the fluid.

The tape ``sink_servo`` runs on the machine ``small`` in fluids of the four resistivities of the
table in JP S60-10852 B, with the same seeds in two arms. Arm ``fixed``: every class of the fluid
has the presets of the highest resistance. Arm ``switched``: each class has its own. Nothing else
differs: in both arms the conductivity cell is read, and the open reference follows the voltage that
the fluid leaves. At the highest resistance both arms are the same run.

Both arms run with two pulses: that of the tape's condition, as a user would choose it for so small
an electrode, and the one of 250 us for which the table was found. A servo period of 20 ms has about
490 pulses of the first kind and 67 of the second.
"""

import copy
from collections.abc import Callable, Iterable
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
    value_with_spread,
    write_results,
)
from host.machines import machine as machines
from host.machines.machine import Machine
from host.places import ROOT
from host.run import figures
from host.run.run import count_retractions
from host.run.workpiece import Columns
from host.tape.tape import load
from host.words import counted

__all__ = ["ARMS", "FIGURES", "OHM_CM", "PULSES", "Trial", "add_figures", "fluid", "in_parallel",
           "measure", "plot", "sentences", "statistics", "summed_up", "table", "value_with_spread"]

MACHINE, TAPE = "small", ROOT / "tapes" / "sink_servo.nc"
OHM_CM = (1e6, 1.25e5, 4e4, 1e3)
# Presets entered by hand before the tape for the classes 1 to 3: those of class 0, or their own,
# which are the controller's defaults. Both have the same number of digits, so that the tape begins
# in the same clock.
ARMS = {
    "fixed": ("G10 W1 X3 Y6 Z14", "G10 W2 X3 Y6 Z14", "G10 W3 X03 Y6 Z14"),
    "switched": ("G10 W1 X5 Y5 Z18", "G10 W2 X8 Y3 Z22", "G10 W3 X13 Y2 Z28"),
}
# Pulses, and what is entered by hand for them: condition 100 of the tape.
PULSES = {"15 us": (), "250 us": ("G10 C100 P250 Q50 R50",)}
LONGEST_S = 60.0    # of the machine's time; a run that takes longer counts as stopped
FRONT = 0           # of a trace's states of the motion: machining
SETTLE_S = 0.5      # after the first discharge the servo closes the gap: this time does not count

# Figure: its name in the table, and digits.
FIGURES = {
    "gap_um": ("gap, um", 1), "gap_deviation_um": ("its deviation, um", 1),
    "ok": ("good, %", 1), "open": ("open, %", 1), "dame": ("arc, %", 1), "short": ("short, %", 2),
    "removal_mm3_min": ("removal, mm3/min", 3), "scaled_mm3_min": ("scaled", 2),
    "up": ("UP", 0), "down": ("DOWN", 0), "retractions": ("retractions", 1),
    "time_s": ("time, s", 1),
}
COLOURS = {"fixed": figures.FAINT, "switched": figures.PATH}
LINES = {"15 us": "-", "250 us": "--"}


@dataclass(frozen=True)
class Trial:
    """One run: pulse, resistivity of the fluid, arm, seed."""

    pulse: str
    ohm_cm: float
    arm: str
    seed: int


def machine_with(ohm_cm: float) -> Machine:
    """The machine with a fluid of this resistivity, which does not drift."""
    tables = copy.deepcopy(machines.load(MACHINE).tables)
    tables["gap"]["fluid_ohm_cm"] = ohm_cm
    return Machine(MACHINE, tables)


def run(trial: Trial) -> Record:
    """Run a trial; return its figures and how it ended."""
    machine = machine_with(trial.ohm_cm)
    with executed(machine, load(TAPE), trial.seed, until_s=LONGEST_S,
                  mdi=[*PULSES[trial.pulse], *ARMS[trial.arm]]) as (job, machine_on):
        return asdict(trial) | {
            "outcome": job.outcome, "alarm": job.alarm and job.alarm["text"],
            **measure(machine_on.trace(), machine), **machine_on.servo_steps(),
            "retractions": count_retractions(job.events)["count"]}


def measure(trace: Columns, machine: Machine) -> Record:
    """Figures of a trace whose ``z`` is in pulses.

    ``gap_um``, ``gap_deviation_um`` and the shares of the classes in percent: at the front under
    servo, from ``SETTLE_S`` after the first discharge to the last. ``time_s`` and the removal:
    between these two, retractions included; ``removal_mm3_min`` without the plant's scaling.

    Raises
    ------
    UserError
        If there were no discharges for so long.
    """
    t = trace["t"]
    sparks = np.flatnonzero(trace["ok"] + trace["dame"])
    begin = np.searchsorted(t, t[sparks[0]] + SETTLE_S) if sparks.size else len(t)
    if not sparks.size or begin >= sparks[-1]:
        raise UserError(f"a run of the experiment had no {SETTLE_S} s of discharges.")
    cut = slice(begin, sparks[-1] + 1)
    front = trace["state"][cut] == FRONT
    gap = trace["gap_um"][cut][front]
    pulses = {kind: trace[kind][cut][front].sum() for kind in ("ok", "open", "dame", "short")}
    shares = {kind: 100 * float(number) / float(sum(pulses.values()))
              for kind, number in pulses.items()}
    bottom_mm = trace["gap_um"][cut] / 1000 - trace["z"][cut] / machine.pulses_per_mm
    time_s = float(t[cut][-1] - t[cut][0])
    scaled = machine.number("gap", "area_mm2") * float(bottom_mm[-1] - bottom_mm[0]) / time_s * 60
    return {"gap_um": float(gap.mean()), "gap_deviation_um": float(gap.std()), **shares,
            "removal_mm3_min": scaled / machine.removal_scale, "scaled_mm3_min": scaled,
            "time_s": time_s}


def _order(one: Record) -> tuple[int, float, str, int]:
    return list(PULSES).index(one["pulse"]), -one["ohm_cm"], one["arm"], one["seed"]


def statistics(runs: Iterable[Record]) -> list[Record]:
    """One row for every pulse, resistivity and arm.

    ``outcomes``: how many ended how. For each of ``FIGURES`` mean and spread over the seeds, the
    spread being the sample's standard deviation, or None of a single run.
    """
    groups: dict[tuple[str, float, str], list[Record]] = {}
    for one in sorted(runs, key=_order):
        groups.setdefault((one["pulse"], one["ohm_cm"], one["arm"]), []).append(one)
    return [{"pulse": pulse, "ohm_cm": ohm_cm, "arm": arm, **summed_up(group, FIGURES)}
            for (pulse, ohm_cm, arm), group in groups.items()]


def _ohm_cm(row: Record) -> str:
    return f"{row['ohm_cm']:.3g}".replace("e+0", "e")


def table(rows: list[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Figures down, pulses, resistivities and arms across; mean and spread over the seeds."""
    made = Table(box=style)
    made.add_column("ohm cm", no_wrap=True)
    for row in rows:
        made.add_column(_ohm_cm(row), justify="right", no_wrap=True)
    made.add_row("pulse", *(row["pulse"] for row in rows))
    made.add_row("presets", *(row["arm"] for row in rows))
    add_figures(made, rows, FIGURES)
    return made


def sentences(runs: list[Record]) -> list[str]:
    """Sentences on what switching changed, for better or worse, by pulse and resistivity."""
    said = []
    kinds = dict.fromkeys((one["pulse"], one["ohm_cm"]) for one in sorted(runs, key=_order))
    for pulse, ohm_cm in kinds:
        pairs = [{one["arm"]: one for one in runs
                  if (one["pulse"], one["ohm_cm"], one["seed"]) == (pulse, ohm_cm, seed)}
                 for seed in sorted({one["seed"] for one in runs})]

        def ratio(name: str, pairs: list[dict[str, Record]] = pairs) -> float:
            return float(sum(pair["switched"][name] for pair in pairs)
                    / sum(pair["fixed"][name] for pair in pairs))

        steadier = sum(pair["switched"]["gap_deviation_um"] < pair["fixed"]["gap_deviation_um"]
                       for pair in pairs)
        retractions = [sum(pair[arm]["retractions"] for pair in pairs) for arm in ARMS]
        said.append(
            f"Pulse of {pulse}, {_ohm_cm(pairs[0]['fixed'])} ohm cm, switched against fixed: "
            f"the gap's deviation is {ratio('gap_deviation_um'):.2f} times as great "
            f"(less with {steadier} of {counted(len(pairs), 'seed')}), "
            f"the removal {ratio('removal_mm3_min'):.2f} times, retractions "
            f"{retractions[1]} against {retractions[0]}.")
    return said


def _page(rows: list[Record], said: list[str], seeds: int) -> str:
    """The table and the sentences, as Markdown."""
    tables = []
    for pulse in PULSES:
        of_pulse = [row for row in rows if row["pulse"] == pulse]
        tables += ["", *markdown(table(of_pulse, box.MARKDOWN))]
    return "\n".join([
        "# Presets that stay, and presets switched by the fluid's resistance", "",
        f"Tape {TAPE.stem}, machine {MACHINE}, {counted(seeds, 'seed')}: mean ± sample standard "
        "deviation over the seeds. Gap and", "classes at the front under servo, from "
        f"{SETTLE_S} s after the first discharge to the last.",
        *tables, "", *(f"* {one}" for one in said), ""])


def plot(rows: list[Record], path: Path) -> None:
    """Draw the gap, the removal, the retractions and the shares against the resistivity."""
    panels = (("gap_um", "gap, µm"), ("gap_deviation_um", "deviation of the gap, µm"),
              ("removal_mm3_min", "removal, mm³/min, unscaled"), ("retractions", "retractions"))
    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(9.6, 11.2), layout="constrained")
        axes = figure.subplots(4, 2).ravel()
        for ax, (name, title) in zip(axes, panels, strict=False):
            for (pulse, line), (arm, colour) in product(LINES.items(), COLOURS.items()):
                points = [(row["ohm_cm"], *row[name]) for row in rows
                          if (row["pulse"], row["arm"]) == (pulse, arm)]
                x, mean, spread = zip(*points, strict=True)
                ax.errorbar(x, mean, [one or 0 for one in spread], color=colour, marker="o",
                            markersize=4, capsize=3, linestyle=line,
                            label=f"presets {arm}, pulse of {pulse}")
            ax.set(title=title, xscale="log", ylim=(0, None))
        axes[1].legend()
        for ax, (pulse, arm) in zip(axes[4:], product(PULSES, ARMS), strict=True):
            mine = [row for row in reversed(rows) if (row["pulse"], row["arm"]) == (pulse, arm)]
            base = np.zeros(len(mine))
            for kind, (title, colour) in figures.CLASSES.items():
                share = np.array([row[kind][0] for row in mine])
                ax.bar(range(len(mine)), share, bottom=base, color=colour, label=title)
                base += share
            ax.set(title=f"classes, %, presets {arm}, pulse of {pulse}", ylim=(0, 100))
            ax.set_xticks(range(len(mine)), [_ohm_cm(row) for row in mine])
        figure.legend(*axes[4].get_legend_handles_labels(), loc="outside lower center", ncol=4)
        for ax in axes[6:]:
            ax.set_xlabel("resistivity of the fluid, ohm cm")
        figure.savefig(path, dpi=120)


def _runs(seeds: int, progress: Callable[[Record], None]) -> list[Record]:
    trials = [Trial(pulse, ohm_cm, arm, seed) for seed, pulse, ohm_cm, arm
              in product(range(1, seeds + 1), PULSES, OHM_CM, ARMS)]
    return sorted(in_parallel(run, trials, progress), key=_order)


def fluid(*, seeds: int, folder: Path, console: Console) -> None:
    """Make the experiment; write ``runs.json``, ``table.md`` and ``plot.png``, print the table."""
    make_folder(folder)
    build_simulator(machine_with(OHM_CM[0]), console)
    with Progress(console=console) as bar:
        task = bar.add_task("runs", total=seeds * len(PULSES) * len(OHM_CM) * len(ARMS))

        def tell(one: Record) -> None:
            bar.advance(task)
            bar.console.print(f"{one['pulse']}, {_ohm_cm(one)} ohm cm, presets {one['arm']}, "
                              f"seed {one['seed']}: {one['outcome']} after {one['time_s']:.1f} s, "
                              f"gap {one['gap_um']:.1f} ± {one['gap_deviation_um']:.1f} um",
                              soft_wrap=True)
        runs = _runs(seeds, tell)
    rows, said = statistics(runs), sentences(runs)
    write_results(folder, runs, _page(rows, said, seeds))
    plot(rows, folder / "plot.png")
    for pulse, arm in product(PULSES, ARMS):
        console.print(table([row for row in rows if (row["pulse"], row["arm"]) == (pulse, arm)]))
    for one in said:
        console.print(one, soft_wrap=True)
    console.print(f"{folder}: runs.json, table.md, plot.png", soft_wrap=True)
