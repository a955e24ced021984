# SPDX-License-Identifier: Apache-2.0
"""A coder that fails is found in time and named: some cases, and in the soak the whole matrix.

The matrix is every fault in every situation, on every axis of both machines, at 2 and at 50 MHz.
"""

import pytest

from host.machines import machine as machines
from softcore.tables.settings import LARGEST_FRICTION, assign, named
from testbench.cosim.coder import DEVIATION_UM, FAULTS, SITUATIONS, courses, judge
from testbench.cosim.job import MM, Job
from testbench.native.simulation import Simulation

# Machine: its axes, a condition, the highest speed in mm/min.
MACHINES = {"sinker": ("xyz", 100, 1800), "wire": ("xy", 500, 900)}
SEED = 1


def check(machine, situation, axis, faults, clock_hz=2_000_000):
    """Try faults in a situation; return those that are not found in time and named."""
    _, condition, highest = MACHINES[machine]
    tables = machines.load(machine).tables
    with Simulation(machine=tables, clock_hz=clock_hz, seed=SEED, trace=False) as session:
        found, begun = courses(session, situation, axis, faults, condition, highest)
    wrong = []
    for fault in faults:
        try:
            figures = judge(situation, axis, fault, found[fault], found[""], begun, clock_hz)
            print(f"{machine} {axis}, {situation}, {fault}: {figures}")
        except AssertionError as error:
            wrong.append(str(error))
    assert not wrong


@pytest.mark.parametrize(("machine", "situation", "axis", "faults"), [
    ("sinker", "rest, then G00", "x", ("open", "b_low")),
    ("sinker", "F12", "z", ("b_high", "cut")),
    ("sinker", "retracting", "z", ("a_low", "swap")),
    ("wire", "F1200", "y", ("both_low", "a_noise")),
])
def test_a_lost_coder_is_found(machine, situation, axis, faults):
    check(machine, situation, axis, faults)


def way(lines, block, fault):
    """Pulses that X has gone from rest, looked at each millisecond until the interlock has tripped.

    The drives have the gain as delivered, whatever is set, so it trips with sound coders, too.
    """
    machine = machines.load("sinker")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=SEED,
                    trace=False) as session:
        job = Job(session, *lines, watched=("safe",))
        session.set("force.encoder_cut", fault)
        job.press(block)
        begun, gone = session.positions()["x"], []
        for _ in range(200):
            job.run(session.clock_hz // 1000)
            gone.append(session.positions()["x"] - begun)
            if job.probe("safe"):
                return gone
    raise AssertionError(f"{block} with {lines}: it never tripped")


@pytest.mark.parametrize(("feed", "share", "friction"), [
    (300, 100, 0), *(pytest.param(*one, marks=pytest.mark.soak) for one in (
        (300, 0, 0), (1800, 100, 0), (1800, 0, 0), (300, 100, LARGEST_FRICTION)))])
def test_no_setting_of_the_gain_takes_the_bound_away(feed, share, friction):
    """A slow loop's model says late that a coder is lost; from the least gain on not too late.

    Nor does a friction that is made up for and that there is not.
    """
    lines = [assign("loop_gain", named("loop_gain").lowest), assign("feed_forward", share),
             assign("drive_friction_x", friction)]
    sound, lost = (way(lines, f"G91 G01 X5 F{feed}", fault) for fault in (0, 1))
    sound += sound[-1:] * len(lost)
    furthest = max(abs(one - other) for one, other in zip(lost, sound, strict=False))
    print(f"F{feed}, feed-forward {share} %, friction {friction}: {furthest / MM * 1000:.0f} um")
    assert 0 < furthest / MM * 1000 <= DEVIATION_UM


@pytest.mark.soak
@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize(("machine", "axis"), [
    (machine, axis) for machine, (axes, *_) in MACHINES.items() for axis in axes])
@pytest.mark.parametrize("clock_hz", [2_000_000, 50_000_000])
def test_every_fault_in_every_situation(clock_hz, machine, axis, situation):
    check(machine, situation, axis, tuple(FAULTS), clock_hz)
