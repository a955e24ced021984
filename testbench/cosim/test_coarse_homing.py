# SPDX-License-Identifier: Apache-2.0
"""Coders coarser than a pulse: an axis between two edges goes to and fro, and counts as at rest."""

import pytest

from softcore.tables.settings import assign
from testbench.cosim import homing
from testbench.cosim.job import MM
from testbench.cosim.test_homing_index import SINKER, SWITCH_MM
from testbench.native.simulation import Simulation
from testbench.some import some

REST_S = 2.0


def machine(edges_mm, brake_mm_s2=SINKER.tables["axis"]["brake_mm_s2"], **x):
    """The sinker with its switches near, without scatter; its coders have so many edges per mm.

    ``x`` are numbers of the table of its X axis.
    """
    side = {**SINKER.tables["side"], "limit_low_mm": -SWITCH_MM, "limit_high_mm": SWITCH_MM,
            "limit_scatter_um": 0}
    axes = {axis: {**SINKER.tables[axis], "steps_per_turn": edges_mm} for axis in "xyz"}
    axes["x"] |= x
    axes["axis"] = {**SINKER.tables["axis"], "brake_mm_s2": brake_mm_s2}
    return Simulation(machine={**SINKER.tables, "side": side, **axes},
                      clock_hz=SINKER.clock_hz, seed=1, trace=False)


def begin(session, edges_mm, **changed):
    gears = {f"gear_steps_{axis}": edges_mm for axis in "xyz"}
    return homing.begin(session, *(assign(*one) for one in (
        homing.SETTINGS | gears | {"home_order": 1} | changed).items()))


def rests(job):
    """Run until the machine has nothing to do; return the status."""
    session = job.session
    end = session.cycle + round(REST_S * session.clock_hz)
    while (status := job.link.status())["state"] != "Idle":
        assert session.cycle < end, status
        job.run(session.clock_hz // 20)
    return status


@pytest.mark.parametrize(("edges_mm", "pull_off_um"), some([(500, 101), (625, 100), (501, 100)]))
def test_homing_ends_between_two_edges_too(edges_mm, pull_off_um):
    with machine(edges_mm) as session:
        job = begin(session, edges_mm, home_pull_off_um=pull_off_um)
        job.link.command("$POSITION=HERE")      # that of Y and Z, which are not homed
        for _ in range(2):
            job.link.command("$H")
            job.run(session.clock_hz // 20)
            status = rests(job)
            assert float(status["MPos"].split(",")[0]) == pytest.approx(-299, abs=1 / edges_mm)
        assert not job.told("alarm")


@pytest.mark.parametrize("edges_mm", some([500, 625, 3150]))
@pytest.mark.parametrize("way_um", some([1.1, 0.7, 0.9, 0.1]))
def test_a_jog_ends_between_two_edges_too(edges_mm, way_um):
    with machine(edges_mm) as session:
        job = begin(session, edges_mm)
        job.link.command("$POSITION=HERE")
        job.link.command(f"$J=G91 X{way_um / 1000:.4f} F300")
        job.run(session.clock_hz // 5)
        status = rests(job)
        assert abs(float(status["MPos"].split(",")[0]) - way_um / 1000) <= 1 / edges_mm
        job.link.command("G91 G01 X0.1 F300")
        job.run(session.clock_hz // 5)
        rests(job)
        assert session.get("read.x_pulses") / MM == pytest.approx(way_um / 1000 + 0.1,
                                                                  abs=1 / edges_mm)
        assert not job.told("alarm")
