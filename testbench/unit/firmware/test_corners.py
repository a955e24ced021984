# SPDX-License-Identifier: Apache-2.0
"""Corners: how slow the machine must be before one, and from where on, either way."""

import math

import pytest

from softcore.tables.settings import assign, named
from testbench.firmware import Controller
from testbench.travel import go, load

PULSES_PER_MM = 10_000
SLOWER = 1.1            # the drives may be a tenth slower than the settings say
LAG_S = 4.096e-3 * SLOWER
LOOP_S = 1 / named("loop_gain").default
DEVIATION_UM = named("corner_deviation_nm").default / 1000
START_MM_S = named("start_speed_um_s").default / 1000
HIGHEST_MM_S = named("highest_speed_mm_min").default / 60
CAUGHT_UP, DIED_AWAY = 5, 3     # lags, and times of the loop, from the place to the corner


def speed_round(degrees, *, deviation_um=DEVIATION_UM, lag_s=LAG_S):
    """Speed in mm/s at which an axis of first order rounds a corner by the deviation."""
    sine = math.sin(math.radians(min(degrees, 90)))
    return deviation_um / 1000 * math.e / (lag_s * sine)


def zone(speed, lag_s=LAG_S, loop_s=LOOP_S):
    """Pulses from the place to the corner."""
    before_s = max(CAUGHT_UP * lag_s, DIED_AWAY * loop_s)
    return min(speed, START_MM_S) * before_s * PULSES_PER_MM


def behind(speed, lag_s=LAG_S):
    """Pulses behind the corner in which the speed is kept."""
    return min(speed, START_MM_S) * lag_s * PULSES_PER_MM


@pytest.fixture
def wire():
    """A wire machine: there is no way up before the first point."""
    machine = Controller(jump_axis=15)
    machine.unlock()
    return machine


def told(machine, way):
    """Place and rate of a corner, the latter in mm/s; None without a bound."""
    rate = machine.bound(f"fast_{way}_rate")
    speed = rate * 2**-28 * machine.clock_hz / PULSES_PER_MM
    return machine.bound(f"fast_{way}"), speed if rate else None


def to(machine, place):
    """Go to a place on the path."""
    go(machine, place - machine.library.gk_position())
    assert machine.library.gk_position() == place


def bend(degrees, *, length=1, after=1):
    """Blocks of two lines in the plane with so many degrees between them."""
    x, y = (after * part(math.radians(degrees)) for part in (math.cos, math.sin))
    return f"X{length}", f"X{x:.4f} Y{y:.4f}"


@pytest.mark.parametrize("degrees", [8, 15, 30, 60, 90, 120, 179])
def test_the_speed_before_a_corner_goes_with_its_sine(wire, degrees):
    load(wire, "G91 G01 F60", *bend(degrees), "M02")
    speed = speed_round(degrees)
    assert speed < HIGHEST_MM_S
    place, found = told(wire, "ahead")
    assert found == pytest.approx(speed, rel=0.01)
    assert place == pytest.approx(10_000 - zone(speed), abs=2 + 0.01 * zone(speed))


@pytest.mark.parametrize("degrees", [0, 0.5, 5])
def test_a_bend_that_needs_no_bound_at_the_highest_speed_is_none(wire, degrees):
    assert degrees == 0 or speed_round(degrees) > HIGHEST_MM_S
    load(wire, "G91 G01 F60", *bend(degrees), "M02")
    assert told(wire, "ahead") == (pytest.approx(20_000, abs=2), None)


def test_a_gentle_bend_between_the_axes_is_none(wire):
    """Its sine counts, and not the sum of what the axes change."""
    x, y = (math.sqrt(2) * part(math.radians(50)) for part in (math.cos, math.sin))
    load(wire, "G91 G01 F60", "X1 Y1", f"X{x:.4f} Y{y:.4f}", "M02")
    assert told(wire, "ahead")[1] is None


@pytest.mark.parametrize(("line", "lag_s", "deviation_um", "loop_s"), [
    (assign("feed_forward", 0), 1 / 50 * SLOWER, DEVIATION_UM, LOOP_S),
    (assign("feed_forward", 50), 1 / 100 * SLOWER + LAG_S / 2, DEVIATION_UM, LOOP_S),
    (assign("corner_deviation_nm", 1000), LAG_S, 1, LOOP_S),
    (assign("corner_deviation_nm", 12_000), LAG_S, 12, LOOP_S),
    (assign("loop_gain", 10), LAG_S, DEVIATION_UM, 1 / 10),
    (assign("drive_lag_us", 8000), (8e-3 + 2 * 3.904e-3) * SLOWER, DEVIATION_UM, LOOP_S),
    (assign("model_lag_z_us", 2096), (4.096e-3 + 2 * 2e-3) * SLOWER, DEVIATION_UM, LOOP_S),
    (assign("model_lag_y_us", 6096), (4.096e-3 + 3.5 * 2e-3) * SLOWER, DEVIATION_UM, LOOP_S)])
def test_it_follows_the_loop_in_force_and_the_setting(wire, line, lag_s, deviation_um, loop_s):
    wire.line(line)
    load(wire, "G91 G01 F60", "X1", "Y1", "M02")
    speed = speed_round(90, lag_s=lag_s, deviation_um=deviation_um)
    place, found = told(wire, "ahead")
    assert found == pytest.approx(speed, rel=0.01)
    assert place == pytest.approx(10_000 - zone(speed, lag_s, loop_s), abs=4)


def test_it_follows_a_change_of_the_highest_speed(wire):
    """At 600 mm/min a bend of 15 degrees leaves the path by less than the setting."""
    wire.line(assign("highest_speed_mm_min", 600))
    load(wire, "G91 G01 F60", *bend(15), "M02")
    assert told(wire, "ahead")[1] is None


def test_without_a_deviation_only_the_start_stop_speed_counts(wire):
    wire.line(assign("corner_deviation_nm", 0))
    load(wire, "G91 G01 F60", "X1", "Y1", "M02")
    assert told(wire, "ahead") == (10_000, None)
    to(wire, 10_001)
    assert told(wire, "ahead") == (20_000, None)
    assert told(wire, "behind") == (10_000, None)


def test_the_way_up_before_the_first_point_is_a_corner_of_the_way_back(machine):
    load(machine, "G91 G01 F60", "X1", "M02")
    speed = speed_round(90)
    assert told(machine, "behind") == (pytest.approx(zone(speed), abs=2),
                                       pytest.approx(speed, rel=0.01))


def test_the_speed_of_a_corner_is_kept_a_lag_behind_it_either_way(wire):
    """The corner that was passed is the place, until the machine is far enough."""
    load(wire, "G91 G01 F60", "X1", "Y1", "X1", "M02")
    speed = speed_round(90)
    before, kept = zone(speed), behind(speed)
    there = pytest.approx(speed, rel=0.01)
    to(wire, 10_001)
    assert told(wire, "ahead") == (10_000, there)
    to(wire, 10_000 + round(kept) - 2)
    assert told(wire, "ahead") == (10_000, there)
    to(wire, 10_000 + round(kept) + 2)
    assert told(wire, "ahead") == (pytest.approx(20_000 - before, abs=2), there)
    assert told(wire, "behind") == (pytest.approx(10_000 + before, abs=2), there)
    to(wire, 15_000)
    wire.state("retracting")
    to(wire, 9_999)
    assert told(wire, "behind") == (10_000, there)
    to(wire, 10_000 - round(kept) - 2)
    assert told(wire, "behind") == (0, None)
    assert told(wire, "ahead") == (pytest.approx(10_000 - before, abs=2), there)


def test_behind_a_gentle_bend_the_speed_is_its_own(wire):
    """Not that of a sharper corner far ahead."""
    load(wire, "G91 G01 F60", *bend(30), "X-1", "M02")
    to(wire, 10_001)
    assert told(wire, "ahead") == (10_000, pytest.approx(speed_round(30), rel=0.01))


@pytest.mark.parametrize(("first", "then"), [(30, "X-1"), (90, "X-.3 Y1")])
def test_of_two_corners_close_together_the_lower_speed_and_the_earlier_place_count(
        wire, first, then):
    """If the zone of the second begins before the first."""
    load(wire, "G91 G01 F60", *bend(first, after=0.02), then, "M02")
    second = 90 if first == 30 else math.degrees(math.atan(.3))
    speeds = speed_round(first), speed_round(second)
    place = min(10_000 - zone(speeds[0]), 10_200 - zone(speeds[1]))
    assert told(wire, "ahead") == (pytest.approx(place, abs=30),
                                   pytest.approx(min(speeds), rel=0.01))
    to(wire, 13_000)
    assert told(wire, "behind")[0] == pytest.approx(
        max(10_000 + zone(speeds[0]), 10_200 + zone(speeds[1])), abs=30)


def test_a_corner_whose_zone_begins_behind_the_next_one_waits(wire):
    load(wire, "G91 G01 F60", *bend(30), "X-1", "M02")
    speed = speed_round(30)
    assert told(wire, "ahead") == (pytest.approx(10_000 - zone(speed), abs=10),
                                   pytest.approx(speed, rel=0.01))


def test_a_lower_feed_alone_has_no_bound(wire):
    load(wire, "G91 G00 X1", "G01 X1 F60", "M02")
    assert told(wire, "ahead") == (10_000, None)


def test_the_least_deviation_still_moves(wire):
    """The rate is bounded to at least one unit."""
    wire.line(assign("corner_deviation_nm", 1))
    wire.line(assign("feed_forward", 0))
    wire.line(assign("loop_gain", 10))
    load(wire, "G91 G01 F60", "X1", "Y1", "M02")
    assert wire.bound("fast_ahead_rate") > 0
