# SPDX-License-Identifier: Apache-2.0
"""Calls of subprograms are written out before they are punched, and comments hold anything."""

import pytest

from host.errors import TapeError
from host.tape.codes import EIA, ISO
from host.tape.subprograms import DEEPEST, MOST
from host.tape.tape import decode, encode
from testbench.firmware import Checker, Fault

PROGRAM = """%
O1000 (square in steps)
G91 G00 X1
N20 M98 P2000 L3 (three passes)
G90 M98 P3000
M30
O2000
G91 G01 Z-.1 F5
M98 P3000
N90 M99
:3000 G91 (side)
G01 Y1 F5
X-1 M99
%
"""
SIDE = ["G91", "G01 Y1 F5", "X-1"]
FLAT = ["O1000", "G91 G00 X1", "N20", *["G91 G01 Z-.1 F5", *SIDE, "N90"] * 3, "G90", *SIDE, "M30"]


def blocks(tape):
    lines = decode(tape.rows)[0].splitlines()[1:-1]
    return [" ".join(line.split("(")[0].split()) for line in lines]


def test_a_program_with_calls_is_the_one_written_out():
    checker = Checker()
    tape = encode(PROGRAM)
    assert blocks(tape) == FLAT
    called, flat = ([(tuple(m.delta), m.speed) for m in checker.motions(rows)]
                    for rows in (tape.rows, encode("\n".join(FLAT)).rows))
    assert called == flat
    assert len(called) == 1 + 3 * 3 + 2


def test_every_block_knows_its_line_in_the_text():
    tape = encode(PROGRAM)
    lines = PROGRAM.splitlines()
    told = [lines[tape.line(block) - 1] for block in range(2, len(FLAT) + 2)]
    assert all(set(flat) <= set(line.upper()) for flat, line in zip(FLAT, told, strict=True))
    fault = Checker().check(encode(PROGRAM.replace("X-1 M99", "X-1 B5 M99")).rows)
    assert isinstance(fault, Fault)
    assert tape.line(fault.line) == lines.index("X-1 M99") + 1
    assert fault.column == 5, "a word that is taken out leaves the others where they are"


@pytest.mark.parametrize(("before", "after", "line", "column", "said"), [
    ("P2000 L3", "L3", 4, 5, "M98 needs the number of its subprogram behind it, P"),
    ("P2000 L3", "P2001", 4, 9, "there is no subprogram O2001 behind the program's end"),
    ("N20 M98", "/N20 M98", 4, 6, "cannot be skipped by /"),
    ("N90 M99", "N90", 7, 0, "the subprogram O2000 has no end (M99)."),
    ("N90 M99", "N90 M99 P20", 10, 5, "M99 returns behind its call"),
    ("N90 M99", "N90 M30", 10, 0, "the end word stands in the subprogram O2000; M99 ends it."),
    ("N90 M99", "/ M99", 10, 3, "M99 cannot be skipped by /."),
    ("G01 Y1 F5", "M98 P2000", 12, 1, "the subprogram O2000 calls itself."),
    (":3000 G91", "O2000 G91", 11, 1, "stands twice, first in line 7."),
])
def test_what_is_wrong_with_a_call_is_said_with_its_place(before, after, line, column, said):
    assert before in PROGRAM
    with pytest.raises(TapeError) as raised:
        encode(PROGRAM.replace(before, after))
    assert said in str(raised.value)
    assert (raised.value.block, raised.value.character) == (line, column)


def test_calls_have_a_depth_and_a_size():
    def nested(depth, times):
        return "\n".join([f"M98 P1 L{times}", "M30", *(
            f"O{n}\nM98 P{n + 1} L{times}\nM99" for n in range(1, depth)), f"O{depth}\nX1\nM99"])

    assert len(encode(nested(DEEPEST, 1)).lines) == 4
    with pytest.raises(TapeError, match=f"more than {DEEPEST} calls stand inside each other"):
        encode(nested(DEEPEST + 1, 1))
    with pytest.raises(TapeError, match=f"more than {MOST:,} blocks or calls"):
        encode(nested(3, 101))


@pytest.mark.parametrize("text", ["M99", "G00 X1\nM99\nM30", "(M98 P2000)\nM99"])
def test_a_return_without_a_call_is_left_to_the_controller_which_refuses_it(text):
    fault = Checker().check(encode(text).rows)
    assert isinstance(fault, Fault)
    assert "M99 belongs to a subprogram" in fault.sentence


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_what_no_code_has_is_a_space_in_a_comment(code):
    tape = encode("(Ätz_tiefe: 50 % ~ \u00df)G00 X1 (5\u00b5m {a})\nM30", code)
    line = decode(tape.rows)[0].splitlines()[1]
    assert line.startswith("( TZ")
    assert line.index("G00 X1") == len("(Ätz_tiefe: 50 % ~ \u00df)")
    with pytest.raises(TapeError, match=r"has no code for \"_\""):
        encode("G00 X_1\nM30", code)


def test_what_stands_behind_the_second_percent_sign_is_not_read():
    text = "%\nG00 X1\nM30\n%\nG00 X5 and words _ that mean nothing\n%\n"
    assert blocks(encode(text)) == ["G00 X1", "M30"]


@pytest.mark.parametrize(("block", "column", "said"), [
    ("M98 P2000 M30", 1, "neither stops nor ends the program, nor does it return"),
    ("M98 P2000 M99", 1, "neither stops nor ends the program, nor does it return"),
    ("G4 P2 M98 P3000", 7, "has no other P or L"),
    ("M98 P2000 L99999999", 11, "repeated at most 9999 times"),
    (f"M98 P{'2' * 5000}", 1, "a whole number of at most 8 digits"),
    ("M98 P2000.", 1, "a whole number of at most 8 digits"),
    ("M98 P52001", 5, "repeats are given by L"),
])
def test_a_call_says_one_thing(block, column, said):
    with pytest.raises(TapeError) as raised:
        encode(PROGRAM.replace("N20 M98 P2000 L3", block))
    assert said in str(raised.value)
    assert (raised.value.block, raised.value.character) == (4, column)


def test_an_empty_subprogram_that_is_called_for_ever_comes_to_an_end():
    nested = "\n".join(f"O{n}\nM98 P{n + 1} L999\nM99" for n in range(1, 4))
    with pytest.raises(TapeError, match=f"more than {MOST:,} blocks or calls"):
        encode(f"M98 P1\nM30\n{nested}\nO4\nM99")


@pytest.mark.parametrize("char", ["\u2028", "\u0085", "\f", "\v", "\x1c"])
def test_a_line_ends_where_a_machine_ends_it(char):
    """Not where Unicode does: what follows would be words of a program instead of a comment's."""
    assert len(encode(f"G01 X1 F100 ; note{char}X99\nM30").lines) == 4


def test_what_is_behind_the_end_need_not_be_punchable():
    assert blocks(encode("G00 X1\nM30\nDuration: 5 min, 3 \u20ac, 100 % {a}")) == [
        "G00 X1", "M30"]


def test_a_name_behind_the_first_percent_sign_is_refused_with_what_to_write():
    with pytest.raises(TapeError, match=r"^Line 1, character 2: % must stand alone"):
        encode("%1001\nG00 X1\nM30\n%")


@pytest.mark.parametrize("block", ["(was (old) X99", "G00 X1 (a (b) c)"])
def test_a_comment_in_a_comment_is_refused(block):
    fault = Checker().check(encode(f"{block}\nM30").rows)
    assert isinstance(fault, Fault)
    assert fault.sentence.endswith("a comment begins within a comment.")
