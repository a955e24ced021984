# SPDX-License-Identifier: Apache-2.0
"""The side walls of the simulated cavity: compared with a model, and their volume conserved."""

from math import pi

import numpy as np
import pytest

from host.machines.machine import load
from testbench.models.cavity import Cavity
from testbench.native.alone import Alone

MACHINE = load("cavity").tables
MACHINE["comparator"]["fixed"] = 1  # nobody drives the references here
AREA_MM2 = 4.0                      # so small that a few hundred pulses sink a millimetre


def machine(**cavity):
    """Tables of a small electrode whose craters have no spread; other numbers of its walls."""
    gap = MACHINE["gap"] | {"area_mm2": AREA_MM2, "removal_spread": 0.0}
    walls = MACHINE["cavity"] | {"perimeter_mm": 8.0, "layer_um": 20.0} | cavity
    debris = MACHINE["debris"] | {"single_short": 0.0, "bridge_rate_per_s": 0.0, "arc_share": 0.0}
    return MACHINE | {"gap": gap, "cavity": walls, "debris": debris}


def sunk(plant, pulses, *, levels=(6,), debris=(0.2,), beside=True, on_us=(100,), model=None):
    """Make pulses with the electrode at the bottom, or above the workpiece; follow with a model.

    The end of a pulse tells its volume, and so, with craters without spread, for how long it
    burnt.
    """
    before = plant.get("read.removed_mm3")
    for number in range(pulses):
        below_um = plant.get("read.depth_um") if beside else -50.0
        plant.set("initial_gap_um", -below_um)
        amount = debris[number % len(debris)]
        plant.hold(gap_um=20, debris=amount)
        level = levels[number % len(levels)]
        plant.pulse(on_us=on_us[number % len(on_us)], off_us=300, level=level)
        after = plant.get("read.removed_mm3")
        mm3, before = after - before, after
        if model is not None and mm3 > 0:
            amps = level * 1.5
            rate_mm3_us = 5 / 60 * amps * 1e-6 * 60
            model.take(mm3, amps, mm3 / rate_mm3_us, amount, below_um)


def walls(plant):
    cavity = plant.cavity()
    return cavity["depth_mm"] * 1000, cavity["opening_um"]


@pytest.mark.parametrize("cavity", [
    {}, {"wall_debris": 0.5, "slope_um": 4.0}, {"layer_um": 17.0, "overcut_um": 90.0},
    {"current_power": 1.0, "time_power": 0.0, "wall_debris": 0.0}])
def test_walls_are_those_of_the_model(rng, cavity):
    tables = machine(**cavity)
    plant = Alone(machine=tables, seed=rng.getrandbits(32))
    model = Cavity(AREA_MM2, tables["cavity"])
    for _ in range(12):
        sunk(plant, 25, levels=[rng.randint(1, 20) for _ in range(5)],
             debris=[rng.uniform(0, 1) for _ in range(3)], beside=rng.random() < 0.8,
             on_us=[rng.choice((60, 100, 300)) for _ in range(4)], model=model)
    bottoms, openings = walls(plant)
    assert len(openings) == len(model.slices) > 5
    assert bottoms == pytest.approx([one.bottom_um for one in model.slices], rel=1e-6)
    assert openings == pytest.approx([model.opening_um(one) for one in model.slices], rel=1e-6)
    assert plant.get("read.depth_um") == pytest.approx(bottoms[-1], rel=1e-9)


def test_what_was_removed_is_what_the_cavity_lacks(rng):
    plant = Alone(machine=machine(wall_debris=1.0), seed=rng.getrandbits(32))
    sunk(plant, 400, levels=(3, 20, 8), debris=(0.1, 0.6), on_us=(60, 250))
    bottoms, openings = walls(plant)
    heights = np.diff(bottoms, prepend=0) / 1000
    wide = openings / 1000
    volume = float(((AREA_MM2 + 8.0 * wide + pi * wide**2) * heights).sum())
    assert volume > 1
    assert plant.get("read.removed_mm3") == pytest.approx(volume, rel=1e-9)
    assert plant.get("read.cavity_mm3") == pytest.approx(volume, rel=1e-9)


def test_the_cavity_is_widest_at_the_top_and_wider_with_more_debris():
    tops = []
    for debris in (0.0, 0.1, 0.6):
        plant = Alone(machine=machine(time_power=0.0), seed=7)
        sunk(plant, 400, debris=(debris,))
        openings = walls(plant)[1]
        tops.append(openings[0])
        overcut = 40 * 0.9**0.29
        if debris:
            assert (np.diff(openings[:-1]) < 0).all()
            assert openings[-2] > overcut
        else:
            assert openings == pytest.approx(np.full(len(openings), overcut), rel=1e-6)
    assert tops[0] + 1 < tops[1] < tops[2] - 5


def test_walls_that_the_electrode_does_not_face_stay():
    plant = Alone(machine=machine(wall_debris=1.0), seed=3)
    sunk(plant, 300, debris=(0.6,))
    bottoms, openings = walls(plant)
    sunk(plant, 100, debris=(0.6,), beside=False)
    later, after = walls(plant)
    assert later[-1] > bottoms[-1] + 50
    assert list(after[:len(openings) - 1]) == list(openings[:-1])


def test_a_greater_current_cuts_wider():
    plant = Alone(machine=machine(wall_debris=0.0, time_power=0.0), seed=5)
    for level in (4, 16):
        sunk(plant, 150, levels=(level,))
    openings = walls(plant)[1]
    assert openings[0] == pytest.approx(40 * 0.6**0.29, rel=1e-6)
    assert openings[-1] == pytest.approx(40 * 2.4**0.29, rel=1e-6)


def test_debris_is_all_that_was_removed():
    """Of front and walls: what goes into the gap is the volume over the electrode's area."""
    tables = machine(wall_debris=2.0)
    tables["debris"] = tables["debris"] | {"time_s": 1e9}
    plant = Alone(machine=tables, seed=9)
    sunk(plant, 200, debris=(0.5,))
    deep = plant.get("read.depth_um")
    plant.set("initial_gap_um", 20 - deep)
    plant.set("force.gap_um", 20)
    plant.set("force.debris", 0.01)
    plant.run(32)
    plant.set("force.debris", float("nan"))
    plant.run(32)
    debris, removed = plant.get("read.debris"), plant.get("read.removed_mm3")
    plant.pulse(on_us=300, off_us=100)
    removed = plant.get("read.removed_mm3") - removed
    assert removed > 0
    assert plant.get("read.depth_um") - deep < 0.99 * removed / AREA_MM2 * 1000
    assert plant.get("read.debris") - debris == pytest.approx(removed / AREA_MM2 * 1000 / 20,
                                                             rel=1e-3)


def test_kept_discharges_make_the_same_cavity_again_and_others_with_other_numbers(rng):
    plant = Alone(machine=machine(), seed=rng.getrandbits(32))
    plant.keep_discharges()
    sunk(plant, 200, levels=(3, 9), debris=(0.3,))
    again, cavity = plant.cavity_with({}), plant.cavity()
    assert len(cavity["opening_um"]) > 5
    for name, column in cavity.items():
        assert list(again[name]) == list(column)
    other = plant.cavity_with({"overcut_um": 80.0, "wall_debris": 0.0})
    assert other["opening_um"].min() > 1.4 * cavity["opening_um"].min()
    assert other["depth_mm"][-1] < cavity["depth_mm"][-1]


def test_a_sinker_without_sides_has_none():
    plant = Alone(machine=load("sinker").tables, seed=1)
    plant.hold(gap_um=20)
    for _ in range(20):
        plant.pulse(on_us=100, off_us=50)
    assert plant.get("read.removed_mm3") > 0
    assert plant.cavity()["depth_mm"].size == plant.get("read.cavity_mm3") == 0
