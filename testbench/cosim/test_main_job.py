# SPDX-License-Identifier: Apache-2.0
"""The tape of ``make run``, to its end, and the same run again."""

import json
import re
from itertools import pairwise

from host.machines import machine as machines
from host.run.run import Run, write_events
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from testbench.cosim.follower import WATCHED, Follower
from testbench.cosim.job import MM
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

MACHINE = machines.load("sinker")
CHANGE_MM = -1.5        # Zr: from here on the tape has another limit
EACH_SIDE = 5           # retractions of natural cause
SPEED_TOLERANCE = 0.02


def job(name, *, seed=1, until_s=None, watched=()):
    """Run a tape natively; return the run, and its ways back and forth if they are watched."""
    follower = Follower()
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=seed,
                    trace=False) as session:
        if watched:
            session.watch(watched)
        done = Run(MACHINE, load(TAPES / f"{name}.nc"), Piped(session), until_s=until_s,
                   watch=lambda _: follower.take(session.changes()))
        done.execute()
        follower.take(session.changes())
        return done, follower


def test_the_main_job_keeps_its_promises():
    # One test: the run takes half a minute, and tests of a file may go to different processes.
    done, follower = job("sink_shallow_deep", watched=WATCHED)
    check_end(done)
    check_retractions(done, follower)
    check_targets(follower)


def check_end(done):
    """The program ends, after shorts enough on both sides of the change."""
    assert done.outcome == "end"
    depths = [event["pos"]["z"] for event in done.events
              if event["event"] == "retraction_start" and event["cause"] == "short"]
    assert sum(depth > CHANGE_MM for depth in depths) >= EACH_SIDE
    assert sum(depth < CHANGE_MM for depth in depths) >= EACH_SIDE


def check_retractions(done, follower):
    """Every retraction keeps to the data in force."""
    sets = [event for event in done.events if event["event"] == "retraction_set"]
    assert [event["source"] for event in sets] == ["tape"] * 2

    def in_force(cycle):
        return [event for event in sets if event["cycle"] < cycle][-1]

    assert len(follower.ways) == len([event for event in done.events
                                      if event["event"] == "resume"])
    for way in follower.ways:
        data = in_force(way.begin)
        assert way.end is not None
        # Not a pulse beyond the limit, and as many forward as back, from the front as it came to
        # rest; the changeover on the pulse.
        assert way.lowest >= way.first - round(data["limit"] * MM), way
        assert way.net == 0, way
        assert set(way.changeovers) <= {round(data["changeover"] * MM)}, way
    ends = [event for event in done.events if event["event"] == "retraction_end"]
    held = [event for event in ends if event["speed"] is not None]
    for data in sets:
        assert sum(in_force(event["cycle"]) is data for event in held) >= EACH_SIDE
        assert sum(bool(way.changeovers) and in_force(way.begin) is data
                   for way in follower.ways) >= EACH_SIDE
    for event in held:
        speed = in_force(event["cycle"])["speed"]
        assert abs(event["speed"] - speed) <= SPEED_TOLERANCE * speed, event
    for event in ends:
        assert event["distance"] <= in_force(event["cycle"])["limit"], event


def check_targets(follower):
    """Interrupted blocks end on their targets."""
    initial = round(MACHINE.initial_gap_mm * MM)
    tape = (TAPES / "sink_shallow_deep.nc").read_text()
    depths = re.findall(r"^N\d+ (?:G01 )?Z-([\d.]+)", tape, re.MULTILINE)
    # Path coordinates of the ends of the two cuts; Z there, and nowhere deeper.
    ends = [initial + round(float(depth) * MM) for depth in depths]
    assert len(ends) == 2
    for begin, end in pairwise([0, *ends]):
        assert any(begin < way.front < end for way in follower.ways)
        assert follower.places[end] == -end
    assert min(follower.places.values()) == -ends[-1]


def test_the_same_seed_gives_the_same_events_to_the_byte(workdir):
    told = []
    for seed in (7, 7, 8):
        done, _ = job("sink_jump", seed=seed, until_s=1.8)
        write_events(done.events, workdir / "events.jsonl")
        told.append((workdir / "events.jsonl").read_bytes())
    assert told[0] == told[1] != told[2]
    assert all(json.loads(line)["cycle"] for line in told[0].splitlines())
