# SPDX-License-Identifier: Apache-2.0
"""A coder that fails is found in time and named: some cases, and in the soak the whole matrix.

The matrix is every fault in every situation, on every axis of both machines, at 2 and at 50 MHz.
"""

import pytest

from host.machines import machine as machines
from testbench.cosim.coder import FAULTS, SITUATIONS, courses, judge
from testbench.native.simulation import Simulation

# Machine: its axes, a condition, the highest speed in mm/min.
MACHINES = {"sinker": ("xyz", 100, 1800), "wire": ("xy", 500, 900)}
SEED = 1


def check(machine, situation, axis, faults, clock_hz=2_000_000):
    """Try faults in a situation; return those that are not found in time and named."""
    _, condition, highest = MACHINES[machine]
    tables = machines.load(machine).tables
    with Simulation(machine=tables, clock_hz=clock_hz, seed=SEED, trace=False) as session:
        found, begun = courses(session, situation, axis, faults, condition, highest)
    wrong = []
    for fault in faults:
        try:
            judge(situation, axis, fault, found[fault], found[""], begun, clock_hz)
        except AssertionError as error:
            wrong.append(str(error))
    assert not wrong


@pytest.mark.parametrize(("machine", "situation", "axis", "faults"), [
    ("sinker", "rest, then G00", "x", ("open", "b_low")),
    ("sinker", "F12", "z", ("b_high", "cut")),
    ("sinker", "retracting", "z", ("a_low", "swap")),
    ("wire", "F1200", "y", ("both_low", "a_noise")),
])
def test_a_lost_coder_is_found(machine, situation, axis, faults):
    check(machine, situation, axis, faults)


@pytest.mark.soak
@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize(("machine", "axis"), [
    (machine, axis) for machine, (axes, *_) in MACHINES.items() for axis in axes])
@pytest.mark.parametrize("clock_hz", [2_000_000, 50_000_000])
def test_every_fault_in_every_situation(clock_hz, machine, axis, situation):
    check(machine, situation, axis, tuple(FAULTS), clock_hz)
