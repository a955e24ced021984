# SPDX-License-Identifier: Apache-2.0
"""A path of very short blocks: its speed, and the way back over thousands of blocks."""

import pytest

from host.machines import machine as machines
from host.run import simulation
from host.run.run import Run
from host.tape.tape import load
from testbench.cosim.job import MM
from testbench.cosim.short_blocks import first_pass, retrace
from testbench.native.simulation import Simulation
from testbench.punch import TAPES
from testbench.some import some

MACHINE = machines.load("sinker")

# Speeds with which the firmware keeps up at the simulation's 2 MHz, mm/s. A block that is read
# costs 18 000 clocks: 1.11 measured (1.168 before the check of the image, overrides and more
# frequent guards; the places of the code in a cache of 4 KiB move it by a tenth). A remembered
# block costs some 3000. The rapid feed is 30; a board's clock is 25 times as fast.
FORWARD, BACK = 1.04, 4.5
# At most, a block of 10 um: 27.4 mm/s at 50 MHz, a line of 1 Mbaud. Measured are 17 738 at 2 MHz,
# with the sources of `image.FAST` compiled for speed.
CLOCKS, SAID = 18_200, 33


def test_way_back_over_short_blocks_ends_at_the_limit():
    forward, *ways = retrace(600, 500)
    assert forward > FORWARD
    assert min(way.mean for way in ways) > BACK


@pytest.mark.parametrize("clock_hz", some([2_000_000, 50_000_000]))
def test_a_board_keeps_up_with_short_blocks(clock_hz):
    cost = first_pass(160, clock_hz)
    assert cost.clocks < CLOCKS
    assert cost.said < SAID


@pytest.mark.soak
def test_way_back_over_five_thousand_blocks_ends_at_the_limit():
    forward, *ways = retrace(10_000, 5_000)
    assert forward > FORWARD
    assert min(way.mean for way in ways) > BACK


@pytest.mark.soak
def test_the_tape_of_short_blocks_goes_back_to_its_middle():
    """Blocks of (8, 6) and (6, 8) um in turn. The motors turn before it: they lag behind."""
    front, turned = 0, []       # turned: place furthest back and the front then, path pulses
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        session.watch(("path_position", "path_front"))

        def watch(run):
            nonlocal front, turned
            back = any(event["event"] == "retraction_start" for event in run.events)
            for _, name, value in session.changes():
                if name == "path_front":
                    front = value
                elif back:
                    turned = min(turned or [value, front], [value, front])

        machine_on = simulation.Simulation(session)
        job = Run(MACHINE, load(TAPES / "sink_blocks.nc"), machine_on, watch=watch)
        assert job.execute() == "end", job.alarm
        positions = machine_on.positions()
    end, = (event for event in job.events if event["event"] == "retraction_end")
    assert (end["reason"], end["distance"]) == ("limit", 50.0)
    # From within the last block.
    assert turned[0] == turned[1] - 50 * MM
    assert all(abs(positions[axis] - 70 * MM) <= 1 for axis in "xy")
