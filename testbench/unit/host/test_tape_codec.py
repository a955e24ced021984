# SPDX-License-Identifier: Apache-2.0
"""Tape codec: the code tables, round trips, and every kind of damage with its sentence."""

import re

import pytest

from host.errors import TapeError
from host.tape.check import check
from host.tape.codes import CODES, EIA, ISO, odd
from host.tape.tape import FEED_ROWS, Tape, decode, encode, ends_program, load
from testbench.firmware import Checker, Fault

# The tables as printed: ISO 840 by its rule, EIA RS-244 as punched by the IBM 1620.
ISO_TABLE = """
0 30  1 B1  2 B2  3 33  4 B4  5 35  6 36  7 B7  8 B8  9 39
A 41  B 42  C C3  D 44  E C5  F C6  G 47  H 48  I C9  J CA  K 4B  L CC  M 4D
N 4E  O CF  P 50  Q D1  R D2  S 53  T D4  U 55  V 56  W D7  X D8  Y 59  Z 5A
% A5  : 3A  / AF  + 2B  - 2D  . 2E  , AC  ( 28  ) A9
= BD  * AA  # A3  $ 24  & A6  ' 27  @ C0  [ DB  ] DD  ! 21  " 22  ; BB  < 3C  > BE  ? 3F
"""
EIA_TABLE = """
0 20  1 01  2 02  3 13  4 04  5 15  6 16  7 07  8 08  9 19
A 61  B 62  C 73  D 64  E 75  F 76  G 67  H 68  I 79
J 51  K 52  L 43  M 54  N 45  O 46  P 57  Q 58  R 49
S 32  T 23  U 34  V 25  W 26  X 37  Y 38  Z 29
/ 31  + 70  - 40  . 6B  , 3B  % 0B  & 0E  ( 1A  ) 4A
"""
NO_START = "there is no start code (% or ER, then end of block) before the data."
M02 = b"\x4d\x30\xb2\x0a"
PROGRAM = "%\nN10 G90 G21 (FIRST)\nG01 Z-1.5 F6\n\nM02\n%\n"

codes = pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)


@pytest.mark.parametrize(("code", "table"), [(ISO, ISO_TABLE), (EIA, EIA_TABLE)],
                         ids=["iso", "eia"])
def test_codes_are_those_of_the_tables(code, table):
    printed = {char: int(row, 16) for char, row in re.findall(r"(\S) ([0-9A-F]{2})", table)}
    white = {" ": 0xA0, "\t": 0x09} if code is ISO else {" ": 0x10, "\t": 0x3E}
    assert code.punch == printed | white


@codes
def test_every_legal_row_has_the_parity_of_its_code(code):
    rows = {*code.read, code.end_of_block} - {0x00}
    assert {odd(row) for row in rows} == {code.parity}


def test_no_row_is_legal_in_both_codes():
    assert not {*ISO.read, ISO.end_of_block} & {*EIA.read, EIA.end_of_block}


@codes
def test_text_survives_the_tape(code):
    tape = encode(PROGRAM, code)
    assert decode(tape.rows) == (PROGRAM, code)
    assert tape.lines == tuple(range(1, len(PROGRAM.splitlines()) + 1))


@codes
def test_reading_goes_on_behind_other_m_words(code):
    text = "%\nM03\nM20 (NOT M02)\n/M30\nM30\n%\n"
    assert decode(encode(text, code).rows)[0] == text


@codes
def test_any_text_survives_the_tape(code, rng):
    for _ in range(200):
        lines = ["".join(rng.choices([c for c in code.punch if c != "%"], k=rng.randrange(40)))
                 for _ in range(rng.randrange(1, 8))]
        lines = [line.replace("M", "N") for line in lines] + ["M30"]
        text = "\n".join(["%", *lines, "%", ""])
        assert decode(encode(text, code).rows) == (text, code)


@pytest.mark.parametrize(("text", "shift"), [
    ("G01 Z-1\nM02",              -1),
    ("\n\nG01 Z-1\nM02\n\n",       1),
    ("%\nG01 Z-1\nM02",            0),
    ("\n %\r\nG01 Z-1\r\nM02\r\n%", 1),
    ("g01 z-1\nm02",              -1),
])
def test_what_a_text_lacks_is_added_and_its_lines_are_known(text, shift):
    tape = encode(text)
    assert decode(tape.rows)[0] == "%\nG01 Z-1\nM02\n%\n"
    line = next(n for n, line in enumerate(text.split("\n"), 1) if "Z-1" in line.upper())
    assert line == tape.line(2) == 2 + shift
    assert tape.line(3) == 3 + shift


@codes
def test_leader_and_trailer_are_blank(code):
    rows = encode(PROGRAM, code).rows
    assert rows[:FEED_ROWS] == rows[-FEED_ROWS:] == bytes(FEED_ROWS)
    assert rows[FEED_ROWS:FEED_ROWS + 2] == bytes([code.start, code.end_of_block])
    assert rows[-FEED_ROWS - 2:-FEED_ROWS] == bytes([code.start, code.end_of_block])


@codes
@pytest.mark.parametrize("leader", ["no end of block", "with ends of block", "with a lone start"])
def test_leader_may_hold_any_pattern(code, leader, rng):
    """Holes that can be read by eye. Row 0x81 belongs to no code, so nothing passes for a block."""
    ends = {0x0A, 0x80} if leader == "no end of block" else set()
    pattern = [rng.choice([n for n in range(256) if n not in ends | {ISO.start, EIA.start}])
               for _ in range(50)]
    holes = b"".join(bytes([row, 0x81, 0x03]) for row in pattern)
    if leader == "with a lone start":
        holes += bytes([code.start, 0x81])
    assert decode(holes + encode(PROGRAM, code).rows[FEED_ROWS:]) == (PROGRAM, code)


def test_iso_ignores_carriage_returns_fillers_and_blanks():
    rows = encode(PROGRAM).rows.replace(b"\x0a", b"\x8d\x0a").replace(b"\x47", b"\x47\x00\xff")
    assert decode(rows) == (PROGRAM, ISO)


@codes
def test_every_single_hole_matters(code):
    """From the start row to the end of block of the end word, any flipped bit is an error there."""
    rows = encode(PROGRAM, code).rows
    last = rows.index(bytes([code.punch["2"], code.end_of_block])) + 1
    block, character = 1, 0
    for index in range(FEED_ROWS, last + 1):
        character += 1
        for bit in range(8):
            damaged = bytearray(rows)
            damaged[index] ^= 1 << bit
            with pytest.raises(TapeError) as caught:
                decode(bytes(damaged))
            if block > 1:
                assert (caught.value.block, caught.value.character) == (block, character)
            else:
                assert caught.value.block == 1
        if rows[index] == code.end_of_block:
            block, character = block + 1, 0


@pytest.mark.parametrize(("damage", "message"), [
    (lambda rows: b"", f"Block 1: {NO_START}"),
    (lambda rows: bytes(100), f"Block 1, character 100: {NO_START}"),
    (lambda rows: rows.replace(b"\xa5", b""), f"Block 1, character 81: {NO_START}"),
    (lambda rows: rows[:-FEED_ROWS - 6],
     "Block 5, character 1: the tape ends before the end word (M02 or M30)."),
    (lambda rows: rows.replace(M02, b""),
     "Block 5, character 1: the program ends without its end word (M02 or M30)."),
    (lambda rows: rows.replace(b"\x36", b"\x16"),
     "Block 3, character 12: parity error (TH) in the byte 16."),
    (lambda rows: rows.replace(b"\x36", b"\x81"),
     "Block 3, character 12: the byte 81 is not a character of the ISO code."),
])
def test_damage_is_named_in_the_words_of_the_controller(damage, message):
    rows = damage(encode(PROGRAM).rows)
    for reader in (decode, lambda rows: check(Tape(rows, ISO))):
        with pytest.raises(TapeError) as caught:
            reader(rows)
        assert str(caught.value) == message


def test_blank_inside_eia_data_is_a_fault():
    rows = encode(PROGRAM, EIA).rows.replace(bytes([EIA.punch["F"]]), bytes([EIA.punch["F"], 0]))
    with pytest.raises(TapeError, match=r"^Block 2, character 15: blank tape inside the pro"):
        decode(rows)


@pytest.mark.parametrize(("text", "code", "message"), [
    ("G01 ; FAST\nM02", EIA, 'Line 1, character 5: EIA RS-244 tape has no code for ";".'),
    ("G01\nGÄ\nM02",    ISO, 'Line 2, character 2: ISO 840 tape has no code for "Ä".'),
    ("%\nG01\n%G01\nM02", ISO, "Line 3, character 1: % starts and ends a tape and cannot stand "
                               "inside the program."),
    ("G01\n/N5 O101 IF [#<_X> GT 0]", ISO,
     "Line 2, character 10: O-words (sub, call, if, while and so on) are not in this version; "
     "write the moves out."),
    ("O<_HOLE> CALL", ISO,
     "Line 1, character 1: O-words (sub, call, if, while and so on) are not in this version; "
     "write the moves out."),
    ("(#=) G01 X#<_DEPTH>", ISO, "Line 1, character 11: variables and expressions (# [ ] =) are "
                                 "not in this version; write the number."),
    ("#1=5", EIA, "Line 1, character 1: variables and expressions (# [ ] =) are not in this "
                  "version; write the number."),
    ("O100 G01 X_", ISO, 'Line 1, character 11: ISO 840 tape has no code for "_".'),
    ("\n \n",           ISO, "Line 1: the text is empty: there is nothing to punch."),
])
def test_what_cannot_be_punched_is_named(text, code, message):
    with pytest.raises(TapeError) as caught:
        encode(text, code)
    assert str(caught.value) == message


@pytest.mark.parametrize(("block", "ends"), [
    ("M02", True), ("N9 M2", True), ("G01 X1 M30", True), ("M30 (M02)", True), ("M030", True),
    ("M20", False), ("M300", False), ("(M02)", False), ("G04 P1 ; M02", False), ("/M02", False),
    ("M 02", True), ("M\t02", True), ("M02.", True), ("M2.00", True), ("(/)M02", True),
    ("(X)/M02", False), (" (X) /M02", False), ("M(X)02", False), ("M02.5", False),
])
def test_end_word_is_found(block, ends):
    assert ends_program(block) is ends


PIECES = ["M", "02", "2", "30", "0", ".", ".0", " ", "\t", "(X)", "(M02)", "/", "(", ";", "G01",
          "X1", "M02", "M30", "M3", "M 2", "M02.", "M30.00"]


@codes
def test_a_tape_ends_where_it_does_for_the_controller(code, rng):
    """Of a block that the controller refuses, only that the tape is not over before it."""
    firmware, seen = Checker(), {"read": 0, "never ends": 0, "refused": 0}
    for _ in range(6000):
        lines = ["".join(rng.choices(PIECES, k=rng.randrange(1, 5))) for _ in range(2)]
        lines += rng.choice([[], ["M02"]])
        text = "\n".join(["%", *lines, "%", ""])
        text = text if code is ISO else text.replace(";", "")
        rows = encode(text, code).rows
        if code is ISO:  # where a small letter may stand, unlike in a text to be punched
            rows = rows.replace(b"\x4d", b"\xed", rng.randrange(2))
        found = firmware.check(rows)
        try:
            last, said = len(decode(rows)[0].splitlines()) - 1, ""
        except TapeError as error:
            last, said = error.block, str(error)
        if not isinstance(found, Fault):
            seen["read"] += 1
            assert (last, said) == (1 + len(found), ""), text
        elif "end word" in found.sentence:
            seen["never ends"] += 1
            assert said == found.sentence, text
        else:
            seen["refused"] += 1
            assert last >= found.line, text
    assert min(seen.values()) > 50, seen


@pytest.mark.parametrize("suffix", [".ptp", ".PTP"])
@pytest.mark.parametrize("name", sorted(CODES))
def test_punched_file_is_taken_as_it_is(name, suffix, workdir):
    path = workdir / f"x{suffix}"
    path.write_bytes(encode(PROGRAM, CODES[name]).rows)
    assert load(path) == encode(PROGRAM, CODES[name])
