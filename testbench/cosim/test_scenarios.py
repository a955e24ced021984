# SPDX-License-Identifier: Apache-2.0
"""Every scenario on the simulations of the emitted Verilog, its firmware and the machine.

All of them run natively. A few short ones also run under cocotb and Verilator, and the others in
the soak. ``test_controller.py`` checks that both simulations are equal in every clock.
"""

import pytest

from host.machines import machine as machines
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native.build import options
from testbench.native.simulation import Simulation

SEED = 1
# Short ones that run under cocotb too: of the retractions, of touching, of the bursts, of the
# breakdowns, and of the wire machine, whose gateware has other options.
SHORT = ("simple", "touches", "burst", "stuck", "by_current")
CHOSEN = tuple(scenario for scenario in SCENARIOS if scenario.function.__name__ in SHORT)
OTHERS = tuple(scenario for scenario in SCENARIOS if scenario not in CHOSEN)


def gateware(scenario):
    """Options of the gateware that a scenario runs on."""
    return options(machines.load(scenario.machine).tables)


def run(scenario, waves=None):
    machine = machines.load(scenario.machine)
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=SEED,
                    trace=False, waves=waves) as session:
        return scenario.run(session)


def same_under_cocotb(scenario, workdir, waves):
    machine = machines.load(scenario.machine)
    return cosimulate(scenario.function, workdir, machine=machine.tables, seed=SEED, waves=waves,
                      **scenario.arguments) == run(scenario)


def test_every_kind_of_gateware_runs_under_cocotb():
    assert len(CHOSEN) == len(SHORT)
    chosen = [gateware(scenario) for scenario in CHOSEN]
    assert all(gateware(scenario) in chosen for scenario in OTHERS)


@pytest.mark.parametrize("scenario", CHOSEN, ids=str)
def test_short_one_is_the_same_natively_and_under_cocotb(scenario, workdir, waves):
    assert same_under_cocotb(scenario, workdir, waves)


@pytest.mark.parametrize("scenario", OTHERS, ids=str)
def test_scenario_natively(scenario, waves):
    assert run(scenario, waves)


@pytest.mark.soak
@pytest.mark.parametrize("scenario", OTHERS, ids=str)
def test_scenario_is_the_same_natively_and_under_cocotb(scenario, workdir, waves):
    assert same_under_cocotb(scenario, workdir, waves)
