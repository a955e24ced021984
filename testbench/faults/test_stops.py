# SPDX-License-Identifier: Apache-2.0
"""Every stop is as fast as documented: at a few phases, and in the soak at a hundred."""

import pytest

from softcore.tables.causes import numbers
from testbench.faults.stops import STOPS, measure

# Causes that must stop the machine: those of the interlock that come from outside of it.
OTHERS = {"power_on", "firmware", "error_saturated", "following_stopped", "following_moving",
          "travel", "limit_high"}


def test_every_cause_has_a_stop():
    measured = {stop.latched for stop in STOPS} - {""}
    assert measured | OTHERS == set(numbers())
    assert not measured & OTHERS
    assert len({stop.name for stop in STOPS}) == len(STOPS)


@pytest.mark.parametrize("count", [1, pytest.param(100, marks=pytest.mark.soak)])
def test_every_stop_keeps_its_bound(count):
    figures = list(measure(count, seed=1))
    assert [figure.stop for figure in figures] == sorted(
        STOPS, key=[figure.stop for figure in figures].index)
    for figure in figures:
        assert len(figure.clocks) == count
        assert min(figure.clocks) > 0, figure.stop.name
        assert figure.worst <= figure.stop.bound, (figure.stop.name, figure.worst)
