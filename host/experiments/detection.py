# SPDX-License-Identifier: Apache-2.0
"""How many shorted pulses should make a short: ``python -m host.experiments.detection``.

Few are seen soon, and leave electrode and work in contact for less time; but single shorted pulses,
of debris, then order retractions that nothing called for. A tape of each machine runs with several
settings of the detector (`$400` of `$401`) and the same seeds. The simulated machine knows its true
contact.
"""

import json
from dataclasses import asdict, dataclass
from itertools import product

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from host.experiments.common import (
    Record,
    add_figures,
    build_simulator,
    executed,
    in_parallel,
    markdown,
    seeds_and_folder,
    summed_up,
    with_settings,
)
from host.machines import machine as machines
from host.places import ROOT
from host.run import clearing
from host.tape.tape import load

__all__ = ["FIGURES", "RULES", "TAPES", "Trial", "figures", "run", "table"]

TAPES = {"sinker": "sink_shallow_deep", "wire": "wire_slot"}
RULES = (1, 1), (2, 2), (2, 3), (3, 4), (4, 5), (6, 8), (8, 10), (16, 20)   # $400 of $401
FIGURES = {
    "time_s": ("time on the machine, s", 1), "shorts": ("shorts a minute", 1),
    "false": ("false ones a minute", 1),
    "found_ms": ("contact to sample, median, ms", 2),
    "contact_s": ("time in contact, s", 3), "contact_ms": ("the same for each true short, ms", 1),
    "arcs": ("arcs", 0),
}


@dataclass(frozen=True)
class Trial:
    """One run: machine, shorted pulses needed, of the last so many, seed."""

    machine: str
    needed: int
    window: int
    seed: int


def figures(touched: list[float | None], *, time_s: float, contact_s: float) -> Record:
    """Figures of the shorts of a run.

    ``touched`` has the time in seconds from the contact to the sample that completed the short, or
    None for a false one: electrode and work were not in contact, nor bridged, at that sample.
    """
    true = [one for one in touched if one is not None]
    return {"time_s": time_s, "shorts": 60 * len(touched) / time_s,
            "false": 60 * (len(touched) - len(true)) / time_s,
            "found_ms": 1e3 * float(np.median(true)) if true else None,
            "contact_s": contact_s, "contact_ms": 1e3 * contact_s / len(true) if true else None}


def run(trial: Trial) -> Record:
    """Run a trial; its figures."""
    machine = with_settings(machines.load(trial.machine), {
        "short_needed": trial.needed, "short_window": trial.window})
    tape = load(ROOT / "tapes" / f"{TAPES[trial.machine]}.nc")
    with executed(machine, tape, trial.seed) as (job, machine_on):
        chains = clearing.chains(machine_on.shorts(), clock_hz=machine.clock_hz,
                                 pulses_per_mm=machine.pulses_per_mm)
        return asdict(trial) | {"outcome": job.outcome, "arcs": machine_on.discharges()["dame"]
                                } | figures([one.touched for one in chains],
                                            time_s=machine_on.time_s(),
                                            contact_s=machine_on.contact_s())


def table(runs: list[Record], machine: str, style: box.Box = box.MARKDOWN) -> Table:
    """Figures down, rules across; mean and deviation of the seeds."""
    made = Table(box=style)
    made.add_column(f"{machine}: mean ± deviation of the seeds", no_wrap=True)
    rows = []
    for needed, window in RULES:
        mine = [one for one in runs if one["machine"] == machine
                and (one["needed"], one["window"]) == (needed, window)]
        if mine:
            made.add_column(f"{needed} of {window}", justify="right", no_wrap=True)
            rows.append(summed_up(mine, FIGURES))
    add_figures(made, rows, FIGURES)
    return made


def main() -> None:
    """Print the tables, as Markdown."""
    seeds, folder = seeds_and_folder("host.experiments.detection", main.__doc__, seeds=3,
                                     folder="detection")
    console = Console()
    for name in TAPES:
        build_simulator(machines.load(name), console)
    trials = [Trial(name, *rule, seed) for seed, name, rule in product(
        range(1, seeds + 1), TAPES, RULES)]
    runs = in_parallel(run, trials, lambda one: console.print(
        f"{one['machine']}, {one['needed']} of {one['window']}, seed {one['seed']}: "
        f"{one['outcome']} after {one['time_s']:.1f} s", soft_wrap=True))
    runs.sort(key=lambda one: one["seed"])
    (folder / "runs.json").write_text(json.dumps(runs, indent=2) + "\n", encoding="utf-8")
    for name in TAPES:
        console.print("\n".join(markdown(table(runs, name))), soft_wrap=True)


if __name__ == "__main__":
    main()
