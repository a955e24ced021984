# SPDX-License-Identifier: Apache-2.0
"""A tape on the machine with each kind of velocity converter."""

import copy

import pytest

from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.run import Run, count_retractions
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

# A register that only this modulator has.
OWN = {"sigma_delta": ".modulator.noise", "pwm": ".modulator.left"}
# The tape's currents are whole steps of either machine. ``test_staircase.py`` has pulse width
# modulation on ``half``, too: so one controller is built for both tests.
ON = {"sigma_delta": "sinker", "pwm": "half"}


@pytest.mark.soak
@pytest.mark.parametrize("kind", OWN)
def test_a_tape_with_its_retractions_runs_on_either_converter(kind):
    usual = machines.load(ON[kind]).tables
    tables = copy.deepcopy(usual)
    tables["axis"]["dac"] = kind
    machine = Machine(kind, tables)
    with Simulation(machine=tables, clock_hz=machine.clock_hz, seed=1, trace=False) as session:
        names = [name for name, _ in session.state()]
        assert [other for other, own in OWN.items()
                if any(name.endswith(own) for name in names)] == [kind]
        if tables == usual:
            return      # the main job runs this tape on it to its end
        run = Run(machine, load(TAPES / "sink_shallow_deep.nc"), Piped(session), until_s=6.0)
        assert run.execute() == "stopped", run.alarm
    counted = count_retractions(run.events)
    assert counted["short"] >= 2
    ended = [event for event in run.events if event["event"] == "retraction_end"]
    assert {event["reason"] for event in ended} == {"cleared"}
    assert -1.0 < min(event["pos"]["z"] for event in run.events) < -0.3
