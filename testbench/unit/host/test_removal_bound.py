# SPDX-License-Identifier: Apache-2.0
"""What bounds the constancy of removal: against loops and signals that are known."""

import numpy as np
import pytest

from host.experiments.removal_bound import (
    PARTS,
    best_by_drop,
    bounds,
    parts,
    reached,
)


@pytest.mark.parametrize("removal", [0.5, 0.8, 1.0, 1.2, 1.5, 3.0])
@pytest.mark.parametrize("slope", [0.0, 0.1, 0.3, 1.0])
def test_the_best_by_drop_is_where_the_loop_comes_to_rest(removal, slope):
    """The feed mode P4, step by step, on an Ex that is linear in the removal."""
    x = removal
    for _ in range(2000):
        x += 0.1 * (removal / (1 + slope * (x - 1)) - x)
    assert best_by_drop(removal, 1 + slope * (removal - 1)) == pytest.approx(x, rel=1e-6)


def test_a_drop_of_discharges_alone_gives_the_root():
    assert best_by_drop(1.5, 1.5) == pytest.approx(1.5**0.5)
    assert best_by_drop(1.5, 1.0) == 1.5, "a signal that says nothing"


def test_too_much_and_too_little_are_both_short_of_the_best():
    assert reached(1.5, 1.0, 1.1) == pytest.approx(0.8)
    assert reached(1.5, 1.0, 0.9) == pytest.approx(0.8)
    assert reached(1.5, 1.0, 1.5) == 0


NO_LOAD = 20.0


def signal(rng, *, shorts=0.0, sparks=0.0, step=0.0, debris=0.0):
    """4000 rows of a millisecond in 0.8 mm, from 0.4 mm on with ``step`` V more of discharges.

    Of 30 pulses a row each short takes its share of the voltage; a discharge takes 0.05 V, and
    debris the volts of its name per unit.
    """
    at = np.linspace(-0.4, 0.4, 4000, endpoint=False)
    # Causes last a unit distance, as if they were its means.
    unit = np.floor(at / 0.01)
    spread = {value: rng.normal(size=3) for value in np.unique(unit)}
    noise = np.array([spread[value] for value in unit])
    short = 3 + shorts * noise[:, 0]
    ok = 10 + sparks * noise[:, 1] + 20 * step * (at >= 0)
    dirt = 0.2 + 0.1 * noise[:, 2]
    drop = NO_LOAD * short / 30 + 0.05 * ok + debris * dirt
    return {"gap_v": NO_LOAD - drop, "ok": ok, "dame": np.zeros(4000), "short": short,
            "open": 30 - ok - short, "debris": dirt}, at


@pytest.mark.parametrize(("causes", "most"), [
    ({"shorts": 0.5}, "shorts"), ({"sparks": 2.0}, "number of discharges"),
    ({"step": 0.3}, "stock"), ({"debris": 5.0}, "debris"),
])
def test_the_cause_of_the_variance_is_found(causes, most):
    trace, at = signal(np.random.default_rng(1), **causes)
    found = parts(trace, np.full(4000, True), at, 0.01, NO_LOAD)
    assert found["shares"][most] == pytest.approx(100, abs=3)
    assert sum(found["shares"].values()) == pytest.approx(100)
    assert found["shares"].keys() == set(PARTS)


def test_means_and_ratios_of_the_step():
    trace, at = signal(np.random.default_rng(2), step=0.25)
    found = parts(trace, at > -0.3, at, 0.01, NO_LOAD)
    assert found["shorts_v"] == pytest.approx(2)
    assert found["drop_ratio"] == pytest.approx(2.75 / 2.5)
    assert found["discharge_ratio"] == pytest.approx(1.5)


def one(mode, behind, **more):
    return {"wall": "step", "mode": mode, "outcome": "end", "behind_step": behind} | more


def test_sentences_give_the_best_beside_what_was_reached():
    made = {"drop_v": 2.5, "shorts_v": 1.2, "drop_ratio": 1.5, "discharge_ratio": 1.5,
            "shares": dict.fromkeys(PARTS, 20.0)}
    runs = [one("G94", 1.4, parts=made), one("G94", 1.6, parts=made), one("P4", 1.3),
            one("P5", 1.05), one("P5", 1.15), {"wall": "step", "mode": "P5", "outcome": "alarm"},
            {"wall": "drift", "mode": "G94", "outcome": "end"}]
    drop, p4, p5 = bounds(runs)
    assert "2.50 V, of it shorts 1.20 V" in drop
    assert "shorts 20 %" in drop
    assert "P4: removal behind the step 1.30 times that before, G94 1.50" in p4
    assert "the best by its signal is 1.22, so 73 % of it is reached" in p4
    assert "the best by its signal is 1.00, so 80 % of it is reached" in p5
    assert bounds(runs[2:]) == []
