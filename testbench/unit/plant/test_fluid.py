# SPDX-License-Identifier: Apache-2.0
"""The simulated machine's fluid, and its pins for references, supply, noise and converter."""

import math

import pytest

from host.machines.machine import load
from testbench.native.alone import Alone

MACHINE = load("sinker").tables
SIGMAS = 4
HZ = 2_000_000
OFF, OPEN, BURNING, ARCING, SHORTED = range(5)      # read.state


@pytest.fixture
def plant(rng):
    return Alone(machine=MACHINE, seed=rng.getrandbits(32))


# ---- the fluid

@pytest.mark.parametrize(("fluid", "decades"), [
    (1e9, 0), (1e6, 0), (1e5, 1), (1e4, 2), (1e3, 3)])
def test_hazard_grows_with_conductivity(plant, fluid, decades):
    plant.hold(gap_um=40)
    plant.set("force.fluid_ohm_cm", fluid)
    assert plant.get("read.hazard_per_us") == pytest.approx(10**(0.3 * decades) / 60, rel=1e-12)
    assert plant.get("read.fluid_ohm_cm") == fluid


def test_arcs_last_longer_in_conductive_fluid(plant):
    # P(arc) = share * debris * exp(-pause / (15 us (1 + 0.3 decades))).
    plant.set("debris.single_short", 0)
    plant.set("debris.bridge_rate_per_s", 0)
    plant.set("gap.area_mm2", 10)
    plant.hold(gap_um=20, debris=0.6)
    count = 1500
    for fluid, decades in ((1e5, 1), (1e3, 3)):
        plant.set("force.fluid_ohm_cm", fluid)
        before = plant.get("read.arcs")
        for _ in range(count):
            plant.pulse(on_us=100, off_us=20)
        chance = 0.6 * math.exp(-20 / (15 * (1 + 0.3 * decades)))
        arcs = plant.get("read.arcs") - before
        assert abs(arcs - count * chance) < SIGMAS * math.sqrt(count * chance * (1 - chance))


def test_current_comparator_sees_the_leak(plant):
    # An open gap of 200 um and 1 cm2 at 4e4 ohm cm: 800 ohm, 0.1 A; at 5e3: 100 ohm, 0.73 A.
    plant.hold(gap_um=200)
    for fluid, ohm in ((4e4, 800), (5e3, 100)):
        plant.set("force.fluid_ohm_cm", fluid)
        plant.set("gap.ignition_delay_us", 1e12)
        plant.drive(gap_on=1, gap_level=6)
        plant.run(40)
        assert plant.get("read.state") == OPEN
        assert plant.get("read.gap_a") == pytest.approx(80 / (10 + ohm))
        assert plant.get("read.gap_v") == pytest.approx(80 * ohm / (10 + ohm))
        assert plant.input("gap_current") == (ohm == 100)
        plant.drive(gap_on=0)
        plant.run(1)
        assert not plant.input("gap_current")
        assert plant.get("read.gap_a") == 0


def test_the_fluid_drifts_by_equal_ratios(plant):
    for name, value in (("gap.fluid_ohm_cm", 1e6), ("fluid.drift_end_ohm_cm", 1e4),
                        ("fluid.drift_s", 0.2)):
        plant.set(name, value)
    for tenth in range(1, 13):
        plant.run(HZ // 50)
        expected = 1e6 * 10**(-2 * min(1, tenth / 10))
        assert plant.get("read.fluid_ohm_cm") == pytest.approx(expected, rel=1e-3)
    plant.set("force.fluid_ohm_cm", 5e4)
    plant.run(100)
    assert plant.get("read.fluid_ohm_cm") == 5e4
    plant.set("force.fluid_ohm_cm", math.nan)
    plant.run(100)
    assert plant.get("read.fluid_ohm_cm") == pytest.approx(1e4)


# ---- references

def test_references_come_through_their_filters(plant):
    # A step of the density: V (1 - exp(-t / 200 us)); the three do not disturb each other.
    plant.set("comparator.fixed", 0)
    plant.references(round(0.6 * 32768), round(0.2 * 32768), round(0.12 * 32768))
    for _ in range(10):
        plant.run(160)
        reached = 1 - math.exp(-plant.cycle / HZ / 200e-6)
        for name, volts in (("open", 60), ("arc", 20), ("short", 12)):
            assert plant.get(f"read.{name}_reference_v") == pytest.approx(volts * reached, abs=0.4)
    plant.run(HZ // 100)
    plant.references(0, 32768, 0)
    plant.run(400)
    left = math.exp(-1)
    assert plant.get("read.open_reference_v") == pytest.approx(60 * left, abs=0.4)
    assert plant.get("read.arc_reference_v") == pytest.approx(100 - 80 * left, abs=0.4)
    assert plant.get("read.short_reference_v") == pytest.approx(12 * left, abs=0.4)


@pytest.mark.parametrize(("pin", "at", "below"), [
    ("gap_high", 0, 0), ("gap_arc", 1, 1), ("gap_short", 2, 1)])
def test_comparators_compare_with_their_references(plant, pin, at, below):
    # 50 V open: each comparator turns where its own reference passes them, in an open pulse, too.
    plant.set("comparator.fixed", 0)
    plant.set("source.open_v", 50)
    plant.hold(gap_um=1000)
    plant.drive(gap_on=1, gap_level=6)
    plant.run(100)
    for volts in (48, 52, 48):
        densities = [0, 0, 0]
        densities[at] = round(volts / 100 * 32768)
        plant.references(*densities)
        plant.run(HZ // 100)
        assert plant.input(pin) == ((volts == 52) == below)
    plant.set("comparator.fixed", 1)                # 60, 20, 12 V
    plant.run(16)
    assert [plant.input(name) for name in ("gap_high", "gap_arc", "gap_short")] == [0, 0, 0]


# ---- noise

def test_sparks_are_heard_and_arcs_are_not(plant):
    # A share of the sparks is missed.
    missed_share = 0.1
    plant.set("comparator.noise_miss", missed_share)
    plant.set("debris.bridge_rate_per_s", 0)
    plant.hold(gap_um=40, debris=0.6)
    heard, seen = 0, dict.fromkeys(range(5), 0)
    for _ in range(3000):
        plant.drive(gap_on=1, gap_level=6)
        plant.run(40)
        state = round(plant.get("read.state"))
        noise = plant.input("gap_noise")
        assert state == BURNING or not noise
        seen[state] += 1
        heard += noise
        plant.drive(gap_on=0)
        plant.run(20)
        assert not plant.input("gap_noise")
    assert min(seen[OPEN], seen[BURNING], seen[ARCING]) > 200
    assert seen[SHORTED] > 1
    sigma = math.sqrt(seen[BURNING] * missed_share * (1 - missed_share))
    assert abs(heard - seen[BURNING] * (1 - missed_share)) < SIGMAS * sigma


def test_noise_ends_with_the_spark(plant):
    plant.set("comparator.noise_miss", 0)
    plant.hold(gap_um=20)
    plant.drive(gap_on=1, gap_level=6)
    plant.until(("gap_noise",), HZ)
    assert plant.input("gap_noise")
    plant.set("force.short", 1)
    plant.run(16)
    assert not plant.input("gap_noise")


# ---- supply

@pytest.mark.parametrize(("code", "volts"), [(0, 80), (1, 20), (4, 80), (15, 300)])
def test_supply_steps(plant, code, volts):
    plant.hold(gap_um=1000)
    plant.drive(gap_on=1, gap_level=6, gap_supply=code)
    plant.run(20)
    assert plant.get("read.gap_v") == pytest.approx(volts, rel=1e-4)
    plant.drive(gap_on=0, gap_sense=1)              # which has a source of its own
    plant.run(20)
    assert plant.get("read.gap_v") == pytest.approx(24, rel=1e-4)


def test_delay_falls_with_the_voltage(plant):
    # By its fourth power. What is below the burning voltage never ignites.
    plant.hold(gap_um=52)
    plant.drive(gap_supply=6)
    tau = 60 * math.e * (80 / 120)**4
    burning = [plant.pulse(on_us=1000, off_us=20) for _ in range(1500)]
    mean = sum(burning) / len(burning) - 1.5
    assert abs(mean - tau) < SIGMAS * tau / math.sqrt(len(burning)) + 0.1
    plant.hold(gap_um=10, debris=1)
    plant.drive(gap_supply=1, gap_on=1)
    plant.run(HZ // 10)
    assert plant.get("read.state") in {OPEN, SHORTED, ARCING}
    assert plant.get("read.sparks") == len(burning)


def test_a_negative_electrode_removes_half(plant):
    plant.set("debris.bridge_rate_per_s", 0)
    plant.hold(gap_um=10)
    removed, count = [], 1000
    for supply in (0, 16):
        plant.drive(gap_supply=supply)
        before = plant.get("read.removed_mm3")
        burnt = sum(100 - plant.pulse(on_us=100, off_us=50) for _ in range(count))
        removed.append((plant.get("read.removed_mm3") - before) / burnt)
    assert removed[1] / removed[0] == pytest.approx(0.5, rel=SIGMAS * 0.25 * math.sqrt(2 / count))


# ---- converter

MANUAL = 0x0804                 # manual mode, results with their channel


def frame(plant, command, *, rest=0, bits=16, between=lambda: None):
    """One frame with the clock resting low or high; the bits read at its rising edges."""
    word = 0
    plant.serial(0, rest, 0)
    plant.run(3)
    plant.serial(1, rest, 0)
    plant.run(3)
    between()
    for at in range(bits):
        bit = command >> (15 - at) & 1
        if rest:
            plant.serial(1, 0, bit)
            plant.run(2)
        else:
            plant.serial(1, 0, bit)
            plant.run(1)
        word = word << 1 | plant.input("adc_data")
        plant.serial(1, 1, bit)
        plant.run(2)
    plant.serial(1, rest, 0)
    plant.run(2)
    plant.serial(0, rest, 0)
    plant.run(2)
    assert not plant.input("adc_data")
    return word >> 12, word & 0xfff


@pytest.mark.parametrize("rest", [0, 1])
def test_a_frame_gives_the_channel_that_the_last_one_asked_for(plant, rest):
    # Nothing on the gap: code 0. Oil: 3976. Other channels are not connected.
    assert frame(plant, MANUAL | 1 << 7, rest=rest) == (0, 0)
    assert frame(plant, MANUAL | 5 << 7, rest=rest) == (1, 3976)
    assert frame(plant, MANUAL | 1 << 7, rest=rest) == (5, 0)
    assert frame(plant, MANUAL, rest=rest) == (1, 3976)
    assert frame(plant, MANUAL, rest=rest) == (0, 0)


def test_other_commands_and_broken_frames_change_no_channel(plant):
    frame(plant, MANUAL | 1 << 7)
    for command in (0x8000, 0x8800 | MANUAL, 0x1004 | 3 << 7, 0):
        assert frame(plant, command) == (1, 3976)
    frame(plant, MANUAL << 4, bits=12)      # ends as a command for channel 0 would
    assert frame(plant, 0) == (1, 3976)


@pytest.mark.parametrize(("fluid", "code"), [
    (1e9, 3976), (1e6, 3863), (3.5e5, 3670), (1.25e5, 3224), (7.1e4, 2819), (4e4, 2301),
    (6.3e3, 707), (1e3, 132)])
def test_codes_of_the_fluid(plant, fluid, code):
    # 4095 R / (R + 30 kohm), R the cell parallel to 1 Mohm.
    plant.set("force.fluid_ohm_cm", fluid)
    frame(plant, MANUAL | 1 << 7)
    assert frame(plant, 0) == (1, code)
    cell = 1 / (1 / fluid + 1e-6)
    assert code == round(4095 * cell / (cell + 30e3))


def test_broken_and_shorted_wires_of_the_cell(plant):
    frame(plant, MANUAL | 1 << 7)
    for fault, code in ((1, 4095), (2, 0), (0, 3976)):
        plant.set("force.fluid_sensor", fault)
        assert frame(plant, 0) == (1, code)


def test_the_gap_is_sampled_when_the_converter_is_selected(plant):
    plant.hold(gap_um=1000)
    plant.drive(gap_on=1, gap_level=6)
    plant.run(20)
    code = round(4095 * 0.8)
    assert frame(plant, 0, between=lambda: plant.drive(gap_on=0)) == (0, code)
    assert frame(plant, 0, between=lambda: plant.drive(gap_on=1)) == (0, 0)
    plant.drive(gap_supply=15, gap_on=0)
    plant.run(2)
    plant.drive(gap_on=1)
    plant.run(20)
    assert frame(plant, 0) == (0, 4095)             # 300 V
