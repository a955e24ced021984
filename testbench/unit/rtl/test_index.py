# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.index``, against the exact model and beside an encoder."""

import pytest
from amaranth import *

from rtl.motion.encoder import Encoder
from rtl.motion.index import Index
from testbench.models import index as model
from testbench.models.encoder import CYCLE
from testbench.refusal import refuses

AXES = 3


async def clock(ctx, dut, lines, order=None, safe=False):
    """Give the inputs for one clock; return what is found in the next."""
    ctx.set(dut.line, lines)
    ctx.set(dut.arm, order or 0)
    ctx.set(dut.arm_strobe, order is not None)
    ctx.set(dut.safe, safe)
    await ctx.tick()
    return ctx.get(dut.found)


@pytest.mark.parametrize("samples", [3, 1, 5], ids=lambda samples: f"samples={samples}")
def test_follows_the_model_on_any_lines(simulate, rng, samples):
    dut, axes = Index(axes=AXES, samples=samples), [model.Index(samples) for _ in range(AXES)]

    async def bench(ctx):
        lines = count = 0
        for _ in range(4000):
            # Mostly steady, so that levels pass the filter, with edges at all distances.
            lines ^= sum((rng.random() < 0.15) << axis for axis in range(AXES))
            order = rng.randrange(1 << AXES) if rng.random() < 0.1 else None
            safe = rng.random() < 0.02
            wanted = sum(
                axis.tick(lines >> at & 1, None if order is None else bool(order >> at & 1),
                          safe) << at for at, axis in enumerate(axes))
            assert await clock(ctx, dut, lines, order, safe) == wanted
            count += wanted.bit_count()
        assert count > 50

    simulate(dut, bench)


def test_an_order_finds_one_index(simulate):
    dut = Index(axes=AXES)

    async def bench(ctx):
        async def turn():
            return [await clock(ctx, dut, line) for line in (2,) * 10 + (0,) * 10]

        assert not any(await turn()), "nothing was asked for"
        assert not await clock(ctx, dut, 0, order=2)
        # With the first clock of the new level as clock 0, it is found in clock 3.
        assert await turn() == [2 if at == dut.samples - 1 else 0 for at in range(20)]
        assert not any(await turn()), "once"
        assert not await clock(ctx, dut, 0, order=5)
        assert not any(await turn()), "of another axis"

    simulate(dut, bench)


def test_an_index_that_is_there_already_is_none(simulate):
    dut = Index(axes=AXES)

    async def bench(ctx):
        for _ in range(10):
            await clock(ctx, dut, 1)
        await clock(ctx, dut, 1, order=1)
        assert not any([await clock(ctx, dut, 1) for _ in range(20)])
        for _ in range(10):
            await clock(ctx, dut, 0)
        assert [await clock(ctx, dut, 1) for _ in range(5)] == [0, 0, 1, 0, 0]

    simulate(dut, bench)


def test_safe_ends_the_wait(simulate):
    dut = Index(axes=AXES)

    async def bench(ctx):
        await clock(ctx, dut, 0, order=7)
        await clock(ctx, dut, 0, safe=True)
        assert not any([await clock(ctx, dut, 7) for _ in range(10)])

    simulate(dut, bench)


@pytest.mark.parametrize("way", [1, -1], ids=["up", "down"])
def test_it_is_found_with_the_pulse_of_its_edge(simulate, rng, way):
    """A coder whose index comes with an edge: the count in the clock after has that pulse."""
    m = Module()
    m.submodules.index = dut = Index(axes=1)
    m.submodules.encoder = encoder = Encoder()

    async def bench(ctx):
        place = count = 0

        async def go(clocks, order=None):
            nonlocal count
            a, b = CYCLE[place % 4]
            ctx.set(encoder.a, a)
            ctx.set(encoder.b, b)
            found = []
            for at in range(clocks):
                seen = await clock(ctx, dut, place % 40 == 0, order if at == 0 else None)
                # A counter of the pulses has this value in the clock after.
                count += ctx.get(encoder.fp) * (-1 if ctx.get(encoder.fp_reverse) else 1)
                if seen:
                    found.append(count)
            return found

        await go(20)
        found = []
        for _ in range(300):
            place += way
            found += await go(rng.choice((4, 5, 9)), order=1)
        assert found == [place for place in range(way, 301 * way, way) if place % 40 == 0]

    simulate(m, bench)


def test_refuses_wrong_parameters():
    refuses(Index, r"at least 1 sample, not 0", samples=0)
