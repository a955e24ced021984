# SPDX-License-Identifier: Apache-2.0
"""Sleep of the main loop: repeated while the machine runs by itself, and ended by any event."""

import ctypes

import pytest

from softcore.image import image_digest
from testbench.firmware import KINDS, Controller, Memory
from testbench.programs import punched

TASKS = 4           # passes of a round; it sleeps in the last
SLEEPS = 64         # in a row, as in app/main_loop.c
ROUNDS = 50
ALWAYS = 1 << 31
SILENT, KNOWN = 1 << 3, 1 << 4 # of the fluid's state, see hal.h
DATA = "G36 R300 L.5 H600 E60 Q.1"


@pytest.fixture
def memory():
    return Memory()


@pytest.fixture
def machine():
    ready = Controller()
    ready.unlock()
    ready.library.gk_sleep_lasts(ALWAYS, 0)
    return ready


def to_a_round(machine):
    """Run until a round begins."""
    before = machine.library.gk_sleeps()
    while machine.library.gk_sleeps() == before:
        machine.run(1)


def on_its_way(machine, *blocks):
    """The discharge is on, and the machine stands within a line, without any event."""
    machine.library.gk_speed(0)
    machine.tape(punched([DATA, "C130", "M03", *(blocks or ["G01 Z-1 F6"]), "M05", "M02"]),
                 passes=400)
    machine.library.gk_go(1000)
    machine.run(400)
    to_a_round(machine)
    assert machine.flags >= {"run", "discharge"}


def sleeps_of_a_pass(machine):
    before = machine.library.gk_sleeps()
    machine.run(1)
    return machine.library.gk_sleeps() - before


def sleeps(machine, rounds):
    before = machine.library.gk_sleeps()
    machine.run(TASKS * rounds)
    return (machine.library.gk_sleeps() - before) / rounds


def keys(machine):
    """Calls of the watchdog in the passes of a round before it sleeps."""
    before = machine.library.gk_pets()
    machine.run(TASKS - 1)
    return machine.library.gk_pets() - before


def test_it_sleeps_on_while_the_machine_goes_by_itself(machine):
    on_its_way(machine)
    pets = machine.library.gk_pets()
    assert sleeps(machine, ROUNDS) == SLEEPS
    assert machine.library.gk_pets() - pets > 2 * SLEEPS * ROUNDS, "after each of them"
    assert machine.library.gk_unwatched() == 0, "all work is between the keys"


def test_it_sleeps_on_while_the_machine_rests(machine):
    assert sleeps(machine, ROUNDS) == SLEEPS
    machine.library.gk_moving(1)
    assert sleeps(machine, ROUNDS) == 1, "a coast is looked at"
    machine.library.gk_moving(0)
    machine.tape(punched(["G91 G00 X1", "M02"]), passes=2000)
    machine.run(400)    # the journal is written, too
    assert sleeps(machine, ROUNDS) == SLEEPS


def test_in_a_dwell_each_sleep_ends_with_a_round(machine):
    """Its end is only looked at."""
    machine.tape(punched(["G04 P60000", "M02"]), passes=2000)
    assert sleeps(machine, ROUNDS) == 1


def test_while_the_link_is_not_quiet_each_sleep_ends_with_a_round(machine):
    """A frame that stalls is found by time."""
    assert sleeps(machine, 1) == SLEEPS
    machine.send(machine.framed(5, 0, b"12345")[:6])
    machine.run(TASKS)
    assert sleeps(machine, 1) == 1
    machine.run(400)
    assert sleeps(machine, ROUNDS) == SLEEPS


def test_while_the_journal_is_written_each_sleep_ends_with_a_round(memory):
    machine = Controller(memory=memory)
    machine.unlock()
    machine.library.gk_sleep_lasts(ALWAYS, 0)
    machine.run(2000)
    assert sleeps(machine, ROUNDS) == SLEEPS
    machine.send(b"G10 L2 P1 X1\n")
    machine.run(40)
    assert sleeps(machine, 10) == 1
    machine.run(2000)
    assert sleeps(machine, ROUNDS) == SLEEPS


def test_the_checks_go_on_while_every_round_has_work(machine):
    words = [3, 1, 4, 1, 5]
    for digest in (image_digest(words), 0):
        machine.library.gk_image((ctypes.c_uint32 * len(words))(*words), len(words), digest)
        before = machine.library.gk_sleeps()
        for _ in range(50 * TASKS):
            machine.send(b"?")
            machine.run(1)
        assert machine.library.gk_sleeps() == before, "each round has work"
        assert ("safe" in machine.flags) == (digest == 0)


@pytest.mark.parametrize("whole", [0, 1, 7])
def test_what_wakes_it_begins_a_round_that_serves_the_link_in_each_pass(machine, whole):
    on_its_way(machine)
    served = keys(machine)
    machine.run(1)
    machine.library.gk_sleep_lasts(whole, 0)
    assert sleeps(machine, 1) == whole + 1
    assert keys(machine) == served + 2 * (TASKS - 1), "two keys more in each pass"


@pytest.mark.parametrize("line", ["G38.2 Z-1 F6", "$J=G91 X20 F600"])
def test_in_a_touch_off_and_in_a_jog_each_sleep_ends_with_a_round(machine, line):
    """What ends them is looked at only there."""
    machine.run(400)
    assert sleeps(machine, ROUNDS) == SLEEPS
    machine.library.gk_speed(0)
    machine.line(line, 400)
    assert "run" in machine.flags
    assert sleeps(machine, 5) == 1


def test_it_sleeps_no_further_when_the_machine_is_at_the_end(machine):
    on_its_way(machine)
    machine.run(TASKS - 1)
    machine.library.gk_sleep_lasts(ALWAYS, 1000)
    assert sleeps_of_a_pass(machine) == 9, "9000 pulses were left"


@pytest.mark.parametrize("byte", [b"\x91", b"\x97"])
def test_it_sleeps_no_further_when_an_override_has_come(machine, byte):
    """The byte of an override does not wake the processor."""
    on_its_way(machine)
    machine.run(TASKS)
    machine.run(TASKS - 1)
    machine.library.gk_sleep_says(byte[0])
    assert sleeps_of_a_pass(machine) == 1
    assert sleeps(machine, 1) == 1, "what is loaded has the old rate"
    machine.run(TASKS)
    assert sleeps(machine, 1) == SLEEPS, "it has been obeyed"


def test_it_sleeps_no_further_in_another_segment(machine):
    on_its_way(machine, "G91 G01 Z-.2 F6", "X.2")
    machine.run(TASKS - 1)
    machine.library.gk_sleep_lasts(ALWAYS, 400)
    assert sleeps_of_a_pass(machine) == 3, "1000 pulses of 2000 were left"


def test_it_sleeps_no_further_with_an_event_that_ended_no_sleep(machine):
    on_its_way(machine)
    machine.run(TASKS - 1)
    machine.library.gk_sleep_meets(KINDS.index("fluid_class"), 0)
    assert sleeps_of_a_pass(machine) == 1, "it is told now"


def test_it_is_watched_over_in_between(machine):
    machine.library.gk_fluid(KNOWN)
    assert machine.line("$436=1") == ["ok"]
    on_its_way(machine)
    machine.run(TASKS - 1)
    machine.library.gk_fluid(KNOWN | SILENT)
    machine.run(1)
    assert "discharge" not in machine.flags, "after a few sleeps of those at the round's end"
