# SPDX-License-Identifier: Apache-2.0
"""A tape begun at one of its blocks: how it is named, and what a run does with it."""

import pytest

from host.errors import UsageError
from host.machines import machine as machines
from host.run import session, simulation
from host.run.run import Run
from host.tape.start import block_of
from host.tape.tape import encode

TAPE = encode("""%
N10 G21 G90 G94 (N77)
N20 C100
N30 G36 R600 L0.5 H900 E60 Q0.1
M03
N40 G01 Z0.09 F600
/N50 Z0.08
N50 Z0.07
N0060 M02
%
""")


@pytest.mark.parametrize(("wanted", "block"), [
    ("1", 1), ("2", 2), ("9", 9), ("N10", 2), ("n40", 6), ("N60", 9), (" 5 ", 5)])
def test_a_block_is_named_by_its_number_or_its_n_word(wanted, block):
    assert block_of(TAPE, wanted) == block


@pytest.mark.parametrize(("wanted", "sentence"), [
    ("0", "begin at 0: the tape has the blocks 1 to 9."),
    ("10", "begin at 10: the tape has the blocks 1 to 9."),
    ("N77", "begin at N77: no block of the tape has this number."),
    ("N50", "begin at N50: the blocks 7, 8 of the tape have this number; give one of those "
            "without N."),
    ("", 'begin at "": give the number of a block, such as 7, or its N word, such as N60.'),
    ("N", 'begin at "N": give the number of a block, such as 7, or its N word, such as N60.'),
    ("-3", 'begin at "-3": give the number of a block, such as 7, or its N word, such as N60.'),
])
def test_a_block_that_is_none_is_named(wanted, sentence):
    with pytest.raises(UsageError) as caught:
        block_of(TAPE, wanted)
    assert str(caught.value) == sentence


def test_a_run_goes_there_at_the_word_of_the_person():
    machine = machines.load("sinker")
    machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=1, trace=False,
                                  waves=None, progress=print)
    asked = []

    def goes_on(what):
        asked.append(what)
        assert not machine_on.front()
        return len(asked) > 3

    job = Run(machine, TAPE, machine_on, from_block=8, goes_on=goes_on)
    try:
        assert job.execute() == "end", job.alarm
    finally:
        machine_on.close()
    assert asked == ["block 8 begins at X0.0000 Y0.0000 Z0.0900: ~ goes there without discharge, "
                     "and on from there"] * 4
    assert [event["text"] for event in job.events if event["event"] == "block"] == [
        "N50 Z0.07", "N0060 M02"]


def test_what_the_controller_asks_is_told_once(monkeypatch):
    said, keys = [], iter([False, False, True, True])
    monkeypatch.setattr(session, "enter_pressed", lambda: next(keys))
    stop = session.Stop(said.append)
    assert [stop("block 8 begins at X0") for _ in range(3)] == [False, False, True]
    assert stop("") is True
    assert said == ["block 8 begins at X0 (Enter)", "programmed stop (M00): Enter goes on"]
