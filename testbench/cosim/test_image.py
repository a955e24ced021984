# SPDX-License-Identifier: Apache-2.0
"""The firmware compares its image with the digest: the cost of the check, and its findings."""

import pytest

from host.machines import machine as machines
from softcore.tables.faults import alarm_line
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.native.simulation import Simulation
from testbench.native.symbols import firmware_symbols

MACHINE = machines.load("sinker")
SHARE = 0.02        # of the clocks, at most
LEAST = 0.005       # or a round would take minutes
ROUND_S = 50        # of the machine's time: two rounds


@pytest.fixture
def job():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        yield Job(session, watched=("safe",))


def spent(job):
    """Clocks that the check has used."""
    job.link.command("$P")
    told = next(line for line in reversed(job.said) if line.startswith("[PRF:"))
    return int(told.rstrip("]").split("image ")[1])


def share(job, clocks):
    before, begun = spent(job), job.session.cycle
    job.run(clocks)
    return (spent(job) - before) / (job.session.cycle - begun)


def test_it_takes_its_share_of_the_clocks(job):
    """The cost while idle, with sleep between the rounds of the main loop, and in a cut."""
    shares = [share(job, 1_500_000)]
    job.start(program(Data(), "G01 Z-0.9 F300"))
    job.reach(2000, pace(job.session, 300))
    shares.append(share(job, 1_500_000))
    assert min(shares) > LEAST
    assert max(shares) <= SHARE, shares


@pytest.mark.soak
@pytest.mark.parametrize("name", ["__image_digest", "network_ask"])
def test_two_bits_of_a_word_that_is_not_used_are_found(job, name):
    """A changed word with a correct parity is found."""
    address = (firmware_symbols()[name][0] & -4) - (4 if name == "__image_digest" else 0)
    job.run(round(ROUND_S / 2 * MACHINE.clock_hz))
    assert not job.probe("safety_status_safe"), "what is sound stays unnoticed"
    for bit in 3, 17:
        job.session.flip(address, bit)
    job.until(lambda: alarm_line("guard") in job.said, "the alarm", seconds=ROUND_S)
    assert job.probe("safety_status_safe")
    assert "the firmware in memory is not what was loaded" in job.told("alarm")[-1]["text"]
