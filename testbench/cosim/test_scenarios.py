# SPDX-License-Identifier: Apache-2.0
"""Every scenario on the simulations of the emitted Verilog, its firmware and the machine.

All of them run natively. The first of every kind runs under cocotb and Verilator as well, and the
others in the soak: they differ by an argument. That both simulations are equal in every clock is
held by ``test_controller.py``.
"""

import pytest

from host.machines import machine as machines
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
SEED = 1


def firsts():
    """Scenarios that are the first of their function."""
    return tuple({scenario.function: scenario for scenario in reversed(SCENARIOS)}.values())


def run(scenario):
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=SEED,
                    trace=False) as session:
        return scenario.run(session)


def same_under_cocotb(scenario, workdir):
    return cosimulate(scenario.function, workdir, machine=MACHINE.tables, seed=SEED,
                      **scenario.arguments) == run(scenario)


@pytest.mark.parametrize("scenario", firsts(), ids=str)
def test_the_first_of_a_kind_is_the_same_natively_and_under_cocotb(scenario, workdir):
    assert same_under_cocotb(scenario, workdir)


OTHERS = tuple(scenario for scenario in SCENARIOS if scenario not in firsts())


@pytest.mark.parametrize("scenario", OTHERS, ids=str)
def test_scenario_natively(scenario):
    assert run(scenario)


@pytest.mark.soak
@pytest.mark.parametrize("scenario", OTHERS, ids=str)
def test_scenario_is_the_same_natively_and_under_cocotb(scenario, workdir):
    assert same_under_cocotb(scenario, workdir)
