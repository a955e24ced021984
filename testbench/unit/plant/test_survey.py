# SPDX-License-Identifier: Apache-2.0
"""Where the simulated wire sees its workpiece, compared with a look at every single cell."""

import copy

import numpy as np
import pytest

from host.machines.machine import load
from testbench.native.alone import Alone

MACHINE = load("wire").tables
MACHINE["comparator"]["fixed"] = 1  # nobody drives the references here
SECTORS = 128           # of pseudo-angles, as in testbench/plant/wire.hpp
DENTED_UM, FOLDS = 20, 3
HZ = 2_000_000


def borders():
    """Angles at which the sectors begin and end, in radians from +X."""
    quarter, part = np.divmod(np.arange(SECTORS + 1) * 4 / SECTORS, 1)
    return (quarter + np.arctan2(part, 1 - part) / (np.pi / 2)) * np.pi / 2


def engagement(plant, radius_um, cell_um, scale_um):
    """Share of a half circle that is as near as the narrowest place, from all cells there are."""
    seen = plant.workpiece()
    x, y = np.meshgrid(seen["x"] * 1000 - plant.get("read.wire_x_um"),
                       seen["y"] * 1000 - plant.get("read.wire_y_um"))
    left = seen["left"].astype(float)
    centre = np.hypot(x, y)
    there = (left > 0) & (centre >= max(radius_um - DENTED_UM, 0))
    x, y, distance = x[there], y[there], (centre + (0.5 - left) * cell_um)[there]
    share = y / (abs(x) + abs(y) + 1e-12)
    quarter = np.where(x >= 0, share, 2 - share)
    sector = (np.where(quarter >= 0, quarter, quarter + 4) / 4 * SECTORS).astype(int) % SECTORS
    nearest = np.full(SECTORS, np.inf)
    np.minimum.at(nearest, sector, distance)
    nearest -= distance.min()
    weights = np.diff(borders()) * np.exp(-nearest / scale_um)
    return weights[nearest <= max(FOLDS * scale_um, 2 * cell_um)].sum() / np.pi


# How far the wire goes, in 0.1 um: into the material by 10 um, and no deeper than it sees; a wire
# thinner than that sees everything.
@pytest.mark.parametrize(("diameter_mm", "most"), [(0.02, 600), (0.06, 220), (0.25, 220)])
def test_the_nearest_cell_in_every_direction_is_found(rng, diameter_mm, most):
    """The gap is forced, so that it discharges everywhere."""
    tables = copy.deepcopy(MACHINE)
    tables["wire"] |= {"diameter_mm": diameter_mm, "break_a": 0, "deflection_um_a": 0}
    tables["debris"] |= {"random_short_per_us": 0, "single_short": 0, "arc_share": 0}
    tables["stock"] |= {"edge_mm": -5.0, "hole_mm": diameter_mm + 0.04}
    tables["removal_scale"] = 20
    plant = Alone(machine=tables, seed=rng.getrandbits(32))
    plant.drive(drive_enable=7)
    plant.hold(gap_um=10)
    cell_um, scale_um = plant.get("workpiece.cell_um"), plant.get("gap.engagement_um")
    at = [0, 0]
    for _ in range(60):
        axis = rng.randrange(2)
        way = rng.choice([0, rng.randint(-3, 3), rng.randint(-most, most) - at[axis]])  # of 0.1 um
        at[axis] += way
        for _ in range(abs(way)):
            plant.step(1 << axis, (way < 0) << axis)
            plant.run(2)
            plant.step(0)
            plant.run(6)
        plant.run(HZ // 10)
        while plant.pulse(on_us=200, off_us=20, level=rng.choice([2, 8])) is None:
            pass
        assert plant.get("read.engagement") == pytest.approx(
            engagement(plant, diameter_mm * 500, cell_um, scale_um), rel=1e-5)
