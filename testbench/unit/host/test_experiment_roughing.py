# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment roughing``: its figures on invented runs, its table, its two tapes."""

import json
import re
from itertools import product

import numpy as np
import pytest
from rich import box
from rich.console import Console

from host.errors import UserError
from host.experiments import common
from host.experiments import roughing as experiment
from host.experiments.roughing import (
    AREA_MM2,
    ARMS,
    FIGURES,
    SWEEP,
    Trial,
    machine_for,
    measure,
    needed,
    opened,
    plot,
    sentences,
    staircase_for,
    statistics,
    sweep_table,
    table,
    tape_for,
)
from host.roughing.basic import read_all
from host.roughing.roughing import JUMP
from host.roughing.staircase import neighbours
from host.roughing.synthetic import undersize_um
from host.tape.tape import decode

DATA = read_all("copper", "steel")
NEAR = neighbours(DATA, AREA_MM2)
MACHINE = machine_for()


def text_of(arm):
    return decode(tape_for(Trial(arm, 1, 15.0), DATA).rows)[0]


def made_up(speed_mm_s=0.5, depth_mm=4.0, dwell_s=1.0):
    """Sinks evenly from ``dwell_s`` on; draws back by 1 mm in the middle; 3000 good, 1000 arcs."""
    t = np.arange(0, dwell_s + depth_mm / speed_mm_s + 1, 1e-3)
    z = -np.clip((t - dwell_s) * speed_mm_s, 0, depth_mm)
    sparks = (z < 0) & (z > -depth_mm)
    middle = np.abs(z + depth_mm / 2) < 0.1
    place = z + 1.0 * middle - MACHINE.start_mm["z"]
    return {"t": t, "z": place * MACHINE.pulses_per_mm,
            "ok": 3.0 * sparks, "dame": 1.0 * sparks, "open": np.zeros(len(t)),
            "short": np.zeros(len(t))}


def switched(*pairs):
    return [{"event": "condition", "t": t, "ip": ip} for t, ip in pairs]


def test_all_arms_are_one_tape_but_for_the_currents():
    constant, staircase, highest = map(text_of, ARMS)
    assert "G39 Z" not in constant + highest
    planned = staircase_for(Trial("staircase", 1, 15.0), DATA)
    assert staircase.count("G39 Z") == len(planned.steps) - 1

    def same(text):
        blocks = [re.sub(r"^N\d+ ", "", line) for line in text.splitlines() if "(" not in line]
        return [one for one in blocks if not one.startswith(("G39", "G10", "C"))]

    assert same(constant) == same(staircase)
    assert len(same(highest)) == len(same(constant))
    assert same(constant).count(JUMP) == 1
    assert "Z-14.97 " in "".join(same(constant))


def test_the_constant_current_is_that_of_the_last_step():
    constant, staircase, highest = (staircase_for(Trial(arm, 1, 15.0), DATA) for arm in ARMS)
    assert [step.ip for step in constant.steps] == [staircase.steps[-1].ip] == [staircase.alpha]
    assert constant.steps[-1].depth_um == staircase.steps[-1].depth_um == 15_000
    assert len(staircase.steps) == 3
    assert [step.ip for step in highest.steps] == [staircase.steps[0].ip]
    assert highest.steps[-1].depth_um == 15_000


def test_a_finer_supply_plans_more_steps_on_a_machine_that_has_it():
    staircase = staircase_for(Trial("staircase", 1, 8.0, 3), DATA)
    assert len(staircase.steps) == 6
    machine = machine_for(3)
    assert machine.tables["source"]["step_a"] == 0.5
    assert machine.settings["455"] == 500
    text = decode(tape_for(Trial("staircase", 1, 8.0, 3), DATA).rows)[0]
    assert text.count("G39 Z") == 5


def test_undersize_is_the_most_that_any_current_in_force_needed():
    t = np.linspace(0, 10, 101)
    deepest = t / 2                     # 5 mm at the end
    found = needed(t, deepest, switched((0.0, 8), (4.0, 6)), NEAR)
    # IP 8 was in force until 2 mm less one sample, IP 6 to the end; the data are interpolated.
    assert found == pytest.approx(max(undersize_um(AREA_MM2, 8, 1.95),
                                      undersize_um(AREA_MM2, 6, 5.0)), abs=0.3)
    early = needed(t, deepest, switched((0.0, 8), (1.0, 6)), NEAR)
    assert early < found
    assert needed(t, np.zeros(101), switched((0.0, 8)), NEAR) == 0


def test_figures_of_a_run_made_up():
    found = measure(made_up(), switched((0.0, 6)), MACHINE, NEAR)
    assert found["time_s"] == pytest.approx(8.0, abs=0.01)
    assert found["unscaled_min"] == pytest.approx(found["time_s"] * MACHINE.removal_scale / 60)
    assert found["depth_mm"] == pytest.approx(4.0)
    assert (found["ok"], found["dame"], found["open"], found["short"]) == (75, 25, 0, 0)
    assert json.loads(json.dumps(found)) == found
    assert found["by_data_um"] == pytest.approx(undersize_um(AREA_MM2, 6, 4.0), abs=0.5)
    # The way back counts as time, and not as depth.
    depths, times = (np.array(found["profile"][name]) for name in ("depth_mm", "time_s"))
    assert (np.diff(times) >= 0).all()
    assert times[np.searchsorted(depths, 3.0)] == pytest.approx(6.0, abs=0.2)


def test_a_run_without_discharges_has_no_figures():
    trace = made_up()
    trace["ok"], trace["dame"] = trace["ok"] * 0, trace["dame"] * 0
    with pytest.raises(UserError, match="had no discharge"):
        measure(trace, switched((0.0, 6)), MACHINE, NEAR)


def one_run(arm, seed, time_s, outcome="end"):
    return {"arm": arm, "seed": seed, "depth_mm": 15.0, "outcome": outcome,
            "alarm": None, "time_s": time_s, "unscaled_min": time_s, "by_data_um": 107.0,
            "consumed_um": 60.0 + seed + 2 * (arm == "staircase"), "bottom_um": 41.0,
            "walls": {"depth_mm": [5.0, 15.0], "opening_um": [60.0, 41.0]},
            "swept_um": [50.0 + ARMS.index(arm)] * len(SWEEP),
            "ok": 70.0, "open": 10.0, "dame": 15.0, "short": 5.0, "retractions": 4,
            "profile": {"depth_mm": [0.0, 15.0], "time_s": [0.0, time_s]}}


RUNS = [one_run(arm, seed, 100.0 + seed - (20 if arm == "staircase" else 0))
        for seed, arm in product((1, 2), ARMS)]


def test_statistics_and_table():
    rows = statistics([*RUNS, one_run("staircase", 3, 5.0, "alarm")])
    assert [row["time_s"] for row in rows] == [(101.5, pytest.approx(0.5**0.5)),
                                               (81.5, pytest.approx(0.5**0.5)),
                                               (101.5, pytest.approx(0.5**0.5))]
    assert rows[1]["outcomes"] == {"alarm": 1, "end": 2}
    console = Console(width=200)
    with console.capture() as text:
        console.print(table(rows, box.MARKDOWN))
    assert "| 101.5 ± 0.7" in text.get()
    assert len(text.get().strip().splitlines()) == len(FIGURES) + 3


def test_sentences_compare_seeds_that_ended_in_both_arms():
    found = staircase_for(Trial("staircase", 1, 15.0), DATA)
    said = sentences([*RUNS, one_run("constant", 3, 1000.0),
                      one_run("staircase", 3, 5.0, "alarm")], found)
    assert "takes 0.803 times as long as the constant current" in said[1]
    assert "less with 2 of 2 seeds" in said[1]
    assert "consumes +2.00 um of undersize more than it in the cavity (more with 2)" in said[1]
    assert "as the highest one" in said[2]
    assert len(sentences([one_run("constant", 1, 9.0)], found)) == 1


def test_files_of_an_experiment(workdir, monkeypatch, idle_simulation):
    # With invented runs: these tests check only the output.
    monkeypatch.setattr(common.simulation, "start", lambda *_, **__: idle_simulation)
    monkeypatch.setattr(experiment, "in_parallel", lambda function, trials, tell: [
        (tell(one), one)[1] for one in RUNS])
    with (workdir / "said.txt").open("w") as file:
        experiment.roughing(seeds=2, depth_mm=15.0, folder=workdir / "out",
                            console=Console(file=file, width=100))
    assert sorted(json.loads((workdir / "out" / "runs.json").read_text()),
                  key=lambda one: (one["arm"], one["seed"])) == sorted(
                      RUNS, key=lambda one: (one["arm"], one["seed"]))
    page = (workdir / "out" / "table.md").read_text()
    assert "consumed in the cavity, um" in page
    assert page.count("+1.00") == len(SWEEP)
    assert "staircase, seed 2: end after 82.0 s at 15.000 mm" in (workdir / "said.txt").read_text()
    assert (workdir / "out" / "plot.png").read_bytes()[:4] == b"\x89PNG"


def test_the_cavity_consumes_what_its_widest_layer_opens():
    walls = {"depth_mm": np.array([0.1, 0.2, 0.25]), "opening_um": np.array([48.0, 51.0, 44.0])}
    found = opened(walls)
    assert (found["consumed_um"], found["bottom_um"]) == (51.0, 51.0)
    assert found["walls"] == {"depth_mm": [0.1, 0.2, 0.25], "opening_um": [48.0, 51.0, 44.0]}


def test_a_sweep_of_runs_that_failed_has_no_means():
    console = Console(width=200)
    with console.capture() as text:
        console.print(sweep_table([one_run("constant", 1, 9.0, "alarm")], box.MARKDOWN))
    assert len(text.get().strip().splitlines()) == len(SWEEP) + 2
    first = next(line for line in text.get().splitlines() if "the machine's constants" in line)
    assert [cell.strip() for cell in first.split("|")[2:-1]] == ["-"] * (len(ARMS) + 1)


def test_plot_is_drawn_of_runs_that_failed(workdir):
    plot([one_run("constant", 1, 9.0, "alarm")], staircase_for(Trial("staircase", 1, 15.0), DATA),
         workdir / "plot.png")
    assert (workdir / "plot.png").read_bytes()[:4] == b"\x89PNG"
