# SPDX-License-Identifier: Apache-2.0
"""The watchdog's stages: calls too soon or too late, interrupts not taken, and silence."""

from itertools import pairwise

import pytest

from host.link.link import HeldError
from host.machines import machine as machines
from rtl.safety.watchdog import SECOND_KEY, THIRD_KEY
from softcore.image import target_image
from softcore.tables.causes import numbers
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
PERIOD = 10_000     # clocks, at 2 MHz
EARLIEST = PERIOD // 4
PINS = 1            # clock to the pads' registers
LOOP = 0x6F.to_bytes(4, "little")   # jump to itself
WATCHDOG = 1 << numbers()["watchdog"]
SENTENCE = "ALARM:155 watchdog: the processor does not answer"


def machining(session):
    """A job in the middle of a cut."""
    job = Job(session, watched=("safe", "processor_held", "safety_pet_strobe", "safety_pet"))
    job.start(program(Data(), "G01 Z-0.9 F300"))
    job.reach(2000, pace(session, 300))
    return job


@pytest.fixture
def session():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as made:
        yield made


def test_firmware_keeps_the_window(session):
    """Idle, machining, and while lines come: no call too soon, and answers when asked."""
    job = machining(session)
    for _ in range(20):
        job.link.command("$L")
        job.link.status()
        job.run(20_000)
    written = job.collect().watch_keys(300_000)
    calls = [clock for clock, key in written if key == SECOND_KEY]
    answers = [clock for clock, key in written if key == THIRD_KEY]
    gaps = [after - before for before, after in pairwise(calls)]
    assert len(gaps) > 200
    assert min(gaps) >= EARLIEST
    assert max(gaps) < PERIOD
    waits = [after - before for before, after in pairwise(answers)]
    assert len(waits) > 100
    assert min(waits) >= PERIOD // 2
    assert max(waits) < PERIOD
    assert not session.probe("safety_latched")


def test_interrupts_switched_off_are_noticed(session):
    """The main loop runs on and reports it, until the gateware takes over a period later."""
    job = machining(session)
    answer = [clock for clock, key in job.collect().watch_keys() if key == THIRD_KEY][-1]
    session.poke("interrupts", 0)
    job.run(4 * PERIOD)
    record = job.collect()
    safe = record.rises("safe", answer)[-1]
    assert safe - answer == PERIOD + PINS
    assert record.rises("processor_held", answer) == [safe - PINS + PERIOD + 1]
    assert session.probe("safety_latched") == WATCHDOG
    job.until(lambda: SENTENCE in job.said, "the notice")
    with pytest.raises(HeldError, match=r"^watchdog: the processor does not answer: the processor"):
        job.link.command("$X")


def test_a_program_that_is_gone_is_told_by_the_gateware(session):
    job = machining(session)
    session.load(LOOP * (len(target_image().read_bytes()) // 4))
    session.send(b"?")  # takes it through words that it does not use otherwise
    job.run(20 * PERIOD)
    record = job.collect()
    safe = record.rises("safe")[-1]
    assert safe - record.last_care(safe) == PERIOD + PINS
    assert record.rises("processor_held", safe) == [safe - PINS + PERIOD + 1]
    assert session.probe("safety_latched") == WATCHDOG
    job.run(session.clock_hz)
    assert [line for line in job.said if line.startswith("ALARM")] == [SENTENCE, SENTENCE]
