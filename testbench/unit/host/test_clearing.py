# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``host.run.clearing``: how soon the electrode is clear of a short."""

import numpy as np
import pytest

from host.machines import machine as machines
from host.run.clearing import CLEAR_UM, SAMPLE, alone, chains, figures

HZ = 2_000_000
PULSES = 10_000     # of a mm
AXIS = machines.load("sinker").tables["axis"]
TICK_S = 8e-6
NONE = -1.0


def way(number, sample, *, down_um=2.0, speed=5.0, turn_s=1e-3, rows=400, wraps=0,
        touched_s=4e-3, stops_at_once=False):
    """A short: the electrode goes on for some um, turns, and leaves at a speed in mm/s."""
    cycle = sample + SAMPLE + np.arange(rows) * 125.0
    after = (cycle - sample) / HZ
    z = np.where(after < turn_s, -down_um * after / turn_s,
                 -down_um + (after - turn_s) * speed * 1000)
    z -= z[0]
    path = 1000.0 - np.maximum(0, np.arange(rows) - 3)
    path = (path - wraps + 2**31) % 2**32 - 2**31
    forward = np.where(np.arange(rows) > 1, cycle[0] + 3, NONE)
    return {"short": np.full(rows, float(number)), "cycle": cycle, "path": path,
            "contact": np.full(rows, NONE if touched_s is None else sample - touched_s * HZ),
            "forward": np.full(rows, NONE) if stops_at_once else forward,
            "x": np.zeros(rows), "y": np.zeros(rows), "z": z * PULSES / 1000}


def joined(*ways):
    return {name: np.concatenate([one[name] for one in ways]) for name in ways[0]}


def test_every_link_of_a_short():
    one, two = chains(joined(way(1, 10_000), way(2, 90_000, speed=15, turn_s=2e-3)),
                      clock_hz=HZ, pulses_per_mm=PULSES)
    assert (one.t, two.t) == (10_000 / HZ, 90_000 / HZ)
    assert one.back == pytest.approx((4 * 125 + SAMPLE) / HZ)
    assert (one.touched, one.forward) == pytest.approx((4e-3, (SAMPLE + 3) / HZ))
    assert one.turn == pytest.approx(1e-3, abs=0.07e-3)
    assert two.turn == pytest.approx(2e-3, abs=0.07e-3)
    assert one.clear[20] == pytest.approx(1e-3 + 22 / 5000, rel=1e-3)
    assert one.clear[100] == pytest.approx(1e-3 + 102 / 5000, rel=1e-3)
    assert two.clear[20] == pytest.approx(2e-3 + 22 / 15_000, rel=1e-3)


def test_a_path_coordinate_may_wrap():
    one, = chains(way(1, 0, wraps=2**31 + 1002), clock_hz=HZ, pulses_per_mm=PULSES)
    assert one.back == pytest.approx((4 * 125 + SAMPLE) / HZ)


def test_a_short_without_contact_and_one_after_the_last_pulse_forward():
    one, = chains(way(1, 10_000, touched_s=None, stops_at_once=True), clock_hz=HZ,
                  pulses_per_mm=PULSES)
    assert one.touched is None
    assert one.forward == SAMPLE / HZ
    event = [{"event": "retraction_set", "speed": 300.0},
             {"event": "retraction_start", "cause": "short"}]
    row, = figures([one], event, AXIS, TICK_S)
    assert row["sample_ms"] is None
    assert row["forward_us"] == {"median": 1.0, "worst": 1.0, "shorts": 1}


def test_what_was_not_reached_is_unknown():
    one, two = chains(joined(way(1, 0, rows=60), way(2, 50_000, rows=3)), clock_hz=HZ,
                      pulses_per_mm=PULSES)
    assert one.clear[20] is None
    assert one.turn is None
    assert one.back is not None
    assert (two.back, two.turn, two.clear) == (None, None, {20: None, 100: None})
    nothing = {name: np.empty(0) for name in way(1, 0)}
    assert chains(nothing, clock_hz=HZ, pulses_per_mm=PULSES) == []


@pytest.mark.parametrize("speed", [60, 300, 900])
def test_a_drive_alone_is_late_by_its_lags(speed):
    lag = (AXIS["speed_loop_ms"] + AXIS["current_loop_ms"] + AXIS["filter_ms"]) * 1e-3
    found = alone(AXIS, speed, TICK_S)
    assert found[100] == pytest.approx(0.1 / (speed / 60) + lag, rel=0.06)
    assert found[20] < found[100]
    assert alone(AXIS | {"max_acceleration_mm_s2": 500.0}, 900, TICK_S)[20] > alone(
        AXIS, 900, TICK_S)[20]


@pytest.mark.parametrize("um", CLEAR_UM)
def test_dead_time_and_friction_hold_a_drive_back(um):
    usual = alone(AXIS, 300, TICK_S)[um]
    assert alone(AXIS | {"dead_time_ms": 2.0}, 300, TICK_S)[um] - usual == pytest.approx(2e-3)
    slowed = alone(AXIS | {"friction_mm_s": 0.5}, 300, TICK_S)[um]
    assert slowed == pytest.approx(usual + um / 1000 * (1 / 4.5 - 1 / 5), rel=0.05)


def test_a_drive_that_is_too_slow_never_arrives():
    assert alone(AXIS, 0.001, TICK_S) == dict.fromkeys(CLEAR_UM)


def test_figures_go_by_the_speed_in_force():
    found = chains(joined(*(way(number, 40_000 * number, speed=speed, rows=200)
                            for number, speed in ((1, 5), (2, 4), (3, 15)))),
                   clock_hz=HZ, pulses_per_mm=PULSES)
    start = {"event": "retraction_start", "cause": "short"}
    events = [{"event": "retraction_set", "speed": 300.0}, start, start | {"cause": "jump"}, start,
              {"event": "retraction_set", "speed": 900.0}, start]
    slow, fast = figures(found, events, AXIS, TICK_S)
    assert (slow["speed"], slow["shorts"], fast["speed"], fast["shorts"]) == (300, 2, 900, 1)
    times = sorted(one.clear[20] * 1000 for one in found[:2])
    assert slow["clear_20_um_ms"] == {
        "median": pytest.approx(sum(times) / 2, abs=1e-3),
        "worst": pytest.approx(times[1], abs=1e-3), "shorts": 2,
        "drive": pytest.approx(alone(AXIS, 300, TICK_S)[20] * 1000, abs=1e-3)}
    assert slow["back_us"]["shorts"] == 2
    assert "drive" not in slow["back_us"]
    assert slow["clear_100_um_ms"] is None
    assert fast["clear_100_um_ms"]["drive"] < 15
