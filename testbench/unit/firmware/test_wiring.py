# SPDX-License-Identifier: Apache-2.0
"""The lines that check board and wires: ``$INPUTS``, ``$MEMORY`` and ``$LEVELS``."""

import pytest

from softcore.tables.faults import error_line
from softcore.tables.settings import assign
from testbench.firmware import Controller
from testbench.programs import punched

WORDS = 1000        # of the model's memory
AS_BUILT = 0, 0, 122


@pytest.fixture
def machine():
    return Controller()


@pytest.fixture
def burning(machine):
    """A machine with a condition that may discharge."""
    machine.unlock()
    assert machine.line("C140")[-1] == "ok"
    return machine


def test_inputs_are_told_with_gateware_and_clock(machine):
    machine.library.gk_inputs(0x1234567, 983, 40)
    build, inputs, answer = machine.line("$inputs")
    gateware, clock_hz, cycle = map(int, build.removeprefix("[BUILD:")[:-1].split(","))
    assert (gateware, clock_hz) == (0x12345678, machine.clock_hz)
    assert 0 < cycle < 2**32
    assert inputs.startswith(f"[INPUTS:{0x1234567},983,40,")
    assert answer == "ok"


def test_every_word_of_the_memory_is_read_once_and_in_order(machine):
    assert machine.library.gk_words_read() == 0
    assert machine.line("$MEMORY", 200) == [f"[MEMORY:{4 * WORDS}]", "ok"]
    assert machine.library.gk_words_read() == WORDS


def test_levels_are_tried_and_the_converter_runs_meanwhile(machine):
    assert not machine.gap["convert"]
    assert machine.line("$LEVELS=300,200")[-1] == "ok"
    assert machine.gap["reference"] == (300, 200, 122)
    assert machine.gap["convert"]
    assert machine.line("$LEVELS")[-1] == "ok"
    assert machine.gap["reference"] == AS_BUILT
    assert not machine.gap["convert"]


def test_a_condition_ends_the_trial(burning):
    before = burning.gap["reference"]
    burning.line("$LEVELS=300,200")
    assert burning.gap["reference"] == (300, 200, before[2])
    assert burning.line("C140")[-1] == "ok"
    assert burning.gap["reference"] == before
    assert not burning.gap["convert"]


@pytest.mark.parametrize("way", ["M00", "M01", "single"])
def test_no_discharge_comes_back_after_a_pause_with_levels_that_are_tried(burning, way):
    burning.line(assign("optional_stop", 1))
    burning.line(assign("single_block", int(way == "single")))
    before = burning.gap["reference"]
    burning.tape(punched(["C140", "M03", *([way] * (way != "single")), "G04 P5000", "M02"]),
                 passes=1000)
    if way == "single":
        burning.send(b"~")
        burning.run(100)    # from the stop after C140 to that after M03
    assert "discharge" not in burning.flags, "it stands after the block with M03"
    assert burning.line("$LEVELS=1000,0")[-1] == "ok"
    assert burning.gap["reference"][:2] == (1000, 0)
    burning.send(b"~")
    burning.run(100)
    assert "discharge" in burning.flags
    assert burning.gap["reference"] == before


def test_the_memory_is_not_read_in_a_discharge(burning):
    burning.line("M03")
    *said, answer = burning.line("$MEMORY")
    assert answer == error_line("busy")
    assert "M05 comes first" in " ".join(said)
    assert burning.library.gk_words_read() == 0


def test_no_discharge_comes_on_with_levels_that_are_tried(burning):
    before = burning.gap["reference"]
    burning.line("$LEVELS=300,200")
    assert burning.line("M03")[-1] == "ok"
    assert "discharge" in burning.flags
    assert burning.gap["reference"] == before
    code, = {answer for answer in burning.line("$LEVELS=300,200") if answer.startswith("error")}
    assert code == error_line("busy")
    assert burning.gap["reference"] == before


def test_a_reset_ends_the_trial(machine):
    machine.line("$LEVELS=300,200")
    machine.send(b"\x18")
    machine.run()
    assert not machine.gap["convert"]
    assert machine.gap["reference"] == AS_BUILT


@pytest.mark.parametrize("text", ["$LEVELS=", "$LEVELS=1", "$LEVELS=1,", "$LEVELS=1,2,",
                                  "$LEVELS=1024,0", "$LEVELS=0,1024", "$LEVELS1,2", "$LEVELSX",
                                  "$LEVELS=-1,2"])
def test_other_words_are_refused_and_change_nothing(machine, text):
    *said, answer = machine.line(text)
    assert answer == error_line("command")
    assert "$LEVELS=open,arc" in " ".join(said)
    assert machine.gap["reference"] == AS_BUILT
