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
    ("P2000 L3", "L3", 4, 5, "M98 needs the number of its subprogram, P."),
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
    with pytest.raises(TapeError, match=f"more than {MOST:,} blocks"):
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
