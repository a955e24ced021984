# SPDX-License-Identifier: Apache-2.0
"""The firmware's wire offset against the model, and against its purpose: no point too near."""

import cmath
from itertools import pairwise
from math import pi

import pytest

from testbench import programs
from testbench.firmware import Checker, Fault
from testbench.models.wire_offset import JOINED, Element, NoOffsetError, beside

MM = 10_000
PLANES = {17: "XYIJ", 18: "ZXKI", 19: "YZJK"}


@pytest.fixture(scope="module")
def checker():
    return Checker()


def motions(checker, *blocks):
    return checker.motions(programs.punched(["G10 D1 R.1", "F100", *blocks, "M02"]))


def elements(found, plane=17):
    """Motions as elements, from the origin."""
    first, second = {17: (0, 1), 18: (2, 0), 19: (1, 2)}[plane]
    at, result = 0j, []
    for motion in found:
        end = at + complex(motion.delta[first], motion.delta[second])
        away = complex(*motion.centre) / 64
        result.append(Element(at, end, motion.arc, at + away, abs(away)))
        at = end
    return result


def contour(rng, *, calm):
    """A closed contour of lines and arcs as elements on whole micrometres, clockwise or not."""
    count = rng.randint(3, 8)
    turn = rng.choice((1, -1))
    angles = sorted(rng.uniform(0, 0.6) + k for k in range(count))
    corners = [rng.uniform(60_000, 120_000) * cmath.exp(turn * 2j * pi * a / count) for a in angles]
    corners = [complex(round(c.real, -1), round(c.imag, -1)) for c in corners]
    path = []
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        chord = end - start
        if rng.random() < 0.5 or (calm and not path):
            path.append(Element(start, end))
            continue
        away = rng.uniform(1.5, 9) if calm else rng.uniform(0, 5)
        away *= rng.choice((-1, 1)) * abs(chord)
        centre = (start + end) / 2 + 1j * chord / abs(chord) * away
        bulge = rng.choice((-1, 1)) if not calm else (1 if away > 0 else -1)
        path.append(Element(start, end, bulge, centre, abs(start - centre)))
    return path


def program(path, offset, side, plane=17):
    """Blocks along a path with a wire offset: in from the origin, and out again."""
    a, b, i, j = PLANES[plane]

    def point(p):
        return f"{a}{p.real / MM:.7f}{b}{p.imag / MM:.7f}"

    blocks = [f"G10 D1 R{offset / MM:.4f}", f"G{plane}", "F100",
              f"G{41 if side > 0 else 42} D1 G01 {point(path[0].start)}"]
    for element in path:
        if element.turn:
            away = element.centre - element.start
            blocks.append(f"G{2 if element.turn < 0 else 3} {point(element.end)}"
                          f"{i}{away.real / MM:.7f}{j}{away.imag / MM:.7f}")
        else:
            blocks.append(f"G01 {point(element.end)}")
    return [*blocks, "G40 G01 X0 Y0 Z0", "M02"]


def on_the_edge(path, offset, side):
    """Whether the ends at a corner are so far apart that rounding decides the case."""
    for before, after in pairwise(path):
        gap = before.tangent(before.end) - after.tangent(after.start)
        largest = max(abs(gap.real), abs(gap.imag)) * offset
        if abs(largest - JOINED) < 0.1:
            return True
    return False


def compared(checker, path, offset, side, plane=17):
    """Compare the motions with the model: both have some, or neither; return the motions."""
    if on_the_edge(path, offset, side):
        return True, None
    result = checker.motions(programs.punched(program(path, offset, side, plane)))
    try:
        expected = beside(path, offset, side)
    except NoOffsetError:
        expected = None
    if isinstance(result, Fault):
        assert result.name == "corner", result
        return expected is None, None
    if expected is None:
        return False, None
    made = elements(result, plane)[1:-1]
    assert len(made) == len(expected)
    for number, (mine, model) in enumerate(zip(made, expected, strict=True)):
        blur = 1.5
        if number + 1 < len(expected):
            # Where two paths cross at a small angle the last place of a centre moves the point.
            after = expected[number + 1]
            blur += 0.1 / max(1e-9, abs((model.tangent(model.end).conjugate()
                                          * after.tangent(after.start)).imag))
        assert abs(mine.end - model.end) < blur
        assert mine.turn == model.turn
        assert not mine.turn or abs(mine.centre - model.centre) < 0.1
        # The ends being right, this tells an arc from the same with a turn more or less.
        assert not mine.turn or abs(mine.length - model.length) < min(3 * model.radius, 20) + 2
    return True, made


def test_paths_are_those_of_the_model(checker, rng):
    right, alike, count = 0, 0, 400
    for _ in range(count):
        path = contour(rng, calm=False)
        offset = rng.choice((1, 7, 100, 1000, 1250, 5000, 20_000))
        agrees, made = compared(checker, path, offset, rng.choice((1, -1)), rng.choice((*PLANES,)))
        right += made is not None
        alike += agrees
    assert right > count // 4
    assert alike == count


def test_no_point_is_nearer_than_the_offset(checker, rng):
    """Closed contours that begin on a straight, with features larger than the wire."""
    right = 0
    for _ in range(150):
        path = contour(rng, calm=True)
        first, *rest = path
        middle = (first.start + first.end) / 2
        middle = complex(round(middle.real, -1), round(middle.imag, -1))
        path = [Element(middle, first.end), *rest, Element(first.start, middle)]
        offset = rng.choice((10, 300, 1250, 2000))
        agrees, made = compared(checker, path, offset, rng.choice((1, -1)))
        assert agrees
        if not made:
            continue
        right += 1
        for mine in made:
            for part in range(21):
                point = mine.at(mine.length * part / 20) if part < 20 else mine.end
                distance = min(element.distance(point) for element in path)
                assert distance >= offset - 1
                assert mine.turn or distance <= 6 * offset
    assert right > 100


def test_cusps_are_inside_or_outside_by_their_bends(checker, rng):
    """Back beside the move before: the angle is mere rounding."""
    made = {True: 0, False: 0}
    for _ in range(200):
        ahead = cmath.exp(2j * pi * rng.random())
        corner = complex(rng.randint(-50, 50), rng.randint(-50, 50)) * 1000
        path, bends = [], 0.0
        for back in (True, False):
            if back and rng.random() < 0.4:
                start = corner - ahead * rng.uniform(20_000, 50_000)
                path.append(Element(complex(round(start.real), round(start.imag)), corner))
                continue
            turn, radius = rng.choice((1, -1)), rng.uniform(10_000, 60_000)
            away = (1j if back else -1j) * turn * ahead * radius
            swept = turn * rng.uniform(1.5, 3)
            other = corner + away - away * cmath.exp(-1j * swept if back else 1j * swept)
            other = complex(round(other.real), round(other.imag))
            chord = corner - other
            side = 1j * chord / abs(chord) * (radius**2 - abs(chord)**2 / 4) ** 0.5
            middle = (corner + other) / 2
            centre = min((middle + side, middle - side), key=lambda c: abs(c - corner - away))
            centre = complex(round(centre.real * 64), round(centre.imag * 64)) / 64
            ends = (other, corner) if back else (corner, other)
            path.append(Element(*ends, turn, centre, abs(centre - corner)))
            bends += turn / radius
        if abs(bends) < 1e-6:
            continue
        side = rng.choice((1, -1))
        agrees, motion = compared(checker, path, rng.choice((100, 1250, 2000)), side)
        assert agrees
        if motion:
            assert (len(motion) == 3) == (bends * side > 0), "round it outside alone"
            made[bends * side > 0] += 1
    assert min(made.values()) > 50


def test_most_of_a_turn_stays_it_however_near_its_ends_come(checker, rng):
    for _ in range(400):
        left, angle = rng.uniform(4.5, 60), rng.uniform(5.5, 6.28)
        radius, begin = 1234 + left, rng.uniform(0, 2 * pi)
        centre = 20_000 + 5000j
        ends = [centre + cmath.rect(radius, begin + part) for part in (0, angle)]
        start, end = (complex(round(p.real), round(p.imag)) for p in ends)
        tangents = [cmath.rect(5000, begin + part + pi / 2) for part in (0, angle)]
        path = [Element(start - tangents[0], start),
                Element(start, end, 1, centre, abs(centre - start)),
                Element(end, end + tangents[1])]
        arc, = (made for made in elements(checker.motions(programs.punched(
            program(path, 1234, 1)))) if made.turn and abs(made.centre - centre) < 1)
        assert 0.8 * left * angle < arc.length < 1.25 * left * angle


@pytest.mark.parametrize(("offset", "turn"), [(1, 0), (2, 0), (3, 0), (4, 1), (5, 1)])
def test_a_corner_is_rounded_by_an_arc_that_whole_pulses_still_make(checker, rng, offset, turn):
    count = 0
    while count < 30:
        ahead = 20_000 * cmath.exp(2j * pi * rng.random())
        ends = [10_000j, 10_000j + ahead]
        ends.append(ends[-1] + ahead * cmath.exp(1j * rng.uniform(1.6, 3)))
        ends = [complex(round(end.real), round(end.imag)) for end in ends]
        _, made = compared(checker, [Element(*pair) for pair in pairwise(ends)], offset, -1)
        if made:    # not just where the last place decides
            assert [element.turn for element in made] == [0, turn, 0]
            count += 1


@pytest.mark.parametrize("back", ["R3", "R2.9995", "R3.0005", "I-1.5 J-2.598", "I-1.501 J-2.598"])
def test_way_back_along_an_arc_is_round_its_end(checker, back):
    for side in (41, 42):
        made = motions(checker, f"G{side} D1 G01 X3 Y0", "G03 X1.5 Y2.598 R3", f"G02 X3 Y0 {back}",
                       "G40 G01 X5")
        assert [(motion.line, motion.arc) for motion in made] == [
            (4, 0), (5, 1), (6, -1 if side == 41 else 1), (6, -1), (7, 0)]


@pytest.mark.parametrize(("side", "turn"), [(41, -1), (42, 1)])
def test_way_back_along_a_line_is_round_its_end(checker, side, turn):
    made = motions(checker, f"G{side} D1 G01 X1", "X3", "X2", "G40 Y1")
    assert not isinstance(made, Fault), made
    assert [(motion.line, motion.arc) for motion in made] == [
        (4, 0), (5, 0), (6, turn), (6, 0), (7, 0)]


def test_circle_is_gone_round_whatever_the_last_place_of_the_line_before(checker, rng):
    """With whole micrometres a line is tangent to a circle up to a small angle."""
    for _ in range(200):
        ahead, turn = cmath.exp(2j * pi * rng.random()), rng.choice((1, -1))
        side, offset = rng.choice((1, -1)), rng.choice((1000, 1250, 2000))
        way = ahead * rng.choice((1000, 3000, 10_000))
        at = 30_000 * cmath.exp(2j * pi * rng.random())
        away = 1j * ahead * turn * rng.choice((3000, 10_000, 50_000))
        start, corner, end, centre = (complex(round(p.real, -1), round(p.imag, -1))
                                      for p in (at - way, at, at + way, at + away))
        radius = abs(centre - corner)
        path = [Element(start, corner), Element(corner, corner, turn, centre, radius),
                Element(corner, end)]
        made = elements(checker.motions(programs.punched(program(path, offset, side))))
        arcs = [arc for arc in made if arc.turn and abs(arc.centre - centre) < 1]
        whole = 2 * pi * (radius - side * turn * offset)
        assert sum(arc.length for arc in arcs) == pytest.approx(whole, rel=0.02)


@pytest.mark.parametrize("side", [41, 42])
def test_circle_stays_a_circle(checker, side):
    result = motions(checker, f"G{side} D1 G01 X1", "G02 I5", "G40 G01 X0")
    assert [tuple(motion.delta) for motion in result][1] == (0, 0, 0)
    radius = 51_000 if side == 41 else 49_000
    assert tuple(result[1].centre) == (64 * radius, 0)


def test_third_axis_goes_as_programmed(checker):
    result = motions(checker, "G42 D1 G01 X1", "G03 X0 Y1 I-1 Z2", "G01 Z1", "X-1 Z.5", "G40 X0")
    assert [motion.delta[2] for motion in result] == [0, 20_000, -10_000, -5_000, 0]
    at = elements(result)
    assert at[0].end == 11_000
    assert at[1].end == at[2].end == at[3].start == 11_000j


def test_offset_of_nothing_changes_nothing(checker):
    blocks = ["D0 G01 X1", "Y1", "G03 X2 Y2 R1", "G01 X1", "X3", "G02 I1"]
    plain = motions(checker, *[block.replace("D0 ", "") for block in blocks], "G01 X0")
    for side in (41, 42):
        offset = motions(checker, f"G{side} {blocks[0]}", *blocks[1:], "G40 G01 X0")
        assert [(*m.delta, m.arc, *m.centre) for m in offset] == [
            (*m.delta, m.arc, *m.centre) for m in plain]


def test_outside_of_a_corner_is_an_arc_at_the_lower_speed(checker):
    result = motions(checker, "G42 D1 G01 X1", "X2 F50", "Y1 F70", "X0 F20", "G40 X-1")
    assert [(m.arc, m.speed) for m in result] == [
        (0, 100_000), (0, 50_000), (1, 50_000), (0, 70_000), (1, 20_000), (0, 20_000), (0, 20_000)]


ROUND = ["G41 D1 G01 X1", "Y1"]


@pytest.mark.parametrize(("blocks", "line", "words"), [
    ([*ROUND, "G40", "G91", "M02"], 7, "two blocks in a row"),
    ([*ROUND, "M08", "Z1", "X2"], 7, "two blocks in a row"),
    ([*ROUND], 6, "ends under a wire offset"),
    ([*ROUND, "X2 M02"], 6, "ends under a wire offset"),
    (["G41 D1 G02 X1 I.5"], 4, "must begin with a line"),
    ([*ROUND, "G40 G02 X2 R1"], 6, "must end with a line"),
    (["G41 D1 G01 X1", "G40 X2"], 5, "no motion beside the path"),
    ([*ROUND, "G40", "G42 X2"], 7, "begins before the one before"),
    ([*ROUND, "G42 X2"], 6, "there must be G40"),
    ([*ROUND, "G10 D1 R.2", "X2"], 6, "D1 is in force and cannot change before G40"),
    ([*ROUND, "G18 X2"], 6, "plane cannot change"),
    ([*ROUND, "G40", "G18 X2"], 7, "the plane changes"),
    (["G41 D1 G01 X1", "G03 X.8 I-.1"], 5, "0.1000 mm does not fit into the arc's radius of 0.10"),
    (["G41 D1 G01 X1", "G03 X1.2006 I.1003"], 5, "does not fit into the arc's radius of 0.1003 mm"),
    (["G41 D1 G01 X1", "X1.05", "Y1", "G40 X0"], 5, "leaves nothing of this move"),
    (["G41 D1 G01 X1", "X3", "X1 Y.01", "G40 X0"], 5, "leaves nothing of this move"),
    (["G41 D1 G01 X1", "X3", "G03 X2.89 Y.11 I-.11"], 6, "of 0.1000 mm do not meet"),
    (["G41 D1 G01 X-1", "X0", "G03 X.0095 Y.001 R10", "G01 X.989 Y.2036", "G40 Y5"], 6,
     "leaves nothing of this move"),
])
def test_what_cannot_be_offset_is_refused(checker, blocks, line, words):
    result = motions(checker, *blocks)
    assert isinstance(result, Fault)
    assert result.sentence.startswith(f"Block {line}")
    assert words in result.sentence


def test_an_offset_in_force_may_be_entered_again_and_others_changed(checker):
    between = ["G10 D1 R.1", "G10 D2 R.3"]
    for block in between:
        result = motions(checker, *ROUND, block, "X2", "G40 X0")
        assert result[3].delta[:2] == [10_000, 0], result


def test_travel_holds_beside_the_path(checker):
    end = 26843.5
    right = motions(checker, f"G42 D1 G01 X{end}", "Y1", "G40 X0")
    assert isinstance(right, Fault)
    assert (right.name, right.line) == ("travel", 4)
    assert "beside the path the travel of X" in right.sentence
    assert not isinstance(motions(checker, f"G41 D1 G01 X{end}", "Y1", "G40 X0"), Fault)
    corner = motions(checker, f"G42 D1 G01 X{end - 0.09} Y5", "X26843.49", "Y8", "G40 X0")
    assert (corner.name, corner.line) == ("travel", 6)
