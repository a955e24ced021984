# SPDX-License-Identifier: Apache-2.0
"""Contours at 600 mm/min: the loop as delivered, beside the plain loop of the first patent.

``pytest -s -m "soak or not soak" testbench/cosim/test_contour.py`` tells all figures.
"""

import pytest

from host.machines import machine as machines
from softcore.tables.settings import assign
from testbench.cosim.contour import FEED, circle, deviation, rounded, square
from testbench.native.simulation import Simulation

PLAIN = assign("feed_forward", 0)
SHARE = 1 / 5               # of the plain loop's deviation
CODER_UM = 0.1              # an edge of the coder
DRIVE_S = 4e-3              # lag of the simulated drives
CIRCLES = 0.05, 0.1, 0.2, 0.5, 1.0, 5.0     # radii in mm


def measured(name, shape, *lines):
    machine = machines.load(name)
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=False) as session:
        return deviation(session, shape, *lines)


def cases(*names):
    """On the sinker in short, on the wire machine as a long test."""
    return [*(("sinker", name) for name in names[:1]),
            *(pytest.param("sinker", name, marks=pytest.mark.soak) for name in names[1:]),
            *(pytest.param("wire", name, marks=pytest.mark.soak) for name in names)]


def beside(name, title, shape):
    """Deviations as delivered and in the plain loop, printed."""
    now, plain = measured(name, shape), measured(name, shape, PLAIN)
    print(f"{name}, {title}: {now} of {plain}")
    return now, plain


@pytest.mark.parametrize(("machine", "radius"), cases(0.5, *(one for one in CIRCLES if one != 0.5)))
def test_a_circle_is_left_by_a_fifth_of_what_the_plain_loop_does(machine, radius):
    now, plain = beside(machine, f"circle of {radius:g} mm", circle(radius))
    assert 0 < now.course <= SHARE * plain.course + CODER_UM


@pytest.mark.soak
@pytest.mark.parametrize(("machine", "radius"), cases(0.25))
def test_a_square_of_tangent_corners_is_left_by_a_fifth(machine, radius):
    now, plain = beside(machine, f"rounded by {radius:g} mm", rounded(1.5, radius))
    assert 0 < now.course <= SHARE * plain.course


@pytest.mark.parametrize(("machine", "side"), cases(1.5))
def test_sharp_corners_are_rounded_by_the_lag_of_the_drive(machine, side):
    """By 0.37 times speed times lag at most; beyond them the path is met again."""
    now, plain = beside(machine, "square", square(side))
    bound_um = 0.37 * FEED / 60 * 1000 * DRIVE_S
    assert 0 < now.corners <= bound_um
    assert plain.corners > 3 * bound_um
    assert now.course < plain.course
