# SPDX-License-Identifier: Apache-2.0
"""Stuck gates are found, at every phase and at both clocks; slow gaps give no false alarm."""

import copy
from itertools import pairwise

import pytest

from host.experiments import fluid as experiment
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run import simulation
from host.run.run import Run
from host.tape.tape import load
from testbench.cosim import gates
from testbench.cosim.job import Data, Job, program
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

MACHINE = machines.load("sinker")
SLOW_US = 100.0     # the slowest fall of the gap's voltage that is promised to trip nothing


def session(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz):
    return Simulation(machine=machine, clock_hz=clock_hz, seed=1, trace=False)


def slow(tables):
    """A machine whose gap loses its voltage slowly."""
    found = copy.deepcopy(tables)
    found["source"]["fall_us"] = SLOW_US
    return found


@pytest.mark.parametrize(("kind", "when"), [
    ("main", "open"), ("sensing", "idle"), *(pytest.param(*one, marks=pytest.mark.soak) for one in (
        ("shorted", "short"), ("short_dead", "idle"), ("current_cut", "cut")))])
def test_what_does_not_let_go_is_found(kind, when):
    with session() as one:
        gates.stuck(one, kind, when, delay=13)


def test_a_gate_that_stays_on_after_a_stop_is_named_too():
    with session() as one:
        gates.later(one)


def test_it_is_found_at_every_phase():
    with session() as one:
        assert gates.phases(one, 6)["worst"] <= one.clock_hz // 1000


@pytest.mark.parametrize("gap_um", [500, pytest.param(30, marks=pytest.mark.soak)])
def test_a_gap_that_is_slow_has_longer_pauses_and_trips_nothing(gap_um):
    """The gap falls to 12 V in 190 us from 80 V (open pulse), in 73 us from 25 V (discharge)."""
    with session(slow(MACHINE.tables)) as one:
        job = Job(one, watched=("gap_on",))
        job.start(program(Data(), "G04 P100", condition=130))
        job.until(lambda: job.told("aux", letter="M", code=3), "the discharge")
        one.set("force.gap_um", gap_um)
        job.run(1000)
        begin = one.cycle
        job.run(one.clock_hz // 50)
        pulses = job.collect().rises("gap_on", begin)
        apart = [after - before for before, after in pairwise(pulses)]
        assert not job.probe("safety_status_safe")
        # 100 us on; the pause is not 50 us but the time of the fall, and two clocks each to detect
        # its begin and its end.
        assert max(apart) < 2 * 296
        assert min(apart) in (range(2 * 290, 2 * 296) if gap_um == 500 else range(300, 2 * 180))


@pytest.mark.soak
@pytest.mark.parametrize("clock_hz", [2_000_000, 50_000_000])
def test_it_is_found_at_a_hundred_phases(clock_hz):
    with session(clock_hz=clock_hz) as one:
        assert gates.phases(one, 100)["worst"] <= clock_hz // 1000


@pytest.mark.soak
@pytest.mark.parametrize("kind", [*gates.KINDS, *gates.WIRES])
@pytest.mark.parametrize("when", ["idle", "cut", "open", "short"])
def test_what_does_not_let_go_is_found_whenever_it_comes(kind, when):
    for delay in (0, 5, 19, 77, 131):
        with session() as one:
            gates.stuck(one, kind, when, delay=delay)


@pytest.mark.soak
@pytest.mark.parametrize("falls", ["fast", "slow"])
@pytest.mark.parametrize("ohm_cm", experiment.OHM_CM)
def test_no_fluid_is_taken_for_a_stuck_gate(ohm_cm, falls):
    machine = experiment.machine_with(ohm_cm)
    if falls == "slow":
        machine = Machine(machine.name, slow(machine.tables))
    machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=1, waves=None,
                                  progress=lambda _: None)
    job = Run(machine, load(TAPES / "sink_servo.nc"), machine_on)
    try:
        assert job.execute() == "end", job.alarm
    finally:
        machine_on.close()
