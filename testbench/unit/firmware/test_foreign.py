# SPDX-License-Identifier: Apache-2.0
"""Programs as other controls and CAM posts write them: their meaning here, or their refusal."""

import math

import pytest

from testbench.firmware import Checker, Fault
from testbench.programs import punched


@pytest.fixture(scope="module")
def checker():
    return Checker()


def taken(checker, *blocks):
    """Records of a program without a fault, but for that of its end."""
    result = checker.check(punched([*blocks, "M02"]))
    assert not isinstance(result, Fault), result.sentence
    return result[:-1]


def refused(checker, *blocks):
    """The fault in the last of some blocks."""
    result = checker.check(punched([*blocks, "M02"]))
    assert isinstance(result, Fault), "all of it was taken"
    assert result.line == len(blocks) + 1, result.sentence
    return result


@pytest.mark.parametrize("head", [
    "G17 G21 G40 G49 G54 G80", "G64 P0.01", "G64", "G61 G90 G94 G98", "G99", "G80 G00 X0",
    "O1000", "O0100 G90",
])
def test_what_changes_nothing_here_is_taken(checker, head):
    records = taken(checker, head, "G00 X1 Y2", "G01 X3 F5")
    assert [(tuple(r.delta), r.speed, r.act) for r in records if r.moves] == [
        ((10_000, 20_000, 0), 1_800_000, 0), ((20_000, 0, 0), 5000, 0)]


def test_g80_ends_the_mode_of_motion(checker):
    assert refused(checker, "G00 X1", "G80", "X2").name == "mode"


def test_g53_counts_from_the_machines_zero(checker):
    moves = taken(checker, "G10 L2 P1 X10", "G92 X0", "G53 G00 X1 Y1", "G20 G53 X1", "G21 X1")[2:]
    assert [tuple(r.delta) for r in moves] == [
        (10_000, 10_000, 0), (244_000, 0, 0), (-244_000, 0, 0)]


@pytest.mark.parametrize(("blocks", "needs"), [
    (("G91 G53 G00 X1",), "G90"), (("G53 X1",), "G00 or G01"),
    (("G02 G53 X1 I1 F5",), "G00 or G01"), (("G41 D0 G00 G53 X1",), "G40"),
])
def test_g53_says_what_it_needs(checker, blocks, needs):
    assert refused(checker, *blocks).sentence.endswith(f"G53 needs {needs}.")


def test_g28_goes_over_a_point_in_the_axes_named_alone(checker):
    records = taken(checker, "G00 X5 Y6 Z7", "G28.1", "X50 Y60 Z70", "G91 G28 Z-10.",
                    "G90 G00 X50 Y60 Z70", "G28", "G28 X5", "G30.1", "G00 X1", "G30 X2 Y2")
    assert [(tuple(r.via), tuple(r.delta)) for r in records if any(r.delta)] == [
        ((0, 0, 0), (50_000, 60_000, 70_000)), ((0, 0, 0), (450_000, 540_000, 630_000)),
        ((0, 0, -100_000), (0, 0, -530_000)), ((0, 0, 0), (0, 0, 630_000)),
        ((0, 0, 0), (-450_000, -540_000, -630_000)), ((0, 0, 0), (-40_000, 0, 0)),
        ((10_000, -40_000, 0), (30_000, 40_000, 0))]
    assert all(r.speed == 1_800_000 for r in records if any(r.via))


def test_a_point_that_is_the_place_itself_is_one_move(checker):
    move = taken(checker, "G28.1", "G91 G28 X3")[1]
    assert (tuple(move.via), tuple(move.delta)) == ((30_000, 0, 0), (-30_000, 0, 0))
    move = taken(checker, "G00 X3", "G28.1", "G00 X1", "G28 X3")[3]
    assert (tuple(move.via), tuple(move.delta)) == ((0, 0, 0), (20_000, 0, 0))


@pytest.mark.parametrize(("blocks", "said"), [
    (("G28",), "G28 has no place to go to; go there once and store it by G28.1."),
    (("G28.1", "G30 X1"), "G30 has no place to go to; go there once and store it by G30.1."),
    (("G28.1", "G41 D0", "G28"), "G28 needs G40."),
    (("G28.1", "G00 G28 X1",), "G0 and G28 exclude each other."),
    (("G28.1", "G53 G28 X1",), "G53 and G28 exclude each other."),
    (("G28.1 X1",), "the word X has no meaning in this block."),
    (("G28.1", "G28 X26844"), "the distance X is out of range."),
])
def test_why_a_place_cannot_be_gone_to_is_said(checker, blocks, said):
    assert said in refused(checker, *blocks).sentence


def test_a_wire_offset_ends_before_a_place_over_a_point(checker):
    fault = checker.motions(punched(["G28.1", "G10 D1 R.1", "G41 D1 G00 X5", "Y5", "G40 G28 X1 Y1",
                                     "M02"]))
    assert fault.sentence.endswith(
        "the wire offset must end with one line in its plane, before G28 or G30.")


def test_the_machine_makes_both_moves(checker):
    moves = checker.motions(punched(["G00 X5", "G28.1", "X1", "G28 X2 Y1", "M02"]))
    assert [(tuple(m.delta), m.speed) for m in moves] == [
        ((50_000, 0, 0), 1_800_000), ((-40_000, 0, 0), 1_800_000),
        ((10_000, 10_000, 0), 1_800_000), ((30_000, -10_000, 0), 1_800_000)]


def test_g10_l20_gives_the_present_place_its_coordinates(checker):
    offsets = [tuple(r.offset)[:2] for r in taken(
        checker, "G00 X10 Y5", "G10 L20 P1 X0", "G92 Y0", "G10 L20 P0 X1 Y2", "G10 L20 P2 X3",
        "G55", "G92.1")]
    assert offsets == [(0, 0), (100_000, 0), (100_000, 50_000), (90_000, 30_000),
                       (90_000, 30_000), (70_000, 50_000), (70_000, 0)]
    moves = taken(checker, "G00 X10 Y5", "G10 L20 P1 X0 Y0", "X1 Y1")
    assert tuple(moves[-1].delta) == (10_000, 10_000, 0)


def test_g92_1_takes_back_what_g92_has_set(checker):
    records = taken(checker, "G10 L2 P1 X1", "G92 X5 Z5", "G92.1", "G00 X0")
    assert tuple(records[-1].delta) == (10_000, 0, 0)
    assert tuple(records[-2].offset) == (10_000, 0, 0)


@pytest.mark.parametrize(("block", "column", "said"), [
    ("G10 L3 X8 Y3 Z22 H75", 5,
     "G10 L must be L2 or L20; a class of the fluid is entered by G10 W."),
    ("G10 L2 X8 Y3 Z22", 5, "needs its work offset P; a class of the fluid is entered by G10 W."),
    ("G43 H1 Z5", 1, "tool length offsets (G43)"),
    ("G41.1 D1", 1, "enter the offset by G10 D R"),
    ("G42.1 D1", 1, "enter the offset by G10 D R"),
    ("G81 X1 Z-1 R1 F5", 1, "canned cycles (G81 to G89)"),
    ("G73 X1 Z-1 R1 Q.1 F5", 1, "canned cycles (G73 to G76)"),
    ("G90 G68 X0 Y0 R30", 5, "turned coordinates (G68)"),
    ("G65 P9000", 1, "macro calls"),
    ("G16", 1, "polar coordinates"),
    ("G92.2", 1, "G92.1 takes back"),
    ("G93 G01 X1 F5", 1, "inverse time feed"),
    ("G96 S100", 1, "for lathes"),
    ("G01 X#1 F5", 6, "variables and expressions"),
    ("#1=5", 1, "variables and expressions"),
    ("G01 X[1+2] F5", 6, "variables and expressions"),
    ("O100 SUB", 6, "O-words"),
    ("O<HOLE> CALL", 1, "O-words"),
    ("G65 P9010 A1. B2.", 1, "macro calls (G65, G66)"),
    ("G90 G51 T1.5", 5, "scaling and shifts (G51, G52)"),
    ("G41.1 D", 1, "G41.1 is not in this version"),
    ("G65 P#100", 1, "macro calls (G65, G66)"),
    ("G201 A1", 1, "the code G201 is unknown"),
    ("O101 IF [#1 GT 2]", 6, "O-words"),
    ("M99", 1, "belongs to a subprogram"),
    *((f"M{code}", 1, "modal state") for code in range(70, 74)),
])
def test_what_would_change_the_motion_is_refused_by_name(checker, block, column, said):
    fault = refused(checker, block)
    assert said in fault.sentence
    assert fault.column == column, fault.sentence


def test_a_call_by_hand_is_refused_by_name(checker):
    """The PC writes out the calls of a text, so that none reaches the controller."""
    assert "belongs to a subprogram" in checker.enter("M98 P2000 L3")


@pytest.mark.parametrize(("unit", "places"), [("G20", 4), ("G21", 3)])
def test_arcs_with_the_decimals_of_a_post_are_taken(checker, rng, unit, places):
    """Start, centre and end are rounded each by itself, as a post does; the end stays exact."""
    for _ in range(2000):
        radius = rng.uniform(0.1, 2) * (1 if unit == "G20" else 25.4)
        begin, sweep = rng.uniform(0, 2 * math.pi), rng.uniform(0.2, 6)
        at = [(radius * math.cos(a), radius * math.sin(a)) for a in (begin, begin + sweep)]
        (x0, y0), (x1, y1) = ([round(c, places) for c in point] for point in at)
        i, j = (round(-c, places) for c in at[0])
        records = taken(checker, f"{unit} G00 X{x0:.{places}f} Y{y0:.{places}f}",
                        f"G03 X{x1:.{places}f} Y{y1:.{places}f} I{i:.{places}f} J{j:.{places}f} F5")
        scale = 254_000 if unit == "G20" else 10_000
        assert records[-1].arc == 1
        assert tuple(records[-1].centre) == tuple(round(64 * scale * part) for part in (i, j))
        assert [sum(r.delta[axis] for r in records) for axis in range(2)] == [
            round(x1 * scale), round(y1 * scale)]
