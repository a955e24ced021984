# SPDX-License-Identifier: Apache-2.0
"""A hold in the middle of a motion entered by hand is no rest: what guards it cannot change."""

import pytest

from softcore.tables.faults import error_line
from softcore.tables.settings import SETTINGS, assign, named

GUARDS = ["high_x_um", "loop_gain", "feed_forward", "model_lag_x_us", "start_speed_um_s",
          "gear_steps_x"]
HELD = 2000     # passes until the machine says that it rests


@pytest.fixture
def held(machine):
    """A controller that is held in the middle of a motion of X."""
    machine.library.gk_speed(10)
    machine.line("G91 G94 G01 X5 F600", 20)
    machine.send(b"!")
    machine.run(HELD)
    assert machine.reported_state() == "Hold:0"
    assert 0 < machine.axes[0] < 50_000
    return machine


def lost(machine):
    return "|Lost" in machine.line("?")[-1]


@pytest.mark.parametrize("name", GUARDS)
def test_a_setting_that_guards_is_refused_until_the_motion_has_ended(held, name):
    row = named(name)
    value = row.default - 1 if row.default > row.lowest else row.default + 1
    assert held.line(assign(name, value))[-1] == error_line("busy")
    assert f"${row.number}={row.default}" in held.line("$$", 20_000)
    assert not lost(held)
    held.send(b"~")
    held.run(100_000)
    assert held.axes[0] == 50_000
    assert held.line(assign(name, value)) == ["ok"]


@pytest.mark.parametrize("line", ["$RST=$", "$RST=#", "$RST=*"])
def test_defaults_are_refused_until_the_motion_has_ended(held, line):
    assert held.line(line)[-1] == error_line("busy")
    assert not lost(held)
    held.send(b"~")
    held.run(100_000)
    assert held.axes[0] == 50_000
    assert held.line(line)[-1] == "ok"


def test_a_setting_that_guards_nothing_may_change(held):
    free = next(row for row in SETTINGS if not row.guards and not row.any_time)
    assert held.line(assign(free.name, free.default)) == ["ok"]
