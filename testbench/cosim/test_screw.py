# SPDX-License-Identifier: Apache-2.0
"""Screws with an error of their pitch, and the tables that make up for it.

The true place of an axis is that of the simulated machine behind its screw; its coder, on the
motor, and its steps do not see the error.
"""

import copy
import math

import pytest

from host.machines import machine as machines
from host.machines.machine import Machine
from host.tape.tape import encode
from testbench.cosim.test_stepper import BACKLASH, GEAR, STEP, run
from testbench.models.gear import steps_of

SLOPE, WAVE_UM, WAVE_MM = 150.0, 6.0, 20.0      # um/m, um, mm
FIRST_MM, STEP_MM, POINTS = -12.0, 2.0, 14
# Between two points a sine of amplitude A and wavelength L leaves the straight line by at most
# A (1 - cos(pi STEP / L)), in pulses.
CHORD = 10 * WAVE_UM * (1 - math.cos(math.pi * STEP_MM / WAVE_MM))
# Points and correction are rounded to pulses, each by a half; the error changes by less than 0.2
# over what is made up for; the coder has a pulse, with its hysteresis.
ROUNDED, CODER = 0.5 + 0.5 + 0.2, 1.2
PLACES = (3.0, 7.1, 11.4, 7.1, 3.0, -2.3, -6.6, -11.0, -6.6, -2.3, 0.0)     # mm

THERE_AND_BACK = "\n".join([
    "G36 R300 L0.5 H600 E60 Q0.1", "G21 G90 G94",
    *(f"G00 X{place} Y{-place}\nG04 P160" for place in PLACES), "M02", ""])


def error(place):
    """Error of the screw at a place, all in pulses."""
    return SLOPE * 1e-6 * place + 10 * WAVE_UM * math.sin(2 * math.pi * place / WAVE_MM / 10_000)


def with_screws(name, *, table):
    """A machine whose X and Y have that screw; with ``table`` as it would be measured."""
    tables = copy.deepcopy(machines.load(name).tables)
    screw = {"screw_um_m": SLOPE, "screw_wave_um": WAVE_UM, "screw_wave_mm": WAVE_MM}
    if table:
        screw |= {"pitch_from_mm": FIRST_MM, "pitch_step_mm": STEP_MM, "pitch_error_um": [
            error(10_000 * (FIRST_MM + k * STEP_MM)) / 10 for k in range(POINTS)]}
    for axis in "xy":
        tables[axis] = tables.get(axis, {}) | screw
    return Machine("screw", tables)


def seen(job, rests):
    """Of X and Y at rest: axis, place, whether it came down, steps and true place."""
    assert job.outcome == "end", job.alarm
    found, last = [], dict.fromkeys("xy", (0, False))
    for rest in rests.seen:
        for axis in "xy":
            place, _, steps, true = rest[axis]
            before, down = last[axis]
            last[axis] = place, place < before if place != before else down
            found.append((axis, place, last[axis][1], steps, true))
    places = {round(1e4 * place) for place in PLACES}
    assert {place for axis, place, *_ in found if axis == "x"} == places
    assert {(place, down) for axis, place, down, *_ in found if axis == "x"} > {
        (30_000, True), (30_000, False), (-66_000, True), (-66_000, False)}, "from both sides"
    return found


@pytest.mark.parametrize("name", ["sinker", "stepper"])
def test_with_its_table_each_place_is_the_true_one_from_both_sides(name):
    job, rests, _ = run(with_screws(name, table=True), encode(THERE_AND_BACK))
    beside = (STEP / 2 if name == "stepper" else CODER) + ROUNDED + CHORD
    stands = {}
    for axis, place, down, steps, true in seen(job, rests):
        assert abs(true - place) <= beside, (axis, place, down)
        play = BACKLASH if name == "stepper" and axis == "x" and down else 0
        where = steps if name == "stepper" else round(true)
        stood = stands.setdefault((axis, place, down), where)
        assert abs(where - stood) <= (0 if name == "stepper" else 1), "the same both ways"
        if name == "stepper":
            assert abs(steps * STEP - (place - error(place) - play)) <= STEP / 2 + ROUNDED + CHORD
    assert len(stands) > 20


@pytest.mark.parametrize("name", ["sinker", "stepper"])
def test_without_a_table_it_is_beside_by_the_error_of_the_screw(name):
    machine = with_screws(name, table=False)
    job, rests, _ = run(machine, encode(THERE_AND_BACK))
    worst = 0
    for axis, place, down, steps, true in seen(job, rests):
        assert true - place == pytest.approx(error(place), abs=STEP / 2 + 0.3)
        worst = max(worst, abs(true - place))
        if name == "stepper":
            play = BACKLASH if axis == "x" and down else 0
            assert steps == steps_of(place - play, *GEAR)
    assert worst > 60
