# SPDX-License-Identifier: Apache-2.0
"""Fixtures of several cosimulation tests."""

import pytest

from host.machines import machine as machines
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")


@pytest.fixture
def on():
    """Switch a machine on, with what its flash memory holds; all are closed in the end."""
    running = []

    def switched_on(flash=None, seed=1):
        running.append(Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=seed,
                                  trace=False, flash=flash))
        return running[-1]

    yield switched_on
    for session in running:
        session.close()
