# SPDX-License-Identifier: Apache-2.0
"""Paths of very short blocks: the cost of each, and the way back over thousands of them."""

import math
from dataclasses import dataclass

from host.link.link import RETRACT
from host.machines import machine as machines
from rtl.states import State
from softcore.tables.settings import assign
from testbench.cosim.job import MM, Data, Job, program
from testbench.cosim.wander import WATCHED, Train
from testbench.native.simulation import Simulation

__all__ = ["BLOCK", "Cost", "first_pass", "retrace"]

MACHINE = machines.load("sinker")
BLOCK = 100             # pulses: 10 um
LOOK_CLOCKS = 20_000    # between two looks at a condition
ENDS = 20               # blocks at either end of a path that are not counted
RADIUS_MM = 5
# Neither speed nor acceleration bounds these paths.
FAST = (assign("acceleration_mm_s2", 30_000), assign("highest_speed_mm_min", 6000))


@dataclass
class Way:
    """One way along the path: mean speed in mm/s, highest one, and lowest coordinate."""

    mean: float = 0.0
    highest: float = 0.0
    lowest: int = 0


def go(job, train, until):
    """Run in one direction until a condition holds."""
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
    """Machine ``blocks`` blocks in a line, go back over ``back`` of them and forward again.

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


@dataclass(frozen=True)
class Cost:
    """Cost of a block of a path: clocks, and bytes that the controller sent."""

    clocks: float
    said: float


def _line(blocks):
    return ["G91 G00", *["X.01"] * blocks]


def _circle(blocks):
    places = [(RADIUS_MM * (math.cos(angle) - 1), RADIUS_MM * math.sin(angle)) for angle in (
        number * BLOCK / MM / RADIUS_MM for number in range(1, blocks + 1))]
    return ["G90 G01 F2900", *(f"X{x:.4f} Y{y:.4f}" for x, y in places)]


def _passed(blocks, clock_hz, circle, watched=()):
    """Clocks from the first of so many blocks to the last, and what came and changed in them."""
    data = Data(speed=1800, limit=1, high=1800, low=600, changeover=0.01)
    count = blocks + 2 * ENDS
    with Simulation(machine=MACHINE.tables, clock_hz=clock_hz, seed=1, trace=False) as session:
        job = Job(session, *FAST, watched=watched)
        heard, inner, seen = [], job.pipe.read, []
        job.record.extend = seen.extend

        def read(timeout_s):
            data = inner(timeout_s)
            heard.append((session.cycle, len(data)))
            return data

        job.pipe.read = read
        job.start(program(data, *(_circle if circle else _line)(count)))
        job.finish()
        assert abs(job.probe("path_position") - count * BLOCK) <= count
        told = [event["cycle"] for event in job.told("block")][-1 - ENDS - blocks:-ENDS]
        begun, ended = told[0], told[-1]
        return (ended - begun,
                sum(length for cycle, length in heard if begun < cycle <= ended),
                [value for cycle, _, value in seen if begun < cycle <= ended])


def first_pass(blocks, clock_hz, *, circle=False):
    """Cost of a block of 10 um in the middle of so many that are read and machined at once.

    Each is ``X.01``, or, on a circle, about ``X-0.1234 Y1.2345``.
    """
    clocks, said, _ = _passed(blocks, clock_hz, circle)
    return Cost(clocks / blocks, said / blocks)


def fetched(blocks, *, circle=False):
    """Addresses of the instructions that the processor carries out in so many blocks."""
    return _passed(blocks, MACHINE.clock_hz, circle, ("fetched",))[2]
