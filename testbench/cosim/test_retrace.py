# SPDX-License-Identifier: Apache-2.0
"""A path of very short blocks: how fast it is machined, and the way back over thousands of them."""

from dataclasses import dataclass

import pytest

from host import machine as machines
from host.link import RETRACT
from rtl.motion.retraction import State
from testbench.cosim.job import MM, Data, Job, program
from testbench.cosim.wander import WATCHED, Train
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
BLOCK = 100             # pulses: 10 um
LOOK_CLOCKS = 20_000    # between two looks at a condition
# What the firmware keeps up with at the simulation's 2 MHz, mm/s: 22000 clocks for a block that is
# read, some 3000 for one that is remembered. The rapid feed is 30; a board's clock is 25 times as
# fast.
FORWARD, BACK = 0.8, 4.5


@dataclass
class Way:
    """One way along the path: mean speed in mm/s, highest one, and lowest coordinate."""

    mean: float = 0.0
    highest: float = 0.0
    lowest: int = 0


def go(job, train, until):
    """Let the machine go one way until something holds."""
    begin, since = job.probe("path_position"), job.session.cycle
    way = Way(lowest=begin)
    while not until():
        before, clock = job.probe("path_position"), job.session.cycle
        job.run(LOOK_CLOCKS)
        assert not job.told("alarm"), job.told("alarm")
        changes = job.session.changes()
        train.take(changes)
        way.lowest = min([way.lowest, *(value for _, name, value in changes
                                        if name == "path_position")])
        made = abs(job.probe("path_position") - before)
        way.highest = max(way.highest,
                          made / MM * job.session.clock_hz / (job.session.cycle - clock))
    clocks = max(1, job.session.cycle - since)
    way.mean = abs(job.probe("path_position") - begin) / MM * job.session.clock_hz / clocks
    return way


def retrace(blocks, back):
    """Machine so many blocks in a line, go ``back`` of them and forward again.

    Returns the mean speed of the first way in mm/s, and the two other ways.
    """
    data = Data(speed=1800, limit=back * BLOCK / MM, high=1800, low=600, changeover=0.01)
    train = Train([(count, 0, 0) for count in range(blocks * BLOCK + 1)])
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, watched=WATCHED)
        # The last block takes long enough for the operator.
        job.start(program(data, "G91 G00", *["X.01"] * (blocks - 1), "G01 X.01 F2"))
        go(job, train, lambda: job.probe("path_position") > (blocks - 1) * BLOCK)
        job.press(RETRACT)
        backward = go(job, train, lambda: job.told("retraction_end"))
        front = job.probe("path_front")
        again = go(job, train, lambda: job.probe("path_status_state") == State.FRONT.value)
        told, = job.told("retraction_end")
        assert told["reason"] == "limit"
        assert min(backward.lowest, again.lowest) == front - back * BLOCK
        while not job.told("program_end"):
            go(job, train, lambda: True)
            job.run(LOOK_CLOCKS)
            train.take(session.changes())
        assert train.settled()
        assert job.probe("path_position") == job.probe("axis_x_command") == blocks * BLOCK
        # The first way goes on while the tape is read: its blocks tell their times.
        told = [event["cycle"] for event in job.told("block")][2:-2]
        forward = (len(told) - 1) * BLOCK / MM * session.clock_hz / (told[-1] - told[0])
        return forward, backward, again


def test_way_back_over_short_blocks_ends_at_the_limit():
    forward, *ways = retrace(600, 500)
    assert forward > FORWARD
    assert min(way.mean for way in ways) > BACK


@pytest.mark.soak
def test_way_back_over_five_thousand_blocks_ends_at_the_limit():
    forward, *ways = retrace(10_000, 5_000)
    assert forward > FORWARD
    assert min(way.mean for way in ways) > BACK
