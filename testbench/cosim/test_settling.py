# SPDX-License-Identifier: Apache-2.0
"""The sinker waits after a switch until the comparators behind their filters have followed."""

from itertools import pairwise

import pytest

from host.machines import machine as machines
from rtl.power.settling import filter_clocks
from softcore.tables.settings import assign, named
from testbench.cosim.job import Data, Job, program
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
LEVELS = {"gap_reference_open": "level_open_mv", "gap_reference_arc": "level_arc_mv",
          "gap_reference_short": "level_short_mv"}
SUPPLY = "power_supply_voltage", "power_supply_negative"
WATCHED = (*LEVELS, *LEVELS.values(), *SUPPLY, "gap_on", "gap_sense", "gap_level", "servo_downs",
           "servo_ups", "condition_switched")
SETTLE = filter_clocks(MACHINE.clock_hz, MACHINE.number("comparator", "reference_rc_us"))
FULL_MV = 100_000
PADS = 1                # clocks
# One clock of a stream's first-order modulator, behind its filter, and rounding.
RIPPLE_MV = FULL_MV * 1e6 / MACHINE.clock_hz / MACHINE.number("comparator", "reference_rc_us") + 1


def sensing_clocks():
    """A sensing pulse and its pause."""
    return sum(named(name).default for name in ("sense_on_ns", "sense_off_ns")) * (
        MACHINE.clock_hz // 1000) // 10**6


def recorded(*lines):
    """Open voltage, polarity and level change at depths, while the servo steps forward."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, assign("servo_period_us", 500), *lines,
                  "G10 C901 I4 P30 Q40 E100 K-1 X3 Y2 Z14", "G10 C902 I6 P30 Q40 E60 K1 X3 Y2 Z14",
                  "G10 C903 I2 P30 Q40 E60 K1 H70 X3 Y2 Z14",
                  "G10 C904 I9 P30 Q40 E60 K1 H70 X3 Y2 Z14", watched=WATCHED)
        session.set("force.gap_um", 300)
        job.start(program(Data(), "G39 Z0.08 C902", "G39 Z0.06 C903", "G39 Z0.04 C904", "G95 P1",
                          "G01 Z0.02 F600", condition=901))
        job.finish()
    return job.record


@pytest.fixture(scope="module")
def record():
    return recorded()


def switches(record):
    """Clocks of all changes by depth, and for each whether a reference changed."""
    clocks = record.rises("condition_switched")
    assert len(clocks) == 3
    return [(clock, any(record.changes(name, clock, clock + 100) for name in LEVELS))
            for clock in clocks]


def test_the_first_pulse_waits_until_the_references_have_followed(record):
    found = switches(record)
    assert [waits for _, waits in found] == [True, True, False]
    begins = record.rises("gap_on")
    for clock, waits in found:
        taken = max([clock, *(at for name in (*LEVELS, *SUPPLY)
                              for at, _ in record.changes(name, clock, clock + 100))])
        first = next(at for at in begins if at > taken + PADS)
        senses = len(record.rises("gap_sense", taken, first))
        if waits:
            assert SETTLE < first - taken <= SETTLE + sensing_clocks() + 10
            # Ss is formed meanwhile.
            assert senses >= (first - taken) // sensing_clocks() - 2
        else:
            assert (senses, first - taken < 300) == (0, True)


def test_no_pulse_has_a_reference_on_its_way(record):
    """Every level is within 1 % of its last change whenever a pulse of the discharge begins."""
    begins = record.rises("gap_on")
    assert len(begins) > 100
    for name, level in LEVELS.items():
        steps = [(clock, value * FULL_MV / 1024) for clock, value in record.changes(name)]
        for (before, last), (at, wanted) in pairwise([(0, 0), *steps]):
            later = [clock for clock, _ in steps if clock > at]
            for begin in begins:
                if at + PADS < begin and (not later or begin <= later[0] + PADS):
                    off = abs(record.at(level, begin) - wanted)
                    assert off <= 0.01 * abs(wanted - last) + RIPPLE_MV, (name, before, at, begin)


def test_the_servo_holds_meanwhile(record):
    begins = record.rises("gap_on")
    assert len(record.changes("servo_downs")) > 20
    for clock, waits in switches(record):
        first = next(at for at in begins if at > clock + 100) if waits else clock
        for name in ("servo_ups", "servo_downs"):
            assert record.changes(name, clock + 100, first) == []


def test_a_setting_prolongs_the_wait():
    record = recorded(assign("follow_us", 5000))
    longer = 5000 * MACHINE.clock_hz // 10**6
    (clock, _), *_ = switches(record)
    first = next(at for at in record.rises("gap_on") if at > clock + 100)
    # The machine may reach the depth of the next change meanwhile.
    taken = max(at for name in LEVELS for at, _ in record.changes(name, clock, first))
    assert longer < first - taken <= longer + sensing_clocks() + 100
