# SPDX-License-Identifier: Apache-2.0
"""The wire machine with its own controller: a first cut, a wire that breaks, the path's start."""

import copy

import numpy as np
import pytest

from host import machine as machines
from host import simulation
from host.machine import Machine
from host.run import Run
from host.tape import encode, load
from testbench.punch import TAPES

MACHINE = machines.load("wire")
SHORT_CUT = """%
N10 G21 G90 G94
N20 C500
N30 G36 R60 L0.3 H120 E30 Q0.05
N40 M03
N50 G01 X0.3 F20
N60 M02
%
"""


def execute(tape, machine=MACHINE, watch=lambda run: None):
    """Run a tape; the run and its simulation, which is closed."""
    machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=1, waves=None,
                                  progress=print)
    job = Run(machine, tape, machine_on, watch=watch)
    try:
        job.execute()
    finally:
        machine_on.close()
    return job, machine_on


def test_slot_is_cut_to_program_end():
    job, machine_on = execute(load(TAPES / "wire_slot.nc"))
    assert job.outcome == "end"
    assert all(abs(pulses) <= 1 for pulses in machine_on.positions().values())
    trace, plan = machine_on.trace(), machine_on.workpiece()
    cutting = (trace["t"] > 2) & (trace["t"] < 11) & (trace["state"] == 0)
    gap = trace["gap_um"][cutting].mean()
    assert 7 < gap < 11
    # The slot: through the plate's edge, as wide as the wire and its gaps; nothing beside it.
    cell = plan["y"][1] - plan["y"][0]
    kerf = (1 - plan["left"]).sum(axis=0) * cell
    inside = (plan["x"] > 0.3) & (plan["x"] < 1.9)
    assert 0.2 + 2 * gap / 1000 < kerf[inside].mean() < 0.25
    assert kerf[inside].std() < 0.003
    assert np.all(kerf[(plan["x"] > 2.13)] == 0)
    # What the slot lacks is what was removed, and the end of the slot half a circle.
    plate = plan["x"] > 0.13
    gone = kerf[plate].sum() * cell * MACHINE.number("workpiece", "thickness_mm")
    assert gone == pytest.approx(trace["removed_mm3"][-1], rel=0.002)


def test_a_broken_wire_stops_the_machine():
    tables = copy.deepcopy(MACHINE.tables)
    tables["wire"]["break_a"] = 0.01
    job, machine_on = execute(encode(SHORT_CUT), Machine("fragile", tables))
    assert job.outcome == "alarm"
    assert "the wire is broken or a drive reports a fault" in job.alarm["text"]
    assert machine_on.positions()["x"] < 1500


def test_a_short_that_lasts_ends_at_the_start_of_the_path():
    def watch(run):
        if run.simulation.front() > 300:
            run.simulation._native.set("force.short", 1)

    job, machine_on = execute(encode(SHORT_CUT), watch=watch)
    assert job.outcome == "alarm"
    assert "start of the path" in job.alarm["text"]
    end = next(event for event in job.events if event["event"] == "retraction_end")
    assert end["reason"] == "path_start"
    assert abs(machine_on.positions()["x"]) <= 1
