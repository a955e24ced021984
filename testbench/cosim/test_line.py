# SPDX-License-Identifier: Apache-2.0
"""What a bad line may do to a person's plain lines, in the whole simulated system: nothing unsaid.

Each of these was found as it is told here, at a controller that did otherwise.
"""

import pytest

from host import machine as machines
from testbench.cosim.terminal import Terminal
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")


@pytest.fixture
def session():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        yield session


@pytest.mark.parametrize("at", [0, 7, 9])
def test_a_line_with_a_broken_character_moves_nothing(session, at):
    """`G00 Z-0.5` without its point is `G00 Z-05`; without its end it is a part of the next."""
    terminal = Terminal(session)
    terminal.enter("G91")
    said = len(terminal.lines)
    for place, byte in enumerate(b"G00 Z-0.5\n"):
        if place == at:
            session.send_broken(byte)
        else:
            session.send(bytes([byte]))
    terminal.run(0.05)
    session.send(b"\n")  # if it was the line's end that was hit
    terminal.run(0.3)
    assert terminal.answers(said) == ["error:8"]
    assert terminal.lines[-2].startswith("[MSG:")
    assert session.probe("axis_z_command") == 0
    terminal.enter("G00 Z-0.01")
    terminal.run(0.1)
    assert session.probe("axis_z_command") == -100


@pytest.mark.parametrize("stop", [b"!", b"\x18"])
def test_stops_are_heard_after_a_stray_start_of_a_frame(session, stop):
    terminal = Terminal(session, ["path_command", "power_control_machining", "gap_on"])
    for line in ("G91 G94 F60", "C100", "M03", "G36 R600 L0.5 H600 E120 Q0.05"):
        terminal.enter(line)
    session.send(b"G01 Z-1\n")
    terminal.run(0.05)
    assert session.probe("path_command") > 300
    session.send(b"\x02" + stop)
    terminal.take(300)
    stopped = session.probe("path_command")
    assert stopped
    terminal.run(0.02)
    assert session.probe("path_command") == stopped
    assert session.probe("power_control_machining") == (stop == b"!")


def test_a_strange_character_is_dropped_between_lines_and_refuses_a_line(session):
    terminal = Terminal(session)
    said = len(terminal.lines)
    session.send(b"\xc3\xa4\x80G04 P1\n")
    terminal.run(0.05)
    assert terminal.answers(said) == ["ok"]
    session.send(b"G00 \xb0X1\nG04 P1\n")
    terminal.run(0.05)
    assert terminal.answers(said) == ["ok", "error:8", "ok"]
    assert session.probe("axis_x_command") == 0


def _cut(terminal, *lines):
    """Begin a cut that goes on for a quarter of a second; returns how many lines have been said."""
    for line in ("G91 G94 F12", "C100", "M03", "G36 R600 L0.5 H600 E120 Q0.05", *lines):
        terminal.enter(line)
    said = len(terminal.lines)
    terminal.session.send(b"G01 Z-0.05\n")
    terminal.run(0.02)
    return said


def _check_cut(terminal):
    assert terminal.session.probe("axis_z_command") == -500
    assert not terminal.session.probe("safety_status_safe"), terminal.lines[-3:]
    terminal.watched_well()
    terminal.enter("G04 P1")


PIECES = b"?", b"G4\n", b"$RESUME\n", b"G04 P0\n", b"\n", b"\xff", b"\x02\x01"


@pytest.mark.parametrize("piece", [
    b"x\n", *(pytest.param(piece, marks=pytest.mark.soak) for piece in PIECES)])
def test_a_burst_in_a_cut_costs_no_watchdog(session, piece):
    """3 kB at once, faster than they can be taken: the cut goes on, and what is lost is told."""
    terminal = Terminal(session)
    said = _cut(terminal)
    count = 3000 // len(piece)
    session.send(piece * count + b"?")
    terminal.run(0.2)
    assert any(text.startswith("<Run|") for text in terminal.lines[said:])
    terminal.run(0.2)  # until the end of the cut some lines wait
    while len(terminal.run(0.1)) > 1:
        pass
    session.send(b"\n")  # what was lost may have been a line's end
    terminal.run(0.1)
    answers = terminal.answers(said)
    assert len(answers) <= count + 2
    assert "error:8" in answers or piece in (b"?", b"\n", b"\xff")
    _check_cut(terminal)


@pytest.mark.soak
def test_every_line_of_a_flood_is_answered_in_turn(session):
    """500 of them at the pace of 500 kbaud at 50 MHz: what finds no room is refused."""
    terminal = Terminal(session)
    said = _cut(terminal)
    for _ in range(250):
        session.send(b"G4\nx\n")
        terminal.take(5 * 1000)
    while terminal.run(0.1):
        pass
    answers = terminal.answers(said)
    assert len(answers) == 501, answers
    carried_out = answers.index("error:8")
    # Those that found room were the first; while others were refused none was carried out.
    assert answers[:carried_out] == ["ok", *["error:18", "error:11"] * 250][:carried_out]
    assert carried_out > 100
    assert answers.count("error:8") > 50
    assert any("came faster than they were answered" in line for line in terminal.lines[said:])
    _check_cut(terminal)
