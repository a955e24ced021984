# SPDX-License-Identifier: Apache-2.0
"""Every scenario on the simulations of the emitted Verilog, its firmware and the machine.

All of them run natively. One of each group also runs under cocotb and Verilator, and the others in
the soak. ``test_controller.py`` checks that both simulations are equal in every clock.
"""

import pytest

from host.machines import machine as machines
from testbench.cosim import programs, tapes
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native.simulation import Simulation

SEED = 1


def of_groups():
    """The scenarios that run under cocotb too.

    They are the first one of each module, those that stop the machine or retract at speed, and
    those of the wire machine, of the feed modes P2 to P4 and of a series planned on the controller.
    The noisy line stands for the tapes: the flipped bits take four times as many clocks.
    """
    firsts = {scenario.function.__module__: scenario for scenario in reversed(SCENARIOS)
              if scenario.function.__module__ != tapes.__name__}
    more = {"above_start_speed", "jump", "hold_and_resume", "hung", "noisy_line"}
    of_name = {scenario.function.__name__: scenario for scenario in reversed(SCENARIOS)
               if scenario.function.__name__ in more}
    assert len(of_name) == len(more)
    chosen = {str(scenario): scenario for scenario in (*firsts.values(), *of_name.values())}
    return *chosen.values(), *(scenario for scenario in SCENARIOS
                               if scenario.function.__module__ == programs.__name__
                               and str(scenario) not in chosen
                               and scenario.arguments.get("tape") != "wire_finish_p5")


def run(scenario, waves=None):
    machine = machines.load(scenario.machine)
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=SEED,
                    trace=False, waves=waves) as session:
        return scenario.run(session)


def same_under_cocotb(scenario, workdir, waves):
    machine = machines.load(scenario.machine)
    return cosimulate(scenario.function, workdir, machine=machine.tables, seed=SEED, waves=waves,
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
