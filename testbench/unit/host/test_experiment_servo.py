# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment servo``: its tapes, and its figures on invented runs."""

import json
from itertools import product

import pytest
from rich.console import Console

from host.experiments.common import LOOPS
from host.experiments.fluid import FIGURES
from host.experiments.servo import STEP, VARIANTS, statistics, table, tape_of

DEVIATION = {"feed-forward": 2.0, "plain loop": 4.0}


def run(variant, loop, seed):
    return dict.fromkeys(FIGURES, 10.0) | {
        "variant": variant, "loop": loop, "seed": seed, "outcome": "end",
        "gap_deviation_um": DEVIATION[loop] + seed, "removal_mm3_min": 3.0 * DEVIATION[loop]}


RUNS = [run(*one) for one in product(VARIANTS, LOOPS, (2, 1))]


def test_every_variant_has_its_step_in_the_tape():
    usual, *others = VARIANTS
    assert tape_of(usual).count(STEP) == 1, "the tape's own step"
    steps = {tape_of(name).split(" L")[1].split()[0] for name in VARIANTS}
    assert steps == {f"{step / 1000:g}" for step, _, _ in VARIANTS.values()}
    assert len(others) >= 4


def test_half_the_time_has_half_the_presets():
    for _, period_ms, lines in VARIANTS.values():
        assert bool(lines) == (period_ms != 20)


def test_means_over_the_seeds_are_compared_with_the_plain_loop_of_the_tape():
    rows = statistics(RUNS)
    assert [(row["variant"], row["loop"]) for row in rows] == [*product(VARIANTS, LOOPS)]
    fed, plain = rows[:2]
    assert fed["gap_deviation_um"] == (3.5, pytest.approx(0.5 ** 0.5))
    assert fed["times"] == pytest.approx([3.5 / 5.5, 0.5])
    assert plain["times"] == [1, 1]
    assert statistics(json.loads(json.dumps(RUNS))) == rows


def test_without_the_plain_loop_nothing_is_compared():
    rows = statistics([one for one in RUNS if one["loop"] == "feed-forward"])
    assert {row["times"] for row in rows} == {None}
    said = Console(width=200, record=True)
    said.print(table(rows))
    assert "4 µm in 20 ms" in said.export_text()
