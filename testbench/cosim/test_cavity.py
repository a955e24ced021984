# SPDX-License-Identifier: Apache-2.0
"""A run on the machine ``cavity``: the walls that its report and the experiment tell of."""

import json
from math import pi

import numpy as np
import pytest

from host.experiments.roughing import SWEEP, Trial, run, staircase_for
from host.machines import machine as machines
from host.roughing.basic import read_all
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.run.summary import columns_of, summary_of
from host.tape.tape import load
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

DEPTH_MM = 0.3      # of the short job


@pytest.mark.soak
def test_a_summary_tells_the_walls_of_the_cavity_that_was_cut():
    machine = machines.load("cavity")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=2) as session:
        piped = Piped(session)
        done = Run(machine, load(TAPES / "sink_staircase.nc"), piped)
        done.execute()
        deep, removed = session.get("read.depth_um"), session.get("read.removed_mm3")
        summary = summary_of(done, piped, columns_of(done, piped), seed=2, wall_s=1.0)
    assert (done.outcome, done.alarm) == ("end", None)
    walls = json.loads(json.dumps(summary))["cavity"]
    heights = np.diff(walls["depth_mm"], prepend=0)
    wide = np.array(walls["opening_um"]) / 1000
    area = machine.number("gap", "area_mm2")
    perimeter = machine.number("cavity", "perimeter_mm")
    volume = float(((area + perimeter * wide + pi * wide**2) * heights).sum())
    assert removed == pytest.approx(volume, rel=1e-5)
    assert walls["depth_mm"][-1] == pytest.approx(deep / 1000, abs=1e-5)
    assert walls["widest_um"] == pytest.approx(max(walls["opening_um"]), abs=0.01)
    assert piped.cavity()["opening_um"] == pytest.approx(walls["opening_um"], abs=1e-3)
    # The tape's currents fall from step to step, so the walls are the narrower the deeper.
    assert wide[0] > wide[-2] + 0.005


@pytest.mark.soak
def test_a_short_job_of_the_experiment_consumes_what_its_cavity_opens():
    trial = Trial("staircase", seed=1, depth_mm=DEPTH_MM, parts=3)
    record = run(trial)
    planned = staircase_for(trial, read_all("copper", "steel"))
    assert record["outcome"] == "end"
    # The stock on the bottom stays: the program ends above the depth by it.
    assert record["depth_mm"] == pytest.approx(DEPTH_MM - planned.bottom_um / 1000, abs=0.003)
    walls = record["walls"]
    assert record["consumed_um"] == max(walls["opening_um"]) == record["swept_um"][0]
    assert 0 < walls["depth_mm"][-1] - record["depth_mm"] < 0.15    # by the gap
    by_numbers = {tuple(numbers.items()): widest
                  for numbers, widest in zip(SWEEP, record["swept_um"], strict=True)}
    assert by_numbers[("overcut_um", 80.0),] > 1.5 * record["consumed_um"]
    assert by_numbers[("wall_debris", 0.01),] < record["consumed_um"]
