# SPDX-License-Identifier: Apache-2.0
"""The firmware's pieces of arcs, against the gateware's recurrence and the curve."""

import math
from itertools import pairwise

import pytest

from testbench.firmware import Arc, Move
from testbench.models.arc import FINE, Curve

AXES = ((0, 1), (2, 0), (1, 2))     # of the planes XY, ZX, YZ
LARGEST = 10_500_000                # radius, pulses: 1.05 m
TOLERANCE = 20                      # of the two radii, pulses

HALF = 0.5
EXACT = 1e-9        # of the model's own arithmetic, at a radius of some thousand pulses
# Addition to half a pulse for a radius that changes, by rounding of the end or in the strongest
# allowed spiral: see softcore/firmware/path/arc.h. The same in a chain.
LEANING, CHAINED, CHAINED_SPIRAL = 0.0005, 0.001, 0.005


def helix(plane, delta, third):
    """Travel of all three axes."""
    travel = [0, 0, 0]
    first, second = AXES[plane]
    travel[first], travel[second] = delta
    travel[3 - first - second] = third
    return travel


class Job:
    """An arc, and its pieces by the firmware."""

    def __init__(self, delta, centre, *, ccw=True, plane=0, third=0):
        self.axes = AXES[plane]
        self.travel = helix(plane, delta, third)
        self.curve = Curve(delta, centre, ccw=ccw)
        self.arc = Arc(Move((*self.travel,), True, ccw, plane, tuple(centre)))
        self.said = f"{delta} {centre} ccw={ccw} plane={plane} third={third}"

    def pieces(self):
        """Yield number, path pulses before it, place before it, and the piece; check the joints."""
        place, count = [0, 0, 0], 0
        for index in range(self.arc.pieces):
            before, piece = self.arc.piece(index)
            assert before == count, self.said
            yield index, before, tuple(place), piece
            count += piece.length
            place = [a + b for a, b in zip(place, piece.travel, strict=True)]
        assert count == self.arc.length, self.said
        assert place == self.travel, self.said

    def in_plane(self, place):
        """Coordinates in the plane."""
        return tuple(place[axis] for axis in self.axes)


def random_arc(rng, least, most, *, spiral):
    """Draw an arc, some of them full circles or ending at an octant; ``spiral``: uneven radii."""
    while True:
        radius = math.exp(rng.uniform(math.log(least), math.log(most)))
        angle = rng.choice([rng.uniform(0, math.tau),
                            rng.randrange(8) * math.pi / 4 + rng.choice([0, 0.001, -0.001])])
        centre = [round(radius * FINE * math.cos(angle)), round(radius * FINE * math.sin(angle))]
        if rng.random() < 0.3:
            centre = [value // FINE * FINE for value in centre]
        sweep = rng.choice([rng.uniform(0, math.tau), rng.uniform(0, 10 / radius),
                            rng.randrange(1, 9) * math.pi / 4 + rng.choice([0, 1, -1]) / radius,
                            math.exp(rng.uniform(-math.log(radius), math.log(math.tau)))])
        most_off = min(TOLERANCE, radius * sweep / 16)
        end = radius + (rng.uniform(-most_off, most_off) if spiral else 0)
        delta = [round(value / FINE + end * turned) for value, turned in zip(
            centre, (math.cos(angle + math.pi + sweep), math.sin(angle + math.pi + sweep)),
            strict=True)]
        if rng.random() < 0.15:
            delta = [0, 0]
        ccw = rng.random() < 0.5
        if not ccw:
            centre[1], delta[1] = -centre[1], -delta[1]
        if math.hypot(*centre) < FINE or (delta == [0, 0] and sweep < 1):
            continue
        curve = Curve(delta, centre, ccw=ccw)
        off = abs(curve.end_radius - curve.start_radius)
        if curve.end_radius >= 1 and off <= min(TOLERANCE, curve.length / 16):
            return {"delta": delta, "centre": centre, "ccw": ccw, "plane": rng.randrange(3)}


def check_words(piece, said):
    """Check the assumptions of the gateware."""
    assert piece.length >= 1, said
    if not piece.arc:
        assert all(abs(steps) <= piece.length for steps in piece.travel), said
        return
    steps, whole = abs(piece.travel[piece.major]), piece.length << piece.shift
    assert steps <= piece.length, said
    assert piece.shift <= 15, said
    assert whole < 1 << 30, said
    paces = [piece.start[0] + count * piece.change for count in (0, piece.length - 1)]
    assert sum(paces) * piece.length == 2 * steps * whole, said
    assert paces[1] + piece.change == piece.end[0], said
    assert min(*paces, piece.end[0]) >= 0, said
    assert max(*paces, piece.end[0]) <= whole, said


def check_walk(job, index, before, start, piece):
    """Walk a piece both ways, pulse by pulse; check the greatest distance from the curve."""
    worst, trail = 0, [(0, 0, 0)]
    near = before * job.curve.sweep / job.arc.length
    turn = job.curve.sweep / job.arc.length
    bound = job.curve.bound(piece, job.axes, start, near, turn) + EXACT
    for steps in piece.walk():
        at = job.in_plane([a + b for a, b in zip(start, steps, strict=True)])
        assert max(abs(a - b) for a, b in zip(steps, trail[-1], strict=True)) <= 1, job.said
        trail.append(steps)
        near = job.curve.swept(at, near + job.curve.sweep / job.arc.length)
        worst = max(worst, job.curve.distance(at, near))
    assert worst <= bound, f"{job.said} piece {index}: {worst}, not {bound}"
    assert trail[-1] == piece.travel, f"{job.said} piece {index}"
    for axis in range(3):
        signs = {b[axis] - a[axis] for a, b in pairwise(trail)}
        assert len(signs - {0}) <= 1, "an axis turns round within a piece"
    if piece.arc:
        ahead, back = piece.enter(), piece.enter(back=True)
        for _ in range(piece.length):
            piece.forward(ahead)
        assert (ahead.remainder, ahead.pace, ahead.error, ahead.along, ahead.across) == (
            0, *piece.end), f"{job.said} piece {index}"
        for count in reversed(range(piece.length)):
            piece.backward(back)
            assert all(back.steps[axis] == trail[count][axis]
                       for axis in (piece.major, piece.minor)), f"{job.said} piece {index}"
        assert (back.remainder, back.pace, back.error, back.along, back.across) == (
            0, *piece.start), f"{job.said} piece {index}"
    return worst


SIZES = [(1, 32, 400), (32, 100, 300), (100, 400, 150), (400, 3000, 40)]


@pytest.mark.parametrize("spiral", [False, True], ids=["circle", "spiral"])
@pytest.mark.parametrize(("least", "most", "count"), SIZES)
def test_every_pulse_is_within_half_a_pulse_of_the_curve(rng, cases, least, most, count, spiral):
    """Both ways, to the last bit of a slot's words; single steps, and no axis turns round."""
    worst = 0
    for _ in range(cases(count)):
        third = rng.choice([0, 0, rng.randint(-30, 30), rng.randint(-3000, 3000)])
        job = Job(**random_arc(rng, least, most, spiral=spiral), third=third)
        for index, before, start, piece in job.pieces():
            check_words(piece, job.said)
            worst = max(worst, check_walk(job, index, before, start, piece))
    chained = CHAINED_SPIRAL if spiral else CHAINED
    assert worst <= HALF + (chained if most <= 32 else LEANING), worst


def strong_spiral(rng, least, most):
    """Draw the strongest spiral that the interpreter allows, across a place where an axis turns."""
    while True:
        radius = math.exp(rng.uniform(math.log(least), math.log(most)))
        angle = rng.randrange(4) * math.pi / 2 + rng.uniform(-0.5, 0.05)
        sweep = min(rng.uniform(0.1, 3.1), 16 * TOLERANCE / radius)
        end = radius + rng.uniform(-1, 1) * min(TOLERANCE, radius * math.sin(sweep / 2) / 8)
        centre = [round(radius * FINE * math.cos(angle)), round(radius * FINE * math.sin(angle))]
        delta = [round(value / FINE + end * turned) for value, turned in zip(
            centre, (math.cos(angle + math.pi + sweep), math.sin(angle + math.pi + sweep)),
            strict=True)]
        curve = Curve(delta, centre, ccw=True)
        off = abs(curve.end_radius - curve.start_radius)
        if (min(curve.start_radius, curve.end_radius) >= least
                and 0 < off <= min(TOLERANCE, math.hypot(*delta) / 16)):
            return {"delta": delta, "centre": centre}


def test_a_spiral_leaves_half_a_pulse_by_no_more_than_rounding(rng, cases):
    """By the words of its pieces, wherever the places may lie."""
    for _ in range(cases(250)):
        job = Job(**strong_spiral(rng, 32, 300))
        turn = job.curve.sweep / job.arc.length
        for index, before, start, piece in job.pieces():
            check_words(piece, job.said)
            bound = job.curve.bound(piece, job.axes, start, before * turn, turn)
            assert bound <= HALF + LEANING, f"{job.said} piece {index}: {bound}"


def test_large_arcs_by_pieces(rng, cases):
    """Of a large one the ends of all pieces are checked, and a few short pieces walked."""
    for _ in range(cases(60)):
        job = Job(**random_arc(rng, 3000, LARGEST, spiral=rng.random() < 0.5))
        near = 0
        for index, before, start, piece in job.pieces():
            check_words(piece, job.said)
            assert piece.length <= 1 << 20
            if piece.length < 3000:
                check_walk(job, index, before, start, piece)
            near = job.curve.swept(job.in_plane(start), before * job.curve.sweep / job.arc.length)
            assert job.curve.distance(job.in_plane(start), near) <= HALF + 0.001, job.said
            assert job.curve.length_to(near) == pytest.approx(before, abs=1.3), job.said
        assert job.arc.length == pytest.approx(job.curve.length, abs=0.51)


def pace_place(job, before, start, piece, count):
    """Length of the arc after ``count`` pulses of a piece.

    The major axis runs as evenly as its pace: the step that is under way counts by its part.
    """
    axis = job.axes.index(piece.major)
    whole = piece.length << piece.shift
    made = (count * piece.start[0] + piece.change * (count * (count - 1) // 2)) / whole
    sign = -1 if piece.travel[piece.major] < 0 else 1
    near = (before + count) * job.curve.sweep / job.arc.length
    swept = job.curve.at_major(axis, start[piece.major] + sign * made, near)
    return job.curve.length_to(swept)


def speed_off(job):
    """Greatest error of the arc length of 100 path pulses, in pulses.

    The length is computed from the major axis' pace, so that the raster of pulses has no effect.
    Where the axes exchange their roles the raster has one, so the window ends there. A chain of
    single steps, below a radius of 32 pulses, has no such pace.
    """
    worst = 0
    runs, last = [[]], None
    for _, before, start, piece in job.pieces():
        if (last is not None and piece.major != last) or len(runs[-1]) > 3000:
            runs.append([])
        last = piece.major
        # Of a long piece both ends and the middle.
        counts = range(piece.length + 1)
        if piece.length > 900:
            counts = [*range(300), *range(piece.length - 300, piece.length + 1)]
        for count in counts:
            runs[-1].append((before + count, pace_place(job, before, start, piece, count)))
    for run in runs:
        by_pulse = dict(run)
        for pulse, length in run:
            if pulse + 100 in by_pulse:
                worst = max(worst, abs(by_pulse[pulse + 100] - length - 100))
    return worst


@pytest.mark.parametrize(("least", "most", "count"), [(40, 1_000_000, 150), (64, 400, 60)])
def test_speed_along_the_arc_is_true(rng, cases, least, most, count):
    """Over 100 path pulses the way along the arc is 100 pulses to 1 %."""
    worst = 0
    for _ in range(cases(count)):
        job = Job(**random_arc(rng, least, most, spiral=rng.random() < 0.3))
        off = speed_off(job)
        worst = max(worst, off)
        assert off <= 1.0, f"{job.said}: {off}"
    assert worst > 0.1, "nothing was measured"


@pytest.mark.parametrize(("delta", "centre", "ccw"), [
    ((26, 147), (-10496, 6976), False), ((0, 0), (11173, -5377), True),
    ((0, 0), (-6, -5775), False), ((38, 8), (2112, -3840), True), ((124, -22), (4095, 0), False),
    ((-22, 88), (-17613, -18), False), ((0, 0), (-24838, -19609), False),
    ((-58, 18), (0, 6596), True), ((-1512, -1081), (-43007, -42921), True),
])
def test_speed_where_path_lengths_are_halves(delta, centre, ccw):
    """Arcs whose curve passes places about half a path pulse from a whole one again and again."""
    assert speed_off(Job(delta, centre, ccw=ccw)) <= 1.0


def test_pieces_do_not_depend_on_the_order_of_asking(rng, cases):
    """The way back regenerates the very pieces of the way forward."""
    for _ in range(cases(30)):
        move = random_arc(rng, 1, 100_000, spiral=True)
        forward = Job(**move).arc
        pieces = [forward.piece(index) for index in range(forward.pieces)]
        again = Job(**move).arc
        assert [again.piece(index) for index in reversed(range(again.pieces))] == pieces[::-1]
        for _ in range(20):
            index = rng.randrange(len(pieces))
            assert again.piece(index) == pieces[index]


@pytest.mark.parametrize(("delta", "centre", "ccw"), [
    ((1, 0), (32, 640_000), True),              # shorter than the space between two steps
    ((1, 1), (0, 64), True),                    # a quarter of the smallest circle
    ((0, 0), (64, 0), False), ((0, 0), (45, 45), True),
    ((2, 0), (64, 0), False),
    ((0, 0), (0, -FINE * LARGEST), True),
    ((LARGEST, LARGEST), (FINE * LARGEST, 0), False),
])
@pytest.mark.parametrize("third", [0, 1, -7, 100_000])
def test_smallest_and_largest(delta, centre, ccw, third):
    job = Job(delta, centre, ccw=ccw, third=third)
    length = math.hypot(job.curve.length, third)
    assert job.arc.length == pytest.approx(length, abs=1.01)
    for index, before, start, piece in job.pieces():
        check_words(piece, job.said)
        if piece.length < 30_000:
            check_walk(job, index, before, start, piece)


def test_helix_spreads_its_third_axis_evenly(rng, cases):
    for _ in range(cases(50)):
        third = rng.choice([-1, 1]) * rng.randint(1, 100_000)
        job = Job(**random_arc(rng, 20, 10_000, spiral=False), third=third)
        assert job.arc.length >= abs(third)
        axis = 3 - sum(job.axes)
        pulse = third / job.arc.length
        for _, before, start, piece in job.pieces():
            assert abs(start[axis] - pulse * before) <= 0.5
            # Between two borders it is a line whose ends are so far off.
            for count, steps in enumerate(piece.walk(), before + 1):
                assert abs(start[axis] + steps[axis] - pulse * count) <= 1 + EXACT


# Error of a tangent, 2**-15: the rounding of its two factors and their product, and of the slope.
TANGENT = 4


def test_tangents_are_those_of_the_ends(rng, cases):
    """Also of arcs of a few pulses, whose length has no more bits than those behind the point."""
    for _ in range(cases(300)):
        third = rng.choice([0, rng.randint(-12, 12), rng.randint(-1000, 1000)])
        least, most = rng.choice([(16, 200), (16, 100_000)])
        job = Job(**random_arc(rng, least, most, spiral=True), third=third)
        size = math.hypot(job.curve.length, third)
        for direction, swept in zip(job.arc.directions, (0, job.curve.sweep), strict=True):
            plane = [part * job.curve.length / size for part in job.curve.tangent(swept)]
            wanted = helix(AXES.index(job.axes), plane, third / size)
            assert direction == pytest.approx([part * 2**15 for part in wanted],
                                              abs=TANGENT), job.said


def test_preparation_is_cut_into_steps():
    assert Job((0, 0), (64 * 1000, 0)).arc.steps >= 8
    assert Job((0, 0), (64 * 10, 0)).arc.steps >= 50, "a step of a chain each"
