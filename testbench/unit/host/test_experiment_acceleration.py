# SPDX-License-Identifier: Apache-2.0
"""``host.experiments.acceleration``: its drive against closed forms, and its table."""

import copy

import pytest
from rich import box
from rich.console import Console

from host.experiments.acceleration import LEADS, Way, answer, soonest_ms, table
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.clearing import alone

SINKER = machines.load("sinker")
AXIS = SINKER.tables["axis"]
LAGS_S = 3.5e-3     # speed loop and filter of the sinker
AT_ONCE = Way(1000.0, 5000.0)


def with_axis(**numbers):
    tables = copy.deepcopy(SINKER.tables)
    tables["axis"] |= numbers
    return Machine("changed", tables)


@pytest.mark.parametrize("speed", [300, 900])
def test_with_a_step_the_drive_moves_nearly_as_if_the_step_were_given_to_it_alone(speed):
    """What is left is the loop's answer to a drive that is no first order: some percent."""
    own = alone(AXIS, speed, SINKER.tables["tick_us"] * 1e-6)
    clear = answer(SINKER, speed, AT_ONCE).clear_ms
    assert clear == {um: pytest.approx(1000 * seconds, rel=0.03) for um, seconds in own.items()}


@pytest.mark.parametrize("speed", [300, 900])
def test_a_drive_without_lags_follows_its_ramp(speed):
    """It is slower by at most what the loop takes back: K times the lag that its model has."""
    quick = with_axis(speed_loop_ms=0.01, current_loop_ms=0.001, filter_ms=0.001)
    for um, ms in answer(quick, speed, Way(0.0, 5000.0)).clear_ms.items():
        soonest = soonest_ms(SINKER, speed, um)
        assert soonest - 0.05 < ms < soonest / (1 - 50 * LAGS_S)


def test_the_converter_limits_the_input():
    weak = with_axis(full_speed_mm_s=5.0)
    assert answer(weak, 300, Way(0.0, 5000.0, LAGS_S)).clear_ms[20] > (
        1.2 * answer(SINKER, 300, Way(0.0, 5000.0, LAGS_S)).clear_ms[20])


@pytest.mark.parametrize(("speed", "um", "ms"), [
    (300, 1, 0.632), (300, 20, 4.5), (900, 20, 2.828), (900, 100, 8.167)])
def test_the_soonest_is_by_acceleration_and_speed(speed, um, ms):
    assert soonest_ms(SINKER, speed, um) == pytest.approx(ms, abs=0.001)


@pytest.mark.parametrize("speed", [300, 900])
def test_a_lead_clears_sooner_and_stays_within_the_bound_of_the_overshoot(speed):
    """The input leads by what the drive lags, so that it accelerates as the ramp does."""
    found = [answer(SINKER, speed, Way(0.0, 5000.0, share * LAGS_S)) for share in (
        0.0, *sorted(LEADS.values()))]
    for um in (20, 100):
        times = [one.clear_ms[um] for one in found]
        assert times == sorted(times, reverse=True)
        assert times[0] - times[2] > 0.5
        # No sooner than the current loop and the filter allow, at the ramp's speed.
        assert times[2] > 0.98 * soonest_ms(SINKER, speed, um)
        assert times[2] < 1.03 * soonest_ms(SINKER, speed, um) + 0.7
    assert found[0].beyond_um < 0.1
    # The bound of the issue of the fast loop: speed times the lag of the drive.
    assert max(one.beyond_um for one in found) < speed / 60 * LAGS_S * 1e3


def test_the_table_has_each_way_and_its_share_of_the_drive_alone():
    said = Console(width=300, record=True)
    said.print(table(box.ASCII))
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in said.export_text().splitlines() if line.startswith("| ")]
    assert [row[0] for row in rows[1:]] == [
        "none: the drive alone", "velocity, ramp as delivered", "velocity, ramp from rest", *LEADS,
        "a drive of that acceleration without lags"]
    assert [cell.endswith("(1.00)") for cell in rows[1][1:]] == [True, True, False] * 2
    delivered = answer(SINKER, 900, Way(10.0, 5000.0))
    assert rows[2][4].startswith(f"{delivered.clear_ms[20]:.2f} (")
    assert rows[2][6] == f"{delivered.beyond_um:.1f}"
