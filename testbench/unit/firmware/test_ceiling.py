# SPDX-License-Identifier: Apache-2.0
"""The ceiling of a retraction: where on the path the way back ends."""

import math

import pytest

from testbench.firmware import events
from testbench.travel import go, load


def test_ceiling_is_a_limit(machine):
    machine.event("retraction_end", 3, 10, 100)
    assert events(machine.run(400), "back")[0][1] == "l"


@pytest.mark.parametrize(("height", "limit"), [
    (0.3, -3000),       # above the first point: in the way up
    (0.0, 0),
    (-0.1, 1000),       # between the first point and the front
])
def test_ceiling_is_a_place_on_the_path(machine, height, limit):
    load(machine, "G01 Z-1 F60", "M02", more=f" Z{height}")
    go(machine, 2000)
    assert machine.bound("back_limit") == limit
    machine.state("retracting")
    go(machine, -999_999)
    assert machine.axes[2] == round(height * 10_000)


def test_ceiling_on_a_slope_is_met_to_the_pulse(machine):
    load(machine, "G01 X.7 Z-.3 F60", "M02", more=" Z-.1")
    go(machine, 5000)
    machine.state("retracting")
    go(machine, -999_999)
    length = round(math.hypot(7000, 3000))
    assert machine.bound("back_limit") == min(
        k for k in range(length) if (2 * k * 3000 + length) // (2 * length) >= 1000)
    assert machine.library.gk_position() == machine.bound("back_limit")
    assert machine.axes[2] == -1000


def test_ceiling_changes_at_the_front(machine):
    load(machine, "G01 Z-.2 F60", "Z-.4", "G36 Z-.1", "Z-.6", "G36 Z-.3", "Z-.8", "M02")
    assert machine.bound("back_limit") < 0
    go(machine, 4500)
    assert machine.bound("back_limit") == 1000
    go(machine, 2000)
    assert machine.bound("back_limit") == 3000


def test_a_block_that_ends_a_pulse_above_the_ceiling(machine):
    load(machine, "G01 Z-.0999 F60", "M02", more=" Z-.1")
    go(machine, 500)
    assert machine.bound("back_limit") == 999


def test_no_way_back_into_a_block_that_ends_above_the_ceiling(machine):
    load(machine, "G01 Z-.5 F60", "Z.2", "Z-.5", "M02", more=" Z-.1")
    go(machine, 4000)
    assert machine.bound("back_limit") == 1000
    go(machine, 4000)
    assert machine.bound("back_limit") == 12_000, "its end"
    go(machine, 8000)
    assert machine.bound("back_limit") == 15_000, "below the ceiling again"


def test_a_new_ceiling_below_the_end_of_the_last_block(machine):
    load(machine, "G01 Z-.5 F60", "Z.2", "G36 Z-.1", "Z.1", "M02", more=" Z5")
    go(machine, 12_000)
    machine.run(400)
    assert machine.bound("back_limit") >= 12_000


def test_path_that_comes_from_above_the_ceiling(machine):
    machine.line("G92 Z2")
    load(machine, "G00 Z0", "G01 Z-.5 F60", "M02", more=" Z1")
    assert machine.bound("back_limit") >= 0
    go(machine, 15_000)
    assert machine.bound("back_limit") == 10_000
    machine.state("retracting")
    assert go(machine, -999_999) == -5_000
