# SPDX-License-Identifier: Apache-2.0
"""``python -m host.experiments.detection``: its figures, its table, and one short run."""

from contextlib import closing

import pytest

from host.experiments import detection
from host.experiments.detection import RULES, TAPES, Trial, figures, run, table
from host.machines import machine as machines
from host.run import simulation
from host.tape.tape import encode
from softcore.tables.settings import named

SHALLOW = """%
G21 G90 G94 C130
G36 R300 L0.5 H600 E60 Q0.1
M08
M03
G01 Z-0.2 F10
M05
G00 Z1.0
M09
M02
%
"""


def test_a_short_without_contact_is_a_false_one():
    found = figures([0.001, None, 0.003, None, None, 0.002], time_s=30.0, contact_s=0.06)
    assert found == {"time_s": 30.0, "shorts": 12.0, "false": 6.0, "found_ms": pytest.approx(2.0),
                     "contact_s": 0.06, "contact_ms": pytest.approx(20.0)}


def test_without_a_true_short_its_times_are_unknown():
    assert figures([None], time_s=60.0, contact_s=0.0) == {
        "time_s": 60.0, "shorts": 1.0, "false": 1.0, "found_ms": None, "contact_s": 0.0,
        "contact_ms": None}


def test_the_rules_as_delivered_are_among_those_tried():
    for name in TAPES:
        settings = machines.load(name).settings
        rule = tuple(settings.get(str(named(one).number), named(one).default)
                     for one in ("short_needed", "short_window"))
        assert rule in RULES


def test_the_table_has_the_mean_of_the_seeds():
    runs = [{"machine": "wire", "needed": 8, "window": 10, "seed": seed, "outcome": "end",
             "arcs": seed} | figures([0.001 * seed], time_s=60.0, contact_s=0.5) for seed in (1, 3)]
    made = table(runs, "wire")
    assert [column.header for column in made.columns][1:] == ["8 of 10"]
    cells = dict(zip(made.columns[0].cells, made.columns[1].cells, strict=True))
    assert cells["contact to sample, median, ms"] == "2.00 ± 1.41"
    assert cells["shorts a minute"] == "1.0 ± 0.0"
    assert not [one for one in table(runs, "sinker").columns[1:]]


def test_a_single_shorted_pulse_is_no_contact(monkeypatch):
    monkeypatch.setattr(detection, "load", lambda _: encode(SHALLOW))
    rash, sure = (run(Trial("sinker", needed, window, 1)) for needed, window in ((1, 1), (4, 5)))
    assert rash["outcome"] == sure["outcome"] == "end"
    assert rash["false"] > 0 == sure["false"]


def test_the_machine_counts_the_time_of_contact():
    machine = machines.load("sinker")
    with closing(simulation.start(machine, clock_hz=machine.clock_hz, seed=1, waves=None,
                                  progress=print)) as machine_on:
        machine_on.read(0.01)
        assert machine_on.contact_s() == 0
        machine_on.set("force.short", 1)
        begun = machine_on.time_s()
        machine_on.read(0.01)
        lasted = machine_on.time_s() - begun
        machine_on.set("force.short", 0)
        machine_on.read(0.01)
        assert machine_on.contact_s() == pytest.approx(lasted, abs=2e-5)
        assert lasted > 0
