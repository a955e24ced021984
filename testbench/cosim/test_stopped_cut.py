# SPDX-License-Identifier: Apache-2.0
"""An emergency stop while a tape cuts: it goes on at the pulse where it was left.

The workpiece is then as if nothing had been. Its walls and its depth scatter from run to run as
`test_power_loss.py` tells; a block that began anew made a slot up to 7 um wider there.
"""

import pytest

from testbench.cosim.power_loss import CAVITY, SLOT, whole
from testbench.cosim.stopped_cut import stops

BOUNDS_UM = {CAVITY: 10.0, SLOT: 6.0}
STOPS = 20


def stopped(work, clocks, seed):
    """Blocks whose rest was carried out, for stops in these parts of an uninterrupted run."""
    without = whole(work, 1)
    rests = []
    for at, block, result in stops(work, seed, [round(part * without.clocks) for part in clocks]):
        assert len(result.left_um) == len(without.left_um)
        for left, other in zip(result.left_um, without.left_um, strict=True):
            assert abs(left - other) <= BOUNDS_UM[work], (at, block, result.left_um)
        assert not result.places or result.places == without.places
        rests.append(block)
    assert len(rests) == len(clocks)
    return rests


def test_the_rest_of_a_slot_is_as_if_nothing_had_been(rng):
    (block,) = stopped(SLOT, [0.4], rng.randrange(1 << 32))
    assert block in SLOT.blocks


@pytest.mark.soak
@pytest.mark.parametrize("work", [pytest.param(work, id=work.name) for work in BOUNDS_UM])
def test_wherever_it_is_stopped(work, rng):
    rests = stopped(work, [rng.random() for _ in range(STOPS)], rng.randrange(1 << 32))
    assert sum(block > 0 for block in rests) > STOPS // 3
