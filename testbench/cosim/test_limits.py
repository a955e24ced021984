# SPDX-License-Identifier: Apache-2.0
"""The ends of the travel: soft limits of the gateware, and the way off a limit switch."""

from itertools import pairwise

import pytest

from host.link.link import RETRACT, RefusedError
from host.machines import machine as machines
from testbench.cosim import limits
from testbench.cosim.job import MM, Data, Job, program
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
LEAVING_CLOCKS = MACHINE.clock_hz // MM     # between path pulses at 60 mm/min


@pytest.fixture
def job():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        yield Job(session, watched=("safe", "path_position", "gap_on", "gap_sense",
                                    "safety_limits_leaving"))


def by_hand(job, line):
    """Enter a line; return the lines that answer it."""
    count = len(job.said)
    job.link.command(line)
    return job.said[count:]


def refused(job, line):
    """Enter a line that is refused; return the reason."""
    with pytest.raises(RefusedError) as refusal:
        job.link.command(line)
    return refusal.value.reason


def rest(job):
    job.until(lambda: not job.probe("path_status_moving"), "rest", step=2000, seconds=20)
    job.run(job.session.clock_hz // 4)


def test_a_soft_limit_holds_whatever_firmware_believes():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        limits.soft_limit(session)


def test_firmware_refuses_what_the_gateware_would_stop(job):
    for word in ("X299.1", "Y-299.1", "Z-299.2", "Z100.2"):
        assert f"{word[0]} is beyond the travel" in refused(job, f"G90 G00 {word}")
    assert not job.probe("safety_status_safe")


def test_the_way_off_a_limit_switch(job):
    session = job.session
    session.set("side.limit_high_mm", 1.0)
    job.start(program(Data(), "G00 Z2"))
    alarm = job.alarm()
    assert "an axis is on its upper limit switch (axis Z)" in alarm["text"]
    assert "the position is kept" in alarm["text"]
    rest(job)
    begun = session.cycle
    said = by_hand(job, "$X")
    assert ("[MSG:On the upper limit switch of axis Z: only away from it, slowly, without "
            "discharge.]") in said
    assert "Z leads further onto its upper limit switch" in refused(job, "G91 G00 Z0.1")
    assert "M03 has to wait" in refused(job, "C100 M03")
    job.press("G91 G00 Z-2")
    assert job.probe("safety_limits_leaving")
    job.until(lambda: not job.probe("safety_limits_leaving"), "the switch is left", step=1000,
              seconds=5)
    rest(job)
    record = job.collect()
    left = record.changes("safety_limits_leaving", begun)[-1][0]
    slow = [clock for clock, _ in record.changes("path_position", begun, left)]
    assert len(slow) > 100
    # The ramp lets a pulse go some clocks sooner or later.
    assert (slow[-1] - slow[1]) / (len(slow) - 2) >= LEAVING_CLOCKS - 0.1
    assert min(after - before for before, after in pairwise(slow)) >= 0.95 * LEAVING_CLOCKS
    fast = [clock for clock, _ in record.changes("path_position", left, session.cycle)]
    assert min(after - before for before, after in pairwise(fast)) < LEAVING_CLOCKS / 20
    assert not record.rises("gap_on", begun, left)
    assert record.rises("gap_sense", begun, left), "the contact guard watches"
    # The machine is as after any $X.
    job.pipe.press_arm()
    by_hand(job, "C100 M03")
    job.run(session.clock_hz // 50)
    assert job.collect().rises("gap_on", left)
    by_hand(job, "G91 G00 Z0.1")


def test_no_pulse_goes_further_onto_the_switch(job):
    # Firmware does not know the end of a retraction by hand; the gateware bounds it.
    session = job.session
    session.set("side.limit_high_mm", 1.0)
    job.start(program(Data(), "G00 Z2"))
    job.alarm()
    rest(job)
    by_hand(job, "$X")
    by_hand(job, "G36 R300 L0.5 H600 E60 Q0.05")
    job.press("G91 G01 Z-0.01 F60")
    job.run(session.clock_hz // 100)
    assert job.probe("safety_limits_leaving")
    place = job.probe("axis_z_command")
    count = len(job.told("alarm"))
    job.press(RETRACT)
    job.until(lambda: len(job.told("alarm")) > count, "the trip", step=2000)
    assert "an axis is on its upper limit switch (axis Z)" in job.told("alarm")[-1]["text"]
    assert job.probe("axis_z_command") <= place
    assert not job.probe("safety_limits_leaving")
    assert job.probe("safety_status_safe")
