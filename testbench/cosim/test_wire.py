# SPDX-License-Identifier: Apache-2.0
"""The wire machine with its own controller: a first cut, a wire that breaks, the path's start."""

import copy
import math
from itertools import pairwise

import numpy as np
import pytest

from host.machines import machine as machines
from host.machines.machine import Machine
from host.run import simulation
from host.run.run import Run
from host.tape.tape import encode, load
from softcore.tables.settings import assign
from testbench.cosim.job import MM
from testbench.cosim.wander import WATCHED, Train, places
from testbench.models.wire_offset import Element, beside
from testbench.native.simulation import Simulation
from testbench.punch import TAPES
from testbench.some import some

MACHINE = machines.load("wire")
OFFSET_MM = 0.118        # of wire_punch
CONTOUR = (               # its end points, mm, and centres of arcs: first one counter-clockwise
    (0.5, 0.0), (0.5, 0.4), (0.6, 0.5, -1, 0.6, 0.4), (1.05, 0.5), (1.55, 0.5, 1, 1.3, 0.6),
    (2.1, 0.5), (2.1, -0.3), (1.9, -0.5), (0.6, -0.5), (0.5, -0.4, -1, 0.6, -0.4), (0.5, 0.0))
SHORT_CUT = """%
N10 G21 G90 G94
N20 C500
N30 G36 R60 L0.3 H120 E30 Q0.05
N40 M03
N50 G01 X0.3 F20
N60 M02
%
"""


def execute(tape, machine=MACHINE, watch=lambda run: None, lines=()):
    """Run a tape; the run and its simulation, which is closed."""
    machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=1, waves=None,
                                  progress=print)
    job = Run(machine, tape, machine_on, mdi=list(lines), watch=watch)
    try:
        job.execute()
    finally:
        machine_on.close()
    return job, machine_on


@pytest.mark.soak
@pytest.mark.parametrize("ns", [0, 3000], ids=["voltage", "current"])
def test_slot_is_cut_whatever_tells_a_short(ns):
    job, _ = execute(load(TAPES / "wire_slot.nc"), lines=[assign("short_current_ns", ns)])
    assert job.outcome == "end"
    starts, ends = ([event for event in job.events if event["event"] == name]
                    for name in ("retraction_start", "retraction_end"))
    assert len(starts) == len(ends) > 2
    assert {event["cause"] for event in starts} == {"short"}
    assert {event["reason"] for event in ends} == {"cleared"}


def test_slot_is_cut_to_program_end():
    job, machine_on = execute(load(TAPES / "wire_slot.nc"))
    assert job.outcome == "end"
    assert all(abs(pulses) <= 1 for pulses in machine_on.positions().values())
    trace, plan = machine_on.trace(), machine_on.workpiece()
    cutting = (trace["t"] > 2) & (trace["t"] < 11) & (trace["state"] == 0)
    gap = trace["gap_um"][cutting].mean()
    assert 7 < gap < 11
    # The slot: through the plate's edge, as wide as the wire and its gaps; nothing beside it.
    cell = plan["y"][1] - plan["y"][0]
    kerf = (1 - plan["left"]).sum(axis=0) * cell
    inside = (plan["x"] > 0.3) & (plan["x"] < 1.9)
    assert 0.2 + 2 * gap / 1000 < kerf[inside].mean() < 0.25
    assert kerf[inside].std() < 0.003
    assert np.all(kerf[(plan["x"] > 2.13)] == 0)
    # What the slot lacks is what was removed, and the end of the slot half a circle.
    plate = plan["x"] > 0.13
    gone = kerf[plate].sum() * cell * MACHINE.number("workpiece", "thickness_mm")
    assert gone == pytest.approx(trace["removed_mm3"][-1], rel=0.002)


def test_a_broken_wire_stops_the_machine():
    tables = copy.deepcopy(MACHINE.tables)
    tables["wire"]["break_a"] = 0.01
    job, machine_on = execute(encode(SHORT_CUT), Machine("fragile", tables))
    assert job.outcome == "alarm"
    assert "the wire has a break or its drive reports a fault" in job.alarm["text"]
    assert machine_on.positions()["x"] < 1500


def test_a_short_that_lasts_ends_at_the_start_of_the_path():
    def watch(run):
        if run.simulation.front() > 300:
            run.simulation._native.set("force.short", 1)

    job, machine_on = execute(encode(SHORT_CUT), watch=watch)
    assert job.outcome == "alarm"
    assert "start of the path" in job.alarm["text"]
    end = next(event for event in job.events if event["event"] == "retraction_end")
    assert end["reason"] == "path_start"
    assert abs(machine_on.positions()["x"]) <= 1


def contour():
    """What wire_punch says, in pulses."""
    made = []
    for (x, y, *_), (u, v, *arc) in pairwise(CONTOUR):
        start, end = MM * complex(x, y), MM * complex(u, v)
        turn, *centre = arc or (0, 0, 0)
        centre = MM * complex(*centre)
        made.append(Element(start, end, turn, centre, abs(start - centre) if turn else 0.0))
    return made


def test_the_path_of_the_punch_is_its_contour_offset():
    path = beside(contour(), OFFSET_MM * MM, 1)
    path = [Element(0j, path[0].start), *path, Element(path[-1].end, 0j)]
    way = [complex(x, y) for x, y, _ in places(load(TAPES / "wire_punch.nc").rows)]
    # Half a pulse from what the machine goes along, whose ends and centres are rounded, too.
    assert max(min(element.distance(place) for element in path) for place in way[::7]) < 1.5
    missed = [min(abs(place - element.end) for place in way) for element in path]
    assert max(missed) < 1.5
    assert len(way) == pytest.approx(sum(element.length for element in path), abs=len(path))


def followed(name):
    """Run a tape, every axis pulse in its place. Starts of retractions, plan, pulses backward."""
    tape = load(TAPES / name)
    train = Train(places(tape.rows))
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        session.watch(WATCHED)
        job = Run(MACHINE, tape, simulation.Simulation(session),
                  watch=lambda _: train.take(session.changes()))
        assert job.execute() == "end", job.alarm
        train.take(session.changes())
        assert train.settled()
        assert session.probe("path_position") == len(train.way) - 1
        plan = session.workpiece()
    starts = [event for event in job.events if event["event"] == "retraction_start"]
    assert all(event["cause"] == "short" for event in starts)
    return starts, plan, train.backward


@pytest.mark.soak
def test_shorts_amid_arcs_go_back_along_them():
    starts, plan, backward = followed("wire_arcs.nc")
    for x_mm, y_mm in ((0.4, 0.4), (1.2, 0.4)):
        # Those of the arc about this place: the first ends at this height, the others lie above.
        there = [event["pos"] for event in starts
                 if (event["pos"]["y"] > 0.4) == (x_mm > 1) and event["pos"]["x"] > 0.41]
        assert len(there) > 2
        # Within the lag of the motors, which leads inside.
        assert all(abs(math.hypot(at["x"] - x_mm, at["y"] - y_mm) - 0.4) < 0.002 for at in there)
    assert backward > 500
    # Nothing was cut beside the path by more than the wire's half, its gap and a crater.
    x, y = np.meshgrid(plan["x"], plan["y"])
    beside = np.abs(np.hypot(x - 1.2, y - 0.4) - 0.4) > 0.14
    assert np.all(plan["left"][beside & (y > 0.45) & (x > 0.82)] == 1)


@pytest.mark.parametrize("mode", some([2, 3, 4, 5], 3))
def test_a_tape_begins_to_finish_a_wall_in_each_feed_mode(mode):
    """Its mode is in force, and the mean feed of so short a part within 1/4 of 12 mm/min."""
    machine, modes, drops = machines.load("wall"), set(), []

    def look(_):
        modes.add(session.probe("feed_control_mode"))
        drops.append(session.probe("feed_voltage_drop"))

    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1) as session:
        job = Run(machine, load(TAPES / f"wire_finish_p{mode}.nc"), simulation.Simulation(session),
                  until_s=2.7, watch=look)
        assert job.execute() == "stopped", job.alarm
        trace = session.trace()
    assert modes == {0, min(mode, 4) - 1}   # constant feed, and that of the tape
    # P5 measures a share of the time, half a percent; P4 a drop of more than a volt.
    assert mode < 4 or (np.median(drops) / 65536 < 0.01) == (mode == 5)
    inside = (trace["x"] > 0.02 * MM) & (trace["t"] > 1.3) & (trace["t"] < 2.6)
    t, x = trace["t"][inside], trace["x"][inside]
    assert t[-1] - t[0] > 0.8
    assert (x[-1] - x[0]) / MM / (t[-1] - t[0]) * 60 == pytest.approx(12, rel=0.25)


@pytest.mark.soak
def test_punch_is_cut_round():
    starts, plan, backward = followed("wire_punch.nc")
    # Some of them in the arcs of the hollow.
    assert any(0 < 0.6 - event["pos"]["y"] < 0.2 and 1.1 < event["pos"]["x"] < 1.5
               for event in starts)
    assert backward > 500
    # The punch that is left, within two craters of its contour.
    x, y = np.meshgrid(plan["x"], plan["y"])
    left = plan["left"] > 0.5
    edge = left & ~(np.roll(left, 1, 0) & np.roll(left, -1, 0) & np.roll(left, 1, 1)
                    & np.roll(left, -1, 1))
    punch = (np.abs(x - 1.3) < 0.85) & (np.abs(y) < 0.55)
    surface = MM * (x + 1j * y)[edge & punch]
    off = [min(element.distance(place) for element in contour()) for place in surface]
    assert len(off) > 2000
    assert np.mean(off) < 0.006 * MM
    assert max(off) < 0.020 * MM
