# SPDX-License-Identifier: Apache-2.0
"""Touching cycles against exact geometry: a controller that touches what a formula says."""

import math
import re

import pytest

from host.errors import UsageError
from host.touch.command import SHAPES, check_known, cycle_of, ways_of
from host.touch.cycles import Found, Place, Probe, TouchError, boss, corner, edge, hole
from host.touch.zero import await_rest, stands, zero_lines

RADIUS, OFFSET = 3.0, 0.002
LAG = 0.0007            # by which the axes go on behind a touch
STEP = 0.01             # between two looks for contact, refined by bisection
PROBE = Probe(radius=RADIUS, offset=OFFSET, reach=30)


class Gap:
    """An electrode at a place, a distance to the work, and the lines of a cycle."""

    def __init__(self, distance, start):
        self.distance = distance        # of the electrode's middle from the surfaces, less RADIUS
        self.at = dict(zip("XYZ", start, strict=True))
        self.lines = []
        self.crashed = False

    def touches(self, at):
        return self.distance(at) <= OFFSET

    def carry_out(self, line):
        """What the controller tells of a line: a place, or None."""
        self.lines.append(line)
        ways = {axis: float(way) for axis, way in re.findall(r"([XYZ])(-?[\d.]+)", line)}
        start = dict(self.at)

        def along(share):
            return {axis: start[axis] + share * ways.get(axis, 0) for axis in "XYZ"}

        length = math.hypot(*ways.values())
        if "G01" in line:
            steps = max(1, math.ceil(length / STEP))
            # Away from a contact it may begin in it.
            self.crashed |= any(self.touches(along(k / steps)) for k in range(1, steps + 1))
            self.at = along(1)
            return None
        if line == "G04 P20":
            return None
        assert "G38.2" in line
        steps = math.ceil(length / STEP)
        for k in range(1, steps + 1):
            if self.touches(along(k / steps)):
                low, high = (k - 1) / steps, k / steps
                for _ in range(40):
                    middle = (low + high) / 2
                    low, high = (low, middle) if self.touches(along(middle)) else (middle, high)
                found = along(high)
                self.at = along(high + LAG / length)
                return Place(*(found[axis] for axis in "XYZ"), contact=True)
        self.at = along(1)
        return Place(*(self.at[axis] for axis in "XYZ"), contact=False)


def carry_out(cycle, gap):
    """Drive a cycle on it."""
    try:
        line = next(cycle)
        while True:
            line = cycle.send(gap.carry_out(line))
    except StopIteration as end:
        assert not gap.crashed, gap.lines
        return end.value


@pytest.fixture(params=range(5))
def middle(request, rng):
    return rng.uniform(-20, 20), rng.uniform(-20, 20)


def test_a_hole(middle, rng):
    size = rng.uniform(8, 20)

    def distance(at):
        return size / 2 - math.hypot(at["X"] - middle[0], at["Y"] - middle[1]) - RADIUS

    free = size / 2 - RADIUS - 0.1
    start = (middle[0] + rng.uniform(-0.6, 0.6) * free, middle[1] + rng.uniform(-0.6, 0.6) * free)
    gap = Gap(distance, (*start, 0))
    found = carry_out(hole(Probe(radius=RADIUS, offset=OFFSET, reach=30, back=0.2)), gap)
    assert found.places == pytest.approx({"X": middle[0], "Y": middle[1]}, abs=5e-4)
    assert found.size == pytest.approx(size, abs=5e-4)
    assert (gap.at["X"], gap.at["Y"]) == pytest.approx(middle, abs=3e-3), "it stands in the middle"
    # With no offset known, the true diameter tells it, and the middle is free of it.
    blind = Probe(radius=RADIUS, reach=30, back=0.2)
    again = carry_out(hole(blind), Gap(distance, (*start, 0)))
    assert again.places == pytest.approx(found.places, abs=5e-4)
    assert again.offset(size, blind) == pytest.approx(OFFSET, abs=5e-4)


@pytest.mark.parametrize("lift", [0, 4])
@pytest.mark.parametrize("square", [False, True])
def test_a_boss(middle, rng, lift, square):
    size = rng.uniform(4, 20)

    def distance(at):
        x, y = abs(at["X"] - middle[0]), abs(at["Y"] - middle[1])
        if square:
            out = math.hypot(max(0, x - size / 2), max(0, y - size / 2))
            beside = out or max(x, y) - size / 2
        else:
            beside = math.hypot(x, y) - size / 2
        return beside - RADIUS if at["Z"] < 2 else 10

    off = (rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3))
    start = ((middle[0] + off[0], middle[1] + off[1], 3) if lift else
             (middle[0] - size / 2 - RADIUS - 0.5, middle[1] + off[1], 0))
    gap = Gap(distance, start)
    found = carry_out(boss(PROBE, size + rng.uniform(-0.1, 0.1), lift=lift), gap)
    assert found.places == pytest.approx({"X": middle[0], "Y": middle[1]}, abs=5e-4)
    assert found.size == pytest.approx(size, abs=5e-4)
    blind = Probe(radius=RADIUS, reach=30)
    again = carry_out(boss(blind, size, lift=lift), Gap(distance, start))
    assert again.offset(size, blind) == pytest.approx(OFFSET, abs=5e-4)


@pytest.mark.parametrize("x_way", [1, -1])
@pytest.mark.parametrize("y_way", [1, -1])
def test_a_corner(middle, x_way, y_way, rng):
    def distance(at):
        # The work is where both are positive.
        x, y = (at["X"] - middle[0]) * x_way, (at["Y"] - middle[1]) * y_way
        return math.hypot(max(0, -x), max(0, -y)) - RADIUS if min(x, y) < 0 else -RADIUS

    start = (middle[0] - x_way * (RADIUS + rng.uniform(0.3, 2)),
             middle[1] + y_way * rng.uniform(0.1, 1.9), 0)
    found = carry_out(corner(PROBE, x_way, y_way), Gap(distance, start))
    assert found.places == pytest.approx({"X": middle[0], "Y": middle[1]}, abs=1e-4)


@pytest.mark.parametrize(("axis", "way"), [(axis, way) for axis in "XYZ" for way in (1, -1)])
def test_an_edge(axis, way):
    def distance(at):
        return (7.5 - at[axis]) * way - (RADIUS if axis != "Z" else 0)

    start = [0.0, 0.0, 0.0]
    start["XYZ".index(axis)] = 7.5 - way * 5
    gap = Gap(distance, start)
    found = carry_out(edge(PROBE, axis, way), gap)
    assert found.places == pytest.approx({axis: 7.5}, abs=1e-5)
    assert ["F60" in line for line in gap.lines if "G38.2" in line] == [True, False]
    # The axis stands 0.4 mm before the touch, which is the radius and the offset from the surface.
    assert zero_lines(found, 2, gap.at) == ["G21", f"G10 L20 P2 {axis}{gap.at[axis] - 7.5:.4f}"]
    away = 0.4 + PROBE.before(axis) - LAG
    assert gap.at[axis] - 7.5 == pytest.approx(-way * away, abs=2e-4)


def test_a_slow_touch_without_contact_ends_it():
    cycle = edge(PROBE, "X", 1)
    next(cycle)
    for place in (Place(0, 0, 0, contact=True), None, None, None):
        cycle.send(place)
    with pytest.raises(TouchError, match="reported no contact for the slow touch of X"):
        cycle.send(Place(0, 0, 0, contact=False))


@pytest.mark.parametrize(("words", "said"), [
    ({"shape": "edge"}, '"" is no direction'),
    ({"shape": "edge", "toward": "X"}, '"X" is no direction'),
    ({"shape": "edge", "toward": "X+Y+"}, "an edge needs one direction"),
    ({"shape": "corner", "toward": "X+"}, "a corner needs one of X and one of Y"),
    ({"shape": "corner", "toward": "X+X-"}, '"X+X-" names an axis twice'),
    ({"shape": "boss"}, "a boss needs a size above 0"),
    ({"shape": "cave", "toward": "X+"}, 'there is no "cave" to touch'),
    ({"shape": "ring"}, 'there is no "ring" to touch; there are: edge, corner, hole, boss.'),
])
def test_what_is_missing_is_named(words, said):
    with pytest.raises(UsageError) as refused:
        cycle_of(words.pop("shape"), PROBE, **words)
    assert said in str(refused.value)


def test_directions():
    assert ways_of("x+y-") == {"X": 1, "Y": -1}


@pytest.mark.parametrize("wrong", [{"radius": -1}, {"offset": 1}, {"near": 0.5}, {"quick": 601},
                                   {"slow": 0}, {"reach": 0.1}])
def test_a_probe_that_cannot_be_is_refused(wrong):
    with pytest.raises(UsageError):
        Probe(**wrong)


def test_the_path_stands_at_place_and_following_error():
    told = {"MPos": "1.0000,-2.0000,0.5000", "Er": "5,0,-20"}
    assert stands(told) == pytest.approx({"X": 1.0005, "Y": -2, "Z": 0.498})


@pytest.mark.parametrize("damaged", [{"MPos": "1,2,3"}, {"MPos": "1,2,x", "Er": "0,0,0"},
                                     {"MPos": "1,2", "Er": "0,0"}, {}])
def test_a_damaged_report_tells_no_place(damaged):
    assert stands(damaged) is None


def test_a_zero_has_no_sign_and_only_axes_that_were_found():
    found = Found("hole", {"X": 1.00002, "Y": -3.0})
    assert zero_lines(found, 6, {"X": 1.0, "Y": -2.5, "Z": 9.0}) == [
        "G21", "G10 L20 P6 X0.0000 Y0.5000"]
    with pytest.raises(UsageError, match="a work offset is 1"):
        zero_lines(found, 7, {"X": 0.0, "Y": 0.0, "Z": 0.0})


class Reports:
    """A link that tells its states one after the other."""

    def __init__(self, *states):
        self.states = list(states)

    def status(self):
        return {"state": self.states.pop(0), "MPos": f"{len(self.states)},0,0", "Er": "0,0,0"}

    def poll(self, timeout_s):
        assert timeout_s > 0


def test_the_place_is_that_at_rest():
    assert await_rest(Reports("Run", "Hold", "Run", "Idle"))["X"] == 0
    with pytest.raises(TouchError, match="the state of the controller is Alarm"):
        await_rest(Reports("Run", "Alarm", "Idle"))


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -3.0, 0.0, 1e9])
def test_a_known_diameter_is_a_length(number):
    with pytest.raises(UsageError, match="the true diameter must be above 0"):
        check_known("hole", number)


def test_only_a_hole_or_boss_has_a_known_diameter():
    check_known("edge", None)
    check_known("boss", 3.0)
    with pytest.raises(UsageError, match="calibrated by a hole or a boss"):
        check_known("edge", 3.0)


@pytest.mark.parametrize("name", ["size", "lift", "along", "radius", "offset", "reach"])
@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf"), -3.0])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_number_that_is_none_is_refused_before_a_cycle_begins(shape, name, number):
    own = {name: number} if name in vars(PROBE) else {}
    words = {"size": 5.0, "lift": 2.0, "toward": "X+Y+" if shape == "corner" else "X+"}
    with pytest.raises(UsageError):
        cycle_of(shape, Probe(**own), **(words if own else words | {name: number}))


def test_a_corner_that_is_too_far_off_is_refused_before_it_begins():
    with pytest.raises(UsageError, match="near < back <= reach <= 1000"):
        cycle_of("corner", PROBE, toward="X+Y+", along=999.9)
