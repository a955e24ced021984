# SPDX-License-Identifier: Apache-2.0
"""A tape with a relaxation supply: each spark ends its pulse, and has the energy of its voltage."""

import math

from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from testbench.cosim.sparks import COUNTS
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

MACHINE = machines.load("relaxation")
BURNING, ARCING = 2, 3      # ``plant::Gap::State``
CHARGING_US, OFF_US = 50, 25
SEEN = 6        # clocks from a breakdown to the end of its gate: pads, and the simulated machine's
FULL_UJ = MACHINE.number("relaxation", "step_nf") * 80**2 / 2 / 1000


def test_a_spark_ends_its_pulse():
    clock_us = 1e6 / MACHINE.clock_hz
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1) as session:
        session.watch(("gap_on", "gap_state", *COUNTS))
        job = Run(MACHINE, load(TAPES / "wire_finish_relaxation.nc"), Piped(session), until_s=1.9)
        assert job.execute() == "stopped", job.alarm
        changes = session.changes()
        sparks, total = session.get("read.sparks"), session.get("read.spark_uj")
        square = session.get("read.spark_uj2") / sparks
    longest = CHARGING_US / clock_us
    began = ended = broken = None
    counts, ends = dict.fromkeys(COUNTS, 0), []
    for clock, name, value in changes:
        if name in counts:
            counts[name] = value
        elif name == "gap_state" and value in (BURNING, ARCING) and broken is None:
            broken = clock
        elif name == "gap_on" and value:
            assert ended is None or clock - ended >= OFF_US / clock_us
            began, broken = clock, None
        elif name == "gap_on" and began is not None:
            ended = clock
            assert ended - began <= longest
            if broken is not None and ended - began < longest:
                ends.append(ended - broken)
    assert len(ends) > 300
    # A breakdown below the open level shows when the capacitor is empty, 3 clocks later.
    assert sorted(ends)[len(ends) // 2] <= SEEN
    assert max(ends) <= SEEN + 3
    assert counts["gap_ok_count"] > 3 * counts["gap_dame_count"] > 0
    assert counts["gap_open_count"] > 0
    mean = total / sparks
    assert 0.5 * FULL_UJ < mean < FULL_UJ
    assert 0.05 < math.sqrt(square - mean**2) / mean < 0.3
