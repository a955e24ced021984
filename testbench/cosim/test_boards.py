# SPDX-License-Identifier: Apache-2.0
"""The scenarios on each board's own controller: its clock, its options, its memory's size.

The unit tests of a block hold it in configurations that are quick to simulate. Here the
controller's blocks have those that a board gives them, at 40 MHz: clocks in which the power supply
and the references settle, periods of timers, depths of queues and of the oscilloscope, bytes of
memory. Not the board's are the place of the journal, what is at the pins, the rate of the serial
line and the banks of the memory; the tests of the latter two have the boards' values.
"""

import pytest

from constraints.boards import BOARDS
from host.machines import machine as machines
from softcore.build import controller_options
from softcore.image import target_image
from testbench.cosim.runner import cosimulate
from testbench.cosim.scenarios import SCENARIOS
from testbench.native import build
from testbench.native.simulation import Simulation

SEED = 1
# Under cocotb each takes minutes: a retraction, stops by the coder, the watchdog, contact and the
# gate, and the switching of currents.
UNDER_COCOTB = ("rapid", "tripped-coder", "hung-memory-1234", "touches-G01 Z-0.5 F120-120",
                "stuck-main-cut", "crowded_steps")
CHOSEN = {str(scenario): scenario for scenario in SCENARIOS}


def options(board, machine):
    """Of the controller, for a board beside a machine; and of its memory."""
    return {**build.options(machine), **controller_options(board, board.platform()),
            "memory_size": board.memory_size}


def different():
    """Boards whose controllers differ, with the names of all that have the same."""
    found = {}
    for board in BOARDS:
        key = board.clock_hz, *options(board, {}).items()
        found.setdefault(key, []).append(board)
    return [pytest.param(boards[0], id="+".join(board.name for board in boards))
            for boards in found.values()]


def run(board, scenario):
    """Run a scenario natively on a board's controller; return what it found."""
    tables = machines.load(scenario.machine).tables
    code = build.library(board.clock_hz, lambda _: None, options(board, tables))
    with Simulation(machine=tables, clock_hz=board.clock_hz, seed=SEED, trace=False, code=code,
                    image=target_image(board.memory_size)) as session:
        return scenario.run(session)


@pytest.mark.soak
@pytest.mark.parametrize("scenario", SCENARIOS, ids=str)
@pytest.mark.parametrize("board", different())
def test_scenario_on_a_boards_controller(board, scenario):
    assert run(board, scenario)


@pytest.mark.soak
@pytest.mark.cocotb
@pytest.mark.parametrize("name", UNDER_COCOTB)
@pytest.mark.parametrize("board", different())
def test_a_boards_controller_is_the_same_natively_and_under_cocotb(board, name, workdir):
    scenario = CHOSEN[name]
    tables = machines.load(scenario.machine).tables
    assert cosimulate(scenario.function, workdir, machine=tables, seed=SEED,
                      clock_hz=board.clock_hz, needed=options(board, tables),
                      image=target_image(board.memory_size), **scenario.arguments) == \
        run(board, scenario)
