# SPDX-License-Identifier: Apache-2.0
"""Contours at 600 mm/min: the loop of the machine's file beside that of the first patent.

``pytest -s -m "soak or not soak" testbench/cosim/test_contour.py`` tells all figures.
"""

import math

import pytest

from host.machines import machine as machines
from softcore.tables.settings import assign, named, of_number
from testbench.cosim.contour import FEED, Piece, Shape, circle, deviation, rounded, square
from testbench.native.simulation import Simulation

PLAIN = assign("feed_forward", 0)
CORNER = named("corner_deviation_nm")
FREE = assign(CORNER.name, 0)
SHARE = 1 / 5               # of the plain loop's deviation
DRIVE_S = 3.5e-3            # lag of the simulated drives: speed loop and filter
CIRCLES = 0.05, 0.1, 0.2, 0.5, 1.0, 5.0     # radii in mm


def measured(name, shape, *lines, clock_hz=None):
    machine = machines.load(name)
    loop = (f"${number}={value}" for number, value in machine.settings.items()
            if of_number(int(number)).group == "loop")
    with Simulation(machine=machine.tables, clock_hz=clock_hz or machine.clock_hz, seed=1,
                    trace=False) as session:
        return deviation(session, shape, *loop, *lines)


def cases(*names):
    """On the sinker in short, on the wire machine as a long test."""
    return [*(("sinker", name) for name in names[:1]),
            *(pytest.param("sinker", name, marks=pytest.mark.soak) for name in names[1:]),
            *(pytest.param("wire", name, marks=pytest.mark.soak) for name in names)]


def beside(name, title, shape, **clock):
    """Deviations with feed-forward and in the plain loop, printed."""
    now, plain = measured(name, shape, **clock), measured(name, shape, PLAIN, **clock)
    print(f"{name}, {title}: {now} of {plain}")
    return now, plain


@pytest.mark.parametrize(("machine", "radius"), cases(0.5, *(one for one in CIRCLES if one != 0.5)))
def test_a_circle_is_left_by_a_fifth_of_what_the_plain_loop_does(machine, radius):
    now, plain = beside(machine, f"circle of {radius:g} mm", circle(radius))
    assert 0 < now.course <= SHARE * plain.course


@pytest.mark.soak
@pytest.mark.parametrize("machine", ["sinker", "wire"])
@pytest.mark.parametrize(("radius", "turns"), [(0.05, 6), (0.1, 4), (0.2, 3), (0.5, 2)])
def test_a_small_circle_is_left_by_a_fifth_at_the_clock_of_a_board(machine, radius, turns):
    """The controller of the machines' files, at 2 MHz, is slower than 600 mm/min on these."""
    now, plain = beside(machine, f"circle of {radius:g} mm at 40 MHz", circle(radius, turns),
                        clock_hz=40_000_000)
    assert 0 < now.course <= SHARE * plain.course


@pytest.mark.soak
@pytest.mark.parametrize(("machine", "radius"), cases(0.25))
def test_a_square_of_tangent_corners_is_left_by_a_fifth(machine, radius):
    now, plain = beside(machine, f"rounded by {radius:g} mm", rounded(1.5, radius))
    assert 0 < now.course <= SHARE * plain.course


@pytest.mark.parametrize(("machine", "side"), cases(1.5))
def test_sharp_corners_are_rounded_by_no_more_than_the_setting(machine, side):
    """With the bound off, by a fifth of what the plain loop does, nearly."""
    shape = square(side)
    delivered = measured(machine, shape)
    free, plain = measured(machine, shape, FREE), measured(machine, shape, FREE, PLAIN)
    print(f"{machine}, square: {delivered}, without a bound {free} of {plain}")
    assert 0.4 * CORNER.default / 1000 < delivered.corners <= CORNER.default / 1000
    assert delivered.corners <= SHARE * plain.corners
    assert free.corners <= 0.37 * FEED / 60 * 1000 * DRIVE_S
    assert delivered.course <= SHARE * plain.course


@pytest.mark.soak
@pytest.mark.parametrize("line", [assign(CORNER.name, 2000), assign(CORNER.name, 10_000), PLAIN],
                         ids=["2 um", "10 um", "plain"])
@pytest.mark.parametrize("machine", ["sinker", "wire"])
def test_corners_keep_any_setting_in_any_loop(machine, line):
    found = measured(machine, square(1.5), line)
    number, value = line[1:].split("=")
    bound = int(value) if int(number) == CORNER.number else CORNER.default
    print(f"{machine}, {line}: {found}")
    assert 0.4 * bound / 1000 < found.corners <= bound / 1000


@pytest.mark.soak
@pytest.mark.parametrize("lag_us", [500, 2000, 6000, 8000])
def test_corners_keep_their_setting_with_a_model_whose_lag_is_wrong(lag_us):
    lines = [assign(f"model_lag_{axis}_us", lag_us) for axis in "xyz"]
    found = measured("sinker", square(1.5), *lines)
    print(f"lag of the model {lag_us} us: {found}")
    assert 0 < found.corners <= CORNER.default / 1000


@pytest.mark.soak
@pytest.mark.parametrize("degrees", [10, 20, 45, 120, 150])
def test_bends_are_rounded_by_no_more_than_the_setting(degrees):
    """At the feed of the contour a bend of up to 19 degrees needs no bound."""
    turn = math.radians(degrees)
    places = [(0, 0), (1.5, 0), (1.5 + 1.5 * math.cos(turn), 1.5 * math.sin(turn))]
    found = measured("sinker", Shape(tuple(map(Piece, places, places[1:])), (places[1],)))
    print(f"{degrees} degrees: {found}")
    assert 0 < found.corners <= CORNER.default / 1000
