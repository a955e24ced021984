# SPDX-License-Identifier: Apache-2.0
"""Axes whose coders are coarser than a pulse of the path: scales of 0.5, 1 and 2 um an edge."""

import pytest

from host.machines import machine as machines
from host.machines.machine import Machine
from host.tape.tape import encode, load
from testbench.cosim.test_stepper import BOTH_WAYS, run
from testbench.models.coder_gear import pulses_of
from testbench.punch import TAPES
from testbench.some import some

SINKER = machines.load("sinker")
REACHED = 1.5       # pulses from an edge: the lags of the loop


def coarse(edges_mm):
    """The sinker with coders of so many edges per mm."""
    tables = {axis: SINKER.tables[axis] | {"steps_per_turn": edges_mm} for axis in "xyz"}
    return Machine("coarse", SINKER.tables | tables)


@pytest.mark.parametrize("edges_mm", some([1000, 2000, 500, 3150]))
def test_a_way_and_its_way_back_lead_to_the_same_places(edges_mm):
    """At rest each axis is within half an edge of its command, as its coder tells and in truth."""
    job, rests, _ = run(coarse(edges_mm), encode(BOTH_WAYS))
    assert job.outcome == "end", job.alarm
    assert len(rests.seen) >= 8
    edge = 10_000 / edges_mm
    for rest in rests.seen:
        print(rest)
