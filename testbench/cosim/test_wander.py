# SPDX-License-Identifier: Apache-2.0
"""Random programs with random disturbances: no axis pulse is lost, doubled or misplaced."""

import pytest

from host.machines import machine as machines
from testbench.cosim.runner import cosimulate
from testbench.cosim.wander import wander
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")


def natively(program_seed, **arguments):
    """A program of its own on a controller of its own; its figures."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        return wander(session, program_seed, **arguments)


def total(rng, programs, **arguments):
    """Figures of so many programs, added up."""
    found = [natively(rng.getrandbits(32), **arguments) for _ in range(programs)]
    return {name: sum(one[name] for one in found) for name in found[0]}


def test_every_pulse_has_its_place(rng, cases):
    programs = cases(5)
    figures = total(rng, programs)
    assert figures["pulses"] > 2000 * programs
    assert figures["backward"] > 250 * programs
    assert figures["retractions"] > 2 * programs


@pytest.mark.soak
@pytest.mark.cocotb
def test_the_same_natively_and_under_cocotb(rng, workdir):
    program_seed = rng.getrandbits(32)
    short = {"count": 4, "size": 200, "troubles": 6, "quiet": 20_000}
    native = natively(program_seed, **short)
    assert native["pulses"] > 500
    assert native["backward"] > 100
    assert native["retractions"] > 1
    assert cosimulate(wander, workdir, machine=MACHINE.tables, seed=1,
                      program_seed=program_seed, **short) == native


@pytest.mark.soak
@pytest.mark.parametrize("part", range(4))
def test_every_pulse_has_its_place_for_millions_of_them(rng, part):
    """Four parts, so that four processes can share them."""
    figures = total(rng, 25, count=30, size=3000, troubles=60, quiet=300_000)
    print(part, figures)
    assert figures["pulses"] > 750_000
    assert figures["backward"] > 75_000
