# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment gap``: its tapes, its figures on invented runs, its page."""

import json

import pytest
from rich import box
from rich.console import Console

from host.experiments import common
from host.experiments import gap as experiment
from host.experiments.gap import FIGURES, RULES, Trial, plot, sentences, statistics, table, tape_of

DEVIATION_UM = {rule: 2.0 + index for index, rule in enumerate(RULES)}


def run(rule, seed, **figures):
    return (dict.fromkeys(FIGURES, 10.0)
            | {"rule": rule, "seed": seed, "outcome": "end", "alarm": None,
               "gap_deviation_um": DEVIATION_UM[rule] + 0.1 * (2 * seed - 3)}
            | figures)


RUNS = [run(rule, seed) for seed in (1, 2) for rule in RULES]


def test_statistics_compare_every_rule_with_the_default():
    rows = statistics(reversed(RUNS))
    assert [row["rule"] for row in rows] == list(RULES)
    assert [row["times"] for row in rows] == pytest.approx(
        [deviation / 2 for deviation in DEVIATION_UM.values()])
    for row in rows:
        mean, spread = row["gap_deviation_um"]
        assert mean == pytest.approx(DEVIATION_UM[row["rule"]])
        assert spread == pytest.approx(0.1 * 2 ** 0.5)
        assert row["outcomes"] == {"end": 2}


def test_sentences_say_what_got_better_and_what_got_worse():
    runs = [run("accumulate", 1, removal_mm3_min=2.0, gap_um=70.0),
            run("total", 1, removal_mm3_min=3.0, gap_um=65.5, gap_deviation_um=0.95)]
    assert sentences(statistics(runs)) == [
        "total: the gap's deviation is 0.50 times that of accumulate, the removal 1.50 times, the "
        "gap 65.5 against 70.0 um."]


def test_every_rule_has_a_column():
    said = Console(width=300, record=True)
    said.print(table(statistics(RUNS), box.ASCII))
    lines = [[cell.strip() for cell in line.strip("|").split("|")]
             for line in said.export_text().splitlines() if line.startswith("|")]
    assert lines[0] == ["rule", *RULES]
    found = {line[0]: line[1:] for line in lines[1:]}
    assert found["deviation, times"] == [f"{one / 2:.2f}" for one in DEVIATION_UM.values()]
    assert set(found) > {title for title, _ in FIGURES.values()}


@pytest.mark.parametrize("rule", RULES)
def test_tapes_differ_in_their_rule_and_not_in_pulse_step_or_way(rule):
    def pulse(text):
        row, = (line.split() for line in text.splitlines() if "G10 C900" in line)
        return [word for word in row if word[0] in "CIPQRELHK"]

    text, usual = tape_of(Trial(rule, 1)), tape_of(Trial("accumulate", 1))
    assert pulse(text) == pulse(usual)
    for part in ("G36 R300 L0.5 H600 E60 Q0.1", "G01 Z-0.25 F60", "G95 P1"):
        assert part in text
        assert part in usual
    assert tape_of(Trial(rule, 1, 0.1)) == text.replace("Z-0.25", "Z-0.1") != text


def test_the_page_has_all_of_it(workdir, monkeypatch):
    class Done:
        def close(self):
            pass

    monkeypatch.setattr(common.simulation, "start", lambda *_, **__: Done())
    monkeypatch.setattr(experiment, "in_parallel", lambda _, trials, tell: [
        (tell(one), one)[1] for one in (run(trial.rule, trial.seed) for trial in trials)])
    with (workdir / "said.txt").open("w") as file:
        experiment.gap(seeds=2, depth_mm=0.25, folder=workdir / "out",
                       console=Console(file=file, width=80))
    assert len(json.loads((workdir / "out" / "runs.json").read_text())) == 2 * len(RULES)
    page = (workdir / "out" / "table.md").read_text()
    assert "Machine small, to 0.25 mm, 2 seeds:" in page
    assert page.count("times that of accumulate") == len(RULES) - 1
    assert not [line for line in page.splitlines() if line != line.strip()]
    assert (workdir / "out" / "plot.png").stat().st_size > 10_000
    assert "noise, seed 2: end at" in (workdir / "said.txt").read_text()


def test_a_plot_of_one_seed_needs_no_spread(workdir):
    plot(statistics(RUNS[:len(RULES)]), workdir / "plot.png")
    assert (workdir / "plot.png").stat().st_size > 10_000
