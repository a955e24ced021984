# SPDX-License-Identifier: Apache-2.0
"""A retrofit with stepping motors: 640 steps per mm under a path of 10 000 pulses per mm.

The machine counts the steps at its pins, and knows the true place of each axis behind its play.
"""

import copy
from dataclasses import dataclass, field

import numpy as np
import pytest

from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode, load
from testbench.models.gear import steps_of
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

STEPPER = machines.load("stepper")
GEAR = 640, 10_000
STEP = 15.625       # pulses
BACKLASH = 120      # of X, pulses
HIGHEST = 1500      # of X and Y, mm/min

# X goes up and down to the same places, at which it rests; Y and Z there and back.
BOTH_WAYS = """\
G36 R300 L0.5 H600 E60 Q0.1
G21 G90 G94
G01 X0.4 Y0.3 F1200
G04 P80
X0.8
G04 P80
X0.4003
G04 P80
X0.1 Y-0.3 Z0.35
G04 P80
X0.4003
G04 P80
G00 X3.0
G04 P80
X0 Y0
G04 P80
M02
"""


@dataclass
class Rests:
    """What was seen of the axes each time that they were at rest."""

    session: Simulation
    last: tuple = ()
    since: int = 0
    down: dict = field(default_factory=lambda: dict.fromkeys("xyz", False))
    seen: list = field(default_factory=list)

    def look(self, _):
        now = tuple(self.session.probe(f"axis_{axis}_position") for axis in "xyz")
        if now != self.last:
            for axis, before, after in zip("xyz", self.last or now, now, strict=True):
                if after != before:
                    self.down[axis] = after < before
            self.last, self.since = now, 0
            return
        self.since += 1
        if self.since == 5:     # 50 ms: the drives have come to rest, with their play taken up
            self.seen.append({
                axis: (place, self.down[axis], round(self.session.get(f"read.{axis}_steps")),
                       self.session.get(f"read.{axis}_pulses"))
                for axis, place in zip("xyz", now, strict=True)})


def run(machine, tape, **options):
    """Run a tape; return the job, what was seen at rest, and the trace."""
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1) as session:
        rests = Rests(session)
        job = Run(machine, tape, Piped(session), watch=rests.look, **options)
        job.execute()
        return job, rests, session.trace()


def test_a_way_and_its_way_back_lead_to_the_same_true_places():
    job, rests, trace = run(STEPPER, encode(BOTH_WAYS))
    assert job.outcome == "end", job.alarm
    assert len(rests.seen) >= 8
    at = set()
    for rest in rests.seen:
        for axis, (place, down, steps, true) in rest.items():
            offset = BACKLASH if axis == "x" and down else 0
            assert steps == steps_of(place - offset, *GEAR), rest
            assert abs(true - place) <= STEP / 2 + 0.2, rest
            if axis == "x":
                at.add((place, down))
    assert {(4003, True), (4003, False), (0, True)} <= at, "from both sides"
    assert {rest["z"][0] for rest in rests.seen} == {0, 2500}, "from 0.1 mm to 0.35 mm"
    # The rapid of 1800 mm/min goes no faster than X may, and reaches that.
    speed = np.abs(trace["x"][10:] - trace["x"][:-10]).max() / 10 / 10_000 * 1000 * 60
    assert speed == pytest.approx(HIGHEST, rel=0.02)


def test_without_compensation_the_same_way_ends_beside_it():
    """What the compensation is for, and that the simulated screw does have play."""
    tables = copy.deepcopy(STEPPER.tables)
    tables["settings"]["526"] = 0
    job, rests, _ = run(Machine("worn", tables), encode(BOTH_WAYS))
    assert job.outcome == "end", job.alarm
    off = {down: [true - place for place, down_, _, true in (rest["x"] for rest in rests.seen)
                  if down_ == down] for down in (False, True)}
    assert all(abs(one) <= STEP / 2 + 0.2 for one in off[False])
    assert all(abs(one - BACKLASH) <= STEP / 2 + 0.2 for one in off[True])
    assert min(map(len, off.values())) >= 2


@pytest.mark.soak
def test_a_cavity_is_sunk_to_its_depth():
    job, rests, _ = run(STEPPER, load(TAPES / "sink_jump.nc"))
    assert job.outcome == "end", job.alarm
    assert sum(event["event"] == "retraction_start" for event in job.events) > 10
    assert len(rests.seen) > 3
    for rest in rests.seen:
        for axis, (place, down, steps, true) in rest.items():
            offset = BACKLASH if axis == "x" and down else 0
            assert steps == steps_of(place - offset, *GEAR), rest
            assert abs(true - place) <= STEP / 2 + 0.2, rest
