# SPDX-License-Identifier: Apache-2.0
"""Edge, corner, hole and boss on the simulated machines: what the cycles find, against the truth.

The contact offset is calibrated on a hole of known diameter, with the same machine and seed.
"""

import random

import pytest

from host.machines import machine as machines
from host.touch.cycles import Probe, boss, corner, edge, hole
from testbench.cosim import touch
from testbench.native.simulation import Simulation

SINKER, WIRE = machines.load("sinker"), machines.load("wire")
WITHIN_UM = 2
ELECTRODE_MM = 2.0      # small, so that the ways are short
WIRE_MM = WIRE.tables["wire"]["diameter_mm"]
HEIGHT_MM = SINKER.tables["initial_gap_um"] / 1000
BESIDE_MM = 0.3         # of Z under the top of the work, where the side is touched
SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(2, 101))]
# Nearer than as delivered: beyond a bridge of the gap, whose mean is 60 um here.
PROBE = Probe(radius=ELECTRODE_MM / 2, reach=1.5, back=0.3, near=0.04, clear=0.4)
THIN = Probe(radius=WIRE_MM / 2, reach=1.5, back=0.12, near=0.03, clear=0.2)


def sinker(shape, seed, *, size, centre=(0.0, 0.0)):
    work = {"shape": shape, "size_mm": size, "depth_mm": 5.0, "electrode_mm": ELECTRODE_MM,
            "centre_x_mm": centre[0], "centre_y_mm": centre[1]}
    return Simulation(machine={**SINKER.tables, "work": work}, clock_hz=SINKER.clock_hz, seed=seed,
                      trace=False)


def wire(seed, **stock):
    tables = {**WIRE.tables, "stock": {**WIRE.tables["stock"], **stock}}
    return Simulation(machine=tables, clock_hz=WIRE.clock_hz, seed=seed, trace=False)


def calibrated(seed):
    """The probe with the offset of this machine, from a hole of known diameter."""
    with sinker("hole", seed, size=2.6) as session:
        (found,) = touch.found(session, f"G91 G01 Z{-HEIGHT_MM - BESIDE_MM:.3f} F600", hole(PROBE))
    return Probe(**{**vars(PROBE), "offset": found.offset(2.6, PROBE)})


def near(found, truth):
    errors = {axis: (found.places[axis] - place) * 1000 for axis, place in truth.items()}
    assert all(abs(error) <= WITHIN_UM for error in errors.values()), (errors, found)
    assert found.places.keys() == truth.keys()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_hole_on_the_sinker(seed):
    rng = random.Random(seed)
    centre = rng.uniform(-0.15, 0.15), rng.uniform(-0.15, 0.15)
    with sinker("hole", seed, size=2.8, centre=centre) as session:
        (found,) = touch.found(session, f"G91 G01 Z{-HEIGHT_MM - BESIDE_MM:.3f} F600", hole(PROBE))
    near(found, {"X": centre[0], "Y": centre[1]})
    # The diameter tells the contact offset: the gap conducts below so many um.
    assert found.offset(2.8, PROBE) * 1000 == pytest.approx(SINKER.tables["gap"]["contact_um"],
                                                            abs=0.5)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 101))
def test_a_boss_on_the_sinker(seed):
    rng = random.Random(seed)
    centre = rng.uniform(-0.15, 0.15), rng.uniform(-0.15, 0.15)
    with sinker("boss", seed, size=1.0, centre=centre) as session:
        (found,) = touch.found(session, "G91 G01 Z0.2 F600", boss(PROBE, 1.0, lift=0.8))
    near(found, {"X": centre[0], "Y": centre[1]})


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 101))
def test_edge_corner_and_top_of_a_block_on_the_sinker(seed):
    rng = random.Random(seed)
    probe = calibrated(seed)
    size, gap = 1.0, rng.uniform(0.3, 0.8)
    # The electrode stands beside the block at least X, its middle 0.2 mm from the corner.
    centre = gap + probe.radius + size / 2, size / 2 - 0.2
    with sinker("block", seed, size=size, centre=centre) as session:
        found, = touch.found(session, f"G91 G01 Z{-HEIGHT_MM - BESIDE_MM:.3f} F600",
                             corner(probe, 1, 1, along=0.4))
    near(found, {"X": gap + probe.radius, "Y": -0.2})
    with sinker("block", seed, size=size) as session:
        found, = touch.found(session, "G91 G01 Z0.3 F600", edge(probe, "Z", -1))
    near(found, {"Z": -HEIGHT_MM})


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 101))
def test_hole_edge_and_boss_on_the_wire_machine(seed):
    rng = random.Random(seed)
    off = rng.uniform(-0.08, 0.08), rng.uniform(-0.08, 0.08)
    with wire(seed, edge_mm=-10.0, hole_mm=0.6) as session:
        (found,) = touch.found(session, f"G91 G01 X{off[0]:.4f} Y{off[1]:.4f} F600", hole(THIN))
    near(found, {"X": 0, "Y": 0})
    probe = Probe(**{**vars(THIN), "offset": found.offset(0.6, THIN)})
    place = 0.3 + rng.uniform(0, 0.2)
    with wire(seed, edge_mm=place) as session:
        (found,) = touch.found(session, "G91", edge(probe, "X", 1))
    near(found, {"X": place})
