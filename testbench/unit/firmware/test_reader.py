# SPDX-License-Identifier: Apache-2.0
"""The firmware's tape reader: codes, parity, leader, and every way to damage a tape."""

import pytest

from host.tape.codes import EIA, ISO
from testbench.firmware import Checker, Fault
from testbench.programs import punched

PROGRAM = ["N10 G21 G90", "N20 C130", "N30 G36 R300 L.5 H600 E60 Q.1", "N40 M03",
           "N50 G01 Z-.5 F6 (DEEP)", "N60 M30"]
NO_START, PARITY, BLANK, CODE, TV, TOO_LONG, NO_END = range(101, 108)


@pytest.fixture(scope="module")
def checker():
    return Checker()


def data(rows, code):
    """Numbers of the rows from the start code to the end of block of the end word."""
    begin = rows.index(code.start)
    end = rows.index(code.start, begin + 1) - 1  # the end of block before the last start code
    assert rows[end] == code.end_of_block
    return range(begin, end + 1)


def place(rows, code, at):
    """Block and character of a row."""
    before = rows[rows.index(code.start):at]
    block = 1 + before.count(code.end_of_block)
    return block, 1 + len(before) - 1 - before.rindex(code.end_of_block) if block > 1 else 0


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_good_tape_is_read(checker, code):
    result = checker.check(punched(PROGRAM, code))
    assert [record.line for record in result] == [2, 3, 4, 5, 6, 7]
    assert result[4].delta[2] == -5000


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_every_flipped_bit_is_found_and_named(checker, code):
    rows = punched(PROGRAM, code)
    for at in data(rows, code):
        block, character = place(rows, code, at)
        for bit in range(8):
            flipped = bytearray(rows)
            flipped[at] ^= 1 << bit
            fault = checker.check(flipped)
            assert isinstance(fault, Fault), (at, bit)
            if block == 1:
                assert (fault.code, fault.line) == (NO_START, 1)
                continue
            assert fault.code in (PARITY, BLANK), fault
            assert (fault.line, fault.column) == (block, character), fault


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_every_truncation_is_found(checker, code):
    rows = punched(PROGRAM, code)
    end = data(rows, code)[-1]
    for length in range(end + 1):
        fault = checker.check(rows[:length])
        assert isinstance(fault, Fault), length
        started = length > rows.index(code.start) + 1
        assert fault.code == (NO_END if started else NO_START)
        if started:
            assert (fault.line, fault.column) == place(rows, code, length)
    assert not isinstance(checker.check(rows[:end + 1]), Fault)


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_every_byte_value_is_a_character_a_fault_or_nothing(checker, code):
    for byte in range(256):
        rows = punched(["N1 (A)", "M02"], code)
        at = rows.index(code.punch["A"]) + 1
        result = checker.check(rows[:at] + bytes([byte]) + rows[at:])
        if byte == code.end_of_block:
            assert result.sentence.endswith("the comment is not closed.")
        elif byte == code.start:
            assert (result.code, result.line) == (NO_END, 2)
        elif byte == code.punch[")"]:
            assert result.sentence.endswith("the character ')' is out of place.")
        elif byte == code.punch["("]:
            assert result.sentence.endswith("a comment begins within a comment.")
        elif byte in code.read:
            assert not isinstance(result, Fault), (byte, result.sentence)
        elif byte == 0 and code.blank_is_fault:
            assert result.code == BLANK
        else:
            even = byte.bit_count() % 2 == 0
            assert result.code == (CODE if even == (code is ISO) else PARITY), byte
            assert (result.line, result.column) == (2, 6)


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_leader_is_ignored(checker, rng, code):
    rows = punched(PROGRAM, code)
    start = rows.index(code.start)
    for _ in range(200):
        # Legible hole patterns: any byte may come, but not a row that ends a block of data.
        legible = bytes(rng.choice([0, 0x81, 0x42, 0x24, 0x18, 0x7E, 0x80, 0x90, 0xFE, 0x11])
                        for _ in range(40))
        assert not isinstance(checker.check(legible + b"\0" + rows[start:]), Fault)


def test_second_program_does_not_run_in_place_of_a_damaged_first(checker):
    first = bytearray(punched(["N1 G21", "M02"]))
    first[first.index(ISO.start)] ^= 4
    fault = checker.check(bytes(first) + punched(PROGRAM))
    assert (fault.code, fault.line) == (NO_START, 1)


def test_a_short_block_without_a_start_code_before_it_is_none(checker):
    """Two characters are enough; one may be a hole pattern by chance."""
    for text, right in (("M", True), ("M3", False), ("G01", False), ("G0 X1", False)):
        rows = bytes(ISO.punch[letter] for letter in text) + b"\n" + punched(PROGRAM)
        result = checker.check(rows)
        assert isinstance(result, list) == right, text
        assert right or (result.code, result.line) == (NO_START, 1)


def test_carriage_returns_are_ignored(checker):
    rows = punched(PROGRAM).replace(b"\n", b"\x8d\n")
    assert [record.line for record in checker.check(rows)] == [2, 3, 4, 5, 6, 7]


def test_deleted_characters_are_ignored_inside_a_number(checker):
    rows = punched(["G91 G01 F5 X1", "M02"]).replace(bytes([ISO.punch["X"]]),
                                                     bytes([ISO.punch["X"], 0xFF]))
    assert checker.check(rows)[0].delta[0] == 10_000


@pytest.mark.parametrize(("length", "right"), [(255, True), (256, True), (257, False)])
@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_longest_block(checker, code, length, right):
    result = checker.check(punched(["(" + "A" * (length - 2) + ")", "M02"], code))
    assert isinstance(result, list) == right
    if not right:
        assert (result.code, result.line, result.column) == (TOO_LONG, 2, 257)


def test_end_of_a_block_of_256_may_be_cr_lf(checker):
    rows = punched(["(" + "A" * 254 + ")", "M02"]).replace(b"\n", b"\x8d\n")
    assert not isinstance(checker.check(rows), Fault)


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_tv_counts_the_characters_of_a_block(checker, code):
    even = [text if len(text) % 2 else text + " " for text in PROGRAM]  # the end of block counts
    assert not isinstance(checker.check(punched(even, code), tv=True), Fault)
    odd = even[:3] + [even[3] + " "] + even[4:]
    fault = checker.check(punched(odd, code), tv=True)
    assert (fault.code, fault.line) == (TV, 5)
    assert not isinstance(checker.check(punched(odd, code)), Fault), "TV is optional"


def test_tv_does_not_count_blanks(checker):
    even = [text if len(text) % 2 else text + " " for text in PROGRAM]
    rows = punched(even)
    at = rows.index(ISO.punch["C"])
    assert not isinstance(checker.check(rows[:at] + b"\0" + rows[at:], tv=True), Fault)


@pytest.mark.parametrize(("first", "second"), [(ISO, EIA), (EIA, ISO)], ids=["iso", "eia"])
def test_tape_in_the_other_code_half_way(checker, first, second):
    rows = punched(PROGRAM, first)
    at = rows.index(first.punch["C"])
    fault = checker.check(rows[:at] + punched(PROGRAM, second)[at:])
    assert isinstance(fault, Fault)
    assert fault.line in (3, 4)


def test_blank_is_a_filler_in_iso_and_a_fault_in_eia(checker):
    for code, right in ((ISO, True), (EIA, False)):
        rows = punched(PROGRAM, code)
        at = rows.index(code.punch["C"])
        result = checker.check(rows[:at] + b"\0" + rows[at:])
        assert isinstance(result, list) == right


def test_what_follows_the_end_word_is_ignored(checker, rng):
    rows = punched(PROGRAM)
    end = data(rows, ISO)[-1] + 1
    trailer = bytes(rng.randrange(256) for _ in range(200))
    assert not isinstance(checker.check(rows[:end] + trailer), Fault)


def test_empty_and_blank_tapes_are_refused(checker):
    for rows in (b"", bytes(100), b"\x0a" * 20, b"\x80" * 20):
        assert checker.check(rows).code == NO_START
