# SPDX-License-Identifier: Apache-2.0
"""Scenarios: a bad serial line and plain lines. No damaged line is carried out unnoticed.

Each scenario reproduces a fault that an earlier controller had.
"""

from softcore.tables.faults import error_line
from testbench.cosim.terminal import Terminal
from testbench.native.station import Session

__all__ = ["PIECES", "begin_cut", "broken_character", "burst", "check_cut", "strange_character",
           "stray_start"]

PIECES = b"x\n", b"?", b"G4\n", b"$RESUME\n", b"G04 P0\n", b"\n", b"\xff", b"\x02\x01"


def broken_character(session: Session, at: int) -> dict:
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
    if at == 9:
        session.send(b"\n")     # the damage had hit the line's end
    terminal.run(0.3)
    assert terminal.answers(said) == [error_line("line")]
    assert terminal.lines[-2].startswith("[MSG:")
    assert session.probe("axis_z_command") == 0
    terminal.enter("G00 Z-0.01")
    terminal.run(0.1)
    assert session.probe("axis_z_command") == -100
    return {"cycle": session.cycle}


def stray_start(session: Session, stop: bytes) -> dict:
    """`!` and Ctrl-X act after a stray start of a frame."""
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
    return {"cycle": session.cycle}


def strange_character(session: Session) -> dict:
    """An unknown character from 0x80 on is dropped between lines, and refuses a line."""
    terminal = Terminal(session)
    said = len(terminal.lines)
    session.send(b"\xc3\xa4\x80G04 P1\n")
    terminal.run(0.05)
    assert terminal.answers(said) == ["ok"]
    session.send(b"G00 \xb9X1\nG04 P1\n")
    terminal.run(0.05)
    assert terminal.answers(said) == ["ok", error_line("line"), "ok"]
    assert session.probe("axis_x_command") == 0
    return {"cycle": session.cycle}


def begin_cut(terminal: Terminal, *lines: str) -> int:
    """Begin a cut of a quarter of a second; return the number of lines received so far."""
    for line in ("G91 G94 F12", "C100", "M03", "G36 R600 L0.5 H600 E120 Q0.05", *lines):
        terminal.enter(line)
    said = len(terminal.lines)
    terminal.session.send(b"G01 Z-0.05\n")
    terminal.run(0.02)
    return said


def check_cut(terminal: Terminal) -> None:
    """Check that the cut has come to its end, and that the watchdog was called in time."""
    assert terminal.session.probe("axis_z_command") == -500
    assert not terminal.session.probe("safety_status_safe"), terminal.lines[-3:]
    terminal.watched_well()
    terminal.enter("G04 P1")


def burst(session: Session, piece: bytes) -> dict:
    """3 kB at once in a cut, more than fits: the cut goes on, and lost lines are reported."""
    terminal = Terminal(session)
    said = begin_cut(terminal)
    count = 3000 // len(piece)
    session.send(piece * count + b"?")
    terminal.run(0.2)
    assert any(text.startswith("<Run|") for text in terminal.lines[said:])
    terminal.run(0.2)  # until the end of the cut some lines wait
    while len(terminal.run(0.1)) > 1:
        pass
    session.send(b"\n")  # the end of a line may have been lost
    terminal.run(0.1)
    answers = terminal.answers(said)
    assert len(answers) <= count + 2
    assert error_line("line") in answers or piece in (b"?", b"\n", b"\xff")
    check_cut(terminal)
    return {"cycle": session.cycle}
