# SPDX-License-Identifier: Apache-2.0
"""A bad serial line and plain lines, in the whole system: no damage goes unreported."""

import pytest

from host.machines import machine as machines
from softcore.tables.faults import error_line
from testbench.cosim import line
from testbench.cosim.line import begin_cut, check_cut
from testbench.cosim.terminal import Terminal
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")


@pytest.fixture
def session():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        yield session


@pytest.mark.parametrize("at", [7, *(pytest.param(at, marks=pytest.mark.soak) for at in (0, 9))])
def test_a_line_with_a_broken_character_moves_nothing(session, at):
    line.broken_character(session, at)


@pytest.mark.parametrize("stop", [b"!", b"\x18"])
def test_stops_are_heard_after_a_stray_start_of_a_frame(session, stop):
    line.stray_start(session, stop)


def test_a_strange_character_is_dropped_between_lines_and_refuses_a_line(session):
    line.strange_character(session)


@pytest.mark.parametrize("piece", [
    line.PIECES[0], *(pytest.param(piece, marks=pytest.mark.soak) for piece in line.PIECES[1:])])
def test_a_burst_in_a_cut_costs_no_watchdog(session, piece):
    line.burst(session, piece)


@pytest.mark.soak
def test_every_line_of_a_flood_is_answered_in_turn(session):
    """500 lines at the pace of 500 kbaud at 50 MHz: lines without room are refused."""
    terminal = Terminal(session)
    said = begin_cut(terminal)
    for _ in range(250):
        session.send(b"G4\nx\n")
        terminal.take(5 * 1000)
    while terminal.run(0.1):
        pass
    answers = terminal.answers(said)
    assert len(answers) == 501, answers
    carried_out = answers.index(error_line("line"))
    # The first lines found room; after a refused line none was carried out.
    assert answers[:carried_out] == ["ok", *[error_line("missing"),
                                             error_line("number")] * 250][:carried_out]
    assert carried_out > 100
    assert answers.count(error_line("line")) > 50
    assert any("came faster than they were answered" in line for line in terminal.lines[said:])
    check_cut(terminal)
