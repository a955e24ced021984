# SPDX-License-Identifier: Apache-2.0
"""Scenarios: damaged tapes and a damaged line, through the whole system."""

import random
import re
from collections.abc import Sequence

from host.link.framing import frame, frames
from host.link.link import AGAIN, TAKEN
from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.codes import ISO
from host.tape.tape import Tape, encode, load
from softcore.linkmap import DOOR, REALTIME
from testbench.cosim.job import HEIGHT_MM, MM, Job
from testbench.cosim.record import WATCHDOG
from testbench.native.station import Session
from testbench.punch import TAPES, broken

__all__ = ["broken_tapes", "cut_short", "flipped_bits", "hard_work", "natural", "noisy_line"]

WATCHED = ("axis_x_command", "axis_z_command", *WATCHDOG)

TAPE = """\
%
N10 G21 G90 G94
N20 G01 Z0.09 F600
N30 G36 R600 L0.5 H900 E60 Q0.1
N40 X0.01
N50 M02
%
"""
# Blocks with motion, and the axes that only they move.
MOVES = {3: "z", 5: "x"}
PLACE = re.compile(r"Block (\d+)(?: \(N\d+\))?, character (\d+): .*\.")


def _again(job):
    """Unlock, and go back to the place where every tape begins."""
    job.events.clear()
    job.said.clear()
    job.make_ready()
    job.link.command(f"G21 G90 G00 X0 Z{HEIGHT_MM}")
    job.until(lambda: job.link.status()["state"] == "Idle", "the way back", step=10_000)
    assert job.probe("axis_x_command") == job.probe("axis_z_command") == 0


def _refused(job, rows):
    """Run rows of a tape to their one alarm; return its text."""
    job.start(Tape(rows, ISO))
    alarm = job.alarm()
    assert job.link.status()["state"] == "Alarm"
    # At rest, and every pulse of the command known to the encoder.
    job.until(lambda: not any(job.session.errors().values()), "rest", step=2000)
    assert job.probe("axis_z_position") == job.session.positions()["z"]
    return alarm["text"]


def flipped_bits(session: Session, count: int, choice: int) -> dict:
    """One bit of one row flipped, anywhere from the start code to the end of the end word's block.

    One alarm that names the block and the character, and no motion from that block or after it.
    """
    job = Job(session, watched=WATCHED)
    rng = random.Random(choice)
    rows = encode(TAPE).rows
    first = next(at for at, row in enumerate(rows) if row)
    # Row by row: block, and character in it.
    places, block, character = [], 1, 0
    for row in rows[first:]:
        character += 1
        places.append((block, character))
        if row == ISO.end_of_block:
            block, character = block + 1, 0
            if block > 6:
                break
    told = []
    for _ in range(count):
        at, bit = rng.randrange(len(places)), rng.randrange(8)
        flipped = bytearray(rows)
        flipped[first + at] ^= 1 << bit
        text = _refused(job, bytes(flipped))
        damaged, character = places[at]
        match = PLACE.fullmatch(text)
        assert match, text
        # A start that cannot be recognised is missed where the first block ends.
        if damaged > 1:
            assert (int(match[1]), int(match[2])) == (damaged, character), (text, places[at])
        for moving, axis in MOVES.items():
            if moving >= damaged:
                assert job.probe(f"axis_{axis}_command") == 0, (text, axis)
        told.append([at, bit, text])
        _again(job)
    return {"told": told, "cycle": session.cycle}


def cut_short(session: Session, count: int, choice: int) -> dict:
    """Tapes that end anywhere: complete blocks are carried out, and no other block moves."""
    job = Job(session, watched=WATCHED)
    rng = random.Random(choice)
    rows = encode(TAPE).rows
    first = next(at for at, row in enumerate(rows) if row)
    ends = [at for at, row in enumerate(rows) if row == ISO.end_of_block]
    last = ends[5] - 1  # the end word's own block may lack its end
    told = []
    for _ in range(count):
        at = rng.randrange(first + 3, last)
        text = _refused(job, rows[:at])
        whole = sum(end < at for end in ends)
        for moving, axis in MOVES.items():
            if moving > whole:
                assert job.probe(f"axis_{axis}_command") == 0, (at, text, axis)
        told.append([at, text])
        _again(job)
    return {"told": told, "cycle": session.cycle}


def broken_tapes(session: Session, names: Sequence[str] = ()) -> dict:
    """Broken tapes of the collection, all or some: one sentence each, and the position kept."""
    job = Job(session, watched=WATCHED)
    told = {}
    for name, tape in sorted(broken().items()):
        if names and name not in names:
            continue
        text = _refused(job, tape.rows)
        assert text.startswith(f"Block {tape.block}"), (name, text)
        assert tape.words in text, (name, text)
        # What has moved is a block before the damaged one.
        depth = job.probe("axis_z_command")
        assert depth == 0 or tape.block > 5, (name, depth)
        told[name] = [text, depth]
        _again(job)
    # A good tape runs afterwards.
    job.start(TAPE)
    job.finish()
    assert job.probe("axis_x_command") == 0.01 * MM
    job.record.watched_well(session.clock_hz)
    return {"told": told, "cycle": session.cycle}


def _bent(data, at, bit):
    """A frame with one inverted bit, or two neighbours; no byte becomes a real-time byte."""
    realtime = {DOOR, *(one.byte for one in REALTIME)}
    found = bytearray(data)
    while found[at] == data[at] or found[at] in realtime:
        found[at] = data[at] ^ 1 << bit % 8
        bit += 1
    return bytes(found)


def noisy_line(session: Session) -> dict:
    """Frames that are damaged anywhere, come twice, or are cut off: no byte is lost.

    Then lines and frames go over a line that loses, doubles and breaks one byte in eighty.
    """
    job = Job(session, watched=WATCHED)
    rows = encode(TAPE.replace("N50 M02", "(A HOLD !)\nN50 M02")).rows
    sent = list(frames(rows))
    heard = bytearray()

    def answers(data):
        """Answers to a frame until the sender's time-out, with their sequence numbers."""
        session.send(data)
        end = session.cycle + session.clock_hz // 10
        while session.cycle < end and not {TAKEN, AGAIN} & set(heard):
            heard.extend(session.receive(end - session.cycle))
        heard.extend(session.receive(session.clock_hz // 1000))
        rest = iter(heard)
        # Neither of the two occurs in a line.
        found = [(byte, next(rest)) for byte in rest if byte in (TAKEN, AGAIN)]
        heard.clear()
        return found

    for number, (sequence, data) in enumerate(sent):
        for at in (0, 1, 2, 3, -3, -2, -1):
            # Before a tape has begun, what has no start could be a line.
            lost = number == at == 0
            assert [mark for mark, _ in answers(_bent(data, at, number + at))] == (
                [] if lost else [AGAIN]), (number, at)
        if number == 2:
            assert answers(data[:-4]) == [(AGAIN, sequence)]
        assert answers(data) == [(TAKEN, sequence)]
        if number == 1:
            assert answers(data) == [(TAKEN, sequence)], "sent twice, taken once"
    assert frame(0xFF, sent[-1][0]) == sent[-1][1]
    job.until(lambda: job.probe("axis_x_command") == 0.01 * MM, "the end of the tape", step=2000)
    job.run(session.clock_hz // 5)
    assert job.link.status()["state"] == "Idle"
    assert job.probe("axis_z_command") == -100

    session.damage(1, dropped=0.004, doubled=0.004, unstopped=0.004)
    for count in range(30):
        job.link.command(f"G91 G00 X0.{count:04} (HALF OF IT)")
    done = len(job.told("program_end"))
    job.start(TAPE.replace("N40 X0.01", "N40 X0.05"))
    job.until(lambda: len(job.told("program_end")) > done, "the end", step=10_000)
    harms = [harm for harm, _, _ in session.hits()]
    assert min(map(harms.count, ("dropped", "doubled", "unstopped"))) > 1
    assert job.probe("axis_x_command") == 0.05 * MM
    assert job.probe("axis_z_command") == -100
    assert [event["text"] for event in job.told("block")][-5:] == TAPE.replace(
        "N40 X0.01", "N40 X0.05").split("\n")[1:6]
    return {"cycle": session.cycle, "hits": session.hits()}


def hard_work(session: Session) -> dict:
    """The most expensive work of the firmware all at once: it still calls the watchdog in time.

    Numbers with every digit, many blocks without motion before one that acts, short segments around
    corners, blocks as long as may be, status reports asked for all the time, a retraction, a trip.
    """
    job = Job(session, watched=WATCHDOG)
    data = "G36 R600.0000000 L0.5000000 H900.0000000 E60.0000000 Q0.1000000 Z0.5000000"
    zigzag = [f"X0.{x}012345 Y-0.{x}054321 Z0.0{x}76543 F1234.567" for x in range(5)]
    modes = [f"N{number} G90 G94 G21 F{number}00" for number in range(1, 9)]
    words = "N12345678 G01 G91 G94 G21 X.0001234 Y-.0001234 Z-.0001234 F22.0000001 "
    longest = [f"{words}({letter * (254 - len(words))})" for letter in "XY"]
    tape = encode("\n".join([
        "%", "G21 G90 G94 G01", "C100", "M03", data, *zigzag, *modes, data, *zigzag, longest[0],
        *modes, "M08", "G38 P50 L0.1 R600 H600", *modes, longest[1], "G90 G01 Z-0.5 F600", "M02"]))

    def ask():
        job.link.realtime(b"?")
        return False

    assert job.link.send_tape(tape.rows, ask)
    assert not job.told("alarm"), job.told("alarm")
    job.until(lambda: job.probe("axis_z_command") < -2000 or job.told("alarm"), "the last block")
    assert not job.told("alarm"), job.told("alarm")
    job.short(True)
    job.wait("retraction_end")
    session.set("force.estop", 1)
    job.alarm()
    longest = job.record.watched_well(session.clock_hz)
    return {"longest": longest, "events": job.events, "cycle": session.cycle}


def natural(session: Session, name: str, until_s: float) -> dict:
    """A tape of the collection as ``gapkeeper run`` runs it, with nothing forced.

    It runs until at least one way back: a short or a jump, and the way forward or the alarm after.
    """
    job = Run(machines.load("sinker"), load(TAPES / name), Piped(session), until_s=until_s)
    job.execute()
    told = [event["event"] for event in job.events]
    assert "retraction_end" in told
    assert {"resume", "alarm"} & set(told)
    return {"outcome": job.outcome, "alarm": job.alarm, "events": job.events,
            "positions": session.positions(), "discharges": session.discharges()}
