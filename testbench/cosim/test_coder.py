# SPDX-License-Identifier: Apache-2.0
"""A coder that fails is found in time and named: a few cases, and as a soak the whole matrix."""

from functools import cache

import pytest

from host.machines import machine as machines
from testbench.cosim.coder import FAULTS, SITUATIONS, course, judge
from testbench.native.simulation import Simulation

# Machine: its axes, a condition, the highest speed in mm/min.
MACHINES = {"sinker": ("xyz", 100, 1800), "wire": ("xy", 500, 900)}
SEED = 1


def run(machine, situation, axis, fault, clock_hz):
    _, condition, highest = MACHINES[machine]
    tables = machines.load(machine).tables
    with Simulation(machine=tables, clock_hz=clock_hz, seed=SEED, trace=False) as session:
        return course(session, situation, axis, fault, condition, highest)


@cache
def sound(machine, situation, axis, clock_hz):
    return run(machine, situation, axis, "", clock_hz)[0]


def check(machine, situation, axis, fault, clock_hz=2_000_000):
    found, begun = run(machine, situation, axis, fault, clock_hz)
    return judge(situation, axis, fault, found, sound(machine, situation, axis, clock_hz), begun,
                 clock_hz)


@pytest.mark.parametrize(("machine", "situation", "axis", "fault"), [
    ("sinker", "F300", "z", "cut"), ("sinker", "F12", "z", "b_high"),
    ("sinker", "rest, then G00", "x", "open"), ("sinker", "retracting", "z", "a_low"),
    ("wire", "F1200", "y", "swap"), ("wire", "hold", "x", "cut"),
])
def test_a_lost_coder_is_found(machine, situation, axis, fault):
    check(machine, situation, axis, fault)


@pytest.mark.soak
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize(("machine", "axis"), [
    (machine, axis) for machine, (axes, *_) in MACHINES.items() for axis in axes])
def test_every_fault_in_every_situation(machine, axis, situation, fault):
    check(machine, situation, axis, fault)


@pytest.mark.soak
@pytest.mark.parametrize("fault", ["cut", "a_low", "b_high", "open", "swap"])
@pytest.mark.parametrize("situation", ["rest, then G00", "F12", "F300", "G00", "retracting"])
@pytest.mark.parametrize("machine", MACHINES)
def test_at_the_clock_of_a_board(machine, situation, fault):
    check(machine, situation, MACHINES[machine][0][-1], fault, clock_hz=50_000_000)
