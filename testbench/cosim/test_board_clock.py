# SPDX-License-Identifier: Apache-2.0
"""A short stretch of a job is the same at 50 MHz and at the simulation's slow clock."""

import pytest

from host.machines import machine as machines
from testbench.cosim.checks import pulses
from testbench.cosim.job import MM, Data, Job, program
from testbench.cosim.retractions import at_limit
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
CLOCKS_HZ = (MACHINE.clock_hz, 50_000_000)     # the boards have 40 MHz
GAP_UM = 32.0           # of the stretch: wide enough that hardly a pulse is a short
STRETCH_S = 0.3
FEED, DATA = 15, Data(speed=900, high=900, limit=0.3, low=120, changeover=0.1)

# Allowed differences. Speeds: of the rates' resolution and of whole clocks. Pulses and removal:
# four standard deviations of the difference of two seeds.
SPEED = 0.0002
PULSES = 0.01
SHARE = 0.012
REMOVAL = 0.04


def stretch(clock_hz):
    """Machine for a while, then go through one retraction; return the figures a user would see."""
    with Simulation(machine=MACHINE.tables, clock_hz=clock_hz, seed=1, trace=False) as session:
        job = Job(session, watched=("path_status_state",))
        session.set("force.gap_um", GAP_UM)
        session.set("force.debris", 0.1)
        session.set("force.short", -1)
        job.start(program(DATA, f"G01 Z-0.5 F{FEED}", condition=130))
        # A whole number of pulses at the front, so that the feed is measured from edge to edge.
        job.reach(20, 60 * clock_hz / MM / FEED)
        begun, before, depth = session.cycle, session.discharges(), session.get("read.depth_um")
        job.run(round(STRETCH_S * clock_hz))
        job.reach(job.probe("path_position") + 1, 1)
        classes = {kind: count - before[kind] for kind, count in session.discharges().items()}
        found = {"feed": (job.probe("path_position") - 20) / (session.cycle - begun) * clock_hz,
                 "pulses": sum(classes.values()),
                 "removed": session.get("read.depth_um") - depth}
        found |= {kind: count / found["pulses"] for kind, count in classes.items()}
        job.short(True)
        at_limit(job)
        job.short(False)
        job.wait("resume")
        end, = job.told("retraction_end")
        assert pulses(end["distance"]) == pulses(DATA.limit)
        found["plateau"] = end["speed"]
        start, = job.told("retraction_start")
        found["reaction"] = start["latency_cycles"]
        return found


@pytest.mark.soak
def test_the_two_clocks_agree():
    slow, fast = (stretch(clock_hz) for clock_hz in CLOCKS_HZ)
    for name, tolerance in (("feed", SPEED), ("plateau", SPEED), ("pulses", PULSES),
                            ("removed", REMOVAL)):
        assert fast[name] == pytest.approx(slow[name], rel=tolerance), (name, slow, fast)
    for kind in ("open", "ok", "dame", "short"):
        assert fast[kind] == pytest.approx(slow[kind], abs=SHARE), (kind, slow, fast)
    assert slow["pulses"] > 1000
    assert slow["ok"] > 0.9
    assert max(slow["reaction"], fast["reaction"]) <= 8
