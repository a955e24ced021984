# SPDX-License-Identifier: Apache-2.0
"""The zero at what was touched: the firmware on the simulated machine, with a G92 in force."""

import pytest

from host.machines import machine as machines
from host.touch.cycles import Probe, edge
from testbench.cosim import touch
from testbench.native.simulation import Simulation

SINKER = machines.load("sinker")
PROBE = Probe(reach=1.5, back=0.3, near=0.04, clear=0.4, offset=0.002)
# A place of the report has 0.0001 mm, a pulse; two of them and the line's are added.
WITHIN_MM = 2.01e-4


@pytest.mark.parametrize("start", [
    "G92 X3 Y-2 Z7", pytest.param("G92.1", marks=pytest.mark.soak),
    pytest.param("G56\nG92 Z7.5\nG20", marks=pytest.mark.soak)])
def test_the_touched_surface_reads_zero_in_the_work_offsets(start):
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1,
                    trace=False) as session:
        readings = touch.zeroed(session, start, edge(PROBE, "Z", -1), [1, 2])
    assert {system: set(reading) for system, reading in readings.items()} == {1: {"Z"}, 2: {"Z"}}
    for reading in readings.values():
        assert reading["Z"] == pytest.approx(0, abs=WITHIN_MM)
