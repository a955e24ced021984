# SPDX-License-Identifier: Apache-2.0
"""Axes whose coders are coarser than a pulse of the path: scales of 0.5, 1 and 2 um an edge."""

import pytest

from host.machines import machine as machines
from host.machines.machine import Machine
from host.tape.tape import encode, load
from testbench.cosim.test_stepper import BOTH_WAYS, run
from testbench.models.coder_gear import pulses_of
from testbench.models.gear import steps_of
from testbench.punch import TAPES
from testbench.some import some

SINKER = machines.load("sinker")


def coarse(edges_mm):
    """The sinker with coders of so many edges per mm."""
    tables = {axis: SINKER.tables[axis] | {"steps_per_turn": edges_mm} for axis in "xyz"}
    return Machine("coarse", SINKER.tables | tables)


@pytest.mark.parametrize("edges_mm", some([1000, 2000, 500, 3150]))
def test_a_way_and_its_way_back_lead_to_the_same_places(edges_mm):
    """At rest each axis is within an edge of where it was commanded to, from either side."""
    job, rests, _ = run(coarse(edges_mm), encode(BOTH_WAYS))
    assert job.outcome == "end", job.alarm
    edge = 10_000 / edges_mm
    for rest in rests.seen:
        for axis, (place, _, _, true) in rest.items():
            edges = steps_of(place, edges_mm, 10_000)
            assert place == pulses_of(edges, edges_mm, 10_000), (axis, rest)
            assert edges * edge - 0.3 < true < (edges + 1) * edge + 0.1, (axis, rest)
    # An axis that is commanded to between two edges goes to and fro, and is not seen at rest.
    ends = {one["x"][0] for one in rests.seen}
    assert len(ends) >= 3, ends


@pytest.mark.soak
@pytest.mark.parametrize("edges_mm", [500, 1000, 2000])
def test_a_cavity_is_sunk_to_its_depth(edges_mm):
    job, _, _ = run(coarse(edges_mm), load(TAPES / "sink_jump.nc"))
    assert job.outcome == "end", job.alarm
    assert sum(event["event"] == "retraction_start" for event in job.events) > 10
