# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment shorts``: its figures on invented runs, and its tables."""

import io
import json

import numpy as np
import pytest
from rich import box
from rich.console import Console

from host.experiments import common
from host.experiments import shorts as experiment
from host.experiments.common import LOOPS
from host.experiments.shorts import FIGURES, beyond_um, statistics, table, table_of_runs
from rtl.states import State


def chain(speed, clear_s):
    return {"speed": speed, "t": 1.0, "touched": 4e-3, "forward": 1e-6, "back": 5e-6, "turn": 2e-3,
            "clear": {20: clear_s, 100: None}}


def run(loop, seed):
    slow = 1 if loop == "feed-forward" else 2
    return dict.fromkeys(FIGURES, 10.0 * slow) | {
        "retractions": 10 * slow, "loop": loop, "seed": seed, "outcome": "end", "alarm": None,
        "chains": [chain(300.0, slow * 1e-3 * (seed + 6)), chain(900.0, None)]}


RUNS = [run(loop, seed) for seed in (3, 1, 2) for loop in LOOPS]


def test_shorts_of_all_seeds_count_together():
    rows = statistics(RUNS)
    assert [(row["speed"], row["loop"]) for row in rows] == [
        (300, "feed-forward"), (300, "plain loop"), (900, "feed-forward"), (900, "plain loop")]
    fed, plain, *fast = rows
    assert fed["shorts"] == 3
    figure = fed["clear_20_um_ms"]
    assert (figure["median"], figure["worst"], figure["shorts"]) == pytest.approx((8, 9, 3))
    assert figure["times"] == pytest.approx([8 / figure["drive"], figure["p99"] / figure["drive"]])
    assert plain["clear_20_um_ms"]["median"] == 16
    assert fed["clear_100_um_ms"] is None
    assert [row["clear_20_um_ms"] for row in fast] == [None, None]
    assert fed["sample_ms"]["median"] == pytest.approx(4)


def test_the_table_says_if_not_all_shorts_got_so_far():
    some = [*RUNS, run("feed-forward", 4)]
    some[-1]["chains"][0]["clear"][20] = None
    Console(file=(text := io.StringIO()), width=250).print(table(statistics(some), box.MARKDOWN))
    (row,) = [one for one in text.getvalue().splitlines() if "sample to 20 µm clear" in one]
    assert [" (of 3)" in cell for cell in row.split("|")[2:4]] == [True, False]


def test_runs_that_were_stored_have_the_same_figures():
    assert statistics(json.loads(json.dumps(RUNS))) == statistics(RUNS)


def test_only_the_way_back_and_its_end_count_as_beyond_the_command():
    trace = {"state": np.array([state.value for state in (
        State.FRONT, State.RETRACTING, State.RETRACTING, State.AT_LIMIT, State.HIGH)]),
        "error_z": np.array([-900.0, 300.0, -20.0, -45.0, -700.0])}
    assert beyond_um(trace, 10_000) == pytest.approx(4.5)
    assert beyond_um({name: column[:2] for name, column in trace.items()}, 10_000) == 0


def lines(made):
    said = Console(width=300, record=True)
    said.print(made)
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in said.export_text().splitlines() if line.startswith("| ")]
    return {row[0]: row[1:] for row in rows}


def test_the_tables_say_every_figure():
    found = lines(table(statistics(RUNS), box.ASCII))
    assert found["shorts"] == ["3"] * 4
    assert found["sample to 20 µm clear, ms"] == ["8.00; 8.98; 9.00", "16.00; 17.96; 18.00", "", ""]
    assert found["sample to 100 µm clear, ms"] == [""] * 4
    whole = lines(table_of_runs(RUNS, box.ASCII))
    assert whole["ended"] == ["3 end", "3 end"]
    assert whole["retractions"] == ["10.0 ± 0.0", "20.0 ± 0.0"]
    assert len(whole) == len(FIGURES) + 2


def test_the_whole_experiment_writes_its_files(monkeypatch, workdir):
    def in_parallel(function, trials, progress):
        found = [run(trial.loop, trial.seed) for trial in trials]
        for one in found:
            progress(one)
        return found

    class Built:
        def close(self):
            pass

    monkeypatch.setattr(experiment, "in_parallel", in_parallel)
    monkeypatch.setattr(common.simulation, "start", lambda *_, **__: Built())
    said = Console(width=200, record=True)
    experiment.shorts(seeds=2, folder=workdir / "out", console=said)
    assert len(json.loads((workdir / "out" / "runs.json").read_text())) == 4
    page = (workdir / "out" / "table.md").read_text()
    assert "20 µm clear, times the drive alone" in page
    assert "2 seeds" in page
    assert "plain loop, seed 2: end after 20.0 s, 20 retractions" in said.export_text()
