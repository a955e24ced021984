# SPDX-License-Identifier: Apache-2.0
"""The firmware's reading of programs against a model in exact decimal arithmetic."""

import pytest

from testbench import programs
from testbench.firmware import ACTS, ITEMS, STOPS, Checker, Fault
from testbench.models.dialect import Dialect, DialectError


@pytest.fixture(scope="module")
def checker():
    return Checker()


def judged(blocks):
    """Meanings and retraction data by the model, up to the first damaged block."""
    model = Dialect()
    for text in blocks:
        try:
            meaning = model.block(text)
        except DialectError:
            return
        yield meaning, dict(model.items), dict(model.jump)
        if meaning.stop == "end":
            return


def told(record):
    """A record of the firmware, in the words of the model."""
    return {
        "skipped": bool(record.skipped), "delta": tuple(record.delta), "speed": record.speed,
        "act": ACTS[record.act], "stop": STOPS[record.stop], "machining": record.machining,
        "condition": record.condition, "fluid_off": bool(record.fluid_off), "dwell": record.dwell,
        "servo": record.servo, "arc": record.arc, "centre": tuple(record.centre),
        "plane": 17 + record.plane, "offset": tuple(record.offset), "via": tuple(record.via),
        "codes": {"S": record.s, "T": record.t, "M": [code for code in record.m if code >= 0]},
    }


def compare(checker, blocks):
    """Compare the firmware with the model over a program; return the number of equal blocks."""
    result = checker.check(programs.punched(blocks))
    expected = list(judged(blocks))
    if isinstance(result, Fault):
        ended = expected and expected[-1][0].stop == "end"
        assert not ended, (result, blocks)
        if len(expected) == len(blocks):
            assert result.name == "no_end", "the end word is gone"
        assert result.line == len(expected) + 2, (result, blocks)
        assert result.sentence.startswith(f"Block {result.line}")
        assert result.sentence.endswith(".")
        return len(expected)
    assert len(result) == len(expected), (len(result), len(expected), blocks)
    for record, (meaning, items, jump), text in zip(result, expected, blocks, strict=False):
        if meaning.skipped:
            assert record.skipped
            continue
        said = told(record)
        if not any(meaning.delta) and not meaning.arc:
            said["speed"] = meaning.speed
        near = [abs(a - b) <= 2 for a, b in zip(said["centre"], meaning.centre, strict=True)]
        assert all(near), (text, said, meaning)
        said["centre"] = meaning.centre
        assert said == vars(meaning), text
        assert record.moves == (any(meaning.delta) or meaning.arc != 0)
        given = {letter: value for bit, (letter, value) in enumerate(
                     zip(ITEMS, record.items, strict=True)) if record.given >> bit & 1}
        assert given == items, text
        assert jump == {"P": record.jump_period, "L": record.jump_distance,
                        "R": record.jump_speed, "H": record.jump_high}, text
    return len(expected)


def test_random_programs_mean_what_the_model_says(checker, rng):
    right = sum(compare(checker, programs.program(rng, 20)) for _ in range(400))
    assert right > 400 * 10, "too few blocks got as far as being compared"


def test_damaged_programs_are_judged_as_by_the_model(checker, rng):
    rejected = 0
    for _ in range(1500):
        blocks = programs.program(rng, 4)
        at = rng.randrange(2, len(blocks))
        blocks[at] = programs.damage(rng, blocks[at])
        if "%" in blocks[at]:
            continue
        rejected += compare(checker, blocks) < len(blocks)
    assert rejected > 500


@pytest.mark.parametrize(("block", "name", "column"), [
    ("G01 X1 X2 F5",                   "duplicate", 8),    # duplicate
    ("G01 G00 X1 F5",                  "modal", 5),    # two of a group
    ("G01 G1 X1 F5",                   "duplicate", 5),    # the same twice
    ("G90 G91",                        "modal", 5),
    ("G02 X1 Y1 F5",                   "missing", 5),
    ("N10 G03 Z1 F5",                  "missing", 9),
    ("G02 X1 I1 R5 F5",                "conflict", 11),
    ("G02 X1 K1 F5",                   "place", 8),
    ("G18 G02 X1 J1 F5",               "place", 12),
    ("G19 G02 Y1 I1 F5",               "place", 12),
    ("G02 X1 I0 J0 F5",                "arc", 8),
    ("G02 X1 R0 F5",                   "arc", 8),
    ("G02 I1000.1 F5",                 "arc", 5),
    ("G02 X1 R-1000.1 F5",             "arc", 8),
    ("G02 X1 R40000 F5",               "arc", 8),
    ("G02 R5 F5",                      "arc", 5),
    ("G02 X0 Y0 R5 F5",                "arc", 11),
    ("G02 X10 R4.998 F5",              "arc", 9),
    ("G02 X20000 Y20000 R4.998 F5",    "arc", 19),
    ("G02 X10 I5.002 F5",              "arc", 9),
    ("G02 X20000 Y-9000 J-5. F5",      "arc", 19),
    ("G02 X.005 Y.0005 I5 F5",         "arc", 18),   # a tenth of its length
    ("G02 X1 Y1 R1",                   "feed", 1),    # no feed
    ("G02 X26843 I.1 F5",              "arc", 12),
    ("G10 P7 X1",                      "table", 5),
    ("G10 P1",                         "missing", 0),
    ("G10 D0 R1",                      "table", 5),
    ("G10 D16 R1",                     "table", 5),
    ("G10 D1",                         "missing", 0),
    ("G10 D1 R-1",                     "table", 8),
    ("G10 D1 R100.1",                  "table", 8),
    ("G10",                            "missing", 0),
    ("G41",                            "missing", 1),
    ("G42 D3",                         "table", 5),
    ("D1",                             "place", 1),
    ("G36 R-5 L1 H5 E5 Q.5",           "number", 5),
    ("G38.6 Z-1 F5",                   "refused", 1),
    ("G95 P0",                         "number", 5),
    ("G95 P6",                         "number", 5),
    ("G95 P2 C100",                    "condition", 1),    # without a reference
    ("C100 G95 P4 M03",                "condition", 6),
    ("G95",                            "missing", 1),
    ("G95 P1 G04",                     "conflict", 1),
    ("G77",                            "unknown", 1),    # unknown
    ("G1.5 X1",                        "unknown", 1),
    ("A5",                             "unknown", 1),
    ("X1",                             "mode", 1),    # no mode
    ("G01 X1",                         "feed", 1),    # no feed
    ("G01 X1 F0",                      "feed", 8),
    ("G01 X1 F1801",                   "feed", 8),
    ("G01 X1 F-5",                     "number", 9),
    ("G01 X F5",                       "number", 7),
    ("G01 X1.2.3 F5",                  "number", 9),
    ("G01 X1,5 F5",                    "character", 7),
    ("G01 X1 5 F5",                    "character", 8),
    ("G01 X1234567890123 F5",          "overflow", 18),
    ("G01 X26844 F5",                  "overflow", 5),
    ("N1.5",                           "number", 1),
    ("N123456789",                     "overflow", 1),
    ("M03",                            "condition", 1),
    ("C7",                             "condition", 1),
    ("M03 M05 C100",                   "modal", 5),
    ("M00 M30",                        "modal", 5),
    ("M3.1 C100",                      "number", 1),
    ("P5",                             "place", 1),
    ("G04",                            "missing", 0),
    ("G04 P1 X1",                      "conflict", 5),
    ("G04 X-1",                        "overflow", 5),
    ("G92",                            "missing", 0),
    ("G36 R5",                         "retraction", 0),    # incomplete
    ("G36 R5 L1 H5 E5 Q2",             "retraction", 17),
    ("G36 R0 L1 H5 E5 Q1",             "retraction", 5),
    ("G36 R5 L0 H5 E5 Q0",             "retraction", 8),
    ("G36 R5 L1 H5 E5 Q1 F5",          "place", 20),
    ("G36 R5 L1 H5 E5 Q1 M08",         "place", 20),
    ("G36 G90 R5 L1 H5 E5 Q1",         "place", 5),
    ("G37",                            "retraction", 0),
    ("G38 P5 L1 R5 H5",                "retraction", 0),
    ("G38 L1",                         "missing", 0),
    ("G1 G4 P1",                       "conflict", 4),
    ("(open",                          "comment", 1),
    ("N10 G1 (open",                   "comment", 8),
    ("G1 ) X1",                        "character", 4),
    ("G1 / X1",                        "character", 4),
    ("T70000",                         "overflow", 1),
    ("M7000",                          "unknown", 1),
    ("M06 M07 M10 M11 M12 M13 M14",    "conflict", 25),
])
def test_each_error_is_named_with_its_place(checker, block, name, column):
    fault = checker.check(programs.punched([block, "M02"]))
    assert (fault.name, fault.line, fault.column) == (name, 2, column), fault.sentence
    place = f"Block 2{' (N10)' if block.startswith('N10') else ''}"
    assert fault.sentence.startswith(place + (f", character {column}: " if column else ": "))


@pytest.mark.parametrize("block", [
    "G01X.0000001F.001", "G01 X26843.5456 F1800", "G1 X-26843.5456 F1", "G00 X+0001.50",
    "g1 x1 f5", "N00012 :77 G01 Z-1. F2", "M08 M77 M03 C100", "G20 G91 G94", "X5 G04",
    "G36 R5 L1 H5 E5 Q0", "G36 R5 L1 H5 E5 Q1 Z-3", "G4 X36000", "", "   ", "()", "/ Z9 A5 (",
    "G 01 X 1 F\t5", "G02", "G03 M08", "G02 X2 I1 F5", "G2 X10 I5.0009 F5", "G2 X10 R4.9991 F5",
    "G2 X1 Y1 R+1000 F5", "G3 I1000 F5", "G19 G3 Y1 Z1 X5 R-1. F5", "G41 D0",
    "G10 D15 R100", "G10 P6 X-5 Z26843", "G59 G00 X1", "G01 X.12345678901234 F5.000000000",
])
def test_what_is_right_is_taken(checker, block):
    result = checker.check(programs.punched([block.replace("\t", " "), "M30"]))
    assert not isinstance(result, Fault), result.sentence


def test_mdi_defaults_complete_the_tape(checker):
    assert not checker.enter("G36 L1 H600 E60 Q.1")
    result = checker.check(programs.punched(["G36 R300", "G36 L2", "G37", "M02"]))
    refused = checker.check(programs.punched(["G37", "M02"]))
    checker.forget()
    assert isinstance(refused, Fault), "the defaults lack R"
    assert isinstance(result, Fault)
    assert result.line == 4
    assert not checker.enter("G36 R7 L1 H600 E60 Q.1")
    result = checker.check(programs.punched(["G36 R300", "G36 L2", "G37", "M02"]))
    checker.forget()
    assert [(r.items[0], r.items[1]) for r in result] == [
        (300_000, 10_000), (300_000, 20_000), (7_000, 10_000), (7_000, 10_000)]


def test_numbers_on_the_rounding_edge(checker):
    # 0.00005 mm is half a pulse; 0.0000019685 inch is just below and ..2 just above.
    blocks = ["G91 G01 F5", "X.00005", "X-.00005", "X.0000499", "G20 X.0000019", "X.000002"]
    result = checker.check(programs.punched([*blocks, "M02"]))
    deltas = [record.delta[0] for record in result]
    assert deltas == [0, 1, -1, 0, 0, 1, 0]


@pytest.mark.parametrize(("block", "words"), [
    ("G02 X10 I4.99 F5", "4.9900 mm at its start, 5.0100 mm at its end"),
    ("G20 G02 X1 I.4 F5", "10.1600 mm at its start, 15.2400 mm at its end"),
    ("G02 X20000 I5 F5", "5.0000 mm at its start, 19995.0000 mm at its end"),
    ("G02 X6 Y8 R4.5 F5", "the chord of 10.0000 mm is longer than the arc's diameter of 9.0000 mm"),
    ("G02 I1001 F5", "above 1000.0000 mm"),
    ("G02 X1 Y1 F5", "needs its centre (I, J, K) or its radius R"),
    ("G18 G02 X1 Z1 J1 F5", "J has no meaning in the plane G18"),
])
def test_what_is_wrong_with_an_arc_is_said_with_its_measures(checker, block, words):
    assert words in checker.check(punched(block)).sentence


def punched(*blocks):
    return programs.punched([*blocks, "M02"])


@pytest.mark.parametrize(("block", "centre", "ccw"), [
    ("G02 X1 Y1 R1 F5", (10_000, 0), -1),
    ("G03 X1 Y1 R1 F5", (0, 10_000), 1),
    ("G02 X1 Y1 R-1 F5", (0, 10_000), -1),
    ("G03 X1 Y1 R-1 F5", (10_000, 0), 1),
    ("G18 G03 X1 Z1 R1 F5", (0, 10_000), 1),    # first axis Z
    ("G19 G03 Y1 Z1 R1 F5", (0, 10_000), 1),
    ("G02 X2 R1 F5", (10_000, 0), -1),          # half a circle
    ("G02 X2 R.9995 F5", (10_000, 0), -1),      # within the tolerance
    ("G20 G03 X2 R1 F5", (254_000, 0), 1),
])
def test_centre_of_an_arc_given_by_its_radius(checker, block, centre, ccw):
    record = checker.check(punched(block))[0]
    assert tuple(record.centre) == tuple(64 * c for c in centre)
    assert record.arc == ccw


@pytest.mark.parametrize(("block", "reach"), [
    ("G03 X1 Y1 J1 F5", (0, 0)),                # a quarter to the right and up: no further
    ("G02 X1 Y1 J1 F5", (-1, 2)),               # the other three quarters
    ("G03 J1 F5", (-1, 2)),
    ("G03 X-1 Y1 J1 F5", (-1, 2)),
])
def test_travel_holds_on_the_whole_arc(checker, block, reach):
    """At the end of the travel an arc may go as far as its furthest point does."""
    end = 26843.5456
    for axis, far, sign in (("X", reach[0], -1), ("Y", reach[1], 1)):
        if not far:
            continue
        for beyond in (0, 0.0001):
            room = abs(far) - beyond
            to = f"G00 {axis}{sign * (end - room):.4f}"
            result = checker.check(punched(to, f"G91 {block}"))
            assert isinstance(result, Fault) == (beyond > 0), (to, block)
            if beyond:
                assert (result.name, result.line) == ("travel", 3)
                assert "beyond the travel" in result.sentence


def test_start_and_end_radius_may_differ_by_the_setting(checker):
    """3 um as delivered, of numbers with three decimals; in inches, of four, 2.54 times as much."""
    for unit, difference, right in (("G21", 0.0014, True), ("G21", 0.0016, False),
                                    ("G20", 0.00014, True), ("G20", 0.00016, False)):
        result = checker.check(punched(f"{unit} G02 X10 I{5 + difference:.5f} F5"))
        assert isinstance(result, Fault) != right


def test_work_offsets_lie_under_g92(checker):
    result = checker.check(punched(
        "G10 P1 X10", "G10 P6 X20 Z1", "G00 X1", "G92 X0", "G59", "X1 Z0", "G54 X0", "G10 P1 X5"))
    assert [tuple(r.offset) for r in result][:-1] == [
        (100_000, 0, 0), (100_000, 0, 0), (100_000, 0, 0), (110_000, 0, 0), (210_000, 0, 10_000),
        (210_000, 0, 10_000), (110_000, 0, 0), (60_000, 0, 0)]
    assert [r.delta[0] for r in result if r.moves] == [110_000, 110_000, -110_000]


def test_mode_of_an_arc_stays(checker):
    result = checker.check(punched("G91 G03 X2 I1 F5", "X2 I1", "G90 G01 X1", "X2 Y5"))
    assert [r.arc for r in result] == [1, 1, 0, 0, 0]
