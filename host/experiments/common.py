# SPDX-License-Identifier: Apache-2.0
"""What the experiments share: runs on all cores, mean and spread, and the files of the results."""

import argparse
import io
import json
import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from rich.console import Console
from rich.table import Table

from host.errors import UserError
from host.machines.machine import Machine
from host.run import simulation
from host.run.run import Run
from host.tape.tape import Tape
from softcore.tables.settings import named

__all__ = ["LOOPS", "Record", "add_figures", "build_simulator", "executed", "in_loop",
           "in_parallel", "make_folder", "markdown", "seeds_and_folder", "summed_up",
           "value_with_spread", "with_settings", "write_results"]

Record = dict[str, Any]     # figures of a run, or of all runs of a kind, by name
T = TypeVar("T")
LOOPS = {"feed-forward": 100, "plain loop": 0}      # and the setting ``feed_forward``


def make_folder(folder: Path) -> None:
    """Make the folder of the results.

    Raises
    ------
    UserError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder} cannot be written: {error.strerror}.") from error


def seeds_and_folder(module: str, about: str | None, *, seeds: int,
                     folder: str) -> tuple[int, Path]:
    """Number of seeds and folder of the results, as the command line of a module gives them.

    A wrong number, and a folder that cannot be made, end the program with one sentence.

    Parameters
    ----------
    module, about : str
        The module that runs, and what ``--help`` says of it.
    seeds, folder : int, str
        What is used if nothing is given; the folder lies in ``build/experiments``.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {module}", description=about)
    parser.add_argument("--seeds", type=int, default=seeds, help="runs of each kind: seeds 1 to N")
    parser.add_argument("--out", type=Path, default=Path("build/experiments") / folder,
                        help="folder for runs.json, which has every run")
    chosen = parser.parse_args()
    if chosen.seeds < 1:
        parser.error("--seeds must be 1 or more.")
    try:
        make_folder(chosen.out)
    except UserError as error:
        parser.error(str(error))
    return chosen.seeds, chosen.out


def build_simulator(machine: Machine, console: Console) -> None:
    """Build the simulator of a machine once, so that not every process builds it."""
    simulation.start(machine, clock_hz=machine.clock_hz, seed=1, waves=None,
                     progress=lambda text: console.print(text, soft_wrap=True)).close()


def with_settings(machine: Machine, values: dict[str, int]) -> Machine:
    """The machine with other values of some settings, by their names."""
    numbers = {str(named(name).number): value for name, value in values.items()}
    return Machine(machine.name, machine.tables | {
        "settings": machine.tables.get("settings", {}) | numbers})


def in_loop(machine: Machine, loop: str) -> Machine:
    """The machine with one of ``LOOPS``."""
    return with_settings(machine, {"feed_forward": LOOPS[loop]})


@contextmanager
def executed(machine: Machine, tape: Tape, seed: int, *,
             prepare: Callable[[simulation.Simulation], None] = lambda _: None,
             **options: Any) -> Iterator[tuple[Run, simulation.Simulation]]:
    """Run a tape on a simulated machine; the run and the machine, which is closed on leaving.

    ``prepare`` is called with the machine before the run; ``options`` are those of ``Run``.
    """
    machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=seed, waves=None,
                                  progress=lambda _: None)
    try:
        prepare(machine_on)
        job = Run(machine, tape, machine_on, **options)
        job.execute()
        yield job, machine_on
    finally:
        machine_on.close()


def in_parallel(function: Callable[[T], Record], trials: list[T],
                progress: Callable[[Record], None]) -> list[Record]:
    """``function`` of every trial, one core each; ``progress`` is called with each result."""
    done = []
    with ProcessPoolExecutor(os.cpu_count(), multiprocessing.get_context("spawn")) as pool:
        for future in as_completed([pool.submit(function, trial) for trial in trials]):
            try:
                done.append(future.result())
            except BrokenProcessPool as error:
                raise UserError("a run of the experiment was killed from outside.") from error
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
            progress(done[-1])
    return done


def summed_up(runs: list[Record], names: Iterable[str]) -> Record:
    """``outcomes`` of runs of one kind, and mean and spread of each figure, over the seeds.

    A run without some figure does not count for it. A figure that no run has is None.
    """
    outcomes = [one["outcome"] for one in runs]
    found: Record = {"outcomes": {name: outcomes.count(name) for name in sorted(set(outcomes))}}
    for name in names:
        values = [one[name] for one in runs if one.get(name) is not None]
        found[name] = (float(np.mean(values)),
                       float(np.std(values, ddof=1)) if len(values) > 1 else None
                       ) if values else None
    return found


def value_with_spread(figure: tuple[float, float | None], digits: int) -> str:
    """Mean and, if there is one, spread."""
    mean, spread = figure
    return f"{mean:.{digits}f}" + (f" ± {spread:.{digits}f}" if spread is not None else "")


def add_figures(made: Table, rows: list[Record], titles: dict[str, tuple[str, int]]) -> None:
    """Add the results of ``summed_up`` to a table: how the runs ended, and every figure."""
    made.add_row("ended", *(", ".join(f"{number} {name}"
                                      for name, number in row["outcomes"].items())
                            for row in rows))
    for name, (title, digits) in titles.items():
        made.add_row(title, *(value_with_spread(row[name], digits) if row[name] else ""
                              for row in rows))


def markdown(made: Table) -> list[str]:
    """Lines of a table of the style ``box.MARKDOWN``."""
    page = Console(width=400, file=io.StringIO())
    with page.capture() as text:
        page.print(made)
    return [*filter(None, map(str.strip, text.get().splitlines()))]


def write_results(folder: Path, runs: Any, page: str) -> None:
    """Write ``runs.json`` and ``table.md``."""
    (folder / "runs.json").write_text(json.dumps(runs, indent=2) + "\n", encoding="utf-8")
    (folder / "table.md").write_text(page, encoding="utf-8")
