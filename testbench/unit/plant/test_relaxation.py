# SPDX-License-Identifier: Apache-2.0
"""A capacitor at the main source of the simulated machine, compared with its formulas."""

import math

import pytest

from host.machines.machine import load
from testbench.native.alone import Alone

MACHINE = load("sinker").tables
MACHINE["comparator"]["fixed"] = 1  # nobody drives the references here
MACHINE["source"]["burning_spread_v"] = 0.0
MACHINE["gap"]["contact_um"] = 0.1
MACHINE["debris"]["single_short"] = 0.0
MACHINE["gap"]["removal_spread"] = 0.0
NF, OHM, EMPTYING_OHM, NH = 1000.0, 20.0, 2.0, 500.0
MACHINE["relaxation"] = {"step_nf": NF, "charging_ohm": OHM, "emptying_ohm": EMPTYING_OHM,
                         "inductance_nh": NH}
CLOCK_US = 0.5
TAU_US = OHM * NF / 1000
DISCHARGE_US = math.pi * math.sqrt(NF * NH) / 1000
BURNING_V, REMOVAL = MACHINE["source"]["burning_v"], MACHINE["gap"]["removal_mm3_min_a"]
OPEN, BURNING = 1, 2    # ``plant::Gap::State``


@pytest.fixture
def plant(rng):
    return Alone(machine=MACHINE, seed=rng.getrandbits(32))


def energy_uj(volts):
    """What the gap gets of the capacitor: all, unless the current is 0 before it is empty."""
    left = max(0.0, 2 * BURNING_V - volts)
    return NF * 1e-3 / 2 * (volts**2 - left**2)


def test_the_voltage_rises_with_the_time_constant_and_stays(plant):
    plant.hold(gap_um=500)
    plant.drive(gap_on=1, gap_level=1)
    plant.run(1)
    for clocks in range(2, 200):
        volts = 80 * (1 - math.exp(-(clocks - 1) * CLOCK_US / TAU_US))
        if volts < 0.99 * 80:
            assert plant.get("read.gap_v") == pytest.approx(volts, abs=1.1), clocks
        plant.run(1)
    plant.run(200)
    assert plant.get("read.gap_v") == pytest.approx(80, rel=1e-3)
    plant.drive(gap_on=0)
    plant.run(1)
    before = plant.get("read.gap_v")
    plant.run(4)
    assert plant.get("read.gap_v") == pytest.approx(
        before * math.exp(-4 * CLOCK_US / (EMPTYING_OHM * NF / 1000)), rel=1e-6)
    plant.run(100)
    assert plant.get("read.gap_v") == plant.get("read.sparks") == plant.get("read.spark_uj") == 0


@pytest.mark.parametrize("off_at_once", [True, False])
def test_a_breakdown_gives_the_gap_the_energy_of_its_voltage(plant, off_at_once):
    """Whether the gate goes off or not; each spark removes in proportion to its energy."""
    energies, removed, volts = [], 0.0, 0.0
    for number in range(60):
        plant.hold(gap_um=500)
        plant.drive(gap_on=1, gap_level=1)
        plant.run(10 + 2 * number)
        plant.set("force.gap_um", 5)    # ignites within some microseconds
        while plant.get("read.state") == OPEN:
            volts = plant.get("read.gap_v")
            plant.run(1)
        assert plant.get("read.state") == BURNING
        assert plant.get("read.gap_v") == BURNING_V
        if off_at_once:
            plant.drive(gap_on=0)
        clocks = 0
        while plant.get("read.state") == BURNING:
            assert plant.input("gap_current") or clocks == 0
            plant.run(1)
            clocks += 1
        assert clocks == pytest.approx(DISCHARGE_US / CLOCK_US, abs=1.5)
        sparks = plant.get("read.spark_uj")
        energies.append(sparks - sum(energies))
        # It has broken down a clock after the voltage was read.
        after = 80 - (80 - volts) * math.exp(-CLOCK_US / TAU_US)
        assert energy_uj(volts) * 0.999 <= energies[-1] <= energy_uj(after) * 1.001
        now = plant.get("read.removed_mm3")
        charge_as = energies[-1] / BURNING_V * 1e-6
        assert now - removed == pytest.approx(
            REMOVAL / 60 * charge_as * MACHINE["removal_scale"], rel=1e-6)
        removed = now
        plant.drive(gap_on=0)
        plant.run(400)
        assert plant.get("read.gap_v") == 0
    assert plant.get("read.spark_uj2") == pytest.approx(sum(e * e for e in energies), rel=1e-6)
    assert min(energies) < 0.5 * max(energies)


def test_a_short_keeps_it_empty_and_removes_nothing(plant):
    plant.hold(gap_um=15)
    plant.set("force.short", 1)
    plant.drive(gap_on=1, gap_level=1)
    for _ in range(50):
        plant.run(4)
        assert plant.input("gap_short")
        assert plant.get("read.gap_a") == pytest.approx(80 / OHM)
    plant.drive(gap_on=0)
    plant.run(4)
    assert not plant.input("gap_current")
    assert plant.get("read.removed_mm3") == plant.get("read.spark_uj") == 0


def test_a_sensing_pulse_does_not_charge_it(plant):
    plant.hold(gap_um=500)
    plant.drive(gap_sense=1)
    plant.run(20)
    assert plant.get("read.gap_v") == pytest.approx(24, rel=1e-3)


def test_a_gap_that_has_not_deionised_breaks_down_early(plant):
    """An arc of little energy, as soon as the voltage is above that of a discharge."""
    plant.set("debris.arc_share", 1e6)
    plant.hold(gap_um=15, debris=0.5)
    plant.drive(gap_on=1, gap_level=1)
    plant.until(("gap_current",), 4000)
    plant.run(400)                      # the gate stays on
    assert plant.get("read.arcs") > 10
    assert plant.get("read.sparks") <= 1
