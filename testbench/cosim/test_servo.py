# SPDX-License-Identifier: Apache-2.0
"""Tapes under servo: to their depth in every fluid, and through a fluid that drifts."""

import dataclasses

import pytest

from host.experiments import gap
from host.experiments.fluid import OHM_CM, machine_with
from host.machines.machine import load as load_machine
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode, load
from testbench.native.simulation import Simulation
from testbench.punch import TAPES
from testbench.some import some

# Presets of the four classes, by the table of JP S60-10852 B.
PRESETS = [{"dame": 3, "open": 6, "ok": 14}, {"dame": 5, "open": 5, "ok": 18},
           {"dame": 8, "open": 3, "ok": 22}, {"dame": 13, "open": 2, "ok": 28}]
# Where the classes meet: geometric means of the table's resistivities.
BETWEEN = [3.5e5, 7.1e4, 6.3e3]
DEPTH_MM, SHORT_MM = 0.25, 0.05
LONGEST_S = 30
COUNTING = ("servo_counting_mode", "servo_counting_window", "servo_counting_weight")
JUDGING = ("gap_criteria_delay", "gap_criteria_noise", "gap_delay_least")
USUAL = (0, 50, 1), (0, 0, 0)
# How each rule counts (mode, window, weight) and judges (by delay, by noise, shortest delay).
IN_FORCE = {
    "accumulate": USUAL, "own gate": ((4, 50, 1), USUAL[1]), "consecutive": ((1, 50, 1), USUAL[1]),
    "total": ((2, 50, 1), USUAL[1]), "relative": ((3, 50, 1), USUAL[1]),
    "good alone": ((5, 50, 1), USUAL[1]), "delay": (USUAL[0], (1, 0, 8)),
    "noise": (USUAL[0], (0, 1, 0)),
}
RULES_MM = 0.02     # depth of the short runs of the rules
SEEDS = (1, 2, 3, 4, 5)


def machined(machine, tape, seed=1, probes=()):
    """Run a tape; return the run, probes at its end, and how deep electrode and work's bottom are.

    Depths are in mm.
    """
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=seed) as session:
        done = Run(machine, tape, Piped(session), until_s=LONGEST_S)
        done.execute()
        probed = {name: session.probe(name) for name in probes}
        trace = session.trace()
    height = trace["z"] / machine.pulses_per_mm + machine.initial_gap_mm
    return done, probed, -height.min(), (trace["gap_um"] / 1000 - height)[-1]


def check_depth(done, deepest, bottom, depth):
    """The program ends on the tape's depth, within 1 um, and the work is a gap deeper."""
    assert (done.outcome, done.alarm) == ("end", None)
    assert deepest == pytest.approx(depth, abs=0.0011)
    assert depth + 0.002 < bottom < depth + 0.1


@pytest.mark.parametrize("ohm_cm", some(OHM_CM))
def test_servo_reaches_the_depth_in_every_fluid(ohm_cm):
    text = (TAPES / "sink_servo.nc").read_text()
    assert text.count(f"Z-{DEPTH_MM}") == 1
    tape = encode(text.replace(f"Z-{DEPTH_MM}", f"Z-{SHORT_MM}"))
    done, _, deepest, bottom = machined(machine_with(ohm_cm), tape)
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
    done, _, deepest, bottom = machined(machine_with(ohm_cm), load(TAPES / f"{name}.nc"), seed)
    check_depth(done, deepest, bottom, DEPTH_MM)


def test_classes_follow_a_fluid_that_drifts():
    steady = machine_with(1e6)
    tables = steady.tables | {"fluid": steady.tables["fluid"] | {
        "drift_end_ohm_cm": 1e3, "drift_s": 3.0}}
    machine = dataclasses.replace(steady, tables=tables)
    text = (TAPES / "sink_servo.nc").read_text().replace(f"Z-{DEPTH_MM}", "Z-0.1")
    done, _, deepest, bottom = machined(machine, encode(text))
    check_depth(done, deepest, bottom, 0.1)
    # The first tells that the fluid is known.
    told = [event for event in done.events if event["event"] == "fluid_class" and event["class"]]
    assert [event["class"] for event in told] == [1, 2, 3]
    assert [event["presets"] for event in told] == PRESETS[1:]
    for event, ohm_cm in zip(told, BETWEEN, strict=True):
        assert event["resistivity"] == pytest.approx(ohm_cm, rel=0.2)
        # Three decades in three seconds.
        assert 1e6 * 10 ** -event["t"] == pytest.approx(event["resistivity"], rel=0.05)


@pytest.mark.parametrize("rule", some(gap.RULES, "delay"))
def test_every_rule_reaches_its_depth(rule):
    """The tape's words bring its rule into force in the gateware, and the servo goes by it."""
    text = gap.tape_of(gap.Trial(rule, 1))
    assert text.count(f"Z-{DEPTH_MM}") == 1
    tape = encode(gap.tape_of(gap.Trial(rule, 1, RULES_MM)))
    done, probed, deepest, bottom = machined(load_machine(gap.MACHINE), tape,
                                             probes=(*COUNTING, *JUDGING, "servo_downs"))
    check_depth(done, deepest, bottom, RULES_MM)
    assert probed["servo_downs"] > 0
    assert (tuple(probed[name] for name in COUNTING),
            tuple(probed[name] for name in JUDGING)) == IN_FORCE[rule]


@pytest.mark.soak
def test_every_rule_holds_the_gap_nearly_as_steady_as_the_default():
    """Five seeds: whole tapes to their depth, the gap's deviation at most twice the default's."""
    runs = [gap.run(gap.Trial(rule, seed)) for seed in SEEDS for rule in gap.RULES]
    assert {one["outcome"] for one in runs} == {"end"}
    for one in runs:
        assert one["depth_mm"] == pytest.approx(DEPTH_MM, abs=0.0011)
    found = {row["rule"]: row["times"] for row in gap.statistics(runs)}
    assert len(found) == len(gap.RULES)
    assert max(found.values()) <= 2, found
