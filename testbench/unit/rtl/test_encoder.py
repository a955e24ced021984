# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.encoder``, against the exact model."""

import pytest

from rtl.motion.encoder import Encoder
from testbench.models import encoder as model
from testbench.models.encoder import CYCLE
from testbench.refusal import refuses


async def clock(ctx, dut, a, b, clear=False):
    """Give the levels for one clock; return the pulse and the jump of the next."""
    ctx.set(dut.a, a)
    ctx.set(dut.b, b)
    ctx.set(dut.clear, clear)
    await ctx.tick()
    return ctx.get(dut.fp) * (-1 if ctx.get(dut.fp_reverse) else 1), ctx.get(dut.jump)


@pytest.mark.parametrize("samples", [1, 2, 3, 5], ids=lambda samples: f"samples={samples}")
def test_follows_the_model_on_any_levels(simulate, rng, samples):
    dut, decoder = Encoder(samples=samples), model.Encoder(samples)

    async def bench(ctx):
        a = b = jumps = pulses = 0
        for _ in range(4000):
            # Mostly steady, so that levels pass the filter, with edges at all distances.
            a, b = a ^ (rng.random() < 0.15), b ^ (rng.random() < 0.15)
            if rng.random() < 0.03:
                a, b = 1 - a, 1 - b
            clear = rng.random() < 0.1
            seen = await clock(ctx, dut, a, b, clear)
            assert seen == decoder.tick(a, b, clear)
            assert ctx.get(dut.illegal) == decoder.illegal
            pulses, jumps = pulses + abs(seen[0]), jumps + seen[1]
        assert pulses > 50
        assert jumps > 5

    simulate(dut, bench)


@pytest.mark.parametrize("distance", [4, 5, 9])
def test_counts_every_edge_with_its_direction(simulate, rng, distance):
    dut = Encoder()

    async def bench(ctx):
        await ctx.tick().repeat(dut.settle)
        true = place = counted = 0
        for _ in range(300):
            move = rng.choice((-1, 1, 1))
            place += move
            true += move
            for index in range(distance):
                fp, jump = await clock(ctx, dut, *CYCLE[place % 4])
                # The latency: the pulse of an edge in clock 0 comes in clock 3.
                assert fp == (move if index == dut.samples - 1 else 0)
                assert not jump
                counted += fp
        assert counted == true

    simulate(dut, bench)


def test_ignores_glitches_shorter_than_the_filter(simulate, rng):
    dut = Encoder()

    async def bench(ctx):
        for _ in range(200):
            for levels in [(rng.randrange(2), rng.randrange(2))] * 2 + [(0, 0)]:
                assert await clock(ctx, dut, *levels) == (0, 0)

    simulate(dut, bench)


def test_flags_each_jump_once(simulate):
    dut = Encoder()

    async def bench(ctx):
        await ctx.tick().repeat(dut.settle)
        for levels in (1, 1), (0, 0), (1, 1):
            jumps = [await clock(ctx, dut, *levels) for _ in range(10)]
            assert jumps == [(0, int(index == dut.samples - 1)) for index in range(10)]
            assert ctx.get(dut.illegal)
        await clock(ctx, dut, 1, 1, clear=True)
        assert not ctx.get(dut.illegal)

    simulate(dut, bench)


@pytest.mark.parametrize("levels", CYCLE)
def test_starts_at_any_levels(simulate, levels):
    dut = Encoder()

    async def bench(ctx):
        for _ in range(40):
            assert await clock(ctx, dut, *levels) == (0, 0)
        assert not ctx.get(dut.illegal)

    simulate(dut, bench)


@pytest.mark.parametrize(("wrong", "message"), [
    (dict(samples=0), r"at least 1 sample, not 0"),
    (dict(samples=3, settle=2), r"at least the 3 clocks of the glitch filter, not 2"),
])
def test_refuses_wrong_parameters(wrong, message):
    refuses(Encoder, message, **wrong)
