# SPDX-License-Identifier: Apache-2.0
"""Every scenario on the simulations of the emitted Verilog, its firmware and the machine.

All of them run natively. The first also runs under cocotb and Verilator, and the others in the
soak. ``test_controller.py`` checks that both simulations are equal in every clock.
"""

import pytest

from host.machines import machine as machines
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native.simulation import Simulation
from testbench.some import some

SEED = 1


def run(scenario, waves=None):
    machine = machines.load(scenario.machine)
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=SEED,
                    trace=False, waves=waves) as session:
        return scenario.run(session)


@pytest.mark.parametrize("scenario", SCENARIOS, ids=str)
def test_scenario_natively(scenario, waves):
    assert run(scenario, waves)


@pytest.mark.parametrize("scenario", some(SCENARIOS), ids=str)
def test_scenario_is_the_same_natively_and_under_cocotb(scenario, workdir, waves):
    machine = machines.load(scenario.machine)
    assert cosimulate(scenario.function, workdir, machine=machine.tables, seed=SEED, waves=waves,
                      **scenario.arguments) == run(scenario)
