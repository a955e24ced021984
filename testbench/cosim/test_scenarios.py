# SPDX-License-Identifier: Apache-2.0
"""Every scenario on the simulations of the emitted Verilog, its firmware and the machine.

They run natively, and some of the longer ones in the soak alone. There they all run under cocotb
and Verilator, too; ``test_session.py`` has one of its own in every run, with every pin and probe,
and all but two of them in every clock.
"""

import pytest

from host.machines import machine as machines
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native.simulation import Simulation
from testbench.some import some

SEED = 1
# Longer ones, and those that differ in a number from another that runs always.
SELDOM = {"broken_tapes", "flipped_bits-20-1", "hung-clock-0", "hung-clock-7777",
          "hung-memory-0", "hung-memory-7777", "browned_out-20000", "at_speed-593-24",
          "before_first_point-ceiling", "during_readvance-low", "never_clearing-300",
          "cell-broken", *(f"tripped-{cause}" for cause in (
              "drive_fault", "fluid_low", "limit_high", "following_moving")),
          *(f"begins-wall-wire_finish_p{mode}-1.1" for mode in (2, 3, 5))}
OFTEN = [scenario for scenario in SCENARIOS if str(scenario) not in SELDOM]


def run(scenario, waves=None):
    machine = machines.load(scenario.machine)
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=SEED,
                    trace=False, waves=waves) as session:
        return scenario.run(session)


@pytest.mark.parametrize("scenario", some(SCENARIOS, *OFTEN), ids=str)
def test_scenario_natively(scenario, waves):
    assert run(scenario, waves)


def test_those_that_run_seldom_are_there():
    assert {str(scenario) for scenario in SCENARIOS} > SELDOM


@pytest.mark.soak
@pytest.mark.cocotb
@pytest.mark.parametrize("scenario", SCENARIOS, ids=str)
def test_scenario_is_the_same_natively_and_under_cocotb(scenario, workdir, waves):
    machine = machines.load(scenario.machine)
    assert cosimulate(scenario.function, workdir, machine=machine.tables, seed=SEED, waves=waves,
                      **scenario.arguments) == run(scenario)
