# SPDX-License-Identifier: Apache-2.0
"""``testbench.cosim.whole_cuts``: its figures on invented cuts, and a whole tape."""

import numpy as np
import pytest

from host.machines import machine as machines
from rtl.states import State
from testbench.cosim import whole_cuts
from testbench.cosim.sparks import PLACES, Spark, cut, with_words
from testbench.cosim.whole_cuts import (
    FIGURES,
    SIDES,
    Side,
    constancy,
    craters,
    deviation_um,
    free_voltage,
    table,
    wall_um,
)

CELL_MM = 0.002
PULSES = 10_000     # of a mm
ALONG_X = Side("x", 0.0, 0.1, 0.3, (1, -1))


def slot(away_mm):
    """A plan with a slot along X; how far its walls are from the axis, by X and side."""
    x, y = (np.arange(low, high, CELL_MM) + CELL_MM / 2 for low, high in ((0, 0.4), (-0.25, 0.25)))
    far = np.array([[away_mm(at, 1 if across > 0 else -1) for at in x] for across in y])
    # The share of a cell that a wall leaves.
    left = np.clip((abs(y)[:, None] + CELL_MM / 2 - far) / CELL_MM, 0, 1)
    return {"x": x, "y": y, "left": left}


def test_a_wall_is_where_its_material_begins():
    plan = slot(lambda at, wall: 0.11 if wall > 0 else 0.12)
    for wall, um in ((1, 110), (-1, 120)):
        along, away = wall_um(plan, ALONG_X, wall)
        assert (along.min(), along.max()) == pytest.approx((0.101, 0.299))
        assert away == pytest.approx(um)
    assert deviation_um(plan, (ALONG_X,)) == pytest.approx(0, abs=1e-9)
    assert deviation_um(plan, ()) is None


def test_the_deviation_is_that_of_means_along_each_wall():
    """One wall has steps of 3 um every 40 um. What is finer than 20 um does not count."""
    plan = slot(lambda at, wall: 0.11 + (
        0.003 * (int(at / 0.04 + 1e-6) % 2) if wall > 0 else 0.002 * (int(at / CELL_MM) % 2)))
    # The other wall has none, and counts as much.
    steps = [3.0 * (int((0.1 + n * 0.02) / 0.04 + 1e-6) % 2) for n in range(10)]
    assert deviation_um(plan, (ALONG_X,)) == pytest.approx(np.std(steps) / np.sqrt(2))


def test_the_size_of_a_crater_is_the_radius_of_half_a_ball():
    """Nine sparks of one charge, and one of eight times as much: of twice the size."""
    charges = np.array([1.0] * 9 + [8.0])
    found = craters(charges, 17 * 2 / 3 * np.pi * 1e-9)
    assert found["crater_um"] == pytest.approx(1.1)
    assert found["crater_spread"] == pytest.approx(100 * 0.3 / 1.1)
    assert found["crater_top"] == pytest.approx(2 / 1.1)


def test_along_y_and_backwards_it_is_the_same():
    plan = slot(lambda at, wall: 0.11 + 0.01 * at)
    turned = {"x": plan["y"] + 2.0, "y": plan["x"], "left": plan["left"].T}
    for begin, end in ((0.1, 0.3), (0.3, 0.1)):
        assert deviation_um(turned, (Side("y", 2.0, begin, end, (1, -1)),)) == pytest.approx(
            deviation_um(plan, (ALONG_X,)))


@pytest.mark.parametrize(("words", "volts"), [
    ("A0", 80 / 9), ("A0 P11", 880 / 51), ("A1", 80 / 9), ("A1 B20", 80 / 3), ("A1 B0", 80 / 9)])
def test_the_no_load_voltage_is_that_of_waiting_and_off_time(words, volts):
    row = with_words("G10 C900 I8 P5 Q40 R40 K-1", words)
    assert free_voltage(row, 80.0) == pytest.approx(volts)


def run_along(drops, volumes, side, samples=6):
    """A trace with so many samples in each unit distance of 10 um, and what does not count."""
    number = np.repeat(np.arange(len(drops)), samples)
    far = (number + 0.5) * 0.01
    place = side.begin + far * np.sign(side.end - side.begin)
    trace = {"gap_v": 9.0 - np.array(drops)[number],
             "removed_mm3": np.array(volumes)[number] / samples,
             "state": np.full(len(number), State.FRONT.value, dtype=float),
             side.axis: place * PULSES, "y" if side.axis == "x" else "x": np.full(
                 len(number), side.at * PULSES)}
    # A way back, and a place off the side.
    for name, other in (("state", State.RETRACTING.value), ("y" if side.axis == "x" else "x", 9e3)):
        more = {key: np.append(column, column[:3]) for key, column in trace.items()}
        more["gap_v"][-3:], more[name][-3:] = -50, other
        trace = more
    return trace | {"removed_mm3": np.cumsum(trace["removed_mm3"])}


@pytest.mark.parametrize("side", [ALONG_X, Side("y", 2.2, 0.4, 0.2, (1,))], ids=["x", "y"])
def test_the_constancy_is_that_of_unit_distances(side):
    drops = [1.0, 1.2, 0.8, 1.1, 0.9] * 4
    found = constancy(run_along(drops, [2 * one for one in drops], side), (side,), PULSES, 9.0)
    assert found["drop_v"] == pytest.approx(1.0)
    assert found["drop_spread"] == pytest.approx(100 * np.std(drops))
    ratio = 1 / np.array(drops)
    assert found["ratio_spread"] == pytest.approx(100 * ratio.std() / ratio.mean())
    assert found["removal_spread"] == pytest.approx(100 * np.std(drops))
    assert found["agreement"] == pytest.approx(1)


def test_the_ratio_has_the_bounds_of_its_settings():
    drops, volumes = [-1.0, 3.0, 1.0, 1.0] * 5, [1.0, 1.0, 2.0, 2.0] * 5
    found = constancy(run_along(drops, volumes, ALONG_X), (ALONG_X,), PULSES, 9.0)
    ratio = np.array([4.0, 1 / 3, 1.0, 1.0])    # 1 V over the lowest Ex is more than 4
    assert found["ratio_spread"] == pytest.approx(100 * ratio.std() / ratio.mean())
    assert found["agreement"] == pytest.approx(0, abs=1e-9)


def test_the_table_has_a_column_for_each_tape_and_its_words():
    runs = [dict.fromkeys(FIGURES, 1.0) | {"place": "wire", "words": words, "outcome": "end",
                                           "seed": seed, "charge_uc": charge + seed}
            for seed in (1, 2) for words, charge in (("A0", 10.0), ("A1 B20", 20.0))]
    made = table(runs)
    assert [column.header for column in made.columns[1:]] == ["wire_slot, A0", "wire_slot, A1 B20"]
    cells = [list(column.cells) for column in made.columns]
    row = cells[0].index("charge of a spark, µC")
    assert [column[row] for column in cells[1:]] == ["11.5 ± 0.7", "21.5 ± 0.7"]


@pytest.mark.parametrize("place", [
    pytest.param("wire", marks=pytest.mark.soak), pytest.param("punch", marks=pytest.mark.soak),
    pytest.param("sinker", marks=pytest.mark.soak)])
def test_a_whole_tape(monkeypatch, place):
    """The sparks agree with the plant's own number and energy; an on-time is exact to the clock."""
    kept = []

    def keep(*args, **options):
        kept.append(cut(*args, **options))
        return kept[-1]

    monkeypatch.setattr(whole_cuts, "cut", keep)
    words = "A1 B30" if place == "sinker" else "A1 B20"
    found = whole_cuts.figures_of((place, words, 1))
    (done,), machine = kept, machines.load(PLACES[place][0])
    assert found["outcome"] == "end"
    # A spark that ends as a short, or whose pulse has an arc, is none.
    assert 0.99 * done.counted < len(done.sparks) <= done.counted
    assert found["charge_uc"] * machine.number("source", "burning_v") == pytest.approx(
        done.spark_uj / done.counted, rel=0.01)
    assert found["whole_spread"] < 2, "the bound of the issue"
    assert isinstance(done.sparks[0], Spark)
    assert set(FIGURES) >= set(found) - {"place", "words", "seed", "outcome"}
    for side in SIDES[place]:
        for wall in side.walls:
            _, away = wall_um(done.workpiece, side, wall)
            # Half of the wire, and its gap.
            assert 105 < away.mean() < 130
