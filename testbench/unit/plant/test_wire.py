# SPDX-License-Identifier: Apache-2.0
"""The simulated wire machine, compared with its formulas."""

import copy
import math
import statistics

import numpy as np
import pytest

from host.machines.machine import load
from host.run.workpiece import wall_surface
from testbench.native.alone import Alone

MACHINE = load("wire").tables
MACHINE["comparator"]["fixed"] = 1  # nobody drives the references here
SIGMAS = 4
HZ = 2_000_000
PULSES_PER_UM = 10
OPEN_V, BURNING_V = 80, 24
# Of SPARC: mean and deviation of a crater of 3 us, um3.
CRATERS = {40: (2377, 524), 60: (4867, 899), 80: (5557, 1167)}


def machine(**tables):
    """The machine without shorts and breaks, with changes by table."""
    changed = copy.deepcopy(MACHINE)
    changed["debris"] |= {"random_short_per_us": 0, "single_short": 0, "arc_share": 0,
                          "clog_least": 1.0, "clog_most": 1.0}
    changed["wire"] |= {"break_a": 0, "deflection_um_a": 0}
    for name, values in tables.items():
        changed[name] = changed[name] | values if isinstance(values, dict) else values
    return changed


@pytest.fixture
def seed(rng):
    return rng.getrandbits(32)


def place(plant, **axes):
    """Bring axes to a place from the start, in um, by steps."""
    for letter, um in axes.items():
        axis = "xyz".index(letter)
        wanted = round(um * PULSES_PER_UM)
        way = wanted - plant.targets.get(axis, 0)
        plant.targets[axis] = wanted
        for _ in range(abs(way)):
            plant.step(1 << axis, (way < 0) << axis)
            plant.run(2)
            plant.step(0, (way < 0) << axis)
            plant.run(6)
    plant.run(HZ // 25)  # the drive follows in 3 ms


def at(seed, tables, **axes):
    plant = Alone(machine=tables, seed=seed)
    plant.targets = {}
    plant.drive(drive_enable=7)
    place(plant, **axes)
    return plant


def burn(plant, count, *, level=2, on_us=3, off_us=33):
    """Make discharges of ``on_us`` from their ignition on, as in the table of domain knowledge.

    Returns the delays in us.
    """
    delays = []
    for _ in range(count):
        plant.drive(gap_on=1, gap_level=level)
        delay = plant.until(("gap_current",), HZ)
        assert plant.input("gap_current"), "no discharge in a second"
        plant.run(2 * on_us)
        plant.drive(gap_on=0)
        plant.run(2 * off_us)
        delays.append(delay / 2)
    return delays


def tau_us(gap_um):
    """Mean delay of SPARC: ln 2 over it is the hazard."""
    return (0.48 * gap_um**2 - 3.69 * gap_um + 14.05) / math.log(2)


# ---- ignition

@pytest.mark.parametrize("gap_um", [5, 8, 10, 15, 20, 30])
def test_delay_and_mean_voltage_against_the_gap(seed, gap_um):
    # A discharge of 3 us and a pause of 33, the source waiting for it: V = (V0 td + Ve ton) /
    # (td + ton + toff). A delay begins with 1 us in which nothing ignites and is seen at the next
    # look, half a microsecond later in the mean.
    plant = Alone(machine=machine(), seed=seed)
    plant.hold(gap_um=gap_um)
    count, tau = 4000, tau_us(gap_um)
    delays = burn(plant, count)
    mean = statistics.fmean(delays)
    deviation = tau / math.sqrt(count)
    assert mean - 1.5 == pytest.approx(tau, abs=SIGMAS * deviation + 0.3)
    # The mean over time of the plant's own figure, and its dependence on the mean delay.
    period = mean + 3 + 33
    volts = (OPEN_V * mean + BURNING_V * 3) / period
    expected = (OPEN_V * (tau + 1.5) + BURNING_V * 3) / (tau + 1.5 + 36)
    slope = (OPEN_V * 36 - BURNING_V * 3) / period**2
    assert volts == pytest.approx(expected, abs=slope * (SIGMAS * deviation + 0.3))


def test_the_table_of_mean_voltages_is_met():
    # The figures of domain knowledge, without the first microsecond, in which nothing ignites.
    table = {5: (11.0, 20.2), 8: (22.0, 31.6), 10: (36.3, 41.2), 15: (96, 58.8), 20: (191, 67.6),
             30: (484, 74.6), 50: (1485, 78.2)}
    plant = Alone(machine=machine(), seed=1)
    for gap_um, (delay, volts) in table.items():
        plant.hold(gap_um=gap_um)
        tau = 1 / plant.get("read.hazard_per_us")
        assert tau == pytest.approx(delay, rel=0.01)
        assert (80 * tau + 24 * 3) / (tau + 36) == pytest.approx(volts, abs=0.06)


@pytest.mark.parametrize("gap_um", [8, 14])
def test_delays_are_exponential(seed, gap_um):
    # Laue plot: ln N(t)/N0 is a line of slope -1/tau.
    plant = Alone(machine=machine(), seed=seed)
    plant.hold(gap_um=gap_um)
    late = [delay - 5 for delay in burn(plant, 4000) if delay > 5]
    slope = -math.log(1 - len(late) / sum(late))
    assert slope * tau_us(gap_um) == pytest.approx(1, abs=SIGMAS / math.sqrt(len(late)))


@pytest.mark.parametrize("gap_um", [5, 20])
def test_the_second_law_keeps_the_mean(seed, gap_um):
    # Shape 0.8 below 9 um and 1.6 above: the standard deviation tells them.
    plant = Alone(machine=machine(gap={"ignition_law": 1}), seed=seed)
    plant.hold(gap_um=gap_um)
    count, tau = 4000, tau_us(gap_um)
    delays = burn(plant, count)
    shape = 0.8 if gap_um < 9 else 1.6
    spread = math.sqrt(math.gamma(1 + 2 / shape) / math.gamma(1 + 1 / shape)**2 - 1) * tau
    assert statistics.fmean(delays) - 1.5 == pytest.approx(
        tau, abs=SIGMAS * spread / math.sqrt(count) + 0.3)
    assert statistics.stdev(delays) == pytest.approx(spread, rel=0.12)


def test_debris_makes_ignition_easier_and_distance_ends_it(seed):
    plant = Alone(machine=machine(), seed=seed)
    plant.hold(gap_um=10, debris=0.25)
    assert plant.get("read.hazard_per_us") == pytest.approx(2 / tau_us(10), rel=1e-6)
    plant.hold(gap_um=80)
    assert plant.get("read.hazard_per_us") == 0


# ---- where the wire is

def test_gap_is_the_distance_to_the_edge_of_the_plate(seed):
    # The plate begins 130 um from the wire's axis, whose radius is 100.
    plant = at(seed, machine())
    for um in (0, 7.3, 20.1, 25):
        place(plant, x=um)
        assert plant.get("read.gap_um") == pytest.approx(30 - um, abs=0.3)
    place(plant, y=250)  # along it
    assert plant.get("read.gap_um") == pytest.approx(5, abs=0.3)
    place(plant, x=-60)
    assert plant.get("read.gap_um") == 80, "further than discharges reach"


@pytest.mark.parametrize(("stock", "start", "gap_um"), [
    # Wall at Y 0 with 30 um of stock, 50 from X 1 mm on.
    ({"kind": "wall", "steps": [[0.0, 30.0], [1.0, 50.0]]}, (0.5, -0.160), 30),
    ({"kind": "wall", "steps": [[0.0, 30.0], [1.0, 50.0]]}, (1.5, -0.160), 10),
    # Punch of 4 mm with 30 um, from a quarter of its contour on 10.
    ({"kind": "circle", "size_x_mm": 4.0, "steps": [[0.0, 30.0], [math.pi, 10.0]]},
     (1.5204, 1.5204), 20),
    ({"kind": "circle", "size_x_mm": 4.0, "steps": [[0.0, 30.0], [math.pi, 10.0]]},
     (-1.5204, 1.5204), 40),
    # Punch of 2 x 1 mm: 30 um below, 10 from its lower right corner on.
    ({"kind": "rectangle", "size_x_mm": 2.0, "size_y_mm": 1.0,
      "steps": [[0.0, 30.0], [2.0, 10.0]]}, (0.3, -0.645), 15),
    ({"kind": "rectangle", "size_x_mm": 2.0, "size_y_mm": 1.0,
      "steps": [[0.0, 30.0], [2.0, 10.0]]}, (1.145, 0.2), 35),
    ({"kind": "rectangle", "size_x_mm": 2.0, "size_y_mm": 1.0,
      "steps": [[0.0, 30.0], [2.0, 10.0]]}, (0.1, 0.645), 35),
    # A hole of 0.26 mm in a plate that is everywhere.
    ({"kind": "solid", "edge_mm": -100.0, "hole_mm": 0.26}, (3.0, 2.0), 30),
])
def test_gap_to_what_a_first_cut_has_left(seed, stock, start, gap_um):
    x, y = start
    plant = at(seed, machine(stock=stock, workpiece={"start_x_mm": x, "start_y_mm": y}))
    assert plant.get("read.gap_um") == pytest.approx(gap_um, abs=0.6)


def test_a_wire_in_its_hole_is_engaged_all_around(seed):
    # Half a circle counts as 1; a plane less: of it, what lies within some um of the distance.
    hole = machine(stock={"kind": "solid", "edge_mm": -100.0, "hole_mm": 0.22})
    plant = at(seed, hole)
    assert plant.get("read.engagement") == pytest.approx(2, rel=0.1)
    plane = at(seed, machine(stock={"edge_mm": 0.11}))
    # Gap in the direction a to a plane at 110 um: 110 / cos a - 100.
    angles = np.linspace(-1.2, 1.2, 2401)
    wider = 110 / np.cos(angles) - 110
    share = np.sum(np.exp(-wider / 4)[wider < 12]) * (angles[1] - angles[0]) / math.pi
    assert plane.get("read.engagement") == pytest.approx(share, rel=0.1)
    assert plane.get("read.hazard_per_us") == pytest.approx(
        plane.get("read.engagement") / tau_us(plane.get("read.gap_um")), rel=1e-6)


# ---- removal

@pytest.mark.parametrize(("level", "on_us"), [(2, 3), (3, 3), (4, 6)])
def test_craters_are_those_of_the_table(seed, level, on_us):
    plant = at(seed, machine(removal_scale=1.0), x=20)
    count = 800
    burn(plant, count, level=level, on_us=on_us)
    mean, deviation = CRATERS[20 * level]
    # What is seen is a clock or two longer than the time from the ignition that is seen.
    burnt_us = on_us + 0.5
    removed = plant.get("read.removed_mm3") * 1e9 / count * 3 / burnt_us
    assert removed == pytest.approx(mean, rel=SIGMAS * deviation / mean / math.sqrt(count) + 0.01)


@pytest.mark.parametrize("scale", [1.0, 60.0])
def test_what_craters_take_is_gone_from_the_workpiece(seed, scale):
    plant = at(seed, machine(removal_scale=scale), x=22)
    burn(plant, 400 if scale == 1 else 20, level=8)  # and the wire stands still
    removed = plant.get("read.removed_mm3")
    grain_mm3 = 2 * 2 * 10_000 / 65535 * 1e-9
    assert removed > 1000 * grain_mm3
    assert plant.get("read.missing_mm3") == pytest.approx(plant.get("read.taken_mm3"), rel=1e-12)
    assert plant.get("read.taken_mm3") == pytest.approx(removed, abs=1.01 * grain_mm3)
    # The plan says the same: plate from X 0.13 on.
    plan = plant.workpiece()
    cell = plan["x"][1] - plan["x"][0]
    whole = np.clip((plan["x"] - 0.13) / cell + 0.5, 0, 1)
    gone = (whole[None, :] - plan["left"]).sum() * cell**2 * 10
    assert gone == pytest.approx(removed, rel=1e-3)


def advance(plant, way_um, *, step_um=1.0, level=8, gap_um=10, along="x"):
    """Cut: advance if the gap is wider than wanted, else discharge."""
    gone, gaps = plant.targets.get("xyz".index(along), 0) / PULSES_PER_UM, []
    end = gone + way_um
    while gone < end:
        if plant.get("read.gap_um") > gap_um:
            gone += step_um
            axis = "xyz".index(along)
            for _ in range(round(step_um * PULSES_PER_UM)):
                plant.step(1 << axis)
                plant.run(2)
                plant.step(0)
                plant.run(6)
            plant.targets[axis] = round(gone * PULSES_PER_UM)
            plant.run(HZ // 100)
        else:
            assert plant.get("read.gap_um") > 2, "in contact: nothing is removed"
            burn(plant, 1, level=level, off_us=10)
            gaps.append(plant.get("read.gap_um"))
    return gaps


def test_kerf_is_the_wire_and_two_gaps(seed):
    # Only the narrowest place ignites: front and sides get the same gap.
    tables = machine(gap={"engagement_um": 0.0}, debris={"flow_mm3_s": 1000.0}, removal_scale=10.0)
    plant = at(seed, tables)
    advance(plant, 150, level=4)
    plan = plant.workpiece()
    cell = plan["y"][1] - plan["y"][0]
    kerf = [(1 - plan["left"][:, column]).sum() * cell * 1000
            for column in np.searchsorted(plan["x"], np.arange(0.14, 0.17, 0.002))]
    assert statistics.fmean(kerf) == pytest.approx(200 + 2 * 10, abs=3)
    # A crater reaches 2 um and two cells deep, on either side.
    assert max(kerf) - min(kerf) < 2 * (2 + 2 * 2)


def test_sides_get_wider_where_wider_places_ignite_too(seed):
    tables = machine(debris={"flow_mm3_s": 1000.0})
    plant = at(seed, tables)
    advance(plant, 300)
    plan = plant.workpiece()
    cell = plan["y"][1] - plan["y"][0]
    column = np.searchsorted(plan["x"], 0.2)
    kerf = (1 - plan["left"][:, column]).sum() * cell * 1000
    # By three times the 4 um at most, and by a crater 60 times too great.
    assert 200 + 2 * 11 < kerf < 200 + 2 * (10 + 3 * 4 + 8)


def test_a_step_of_the_stock_is_cut_to_one_surface(seed):
    # Along a wall with 20 um and then 40 um of stock, the gap held: the surface left is one.
    tables = machine(stock={"kind": "wall", "steps": [[-1.0, 0.0], [-0.05, 20.0], [0.15, 40.0]]},
                     workpiece={"start_x_mm": -0.2, "start_y_mm": -0.105},
                     gap={"engagement_um": 0.0}, debris={"flow_mm3_s": 1000.0},
                     removal_scale=10.0)
    plant = at(seed, tables)
    advance(plant, 600, gap_um=6, level=4)
    plan = plant.workpiece()
    surface = wall_surface(plan) * 1000
    cut = surface[np.searchsorted(plan["x"], 0.0):np.searchsorted(plan["x"], 0.3)]
    assert cut.mean() == pytest.approx(-105 + 100 + 6, abs=2)
    assert cut.std() < 1.5
    # Before the wire the stock stands.
    assert surface[np.searchsorted(plan["x"], 0.52)] == pytest.approx(-40, abs=0.5)


# ---- debris, shorts, deflection, break

def test_flow_carries_debris_away(seed):
    # dV/dt = -Q c with Q = 3 mm3/s (g / 25 um)^3 exp(-3 c), speeded up by the scale.
    plant = Alone(machine=machine(), seed=seed)
    plant.hold(gap_um=10, debris=0.1)
    plant.set("force.debris", math.nan)
    began = plant.cycle
    plant.run(HZ // 1000)
    dt = 8e-6
    share, volume = 0.1, math.pi * 0.1 * 10 * 0.010  # mm3, of half the wire's surface
    for _ in range((plant.cycle - began) // 16):
        share *= math.exp(-3 * (10 / 25)**3 * math.exp(-3 * share) * 60 * dt / volume)
    assert share < 0.09
    assert plant.get("read.debris") == pytest.approx(share, rel=0.002)


def test_the_flow_drifts(seed):
    # Its logarithm has the deviation that the file gives, and keeps for the time that it gives:
    # samples ten times as far apart are independent.
    plant = Alone(machine=machine(debris={"flow_spread": 0.5, "flow_time_s": 0.06}), seed=seed)
    plant.hold(gap_um=10, debris=0.01)
    found = []
    for _ in range(400):
        plant.set("force.debris", 0.01)
        plant.run(HZ // 100)
        before = plant.get("read.debris")
        plant.set("force.debris", math.nan)
        plant.run(16)
        lost = -math.log(plant.get("read.debris") / before)
        found.append(math.log(lost))
    assert statistics.stdev(found) == pytest.approx(0.5, rel=SIGMAS / math.sqrt(2 * 400))


def test_contact_shorts_until_the_wire_is_back(seed):
    plant = at(seed, machine(), x=29)
    plant.drive(gap_sense=1)
    plant.run(100)
    assert plant.input("gap_short")
    assert plant.get("read.bridged")
    place(plant, x=-5)  # 34 um back: the stretch is 5 in the mean
    plant.run(100)
    assert not plant.input("gap_short")
    assert not plant.get("read.bridged")


def test_a_contact_ends_by_the_way_back_where_the_kerf_is_narrower_than_its_stretch(seed):
    # The gap to the sides of the kerf stays 10 um all the way.
    plant = at(seed, machine(debris={"stretch_um": 30}))
    plant.set("force.gap_um", 1)
    plant.run(100)
    plant.set("force.gap_um", 10)
    plant.run(100)
    assert plant.get("read.bridged")
    place(plant, x=-200)
    assert not plant.get("read.bridged")
    plant.set("force.gap_um", 1)
    plant.run(100)
    assert plant.get("read.bridged")
    plant.set("force.gap_um", 10)
    place(plant, x=0)   # forward or back: away from where it touched
    assert not plant.get("read.bridged")


@pytest.mark.parametrize(("gap_um", "debris", "short"), [
    (10, 0.49, 0), (10, 0.51, 1), (40, 0.94, 0), (40, 0.96, 1)])
def test_a_clogged_gap_is_shorted(seed, gap_um, debris, short):
    # SPARC: debris above min(0.3 + 0.02 g, 0.95).
    plant = Alone(machine=machine(debris={"clog_least": 0.3, "clog_most": 0.95}), seed=seed)
    plant.hold(gap_um=gap_um, debris=debris)
    assert plant.get("read.bridged") == short


def test_random_shorts_last_as_long_as_they_should(seed):
    # Hazard 0.001 (1 - g / 40 um) per us while it sparks; 100 us each, by ticks of 8.
    plant = Alone(machine=machine(debris={"random_short_per_us": 0.001}), seed=seed)
    plant.hold(gap_um=10)
    shorted = clear = begun = 0
    now = False
    while begun < 300:
        was = now
        plant.drive(gap_on=1, gap_level=2)
        plant.run(16 * 3)
        now = plant.get("read.state") == 4
        plant.drive(gap_on=0)
        plant.run(16)
        begun += now and not was
        shorted += now
        clear += not now
    share = shorted / (shorted + clear)
    rate = 0.001 * 0.75
    expected = 1 / (1 + 1 / (rate * 104))
    assert share == pytest.approx(expected, rel=SIGMAS / math.sqrt(begun) + 0.05)


def test_discharges_push_the_wire_away(seed):
    # 0.5 um per ampere of mean current, away from the plate.
    plant = at(seed, machine(wire={"deflection_um_a": 5.0}, removal_scale=0.001), x=22)
    before = plant.get("read.wire_x_um")
    began = plant.cycle
    for _ in range(20):
        burn(plant, 100, level=8)
    mean_a = 160 * 3.5 * 2000 / ((plant.cycle - began) / 2)
    pushed = before - plant.get("read.wire_x_um")
    assert pushed == pytest.approx(5.0 * mean_a, rel=0.35)
    assert abs(plant.get("read.wire_y_um")) < 0.3 * pushed


def test_the_wire_breaks_by_the_mean_current(seed):
    # 20 A for 3.5 us of some 50: 1.4 A in the mean of 20 ms.
    for threshold, broken in ((3.0, 0), (0.7, 1)):
        plant = Alone(machine=machine(wire={"break_a": threshold}), seed=seed)
        plant.hold(gap_um=8)
        plant.drive(gap_on=0)
        for _ in range(2000):
            plant.drive(gap_on=1, gap_level=1)
            plant.until(("gap_current",), 1000)
            plant.run(6)
            plant.drive(gap_on=0)
            plant.run(50)
        assert plant.get("read.wire_broken") == broken
        assert plant.input("drive_fault") == 4 * broken, "the wire's drive says so"
        sparks = plant.get("read.sparks")
        plant.drive(gap_on=1, gap_level=1)
        plant.run(HZ // 100)
        assert (plant.get("read.sparks") == sparks) is bool(broken)


def test_shorts_do_not_break_the_wire(seed):
    plant = Alone(machine=machine(wire={"break_a": 0.7}), seed=seed)
    plant.hold(gap_um=8)
    plant.set("force.short", 1)
    for _ in range(2000):
        plant.drive(gap_on=1, gap_level=20)
        plant.run(40)
        plant.drive(gap_on=0)
        plant.run(20)
    assert plant.get("read.wire_a") == plant.get("read.wire_broken") == 0


def test_one_seed_one_run(seed):
    def run(seed):
        plant = at(seed, MACHINE, x=22)
        delays = burn(plant, 200, level=8)
        return delays, plant.get("read.removed_mm3"), plant.workpiece()["left"].tobytes()

    assert run(seed) == run(seed) != run(seed + 1)
