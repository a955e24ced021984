# SPDX-License-Identifier: Apache-2.0
"""The path that the firmware remembers, and the window of it that the gateware holds."""

import math

import pytest

from testbench.firmware import Machine, events
from testbench.programs import punched

DATA = "G36 R300 L{limit} H600 E60 Q.1{more}"
RING = 256      # segments remembered
NEAR, FAR = 5, 10


@pytest.fixture
def machine():
    ready = Machine()
    ready.unlock()
    return ready


def load(machine, *blocks, limit=5, more="", passes=300):
    """Start a program with the machine standing still; leave the tape open for more."""
    machine.library.gk_speed(0)
    machine.tape(punched([DATA.format(limit=limit, more=more), *blocks]), passes=passes)


def go(machine, pulses, passes=8):
    """Move along the path in small steps, the firmware following; the pulses made."""
    made = idle = 0
    while made != pulses and idle < 20:
        step = min(37, pulses - made) if pulses > 0 else max(-37, pulses - made)
        part = machine.library.gk_go(step)
        machine.run(passes)
        made += part
        idle = 0 if part else idle + 1
    return made


def test_segment_is_as_long_as_its_line(machine, rng):
    """N is the distance rounded to whole pulses: the coordinate at the end counts them."""
    moves = [[rng.randint(-30000, 30000) for _ in range(3)] for _ in range(8)]
    load(machine, "G91 G01 F60", *("X{:.4f} Y{:.4f} Z{:.4f}".format(*(d / 10_000 for d in move))
                                   for move in moves), "M02")
    total = 0
    for move in moves:
        exact = math.hypot(*move)
        length = math.floor(exact + 0.5)
        total += length
    assert machine.bound("ahead") == total


def test_way_back_is_the_way_that_was_come(machine, rng):
    """Over borders of blocks and windows, to the pulse, and forward again."""
    blocks = [f"X.0{rng.randint(1, 9)} Y-.00{rng.randint(0, 9)}" for _ in range(60)]
    load(machine, "G91 G01 F60", *blocks, "M02", limit=50)
    trail = {0: machine.axes}

    def walk(step, end):
        while machine.library.gk_position() != end:
            assert machine.library.gk_go(step) == step
            position = machine.library.gk_position()
            assert machine.axes == trail.setdefault(position, machine.axes)
            if position % 3 == 0:
                machine.run(8)

    while machine.library.gk_position() < 25_000 and machine.library.gk_go(1):
        trail[machine.library.gk_position()] = machine.axes
        machine.run(8)
    front = machine.library.gk_position()
    assert front > 15_000
    machine.state("retracting")
    machine.run(40)
    walk(-1, 0)
    machine.state("high")
    machine.run(40)
    walk(1, front)


@pytest.mark.parametrize("creep", [-99, -9, 9, 99])
def test_window_moves_under_a_moving_machine(machine, rng, creep):
    """What the gateware is about to use is never overwritten, however the machine turns."""
    blocks = [f"X.000{rng.randint(1, 9)} Z-.00{rng.randint(0, 2)}" for _ in range(55)]
    load(machine, "G91 G01 F60", *blocks, "M02", limit=50)
    trail = {0: machine.axes}
    while machine.library.gk_position() < 400 and machine.library.gk_go(1):
        trail[machine.library.gk_position()] = machine.axes
        machine.run(8)
    front = machine.library.gk_position()
    machine.library.gk_creep(creep)
    for _ in range(400):
        back = rng.random() < 0.5
        machine.state("retracting" if back else "low")
        machine.library.gk_go(-rng.randint(1, 150) if back else
                              min(rng.randint(1, 150), front - machine.library.gk_position()))
        assert machine.axes == trail.setdefault(machine.library.gk_position(), machine.axes)
        machine.run(rng.randint(1, 9))
        assert machine.axes == trail.setdefault(machine.library.gk_position(), machine.axes)


def test_window_covers_both_sides(machine):
    load(machine, "G91 G01 F60", *(["X.01"] * 60), "M02")
    for _ in range(30):
        go(machine, 100)
    at = machine.library.gk_position() // 100
    machine.run(200)
    ahead, behind = machine.bound("ahead") // 100, machine.bound("behind") // 100
    assert at - behind >= NEAR
    assert ahead - at >= FAR
    assert ahead - behind == 16
    machine.state("retracting")
    machine.run(200)
    ahead, behind = machine.bound("ahead") // 100, machine.bound("behind") // 100
    assert at - behind >= FAR - 1
    assert ahead - at >= NEAR


def test_before_the_first_point_lies_the_way_up_to_the_soft_limit(machine):
    machine.line("$15=3000")
    machine.line("G00 Z1")
    load(machine, "G01 X1 F60", "M02")
    assert machine.bound("behind") == machine.bound("floor") == -20_000
    go(machine, 500)
    machine.state("retracting")
    assert go(machine, -999_999) == -20_500
    assert machine.axes == (0, 0, 30_000)


def test_path_of_a_wire_begins_at_its_first_point():
    machine = Machine(jump_axis=15)
    machine.unlock()
    load(machine, "G01 X1 F60", "M02")
    go(machine, 500)
    machine.state("retracting")
    assert go(machine, -999_999) == -500
    machine.event("retraction end", 3, 10, 100)
    assert events(machine.run(400), "back")[0][1] == "p"


def test_ceiling_is_a_limit(machine):
    machine.event("retraction end", 3, 10, 100)
    assert events(machine.run(400), "back")[0][1] == "l"


@pytest.mark.parametrize(("height", "floor"), [
    (0.3, -3000),       # above the first point: in the way up
    (0.0, 0),
    (-0.1, 1000),       # between the first point and the front
])
def test_ceiling_is_a_place_on_the_path(machine, height, floor):
    load(machine, "G01 Z-1 F60", "M02", more=f" Z{height}")
    go(machine, 2000)
    assert machine.bound("floor") == floor
    machine.state("retracting")
    go(machine, -999_999)
    assert machine.axes[2] == round(height * 10_000)


def test_ceiling_on_a_slope_is_met_to_the_pulse(machine):
    load(machine, "G01 X.7 Z-.3 F60", "M02", more=" Z-.1")
    go(machine, 5000)
    machine.state("retracting")
    go(machine, -999_999)
    length = round(math.hypot(7000, 3000))
    assert machine.bound("floor") == min(
        k for k in range(length) if (2 * k * 3000 + length) // (2 * length) >= 1000)
    assert machine.library.gk_position() == machine.bound("floor")
    assert machine.axes[2] == -1000


def test_ceiling_changes_at_the_front(machine):
    load(machine, "G01 Z-.2 F60", "Z-.4", "G36 Z-.1", "Z-.6", "G36 Z-.3", "Z-.8", "M02")
    assert machine.bound("floor") < 0
    go(machine, 4500)
    assert machine.bound("floor") == 1000
    go(machine, 2000)
    assert machine.bound("floor") == 3000


def test_path_that_comes_from_above_the_ceiling(machine):
    machine.line("G92 Z2")
    load(machine, "G00 Z0", "G01 Z-.5 F60", "M02", more=" Z1")
    assert machine.bound("floor") >= 0
    go(machine, 15_000)
    assert machine.bound("floor") == 10_000
    machine.state("retracting")
    assert go(machine, -999_999) == -5_000


def test_corners_bound_the_fast_motion(machine):
    load(machine, "G91 G01 F60", "X1", "X1 Y.01", "Y1", "X-1", "Y.5", "M02")
    assert machine.bound("fast_behind") == 0, "the first point is a corner to the way up"
    junctions = [10_000, 20_000]
    assert machine.bound("fast_ahead") == junctions[1], "a bend of half a degree is none"
    go(machine, 20_500)
    assert machine.bound("fast_behind") == 20_000
    assert machine.bound("fast_ahead") == 30_000


def test_lower_feed_ahead_bounds_the_fast_motion(machine):
    load(machine, "G91 G00 X1", "G01 X1 F60", "X1 F50", "G00 X1", "M02")
    assert machine.bound("fast_ahead") == 10_000
    go(machine, 10_500)
    # Below the start/stop speed every change of speed is immediate.
    assert machine.bound("fast_ahead") == 40_000


def test_oldest_blocks_are_forgotten_only_beyond_the_limit(machine):
    count = RING + 100
    machine.library.gk_speed(37)
    machine.tape(punched([DATA.format(limit=1, more=""), "G91 G01 F60", *["X.01"] * count, "M02"]))
    assert machine.library.gk_position() == count * 100
    machine.state("retracting")
    back = -go(machine, -999_999, passes=40)
    assert 10_000 + 10 <= back < (RING + 1) * 100


def test_limit_that_the_memory_cannot_cover_is_an_alarm_beforehand(machine):
    blocks = ["X.01"] * (RING + 100)
    machine.library.gk_speed(1 << 30)
    machine.tape(punched([DATA.format(limit=5, more=""), "G91 G01 F60", *blocks, "M02"]),
                 passes=20_000)
    alarm = events(machine.lines, "alarm")[0]
    assert alarm[1] == "35"
    assert "limit" in alarm[2]
    # The virtual segment before the first point takes one place; all that remains is covered.
    assert machine.axes[0] == (RING - 1) * 100


def test_new_path_begins_with_every_tape(machine):
    load(machine, "G01 X.1 F60", "M02")
    go(machine, 1000)
    machine.run(400)
    assert events(machine.lines, "end")
    load(machine, "G01 X.2 F60", "M02")
    machine.state("front")
    assert machine.library.gk_position() == 0
    assert machine.bound("ahead") == 1000
