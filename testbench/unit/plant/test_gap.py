# SPDX-License-Identifier: Apache-2.0
"""The gap of the simulated machine, compared with its formulas."""

import math

import pytest

from host.machines.machine import load
from testbench.native.alone import Alone

MACHINE = load("sinker").tables
MACHINE["comparator"]["fixed"] = 1  # nobody drives the references here
SIGMAS = 4              # a correct generator is outside once in 16 000


@pytest.fixture
def plant(rng):
    return Alone(machine=MACHINE, seed=rng.getrandbits(32))


def test_delay_grows_as_the_fluid_leaks(plant):
    # Open voltage V0 Rg/(Rg + Rs) with Rg = rho g/A; the hazard goes with the fourth power.
    plant.hold(gap_um=40)
    plant.set("gap.fluid_ohm_cm", 1e4)
    leak = 1e4 * 40e-4 / 1.0
    share = leak / (leak + 10)
    plant.set("comparator.high_level_v", 80 * share - 0.5)
    plant.set("comparator.current_level_a", 2)      # above the leak
    plant.set("gap.ignition_conductivity", 0)
    tau = 60 / share**4
    burning = [plant.pulse(on_us=2500, off_us=20) for _ in range(1500)]
    mean = sum(burning) / len(burning) - 1
    assert abs(mean - tau) < SIGMAS * tau / math.sqrt(len(burning))
    plant.drive(gap_on=1)
    plant.until(("gap_high",), 20)
    assert plant.input("gap_high")
    assert plant.get("read.gap_v") == pytest.approx(80 * share, rel=0.01)


def test_the_contactor_switches_the_main_source_whatever_its_gate_does(plant):
    plant.hold(gap_um=200)
    plant.drive(gap_on=1, gap_level=6)
    for closed in (0, 1, 0, 1):
        plant.drive(contactor=closed)
        for after_ms, volts in ((19, not closed), (2, closed)):
            plant.run(after_ms * plant.clock_hz // 1000)
            assert plant.get("read.gap_v") == pytest.approx(80 if volts else 0, abs=4)


@pytest.mark.parametrize("scale", [1, 60])
def test_removal_rate(plant, scale):
    # 5 mm3/min per ampere of mean current, times the scale, over the area.
    plant.set("removal_scale", scale)
    plant.hold(gap_um=10)
    count = 1000
    began = [plant.pulse(on_us=100, off_us=50) for _ in range(count)]
    burnt_us = sum(100 - delay for delay in began)
    expected_mm3 = 5 / 60 * 9 * burnt_us * 1e-6 * scale
    sigma = 0.25 / math.sqrt(count)
    assert plant.get("read.removed_mm3") == pytest.approx(expected_mm3, rel=SIGMAS * sigma)
    depth_um = plant.get("read.depth_um")
    assert depth_um == pytest.approx(plant.get("read.removed_mm3") / 100 * 1000, rel=1e-9)


def test_arcs_follow_a_short_pause(plant):
    # P(arc) = share * debris * exp(-pause / deionisation); an arc is below the arc level, burns at
    # once, and removes a fifth.
    plant.set("debris.single_short", 0)
    plant.set("debris.bridge_rate_per_s", 0)
    plant.hold(gap_um=20, debris=0.6)
    count = 1500
    for _ in range(count):
        plant.pulse(on_us=60, off_us=10)
    chance = 0.6 * math.exp(-10 / 15)
    arcs = plant.get("read.arcs")
    assert abs(arcs - count * chance) < SIGMAS * math.sqrt(count * chance * (1 - chance))


def test_levels_of_open_burning_and_short(plant):
    plant.hold(gap_um=200)
    plant.drive(gap_on=1, gap_level=6)
    plant.run(6)
    assert (plant.input("gap_high"), plant.input("gap_arc"), plant.input("gap_short")) == (1, 0, 0)
    assert not plant.input("gap_current")
    plant.set("force.gap_um", 15)
    plant.run(400)
    assert (plant.input("gap_high"), plant.input("gap_arc"), plant.input("gap_short")) == (0, 0, 0)
    assert plant.input("gap_current")
    plant.set("force.short", 1)
    plant.run(16)
    assert all(map(plant.input, ("gap_arc", "gap_short", "gap_current")))
    assert plant.get("read.gap_v") == pytest.approx(2 + 0.2 * 9)
    plant.drive(gap_on=0)
    plant.run(1)
    assert not plant.input("gap_current")
    assert plant.input("gap_short")         # nothing on it: no voltage


def test_sensing_pulses_see_a_short_and_never_burn(plant):
    plant.hold(gap_um=10)
    for forced in (0, 1, 0):
        plant.set("force.short", forced)
        plant.drive(gap_sense=1)
        plant.run(2000)
        assert plant.input("gap_short") == plant.input("gap_current") == forced
        volts = 2 + 0.2 * 22 / 24.2 if forced else 24
        assert plant.get("read.gap_v") == pytest.approx(volts, rel=1e-4)
        plant.drive(gap_sense=0)
        plant.run(100)
    assert plant.get("read.sparks") == plant.get("read.removed_mm3") == 0


@pytest.mark.parametrize(("fluid_ohm_cm", "gap_um", "short"), [
    (1e9, 0.5, 0), (1e5, 3, 0), (1e3, 26, 0), (1e3, 22, 1)])
def test_sensing_pulses_tell_a_leak_from_a_short(plant, fluid_ohm_cm, gap_um, short):
    # V Rg/(Rg + 24 ohm) with Rg = rho g/A, on 10 mm2: at 24 ohm it is half of V, the short level.
    plant.set("gap.area_mm2", 10)
    plant.set("gap.fluid_ohm_cm", fluid_ohm_cm)
    plant.set("gap.contact_um", 0.1)
    plant.hold(gap_um=gap_um)
    plant.drive(gap_sense=1)
    plant.run(20)
    leak = fluid_ohm_cm * max(gap_um, 1) * 1e-4 / 0.1
    assert plant.get("read.gap_v") == pytest.approx(24 * leak / (leak + 24), rel=0.01)
    # With the same resistor 12 V are half an ampere.
    assert plant.input("gap_short") == plant.input("gap_current") == short


def test_the_sensing_source_has_a_level_of_current_of_its_own(plant):
    plant.set("comparator.current_level_a", 2)
    plant.set("force.short", 1)
    for level, seen in ((0.5, 1), (1.0, 0)):        # a short takes 0.91 A
        plant.set("comparator.sensing_level_a", level)
        plant.drive(gap_sense=1)
        plant.run(20)
        assert plant.input("gap_current") == seen
        plant.drive(gap_sense=0)
        plant.run(20)
        assert not plant.input("gap_current")
    plant.drive(gap_on=1, gap_level=1)              # 1.5 A of the main source: its own level
    plant.run(20)
    assert not plant.input("gap_current")


@pytest.mark.parametrize(("fluid_ohm_cm", "fall_us"), [(1e9, 0.2), (1e9, 100), (1e4, 100)])
def test_voltage_falls_when_both_gates_are_off(plant, fluid_ohm_cm, fall_us):
    # 80 V exp(-t/T), 1/T = 1/fall + 1/(Rg C), C = 0.2 us / 10 ohm = 20 nF. A short takes it all.
    plant.set("source.fall_us", fall_us)
    plant.set("gap.fluid_ohm_cm", fluid_ohm_cm)
    plant.hold(gap_um=1000)
    plant.drive(gap_on=1)
    plant.run(40)
    begin = plant.get("read.gap_v")
    plant.drive(gap_on=0)
    plant.run(2)    # the gate is seen in the first of them
    leak = fluid_ohm_cm * 1000e-4 / 1.0
    rate = 1 / fall_us + 1 / (leak * 0.02)
    assert plant.get("read.gap_v") == pytest.approx(begin * math.exp(-rate), rel=1e-6)
    assert not plant.input("gap_current")
    plant.set("force.short", 1)
    plant.run(2)
    assert plant.get("read.gap_v") == 0


@pytest.mark.parametrize(("stuck", "volts", "burning", "shorted"), [
    (1, 80, 9, 9), (2, 24, 0, 22 / 24.2), (3, 80, 8, 8)])
def test_a_gate_that_is_stuck_stays_on(plant, stuck, volts, burning, shorted):
    # At the level it had; of a shorted transistor 80 V through 10 ohm are left.
    plant.hold(gap_um=200)
    plant.drive(gap_on=1, gap_level=6)
    plant.run(10)
    plant.drive(gap_on=0, gap_level=0)
    plant.run(10)
    plant.set("force.gate_stuck", stuck)
    plant.run(100)
    assert plant.get("read.gap_v") == pytest.approx(volts, rel=1e-4)
    assert not plant.input("gap_short")
    plant.hold(gap_um=10)
    plant.run(2000)
    assert plant.get("read.gap_a") == pytest.approx(burning, abs=1e-3)
    plant.set("force.short", 1)
    plant.run(16)
    assert plant.get("read.gap_a") == pytest.approx(shorted)
    assert plant.input("gap_short")
    assert plant.input("gap_current")
    plant.set("force.gate_stuck", 0)
    plant.run(16)
    assert plant.get("read.gap_a") == plant.get("read.gap_v") == 0


def test_wires_of_comparators_break(plant):
    # A cut one reads as the board has it, a short and a current; a dead one as neither.
    for force, level in (("force.comparator_cut", 1), ("force.comparator_dead", 0)):
        plant.hold(gap_um=200)
        plant.drive(gap_on=0)
        plant.run(100)
        for mask, names in ((1, ("gap_short",)), (2, ("gap_current",)), (0, ())):
            plant.set(force, mask)
            plant.run(1)
            for name, healthy in (("gap_short", 1), ("gap_current", 0)):
                assert plant.input(name) == (level if name in names else healthy)


def test_bridges_grow_with_debris(plant):
    # Hazard per second: rate * scale * debris**2 * exp(-gap/25 um), while it sparks.
    plant.set("debris.single_short", 0)
    plant.set("debris.arc_share", 0)
    plant.set("gap.removal_mm3_min_a", 0)   # so that the depth stays
    gap_um, debris = 30.0, 0.5
    rate = MACHINE["debris"]["bridge_rate_per_s"] * 60 * debris**2 * math.exp(-gap_um / 25)
    times = []
    for _ in range(150):
        plant.hold(gap_um=1000)            # breaks what there is
        assert not plant.get("read.bridged")
        plant.hold(gap_um=gap_um, debris=debris)
        begin = plant.cycle
        while not plant.get("read.bridged"):
            plant.pulse(on_us=60, off_us=10)
        times.append((plant.cycle - begin) / 2e6)
    mean = sum(times) / len(times)
    assert abs(mean * rate - 1) < SIGMAS / math.sqrt(len(times))


def test_a_bridge_breaks_when_it_is_drawn_out(plant):
    # Mean stretch 60 um (1 + debris) at the surface, a gamma distribution of shape 3; the width in
    # which it was squeezed most counts.
    stretches = []
    for _ in range(400):
        plant.hold(gap_um=5000)
        assert not plant.get("read.bridged")
        plant.hold(gap_um=1, debris=0.5)   # contact
        assert plant.get("read.bridged")
        gap_um = 1
        while plant.get("read.bridged"):
            gap_um += 2
            plant.set("force.gap_um", gap_um)
            plant.run(16)
        stretches.append(gap_um - 1 - 1)
    mean = sum(stretches) / len(stretches)
    expected = 60 * 1.5
    assert abs(mean - expected) < SIGMAS * expected / math.sqrt(3 * len(stretches))
    # Its excess kurtosis is 2, so the sample's variance spreads by 2 / sqrt(n).
    variance = sum((one - mean)**2 for one in stretches) / len(stretches)
    assert abs(variance / (expected**2 / 3) - 1) < SIGMAS * 2 / math.sqrt(len(stretches))


def test_debris_is_flushed_away(plant):
    # Exponential, with a time constant of 3 s at the surface, 60 times faster by the scale.
    plant.hold(gap_um=40, debris=0.8)
    plant.set("force.debris", math.nan)
    plant.run(100_000)
    assert plant.get("read.debris") == pytest.approx(0.8 * math.exp(-0.05 * 60 / 3), rel=0.01)


def test_a_lift_draws_fresh_fluid_in(plant):
    # From width w0 to w1 at depth d: debris falls by (w0 + d) / (w1 + d); lowering changes nothing.
    plant.set("debris.time_s", 1e12)
    plant.hold(gap_um=10)
    while plant.get("read.depth_um") < 300:
        plant.pulse(on_us=100, off_us=50)
    depth = plant.get("read.depth_um")
    plant.set("force.debris", 0.8)
    plant.set("force.gap_um", math.nan)
    plant.run(16)
    narrow = plant.get("read.gap_um")
    plant.set("force.debris", math.nan)
    plant.drive(drive_enable=7)
    plant.density = 2000
    plant.run(200_000)
    plant.density = 0
    plant.run(100_000)
    wide = plant.get("read.gap_um")
    assert wide > narrow + 800
    expected = 0.8 * (narrow + depth) / (wide + depth)
    assert plant.get("read.debris") == pytest.approx(expected, rel=0.01)
    plant.density = -2000
    plant.run(100_000)
    assert plant.get("read.gap_um") < wide - 300
    assert plant.get("read.debris") == pytest.approx(expected, rel=0.01)


def test_the_scale_changes_time_and_not_depth(rng):
    # The same real pulses, more or fewer: debris at a given depth must agree within its noise.
    found = {}
    for scale in (20, 60):
        plant = Alone(machine=MACHINE, seed=rng.getrandbits(32))
        plant.set("removal_scale", scale)
        plant.set("debris.bridge_rate_per_s", 0)
        plant.set("force.gap_um", 35)
        debris = []
        while plant.get("read.depth_um") < 300:
            plant.pulse(on_us=100, off_us=50)
            if plant.get("read.depth_um") > 150:
                debris.append(plant.get("read.debris"))
        found[scale] = sum(debris) / len(debris)
    assert found[20] == pytest.approx(found[60], rel=0.1)


def test_one_seed_one_run(rng):
    def run(seed):
        plant = Alone(machine=MACHINE, seed=seed)
        plant.set("force.gap_um", 35)
        return [plant.pulse(on_us=100, off_us=20) for _ in range(100)]

    seed = rng.getrandbits(32)
    assert run(seed) == run(seed) != run(seed + 1)


def test_unknown_parameters_are_refused(plant):
    with pytest.raises(ValueError, match=r"no parameter 'gap.colour'"):
        plant.set("gap.colour", 1)
    with pytest.raises(ValueError, match=r"no 'read.colour'"):
        plant.get("read.colour")
    with pytest.raises(ValueError, match=r"gap.area_mm2 must be a number"):
        Alone(machine=MACHINE | {"gap": {"area_mm2": "large"}})
