# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.power.settling``, against the exact model."""

import pytest

from rtl.power.settling import Settling, filter_clocks
from testbench.models import settling as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle

WIDTHS = {"supply": 5, "reference": 30}


@pytest.mark.parametrize("times", [dict(latch=8, settle=37), dict(latch=1, settle=1),
                                   dict(latch=21, settle=4)], ids=str)
def test_follows_the_model_over_random_changes(simulate, rng, times):
    """Words change alone and together, once and again while the outside is still on its way."""
    dut, expected = Settling(**times), model.Settling(**times)
    seen = set()

    async def bench(ctx):
        inputs = dict.fromkeys((*WIDTHS, "longer"), 0)
        pace = 0.02
        for _ in range(8000):
            if rng.random() < 0.01:
                pace = rng.choice((0.005, 0.02, 0.3))
            for name, width in WIDTHS.items():
                if rng.random() < pace:
                    inputs[name] ^= rng.choice((1 << rng.randrange(width), 0, rng.getrandbits(5)))
            if rng.random() < 0.01:
                inputs["longer"] = rng.choice((0, 1, 2, *times.values(), 60))
            for name, value in inputs.items():
                ctx.set(getattr(dut, name), value)
            await settle(ctx)
            got = ctx.get(dut.latched), ctx.get(dut.settled)
            assert got == expected.clock(**inputs)
            seen.add(got)
            await ctx.tick()

    simulate(dut, bench)
    assert seen == {(0, 0), (0, 1), (1, 0), (1, 1)}


def test_the_time_of_a_filter_is_that_of_one_percent():
    assert filter_clocks(50_000_000, 200.0) == 46_052       # 921 us
    assert filter_clocks(1_000_000, 0.0) == 1


@pytest.mark.parametrize("wrong", [dict(latch=0, settle=1), dict(latch=1, settle=0)], ids=str)
def test_refuses_a_time_below_a_clock(wrong):
    refuses(Settling, "the outside takes at least 1 clock to follow", **wrong)
