# SPDX-License-Identifier: Apache-2.0
"""Homing on the simulated machine's reference switches: its frame against the true places."""

from functools import cache

import pytest

from host.link.link import RESET
from host.machines import machine as machines
from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign
from testbench.cosim import homing
from testbench.native.simulation import Simulation
from testbench.some import some

SINKER = machines.load("sinker")
SWITCH_MM = 1.0         # from the start of the axes; as delivered a run would be long
SCATTER_UM = SINKER.tables["side"]["limit_scatter_um"]
# Rounding of the switch's place and of the coder, a pulse each, and the way until it is seen.
PULSE_UM = 0.2
LOW_MM, HIGH_Z_MM = -299.0, 100.0   # ends of the travel as delivered


def run(*lines, seed=1, scatter_um=SCATTER_UM, times=1, pull_off_mm=homing.PULL_OFF_MM):
    tables = {**SINKER.tables, "side": {**SINKER.tables["side"], "limit_low_mm": -SWITCH_MM,
                                        "limit_high_mm": SWITCH_MM,
                                        "limit_scatter_um": scatter_um}}
    settings = {**homing.SETTINGS, "home_pull_off_um": round(pull_off_mm * 1000)}
    with Simulation(machine=tables, clock_hz=SINKER.clock_hz, seed=seed, trace=False) as session:
        return homing.cycle(session, *(assign(*one) for one in settings.items()), *lines,
                            times=times)


def error_um(found, axis):
    """Error of the axis's frame against a switch without scatter, in um."""
    down = axis != "z"
    end, way = (LOW_MM, -1) if down else (HIGH_Z_MM, 1)
    # At the end of its travel the axis stands the pull-off before the switch.
    wanted = end - way * (SWITCH_MM - homing.PULL_OFF_MM)
    return (found[axis] - wanted) * 1000


def test_every_axis_is_homed_within_the_scatter_of_its_switch():
    (found,) = run()
    for axis in "xyz":
        assert abs(error_um(found, axis)) <= SCATTER_UM / 2 + PULSE_UM, (axis, found)


@pytest.mark.parametrize("seed", [2, *(pytest.param(seed, marks=pytest.mark.soak)
                                       for seed in range(3, 101))])
def test_the_scatter_of_the_switch_is_all(seed):
    """With scatter each cycle ends at another place; without, at the same to the pulse."""
    order = assign("home_order", 1)
    errors = [error_um(found, "x") for found in run(order, seed=seed, times=2)]
    assert all(abs(error) <= SCATTER_UM / 2 + PULSE_UM for error in errors), errors
    assert errors[0] != errors[1]
    exact = [error_um(found, "x") for found in run(order, seed=seed, times=2, scatter_um=0)]
    assert all(abs(error) <= PULSE_UM for error in exact), exact


@pytest.mark.soak
def test_as_delivered_on_the_whole_travel():
    """The built-in machine, with no setting entered: 300 mm to each switch."""
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1,
                    trace=False) as session:
        (found,) = homing.cycle(session)
    side = SINKER.tables["side"]
    for axis, end, switch in (("x", LOW_MM, side["limit_low_mm"]),
                              ("y", LOW_MM, side["limit_low_mm"]),
                              ("z", HIGH_Z_MM, side["limit_high_mm"])):
        pull_off = 1 if axis != "z" else -1
        error = (found[axis] - (end - pull_off - switch)) * 1000
        assert abs(error) <= SCATTER_UM / 2 + PULSE_UM, (axis, error)


def homed(report_at=None):
    """Clocks from `$H` to the motion off the switch; a report is asked for at one of them.

    Also the alarms.
    """
    side = {**SINKER.tables["side"], "limit_low_mm": -0.5, "limit_scatter_um": 0}
    lines = [assign(*one) for one in (homing.SETTINGS | {"home_order": 1}).items()]
    with Simulation(machine={**SINKER.tables, "side": side}, clock_hz=SINKER.clock_hz, seed=1,
                    trace=False) as session:
        job = homing.begin(session, *lines)
        job.link.command("$POSITION=HERE")
        job.link.command("G91 G01 X0.05 F300")
        job.run(session.clock_hz // 2)
        job.link.send_line("$H")
        began = session.cycle
        if report_at:
            job.run(report_at)
            session.send(b"?")
        for safe in True, False:
            job.until(lambda safe=safe: job.probe("safety_status_safe") == safe, "a switch",
                      step=250)
        unlocked = session.cycle - began
        job.run(session.clock_hz // 20)
        return unlocked, job.told("alarm")


@cache
def usual():
    return homed()


@pytest.mark.parametrize("before", some(range(500, 14_500, 500), 7000, 12_000))
def test_a_report_that_comes_as_the_switch_trips_leaves_time_for_the_watchdog(before):
    unlocked, alarms = usual()
    assert not alarms
    assert not homed(unlocked - before)[1]


@pytest.mark.parametrize("after_ms", some([20, 150.3, 333.3, 480.1, 600.7], 333.3))
def test_a_reset_in_the_cycle_leaves_time_for_the_watchdog(after_ms):
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1,
                    trace=False) as session:
        job = homing.begin(session, assign("home_order", 1))
        job.link.send_line("$H")
        job.run(round(after_ms / 1000 * session.clock_hz))
        begin = session.cycle
        job.press(RESET)
        job.until(lambda: job.told("alarm"), "the alarm", step=20_000, seconds=1)
        job.run(session.clock_hz // 5)
        assert [one["code"] for one in job.told("alarm")] == [alarm_number("home_reset")]
        job.collect().watched_well(session.clock_hz, begin)
