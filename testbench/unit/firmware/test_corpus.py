# SPDX-License-Identifier: Apache-2.0
"""Every program of the corpus gives its reference, or is refused as its reference says."""

from fractions import Fraction

import pytest

from host.errors import TapeError
from host.tape.check import check
from host.tape.tape import load
from testbench.corpus.reference import Act, Move, walk
from testbench.corpus.table import FILES, POINTS, PROGRAMS, REFUSED
from testbench.corpus.told import acts_of, moves_of
from testbench.firmware import Checker

NEAR_MM = 1e-4      # a pulse: centres of arcs that are given by R are square roots
ACCEPTED = [name for name in FILES if name not in REFUSED]


@pytest.fixture(scope="module")
def checker():
    return Checker()


def text_of(name):
    """The file as an editor shows it."""
    data = (PROGRAMS / name).read_bytes()
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1")


def same(one, other):
    """Whether two moves are one: line, ends, feed and way round to the pulse, centre nearly so."""
    exact = [(m.line, m.start, m.end, m.turn, m.plane, m.feed) for m in (one, other)]
    near = all(abs(a - b) <= NEAR_MM for a, b in zip(one.centre, other.centre, strict=True))
    return exact[0] == exact[1] and near


def differences(wanted, told):
    """Pairs of moves that differ."""
    pairs = zip(wanted, told, strict=False)
    return [pair for pair in pairs if not same(*pair)] + [
        (None, None)] * abs(len(wanted) - len(told))


def test_the_corpus_is_large_and_its_table_complete():
    assert len(ACCEPTED) >= 60
    assert len(REFUSED) >= 60
    assert set(REFUSED) | set(POINTS) <= set(FILES)


@pytest.mark.parametrize("name", [name for name in ACCEPTED if not name.startswith("wire_")])
def test_a_program_does_what_the_reference_says(checker, name):
    wanted = walk(text_of(name))
    tape = load(PROGRAMS / name)
    assert not differences([one for one in wanted if isinstance(one, Move)],
                           moves_of(checker, tape))
    assert acts_of(checker, tape) == [one for one in wanted if isinstance(one, Act)]


@pytest.mark.parametrize("name", POINTS)
def test_a_program_goes_through_the_points_that_were_written_by_hand(checker, name):
    told = []
    for move in moves_of(checker, load(PROGRAMS / name)):
        arc = (move.turn, *move.centre) if move.turn else ()
        told.append((*map(float, move.end[:2]), *arc))
    wanted = [tuple(float(Fraction(number)) for number in point) for point in POINTS[name]]
    assert [pytest.approx(one, abs=NEAR_MM) for one in wanted] == told


def test_every_wire_offset_has_its_points():
    assert {name for name in ACCEPTED if name.startswith("wire_")} <= set(POINTS)


@pytest.mark.parametrize("name", REFUSED)
def test_a_program_is_refused_where_and_as_it_should(name):
    wanted = REFUSED[name]
    with pytest.raises(TapeError) as raised:
        check(load(PROGRAMS / name))
    said = str(raised.value)
    assert wanted.words in said
    place, _, _ = said.partition(": ")
    assert place.lower().endswith(f"line {wanted.line}"
                                  + f", character {wanted.column}" * bool(wanted.column)), said


@pytest.mark.parametrize(("name", "old", "new"), [
    ("fanuc_contour.nc", "I0. J5.", "I0. J5.001"),
    ("fanuc_contour.nc", "G01 Y10.", "G01 Y10.0001"),
    ("haas_contour.nc", "F500.", "F500.001"), ("haas_contour.nc", "G01 X0.", "G00 X0."),
    ("arcs_long_way_round.nc", "R-1. F300.", "R1. F300."),
    ("arcs_full_circles.nc", "G03 J", "G02 J"),
    ("calls_nested.nc", "M98 P3 L2", "M98 P3 L3"), ("arcs_planes.nc", "G19 G00", "G00"),
    ("g53_machine.nc", "G53 G01", "G01"), ("block_skip.nc", "/ G00", "G00"),
])
def test_a_difference_is_seen(checker, name, old, new):
    """The reference of another program does not match."""
    text = text_of(name)
    assert text.count(old) == 1
    other = [one for one in walk(text.replace(old, new)) if isinstance(one, Move)]
    assert differences(other, moves_of(checker, load(PROGRAMS / name)))
