# SPDX-License-Identifier: Apache-2.0
"""Every scenario, on both simulations of the emitted Verilog, its firmware and the machine."""

import pytest

from host.machines import machine as machines
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
SEED = 1


@pytest.mark.parametrize("scenario", SCENARIOS, ids=str)
def test_scenario_is_the_same_natively_and_under_cocotb(scenario, workdir):
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=SEED,
                    trace=False) as session:
        native = scenario.run(session)
    assert cosimulate(scenario.function, workdir, machine=MACHINE.tables, seed=SEED,
                      **scenario.arguments) == native
