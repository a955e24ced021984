# SPDX-License-Identifier: Apache-2.0
"""An orbit on the simulated machine: natural shorts make it retract along its helix."""

import math

import numpy as np
import pytest

from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from rtl.states import State
from testbench.cosim.job import MM
from testbench.cosim.wander import WATCHED, Train, places
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

MACHINE = machines.load("sinker")
STRAIGHT_MM = 0.5       # down before the orbit
LIMIT_MM = 3.0
TURN_PULSES = 3180
ORBIT = 7500, 34_000    # path coordinates: off the corners at its start and its end
DEVIATION_UM = 2.0      # setting 457
SEED = 3                # with shorts enough: 1000 ms of retractions amid the arcs
NEAR = 3000             # pulses of the path along which the electrode may lag


def off_path(trace, way, lowest, highest):
    """Largest distance of the electrode, by its coders, from the path, um; feeds and states then.

    Of every millisecond in which the path coordinate lies between two bounds.
    """
    way, found = np.array(way), []
    rows = np.flatnonzero((trace["path"] > lowest) & (trace["path"] < highest))
    for row in rows:
        at, place = int(trace["path"][row]), [trace[axis][row] for axis in "xyz"]
        around = way[max(0, at - NEAR):at + NEAR] - place
        found.append(math.sqrt((around**2).sum(axis=1).min()) / 10)
    return max(found), trace["feed"][rows], trace["state"][rows]


@pytest.mark.soak
def test_shorts_in_the_orbit_go_back_the_way_it_came():
    tape = load(TAPES / "sink_orbit.nc")
    drop = round(MACHINE.initial_gap_mm * MM)
    train = Train(places(tape.rows, above=drop))
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=SEED) as session:
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
    # The electrode stays on the path that it has cut, at retraction speed, too.
    off, feed, states = off_path(session.trace(), train.way, *ORBIT)
    assert {State.FRONT.value, State.RETRACTING.value, State.HIGH.value} <= set(states)
    assert off <= DEVIATION_UM
    # Back over thousands of pulses, and not for a moment does it wait for the next piece.
    back = np.abs(feed[states == State.RETRACTING.value])
    assert back.size > 1000
    assert np.quantile(back, 0.01) > 0.9 * np.median(back)
