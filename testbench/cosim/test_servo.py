# SPDX-License-Identifier: Apache-2.0
"""Tapes under servo: to their depth in every fluid, and through a fluid that drifts."""

import dataclasses

import pytest

from host.experiments.fluid import OHM_CM, machine_with
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode, load
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

# Presets of the four classes, by the table of JP S60-10852 B.
PRESETS = [{"dame": 3, "open": 6, "ok": 14}, {"dame": 5, "open": 5, "ok": 18},
           {"dame": 8, "open": 3, "ok": 22}, {"dame": 13, "open": 2, "ok": 28}]
# Where the classes meet: geometric means of the table's resistivities.
BETWEEN = [3.5e5, 7.1e4, 6.3e3]
DEPTH_MM, SHORT_MM = 0.25, 0.05
LONGEST_S = 30


def machined(machine, tape, seed=1):
    """Run a tape; return the run, and how deep the electrode and the work's bottom are, in mm."""
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=seed) as session:
        done = Run(machine, tape, Piped(session), until_s=LONGEST_S)
        done.execute()
        trace = session.trace()
    height = trace["z"] / machine.pulses_per_mm + machine.initial_gap_mm
    return done, -height.min(), (trace["gap_um"] / 1000 - height)[-1]


def check_depth(done, deepest, bottom, depth):
    """The program ends on the tape's depth, within 1 um, and the work is a gap deeper."""
    assert (done.outcome, done.alarm) == ("end", None)
    assert deepest == pytest.approx(depth, abs=0.0011)
    assert depth + 0.002 < bottom < depth + 0.1


@pytest.mark.parametrize("ohm_cm", OHM_CM)
def test_servo_reaches_the_depth_in_every_fluid(ohm_cm):
    text = (TAPES / "sink_servo.nc").read_text()
    assert text.count(f"Z-{DEPTH_MM}") == 1
    tape = encode(text.replace(f"Z-{DEPTH_MM}", f"Z-{SHORT_MM}"))
    done, deepest, bottom = machined(machine_with(ohm_cm), tape)
    check_depth(done, deepest, bottom, SHORT_MM)
    told, = [event for event in done.events if event["event"] == "fluid_class"]
    number = OHM_CM.index(ohm_cm)
    assert (told["class"], told["presets"]) == (number, PRESETS[number])
    assert told["resistivity"] == pytest.approx(ohm_cm, rel=0.01)


@pytest.mark.soak
@pytest.mark.parametrize("name", ["sink_servo", "sink_servo_table"])
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("ohm_cm", OHM_CM)
def test_whole_tapes_reach_their_depth_in_every_fluid(ohm_cm, seed, name):
    done, deepest, bottom = machined(machine_with(ohm_cm), load(TAPES / f"{name}.nc"), seed)
    check_depth(done, deepest, bottom, DEPTH_MM)


def test_classes_follow_a_fluid_that_drifts():
    steady = machine_with(1e6)
    tables = steady.tables | {"fluid": steady.tables["fluid"] | {
        "drift_end_ohm_cm": 1e3, "drift_s": 3.0}}
    machine = dataclasses.replace(steady, tables=tables)
    text = (TAPES / "sink_servo.nc").read_text().replace(f"Z-{DEPTH_MM}", "Z-0.1")
    done, deepest, bottom = machined(machine, encode(text))
    check_depth(done, deepest, bottom, 0.1)
    # The first tells that the fluid is known.
    told = [event for event in done.events if event["event"] == "fluid_class" and event["class"]]
    assert [event["class"] for event in told] == [1, 2, 3]
    assert [event["presets"] for event in told] == PRESETS[1:]
    for event, ohm_cm in zip(told, BETWEEN, strict=True):
        assert event["resistivity"] == pytest.approx(ohm_cm, rel=0.2)
        # Three decades in three seconds.
        assert 1e6 * 10 ** -event["t"] == pytest.approx(event["resistivity"], rel=0.05)
