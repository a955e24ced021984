# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``softcore.notice``, against the exact model."""

import pytest

from softcore.notice import FaultNotice
from testbench.models.fault_notice import SILENT, beginnings, sentence
from testbench.simulators.benches import settle

PERIOD = 200


@pytest.mark.parametrize("place", [0, 0x12340, 0x89ABCDEC, 0xFFFFFFFC, None])
def test_tells_the_first_fault_again_and_again(simulate, rng, place):
    """The notice names the place; without a place it says that the processor is silent."""
    dut = FaultNotice(period=PERIOD)
    text = SILENT if place is None else sentence(place)

    async def bench(ctx):
        await ctx.tick().repeat(rng.randrange(2 * PERIOD))
        assert not ctx.get(dut.held)
        assert not ctx.get(dut.valid)
        ctx.set(dut.damaged, place is not None)
        ctx.set(dut.place, place or 0)
        ctx.set(dut.silent, place is None or rng.random() < 0.5)
        await settle(ctx)
        assert not ctx.get(dut.held), "from the next clock on"
        await ctx.tick()
        began, said = [], []
        for clock in range(5 * PERIOD):
            # Other words read wrong after it: they are not told.
            ctx.set(dut.damaged, rng.random() < 0.5)
            ctx.set(dut.place, rng.getrandbits(32))
            ctx.set(dut.silent, rng.random() < 0.5)
            await settle(ctx)
            assert ctx.get(dut.by_damage) == (place is not None)
            ready = rng.random() < 0.5
            ctx.set(dut.ready, ready)
            await settle(ctx)
            assert ctx.get(dut.held)
            if ctx.get(dut.valid):
                if len(said) % len(text) == 0 and len(began) == len(said) // len(text):
                    began.append(clock)
                if ready:
                    said.append(ctx.get(dut.data))
            await ctx.tick()
        assert began == beginnings(0, PERIOD, 5)
        assert bytes(said) == 5 * text

    simulate(dut, bench)


def test_a_byte_stays_until_it_is_taken(simulate):
    dut = FaultNotice(period=PERIOD)

    async def bench(ctx):
        ctx.set(dut.damaged, 1)
        await ctx.tick()
        for byte in sentence(0):
            for _ in range(3):
                assert ctx.get(dut.valid)
                assert ctx.get(dut.data) == byte
                await ctx.tick()
            ctx.set(dut.ready, 1)
            await ctx.tick()
            ctx.set(dut.ready, 0)
            await settle(ctx)
        assert not ctx.get(dut.valid)

    simulate(dut, bench)
