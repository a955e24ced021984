# SPDX-License-Identifier: Apache-2.0
"""An orbit sunk on the simulated machine: shorts of natural cause take it back along its helix."""

from host import machine as machines
from host.run import Run
from host.simulation import Simulation as Piped
from host.tape import load
from testbench.cosim.job import MM
from testbench.cosim.wander import WATCHED, Train, places
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

MACHINE = machines.load("sinker")
STRAIGHT_MM = 0.5       # down before the orbit
LIMIT_MM = 3.0
TURN_PULSES = 3180


def test_shorts_in_the_orbit_go_back_the_way_it_came():
    tape = load(TAPES / "sink_orbit.nc")
    drop = round(MACHINE.initial_gap_mm * MM)
    train = Train(places(tape.rows, above=drop))
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        session.watch(WATCHED)
        job = Run(MACHINE, tape, Piped(session),
                  watch=lambda _: train.take(session.changes()))
        assert job.execute() == "end", job.alarm
        train.take(session.changes())
        assert train.settled()
        assert session.probe("path_position") == len(train.way) - 1
        assert tuple(session.probe(f"axis_{axis}_command") for axis in "xyz") == train.way[-1]
    ends = [event for event in job.events if event["event"] == "retraction_end"]
    inside = [event for event in job.events if event["event"] == "retraction_start"
              and event["cause"] == "short" and event["pos"]["z"] < -STRAIGHT_MM]
    # Amid an arc, and back by more than a turn.
    assert any(event["pos"]["y"] for event in inside)
    assert train.backward > TURN_PULSES
    assert all(event["distance"] <= LIMIT_MM for event in ends)
