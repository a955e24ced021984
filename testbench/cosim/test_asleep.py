# SPDX-License-Identifier: Apache-2.0
"""The processor sleeps while there is nothing to do."""

import pytest

from host.machines import machine as machines
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
AWAKE = 0.14        # of the clocks of a steady cut, and at rest, at most; 0.10 and 0.11 measured
STEP = 997          # clocks from one look to the next: no period of the firmware's
LOOKS = 4000


@pytest.fixture
def job():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        yield Job(session, watched=())


def awake(session, looks):
    """Share of the clocks in which the processor is awake."""
    seen = 0
    for _ in range(looks):
        session.run(STEP)
        seen += not session.probe("sleep_left")
    return seen / looks


def test_it_is_awake_for_little_of_a_steady_cut(job):
    job.start(program(Data(), "G01 Z-0.9 F6"))
    job.reach(2000, pace(job.session, 6))
    assert 0.02 < awake(job.session, LOOKS) < AWAKE, "it watches over the machine"
    assert not job.session.probe("safety_latched")


def test_it_is_awake_for_little_at_rest(job):
    job.session.run(200_000)
    assert 0.02 < awake(job.session, LOOKS) < AWAKE, "it checks its image"
