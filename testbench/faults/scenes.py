# SPDX-License-Identifier: Apache-2.0
"""Scenes that only the campaign has: an operator and a host that do what they should not."""

import random

from host.link.framing import PAYLOAD, frames
from host.link.link import GREETING, HOLD, RESET, Link, RefusedError
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode
from softcore.linkmap import REALTIME
from softcore.tables.settings import assign
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.cosim.terminal import Terminal
from testbench.native.station import AXES, Session

__all__ = ["jammed_reader", "mad_host", "nobody_presses", "off_the_switch", "reset_in_motion",
           "settings_in_a_cut"]

GUARDS = (assign("fluid_required", 0), assign("follow_moving", 131_071), assign("step_axes", 4),
          assign("reversed_encoders", 4), assign("loop_gain", 10), assign("low_x_um", 0),
          assign("soft_limit_um", 0), assign("window", 4095))


def refused(job: Job, line: str) -> str:
    """Enter a line that must be refused; return the controller's sentence."""
    try:
        job.link.command(line)
    except RefusedError as error:
        return error.reason
    raise AssertionError(f"{line} was taken")


def settings_in_a_cut(session: Session) -> dict:
    """Settings that guard the machine, while the discharge is on without a block, and in a cut."""
    job = Job(session, watched=("safe",))
    job.link.command("C130")
    job.link.command("M03")
    reasons = [refused(job, line) for line in GUARDS]
    job.link.command("M05")
    job.start(program(Data(), "G01 Z-0.9 F300", condition=130))
    job.reach(2000, pace(session, 300))
    reasons += [refused(job, line) for line in GUARDS]
    assert all("guards the machine" in reason or "a program runs" in reason for reason in reasons)
    # The guards that they would have switched off are in force.
    session.set("force.fluid_low", 1)
    assert "fluid is below its level" in job.alarm()["text"]
    return {"cycle": session.cycle, "reasons": reasons}


def reset_in_motion(session: Session) -> dict:
    """Ctrl-X in the middle of a cut: an alarm, rest, and the reported place is the true one.

    The gateware stops, and the counters go on counting: so nothing is lost.
    """
    job = Job(session, watched=("safe",))
    job.start(program(Data(), "G01 Z-0.9 F300", condition=130))
    job.reach(2000, pace(session, 300))
    session.send(RESET)
    job.link.await_greeting()
    job.run(session.clock_hz // 10)
    assert job.link.status()["state"] == "Alarm"
    stands = session.positions()
    for line in ("G00 Z1", "M03", "G01 Z1 F60"):
        assert "unlock it with $X" in refused(job, line)
    job.link.command("$X")
    job.run(session.clock_hz // 10)
    assert session.positions() == stands
    assert [job.probe(f"axis_{axis}_position") for axis in AXES] == list(stands.values())
    assert "not armed" in refused(job, "C130 M03")
    return {"cycle": session.cycle}


def nobody_presses(session: Session) -> dict:
    """Everything the link can do without a hand at the machine: no discharge."""
    said = []
    link = Link(Piped(session), said.append)
    session.watch(("gap_on", "contactor"))
    session.set("force.short", 0)
    session.set("force.gap_um", 30.0)
    link.await_greeting()
    for line in ("$X", "$POSITION=HERE", "G21 G90 G94", "C130"):
        link.command(line)
    try:
        link.command("M03")
    except RefusedError as error:
        said.append(error.reason)
    else:
        raise AssertionError("M03 was taken")
    link.send_tape(encode(program(Data(), "G01 Z-0.1 F60")).rows, lambda: False)
    link.poll(0.2)
    session.run(session.clock_hz // 5)
    link.poll(0.01)
    assert any("arm" in line for line in said), said[-3:]
    changes = session.changes()
    assert not [row for row in changes if row[1] in ("gap_on", "contactor") and row[2]]
    return {"cycle": session.cycle}


def off_the_switch(session: Session) -> dict:
    """On a limit switch: `$X` allows motion away from it, slowly, and no pulse further onto it."""
    job = Job(session, watched=("safe", "gap_on"))
    session.set("side.limit_high_mm", 1.0)
    job.start(program(Data(), "G00 Z2"))
    alarm = job.alarm()
    assert "an axis is on its upper limit switch (axis Z)" in alarm["text"]
    job.run(session.clock_hz // 4)
    job.link.command("$X")
    begun = session.cycle
    assert "leads further onto its upper limit switch" in refused(job, "G91 G00 Z0.1")
    assert "M03 has to wait" in refused(job, "C100 M03")
    command = job.probe("axis_z_command")
    job.press("G91 G00 Z-0.05")
    job.run(session.clock_hz // 5)
    assert job.probe("axis_z_command") == command - 500
    assert not job.collect().rises("gap_on", begun)
    return {"cycle": session.cycle}


def mad_host(session: Session, count: int, choice: int) -> dict:
    """Many bytes of nonsense, of valid lines at the wrong time, of torn frames.

    Nobody presses ``arm``: no discharge, and no watchdog that expires.
    """
    rng = random.Random(choice)
    session.watch(("gap_on", "contactor", "safety_latched"))
    session.set("force.gap_um", 300.0)
    said = bytearray()
    while GREETING.encode() not in said:
        said += session.receive(session.clock_hz // 10)
    session.send(b"$X\n")
    session.run(session.clock_hz // 20)
    session.changes()
    single = [bytes([one.byte]) for one in REALTIME]
    rows = encode(program(Data(), "G01 Z-0.05 F600", "G00 X0.1")).rows
    lines = [b"$X\n", b"M03\n", b"C130\n", b"$POSITION=HERE\n", b"G91 G01 X0.01 F600\n", b"$X=1\n",
             b"$426=0\n", b"G38 P50 L0.1\n", b"$RESUME\n", b"$RETRACT\n", b"$ARM\n",
             b"@1 M03*0000\n"]
    sent = 0
    while sent < count:
        kind = rng.randrange(6)
        if kind == 0:
            data = rng.randbytes(rng.randrange(1, 60))
        elif kind < 3:
            data = rng.choice(lines)
        elif kind == 3:
            data = rng.choice(single)
        else:
            data = b"".join(piece for _, piece in frames(rows[:PAYLOAD * 2]))
            data = data[:rng.randrange(len(data))]
        session.send(data)
        sent += len(data)
        session.run(100 * len(data))
        session.received()
    session.send(b"\n")
    session.run(session.clock_hz // 10)
    changes = session.changes()
    assert not [row for row in changes if row[1] in ("gap_on", "contactor") and row[2]]
    expired = [row for row in changes if row[1] == "safety_latched" and row[2] & 1 << 6]
    assert not expired, "the watchdog has expired"
    return {"cycle": session.cycle, "sent": sent}


def jammed_reader(session: Session) -> dict:
    """A tape stops within a frame, and goes on later: no row is lost or doubled."""
    job = Job(session, watched=("safe",))
    text = program(Data(), *(f"G01 X{number / 100:g} F600" for number in range(1, 30)))
    sent = [data for _, data in frames(encode(text).rows)]
    middle = len(sent) // 2
    for data in sent[:middle]:
        session.send(data)
        job.run(session.clock_hz // 100)
    session.send(sent[middle][:20])
    job.run(session.clock_hz // 2)
    assert not job.told("alarm")
    assert job.link.status()["state"] == "Run"
    begun = session.cycle
    for data in sent[middle:]:
        session.send(data)
        job.run(session.clock_hz // 100)
    job.finish()
    blocks = [event["text"] for event in job.told("block")]
    assert blocks == [line for line in text.split("\n")[1:] if line and line != "%"][:len(blocks)]
    assert job.probe("axis_x_command") == 2900
    return {"cycle": session.cycle, "begun": begun}


def held_by_terminal(session: Session) -> dict:
    """`!` in the middle of a torn frame holds the machine; nothing else goes on."""
    terminal = Terminal(session, ["path_command"])
    for line in ("G91 G94 F60", "G36 R600 L0.5 H600 E120 Q0.05"):
        terminal.enter(line)
    session.send(b"G01 X1\n")
    terminal.run(0.05)
    session.send(b"\x02\x40\x05" + HOLD)
    terminal.take(300)
    stopped = session.probe("path_command")
    assert stopped
    terminal.run(0.02)
    assert session.probe("path_command") == stopped
    return {"cycle": session.cycle}
