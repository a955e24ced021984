# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment fluid``: its figures on invented traces, its table, its refusals."""

import json

import numpy as np
import pytest
from rich import box
from rich.console import Console

from host.errors import UserError
from host.experiments import common
from host.experiments import fluid as experiment
from host.experiments.fluid import (
    ARMS,
    FIGURES,
    OHM_CM,
    PULSES,
    measure,
    plot,
    sentences,
    statistics,
    table,
)
from host.machines import machine
from rtl.states import State
from testbench.command import gapkeeper

SMALL = machine.load("small")


def made_up(seconds=4.0, begin=1.0):
    """A trace: 100 um of gap until ``begin``; then discharges, at 30 and 34 um in turn.

    The bottom sinks 0.1 mm a second. From 2.2 s to 2.4 s the machine retracts and the gap is wide.
    """
    t = np.arange(0, seconds, 1e-3)
    burning = t >= begin
    away = (t >= 2.2) & (t < 2.4)
    gap = np.where(burning, 30.0 + 4 * (np.arange(len(t)) % 2), 100.0)
    gap[away] = 500
    bottom_um = 100 * np.maximum(0, t - begin)
    per_ms = {"open": 4, "ok": 14, "dame": 1, "short": 1}
    return {"t": t, "gap_um": gap, "z": (gap - bottom_um) / 1000 * SMALL.pulses_per_mm,
            "state": np.where(away, State.RETRACTING.value, State.FRONT.value).astype(float),
            **{kind: np.where(burning, number, 0.0) for kind, number in per_ms.items()}}


def test_figures_of_a_trace():
    found = measure(made_up(), SMALL)
    assert found["gap_um"] == pytest.approx(32)
    assert found["gap_deviation_um"] == pytest.approx(2)
    assert [found[kind] for kind in ("open", "ok", "dame", "short")] == pytest.approx(
        [20, 70, 5, 5])
    # 0.1 mm/s on 10 mm2, over all of the time.
    assert found["scaled_mm3_min"] == pytest.approx(60, rel=1e-3)
    assert found["removal_mm3_min"] == pytest.approx(60 / SMALL.removal_scale, rel=1e-3)
    assert found["time_s"] == pytest.approx(2.5, abs=2e-3)


def test_the_first_closing_of_the_gap_is_not_counted():
    trace = made_up()
    closing = (trace["t"] >= 1) & (trace["t"] < 1 + experiment.SETTLE_S - 1e-3)
    trace["gap_um"][closing] += 40
    assert measure(trace, SMALL)["gap_um"] == pytest.approx(32)


@pytest.mark.parametrize("begin", [3.8, 9.0])
def test_a_trace_without_discharges_is_refused(begin):
    with pytest.raises(UserError, match=r"no 0\.5 s of discharges"):
        measure(made_up(begin=begin), SMALL)


def run(ohm_cm, arm, seed, pulse="15 us", **figures):
    return (dict.fromkeys(FIGURES, 10.0)
            | {"pulse": pulse, "ohm_cm": ohm_cm, "arm": arm, "seed": seed,
               "outcome": "end", "alarm": None}
            | figures)


RUNS = [run(ohm_cm, arm, seed, pulse)
        for seed in (1, 2) for pulse in PULSES for ohm_cm in OHM_CM for arm in ARMS]


def test_statistics_are_mean_and_spread_of_the_seeds():
    runs = [run(1e3, "fixed", seed, gap_um=value) for seed, value in ((1, 20), (2, 26), (3, 32))]
    runs[1]["outcome"] = "alarm"
    row, = statistics(runs)
    assert (row["ohm_cm"], row["arm"]) == (1e3, "fixed")
    assert row["gap_um"] == pytest.approx((26, 6))
    assert row["ok"] == (10, 0)
    assert row["outcomes"] == {"alarm": 1, "end": 2}


def test_a_single_run_has_no_spread():
    row, = statistics([run(1e3, "fixed", 1)])
    assert row["gap_um"] == (10, None)


def test_table_has_every_figure_and_every_kind_of_run():
    made = table(statistics(reversed(RUNS)), box.MARKDOWN)
    console = Console(width=400)
    with console.capture() as text:
        console.print(made)
    rows = [[cell.strip() for cell in line.split("|")[1:-1]]
            for line in text.get().splitlines() if "|" in line]
    fluids = ["1e6", "1e6", "1.25e5", "1.25e5", "4e4", "4e4", "1e3", "1e3"]
    assert rows[0] == ["ohm cm", *fluids * 2]
    assert rows[2] == ["pulse", *["15 us"] * 8, *["250 us"] * 8]
    assert rows[3] == ["presets", *["fixed", "switched"] * 8]
    assert rows[4] == ["ended", *["2 end"] * 16]
    assert [row[0] for row in rows[5:]] == [title for title, _ in FIGURES.values()]
    assert {cell for row in rows[5:] for cell in row[1:]} == {
        f"{10:.{digits}f} ± {0:.{digits}f}" for _, digits in FIGURES.values()}


@pytest.mark.parametrize(("deviation", "words"), [
    (12.0, "1.20 times as great (less with 0 of 1 seed)"),
    (8.0, "0.80 times as great (less with 1 of 1 seed)")])
def test_better_and_worse_are_told_alike(deviation, words):
    said, = sentences([
        run(4e4, "fixed", 1, retractions=1),
        run(4e4, "switched", 1, gap_deviation_um=deviation, removal_mm3_min=15.0, retractions=7)])
    assert said == ("Pulse of 15 us, 4e4 ohm cm, switched against fixed: the gap's deviation is "
                    f"{words}, the removal 1.50 times, retractions 7 against 1.")


def test_plot_is_drawn(workdir):
    plot(statistics(RUNS), workdir / "plot.png")
    assert (workdir / "plot.png").read_bytes()[:4] == b"\x89PNG"


def test_files_of_an_experiment(workdir, monkeypatch, idle_simulation):
    # With invented runs: these tests check only the output.
    monkeypatch.setattr(common.simulation, "start", lambda *_, **__: idle_simulation)
    monkeypatch.setattr(experiment, "_runs", lambda seeds, tell: [
        (tell(one), one)[1] for one in RUNS])
    with (workdir / "said.txt").open("w") as file:
        experiment.fluid(seeds=2, folder=workdir / "out", console=Console(file=file, width=80))
    assert json.loads((workdir / "out" / "runs.json").read_text()) == RUNS
    page = (workdir / "out" / "table.md").read_text()
    assert page.count("ohm cm, switched against fixed") == 8
    assert page.count("\n| gap, um") == len(PULSES)
    assert "Tape sink_servo, machine small, 2 seeds:" in page
    assert not [line for line in page.splitlines() if line != line.strip()]
    said = (workdir / "said.txt").read_text()
    assert "250 us, 1e3 ohm cm, presets fixed, seed 2: end" in said
    assert not [line for line in said.splitlines() if "removal, mm3/min" in line and "…" in line]


def test_arms_have_lines_of_one_length():
    # So that the tape begins in the same clock.
    assert [len(line) for line in ARMS["fixed"]] == [len(line) for line in ARMS["switched"]]


@pytest.mark.parametrize(("arguments", "message"), [
    (["experiment"],                           "fluid"),
    (["experiment", "nonsense"],               "No such command 'nonsense'"),
    (["experiment", "fluid", "--seeds", "0"],  "greater than or equal to 1"),
    (["experiment", "fluid", "--seeds", "x"],  "should be a valid integer"),
    (["experiment", "fluid", "--out", __file__], "is a file"),
])
def test_wrong_options_are_refused(arguments, message):
    done = gapkeeper(*arguments, columns=200)
    assert done.returncode == 2
    assert message in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(("options", "said"), [
    (("--seeds", "0"), "--seeds must be 1 or more."),
    (("--seeds", "x"), "invalid int value: 'x'"),
    (("--out", f"{__file__}/runs"), f"{__file__}/runs cannot be written: Not a directory."),
])
def test_what_a_module_of_an_experiment_cannot_do_is_one_sentence(
        options, said, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["x", *options])
    with pytest.raises(SystemExit, match="2"):
        common.seeds_and_folder("host.experiments.x", "About.", seeds=3, folder="x")
    assert said in capsys.readouterr().err.splitlines()[-1]
