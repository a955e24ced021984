# SPDX-License-Identifier: Apache-2.0
"""Contact while the discharge is off: on both machines, at every speed, in every direction."""

import pytest

from host.experiments.gap import RULES
from host.machines import machine as machines
from host.run import simulation
from host.run.run import Run
from host.tape.tape import load
from testbench.cosim import contact
from testbench.cosim.job import PATIENCE_S
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

SINKER, WIRE = machines.load("sinker"), machines.load("wire")
FEEDS = (1, 10, 60, 300, 593, 599, 600)     # mm/min, up to the start/stop speed, and above it
FAST = (601, 700, 1200, 1800)
# Ways down, how far they go aside, and how far below the surface of the work, in mm; arcs so wide
# that their curve bounds no speed.
DOWN = (("G01 Z-0.5 F{f}", 0, 0.5), ("G01 X1 Y1 Z-0.5 F{f}", 1.5, 0.5),
        ("G01 X-3 Z-0.4 F{f}", 3, 0.4), ("G18 G02 X-5 Z-0.5 R50 F{f}", 5.5, 0.5),
        ("G19 G03 Y-5 Z-0.5 R50 F{f}", 5.5, 0.5), ("G17 G02 X0 Y0 Z-4 I30 F{f}", 189, 4),
        ("G17 G03 X0 Y0 Z-3 J-30 F{f}", 189, 3))
ASIDE = ("G01 X2 F{f}", "G01 X-2 F{f}", "G01 Y2 F{f}", "G01 X-2 Y-2 F{f}", "G01 X1 Y-2 F{f}",
         "G02 X2 Y1 R50 F{f}", "G03 X-2 Y0.5 R50 F{f}")


def touches(machine, blocks, highest, *, seed=1, hole_mm=0.0, **options):
    """The scenario on a machine; returns its figures."""
    tables = contact.with_hole(hole_mm) if hole_mm else machine.tables
    with Simulation(machine=tables, clock_hz=machine.clock_hz, seed=seed, trace=False) as session:
        return contact.touches(session, blocks, highest, hole_mm=hole_mm, **options)


@pytest.mark.parametrize("way", ["rapid", *(
    pytest.param(way, marks=pytest.mark.soak) for way in ("arc", "after_rapid", "tail"))])
def test_contact_stops_a_tape(way):
    touches(SINKER, *contact.WAYS[way])


def test_contact_stops_what_is_entered_by_hand():
    touches(SINKER, "G01 Z-0.5 F120", 120, by_hand=True)


@pytest.mark.parametrize(("blocks", "highest"), [
    ("G01 X-1 Y0.5 F300", 300), pytest.param("G00 Y-1", 900, marks=pytest.mark.soak)])
def test_contact_stops_a_wire(blocks, highest):
    touches(WIRE, blocks, highest, hole_mm=0.5)


@pytest.mark.parametrize("scenario", [
    pytest.param(contact.out_again, marks=pytest.mark.soak), contact.bridged],
                         ids=lambda one: one.__name__)
def test_the_way_out_is_open(scenario):
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1,
                    trace=False) as session:
        scenario(session)


@pytest.mark.soak
@pytest.mark.parametrize("feed", FEEDS + FAST)
@pytest.mark.parametrize(("way", "aside_mm", "below_mm"), DOWN)
def test_contact_at_every_speed_down(way, aside_mm, below_mm, feed):
    """A rapid to a place above the work; then rest, and a feed down."""
    height = max(0.02, min(1.5, feed * 0.0025)) + (feed / 12_000 if feed <= 600 else 0)
    way_mm = height + aside_mm * height / (height + below_mm)
    for delay in (0, 37, 71):
        found = touches(SINKER, f"G00 Z{height:.3f}\nG04 P150\n{way.format(f=feed)}", feed,
                        delay=delay, seconds=PATIENCE_S + 1.2 * way_mm / (feed / 60))
        assert found["code"] == (contact.CONTACT if feed <= 600 else contact.TRIP)


@pytest.mark.soak
@pytest.mark.parametrize("depth", [0.005, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.45, 0.5, 1])
@pytest.mark.parametrize("rapid", ["G00 Z3\nG00 Z-{d}", "G00 Z3\nG01 Z0.2 F1800\nG01 Z-{d} F590",
                                   "G00 Z3\nG00 X1 Y1 Z-{d}"])
def test_contact_while_the_axes_slow_down(rapid, depth):
    """The command is slow or has ended, but the axes still lag by half a millimetre."""
    touches(SINKER, rapid.format(d=depth), 1800)


@pytest.mark.soak
@pytest.mark.parametrize("feed", [60, 593, 600, 700, 900])
@pytest.mark.parametrize("way", ASIDE)
def test_contact_of_a_wire_in_every_direction(way, feed):
    found = touches(WIRE, way.format(f=feed), feed, hole_mm=0.4 if feed < 100 else 3.0)
    assert found["code"] == (contact.CONTACT if feed <= 600 else contact.TRIP)


@pytest.mark.soak
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("name", "machine"), [
    ("sink_shallow_deep", "sinker"), ("sink_jump", "sinker"), ("sink_orbit", "sinker"),
    ("sink_staircase", "sinker"), ("sink_servo", "small"),
    *((tape, "small") for tape in RULES.values()),
    ("wire_slot", "wire"), ("wire_arcs", "wire"), ("wire_punch", "wire")])
def test_no_tape_of_the_house_is_stopped_without_cause(name, machine, seed):
    """Neither by contact nor by the read-back of the gates."""
    its = machines.load(machine)
    machine_on = simulation.start(its, clock_hz=its.clock_hz, seed=seed, waves=None,
                                  progress=lambda _: None)
    job = Run(its, load(TAPES / f"{name}.nc"), machine_on)
    try:
        assert job.execute() == "end", job.alarm
    finally:
        machine_on.close()
