# SPDX-License-Identifier: Apache-2.0
"""The condition switched at random phases, seen behind the ULX3S's shift registers and filters.

A pulse of the discharge is a mixture if, in any of its clocks, its level at the pins, the voltage
and polarity in the shift registers' outputs, or a reference behind its filter is not that of the
condition in force; or if its length is not. A reference counts as that of the condition within 1 %
of its last change, and the ripple of its stream.
"""

from dataclasses import replace

import pytest

from constraints.ulx3s import BOARDS
from rtl.power.settling import filter_clocks
from softcore.build import controller_options
from testbench.native.at_pins import switched
from testbench.some import some

CLOCK_HZ = 40_000_000
LATCH, SETTLE = 800, 36_842     # clocks: 20 us of the chain, 921 us behind 200 us
SENSING = CLOCK_HZ * 50 // 10**6    # a sensing pulse and its pause
FEW = 300


def ulx3s():
    """What the ULX3S's controller waits, and what hangs on its pins."""
    board, *_ = BOARDS
    options = controller_options(board, board.platform())
    rc_us = options["reference_rc_us"]
    return dict(clock_hz=board.clock_hz, rc_us=rc_us, latch=options["latch_clocks"],
                settle=filter_clocks(board.clock_hz, rc_us))


def looked_at(switches, seed):
    found = switched(switches, seed=seed, **ulx3s())
    print(found)
    assert (found.switches, found.mixed, found.early) == (switches, 0, 0)
    assert found.pulses > 2 * switches
    assert 0.1 * switches < found.skipped < 0.4 * switches
    # No wait without a reason, and none much longer than the outside takes.
    assert found.shortest < 100
    assert LATCH < found.longest_latch <= LATCH + 10
    assert SETTLE < found.longest <= SETTLE + SENSING + 10


def test_the_boards_figures_are_those_of_its_chain_and_filters():
    assert ulx3s() == dict(clock_hz=CLOCK_HZ, rc_us=200.0, latch=LATCH, settle=SETTLE)
    board, *_ = BOARDS
    slower = controller_options(replace(board, supply_settle_us=3.0, reference_rc_us=50.0),
                                board.platform())
    assert slower["latch_clocks"] == LATCH + 3 * CLOCK_HZ // 10**6
    assert slower["reference_rc_us"] == 50.0


def test_no_pulse_mixes_two_conditions_in_some_switches(rng):
    looked_at(FEW, rng.getrandbits(32))


@pytest.mark.soak
def test_no_pulse_mixes_two_conditions_in_10_000_switches(rng):
    looked_at(10_000, rng.getrandbits(32))


@pytest.mark.soak
@pytest.mark.parametrize("hasty", some([dict(latch=1), dict(settle=1)]), ids=str)
def test_without_the_wait_there_are_mixtures(rng, hasty):
    """The bench sees what it looks for."""
    found = switched(FEW, seed=rng.getrandbits(32), **ulx3s() | hasty)
    print(found)
    assert found.mixed > 0.05 * found.switches
