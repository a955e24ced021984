# SPDX-License-Identifier: Apache-2.0
"""The tapes of the project: the committed files are those that the script punches."""

import pytest

from host.errors import TapeError
from host.tape.check import check
from host.tape.codes import CODES, ISO
from host.tape.tape import Tape, decode, encode
from testbench.punch import TAPES, broken, derived

PROGRAMS = sorted(TAPES.glob("*.nc"))
# Faults of the code; the others are faults of the words, which only the firmware knows.
OF_THE_CODE = ("parity", "character", "blank", "M02", "start")


def test_committed_tapes_are_those_of_the_script():
    made = derived()
    assert sorted(TAPES.rglob("*.ptp")) == sorted(made)
    assert [path.name for path, rows in made.items() if path.read_bytes() != rows] == []


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
@pytest.mark.parametrize("code", sorted(CODES))
def test_program_can_be_punched_in_both_codes(program, code):
    text = program.read_text()
    assert decode(encode(text, CODES[code]).rows)[0] == text


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_program_says_why_its_data_are_what_they_are(program):
    text = program.read_text()
    assert text.count("(") >= 4
    assert max(len(line) for line in text.splitlines()) <= 100


@pytest.mark.parametrize("name", [name for name, tape in broken().items()
                                  if tape.words in OF_THE_CODE])
def test_fault_of_the_code_is_found_where_it_is(name):
    tape = broken()[name]
    with pytest.raises(TapeError, match=tape.words) as caught:
        decode(tape.rows)
    assert caught.value.block == tape.block
    if tape.character:
        assert caught.value.character == tape.character
    with pytest.raises(TapeError) as firmware:
        check(Tape(tape.rows, ISO))
    assert str(caught.value) == str(firmware.value)


@pytest.mark.parametrize("name", [name for name, tape in broken().items()
                                  if tape.words not in OF_THE_CODE])
def test_the_others_are_whole_as_tapes(name):
    decode(broken()[name].rows)


@pytest.mark.parametrize("name", sorted(broken()))
def test_firmware_refuses_every_broken_tape_and_says_where(name):
    tape = broken()[name]
    with pytest.raises(TapeError) as caught:
        check(Tape(tape.rows, ISO))
    place = f"Block {tape.block}"
    sentence = str(caught.value)
    assert sentence.startswith(place)
    assert tape.words in sentence
    assert sentence.count(". ") == 0
    if tape.character:
        assert f", character {tape.character}:" in sentence


@pytest.mark.parametrize("path", sorted(TAPES.glob("*.ptp")), ids=lambda path: path.name)
def test_firmware_finds_no_fault_in_the_others(path):
    assert check(Tape(path.read_bytes(), ISO)) >= 10


def test_lines_are_those_of_the_text():
    with pytest.raises(TapeError, match=r"^Block 3, line 2, character 5: the word B is unk"):
        check(encode("G21\nG90 B2\nM02"))
