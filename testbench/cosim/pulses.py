# SPDX-License-Identifier: Apache-2.0
"""Distance in clocks between path pulses at the highest speed."""

from itertools import pairwise

from host.machines import machine as machines
from softcore.tables.settings import assign
from testbench.cosim.job import Data, Job, program
from testbench.native.simulation import Simulation

__all__ = ["WAYS", "clocks_a_pulse"]

MACHINE = machines.load("sinker")
# Stepping axes, whose speed is no bound; high acceleration; no bound on arcs.
FAST = (assign("step_axes", 7), assign("reversed_encoders", 0), assign("step_width_ns", 1),
        assign("step_space_ns", 1), assign("acceleration_mm_s2", 100_000),
        assign("highest_speed_mm_min", 60_000), assign("arc_deviation_nm", 0))
WAYS = {"line": "G01 X5 Y3 F3000", "arc": "G03 X5 Y3 R1000 F3000",
        "helix": "G03 X5 Y3 Z3 R1000 F3000"}


def clocks_a_pulse(way):
    """Mean and least clocks between two path pulses, over the middle half of a way of 6 mm."""
    data = Data(speed=1800, limit=1, high=1800, low=600, changeover=0.01)
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        # To drive an axis by steps is to lose its position.
        job = Job(session, *FAST, "$POSITION=HERE", watched=("path_position",))
        job.start(program(data, "G90", WAYS[way]))
        job.finish()
        clocks = [cycle for cycle, _ in job.record.changes("path_position")]
    apart = [after - before for before, after in pairwise(clocks)]
    middle = apart[len(apart) // 4:3 * len(apart) // 4]
    assert len(middle) > 20_000
    return sum(middle) / len(middle), min(middle)
