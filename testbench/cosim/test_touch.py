# SPDX-License-Identifier: Apache-2.0
"""Touch-off on both machines: the place that the controller reports, against the true one."""

import pytest

from host.machines import machine as machines
from softcore.tables.settings import SETTINGS
from testbench.cosim import touch
from testbench.native.simulation import Simulation

SINKER, WIRE = machines.load("sinker"), machines.load("wire")
# Machine, axis, and where its electrode meets the work, in mm of the machine frame.
Z_DOWN = SINKER, 2, -SINKER.tables["initial_gap_um"] / 1000
X_UP = WIRE, 0, WIRE.tables["stock"]["edge_mm"] - WIRE.tables["wire"]["diameter_mm"] / 2
# Widest gap that conducts: the contact offset, which a user calibrates.
BEFORE_UM = SINKER.tables["gap"]["contact_um"]
LAG_S = 4.1e-3          # of an axis with feed-forward: that of its drive
SENSING_S = 50e-6       # period of the sensing pulses
NEEDED = {one.name: one for one in SETTINGS}["short_needed"]    # of them, shorted, for contact
OPEN_LATE_UM = 0.2      # at F2: way in three clear sensing pulses and a pass of the firmware
PULSE_UM = 0.1          # of the axis: the place that is told is whole pulses
# Feed-forward is rounded to whole pulses of Er: at F2, 0.67 of one to 1. So a moving axis can be a
# pulse ahead of its command, onto which it comes to rest.
AHEAD_UM = 1.01 * PULSE_UM


def run(place, scenario, *arguments, seed=1, **options):
    machine, axis, true_mm = place
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=seed,
                    trace=False) as session:
        return scenario(session, *arguments, axis=axis, true_mm=true_mm, **options)


@pytest.mark.parametrize(("place", "word", "feed"), [
    pytest.param(place, word, feed, id=f"{place[0].name}-F{feed}",
                 marks=() if feed == short else pytest.mark.soak)
    for place, word, short in ((Z_DOWN, "Z-1", 10), (X_UP, "X1", 60)) for feed in (2, 10, 30, 60)])
def test_the_place_of_contact_is_told(place, word, feed):
    found = run(place, touch.off, f"G38.2 {word} F{feed}")
    # Contact is told when the last of these pulses is shorted; the axis goes on meanwhile.
    machine, *_ = place
    needed = machine.settings.get(str(NEEDED.number), NEEDED.default)
    late_um = feed / 60 * 1000 * SENSING_S * needed
    assert -1.01 * PULSE_UM <= found["error"] + BEFORE_UM <= late_um + 1.01 * PULSE_UM, found
    # The axes go on to where the command stood, that is by their lag.
    assert -AHEAD_UM <= found["beyond"] <= feed / 60 * LAG_S * 1000 + 1, found


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.soak)
                                       for seed in range(2, 101))])
@pytest.mark.parametrize("place", [pytest.param(Z_DOWN, id="sinker"),
                                   pytest.param(X_UP, id="wire", marks=pytest.mark.soak)])
def test_a_slow_second_touch_is_within_2_um(place, seed):
    error = run(place, touch.twice, way=-1 if place is Z_DOWN else 1, seed=seed)
    assert abs(error + BEFORE_UM) <= 2, error


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.soak)
                                       for seed in range(2, 21))])
def test_the_end_of_contact_is_told(seed):
    found = run(Z_DOWN, touch.opens, seed=seed)
    # The place is a whole pulse.
    assert found["opened"] - 0.1 <= found["place"] <= found["opened"] + OPEN_LATE_UM, found
    assert found["place"] - AHEAD_UM <= found["stands"] <= found["place"] + 3, found
