# SPDX-License-Identifier: Apache-2.0
"""The experiment on networks and poor data: its data, its judgement, its files."""

import json
import random
from itertools import pairwise

import pytest
from rich import box
from rich.console import Console

from host.experiments import networks as experiment
from host.experiments.networks import (
    DATA,
    FIGURES,
    TRUTHS,
    Trial,
    basic_data,
    judge,
    run,
    statistics,
    table,
)
from host.roughing import synthetic
from host.roughing.basic import read_all
from host.roughing.staircase import Answers, Job, Staircase, Step

JOB = Job(70, 110, 15)


def made(*steps):
    return Staircase(JOB, 110, 6.2, steps[-1][0], 107.8, tuple(Step(*one) for one in steps), 30, 25,
                     ())


def test_whole_data_of_the_straight_formula_are_the_shipped_ones():
    shipped = read_all("copper", "steel")
    found = basic_data(synthetic.undersize_um, "whole", 70, random.Random(1))
    assert [one.area_mm2 for one in found] == [one.area_mm2 for one in shipped]
    for one, other in zip(found, shipped, strict=True):
        assert (one.ip, one.depth_mm) == (other.ip, other.depth_mm)
        assert one.undersize_um == other.undersize_um


@pytest.mark.parametrize("kind", DATA)
@pytest.mark.parametrize("truth", TRUTHS)
def test_data_are_as_poor_as_their_kind_says_and_keep_the_rules(truth, kind, rng):
    gaps, noise, few, held_out = DATA[kind]
    areas = []
    for area in (21, 70, 150, 399):
        data = basic_data(TRUTHS[truth], kind, area, rng)
        areas.append([one.area_mm2 for one in data])
        for one in data:
            for row, other in pairwise(one.undersize_um):
                assert all(a < b for a, b in zip(row, other, strict=True))
            assert all(a < b for row in one.undersize_um for a, b in pairwise(row))
            assert (len(one.ip) < 15) == (gaps or few)
            assert (one.ip[0], one.ip[-1]) == (1, 15)
            assert (len(one.depth_mm) < 12) == few
            off = max(abs(value - TRUTHS[truth](one.area_mm2, ip, depth))
                      for ip, row in zip(one.ip, one.undersize_um, strict=True)
                      for depth, value in zip(one.depth_mm, row, strict=True))
            assert (off > 0.5) == noise
    assert [len(one) for one in areas] == [5 - held_out] * 4
    if held_out:
        assert [sorted({20, 50, 100, 200, 400} - set(one)) for one in areas] == [
            [50], [50], [200], [200]]


def test_a_staircase_is_judged_by_the_formula():
    truth = synthetic.undersize_um
    good = judge(truth, made((8, 2100), (7, 7400), (6, 15_000)))
    assert (good["right"], good["excess"]) == (True, False)
    assert 1.05 > good["time"] > 1
    deep = judge(truth, made((8, 5000), (6, 15_000)))
    assert deep["excess"]
    assert deep["worst_um"] == pytest.approx(truth(70, 8, 5) - 110)
    assert not judge(truth, made((5, 15_000)))["right"]
    assert judge(truth, made((5, 15_000)))["time"] > good["time"]


def test_a_trial_has_all_answers_and_the_same_ones_again():
    first = run(Trial("bent", "all of these", 3))
    assert first == run(Trial("bent", "all of these", 3))
    assert {answers.value for answers in Answers} <= first.keys()
    assert first["network"] != first["interpolation"]


def test_table_and_files(workdir, monkeypatch):
    monkeypatch.setattr(experiment, "in_parallel", lambda function, trials, tell: [
        (tell(one), one)[1] for one in map(function, trials)])
    with (workdir / "said.txt").open("w") as file:
        experiment.networks(jobs=1, folder=workdir / "out", console=Console(file=file, width=250))
    runs = json.loads((workdir / "out" / "runs.json").read_text())
    assert len(runs) == len(TRUTHS) * len(DATA)
    assert all(title in (workdir / "out" / "table.md").read_text() for title, _ in FIGURES.values())
    refused = [one | {answers.value: {"refused": True} for answers in Answers} for one in runs]
    rows = statistics(refused)
    assert {row["refused"] for row in rows} == {100}
    console = Console(width=250)
    with console.capture() as text:
        console.print(table(rows, box.MARKDOWN))
    assert "100 / 100 / 100" in text.get()
