# SPDX-License-Identifier: Apache-2.0
"""Every scenario on the simulations of the emitted Verilog, its firmware and the machine.

All of them run natively. One of each group also runs under cocotb and Verilator, and the others in
the soak. ``test_controller.py`` checks that both simulations are equal in every clock.
"""

import pytest

from host.machines import machine as machines
from testbench.cosim import tapes
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
SEED = 1


def of_groups():
    """The first scenario of each module, and those that stop the machine or retract at speed.

    The noisy line stands for the tapes: the flipped bits take four times as many clocks.
    """
    firsts = {scenario.function.__module__: scenario for scenario in reversed(SCENARIOS)
              if scenario.function.__module__ != tapes.__name__}
    more = {"above_start_speed", "jump", "hold_and_resume", "hung", "noisy_line"}
    of_name = {scenario.function.__name__: scenario for scenario in reversed(SCENARIOS)
               if scenario.function.__name__ in more}
    assert len(of_name) == len(more)
    return (*firsts.values(), *of_name.values())


def run(scenario, waves=None):
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=SEED,
                    trace=False, waves=waves) as session:
        return scenario.run(session)


def same_under_cocotb(scenario, workdir, waves):
    return cosimulate(scenario.function, workdir, machine=MACHINE.tables, seed=SEED, waves=waves,
                      **scenario.arguments) == run(scenario)


@pytest.mark.parametrize("scenario", of_groups(), ids=str)
def test_one_of_a_group_is_the_same_natively_and_under_cocotb(scenario, workdir, waves):
    assert same_under_cocotb(scenario, workdir, waves)


OTHERS = tuple(scenario for scenario in SCENARIOS if scenario not in of_groups())


@pytest.mark.parametrize("scenario", OTHERS, ids=str)
def test_scenario_natively(scenario, waves):
    assert run(scenario, waves)


@pytest.mark.soak
@pytest.mark.parametrize("scenario", OTHERS, ids=str)
def test_scenario_is_the_same_natively_and_under_cocotb(scenario, workdir, waves):
    assert same_under_cocotb(scenario, workdir, waves)
