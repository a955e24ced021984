# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.lib``, against the exact models."""

import pytest

from rtl.lib.debounce import Debounce
from rtl.lib.event_queue import EventQueue
from testbench.models import debounce, event_queue
from testbench.refusal import refuses
from testbench.simulators.benches import settle


@pytest.mark.parametrize(("rise", "fall"), [(2, 7), (1, 1), (7, 2), (1, 5), (8, 8)])
def test_debounce_follows_the_model(simulate, rng, rise, fall):
    dut, model = Debounce(rise=rise, fall=fall), debounce.Debounce(rise, fall)

    async def bench(ctx):
        changes = 0
        for _ in range(300):
            level = rng.randrange(2)
            for _ in range(rng.choice((1, rise - 1, rise, fall - 1, fall, fall + 3))):
                ctx.set(dut.raw, level)
                before = model.steady
                model.clock(level)
                await ctx.tick()
                assert ctx.get(dut.steady) == model.steady
                changes += model.steady != before
        assert changes > 30

    simulate(dut, bench)


@pytest.mark.parametrize("wrong", [dict(rise=0, fall=1), dict(rise=1, fall=0)])
def test_debounce_refuses_wrong_parameters(wrong):
    refuses(Debounce, r"debounce times must be at least 1 clock", **wrong)


@pytest.mark.parametrize(("width", "depth"), [(9, 4), (1, 2), (40, 16)])
def test_queue_follows_the_model(simulate, rng, width, depth):
    dut, model = EventQueue(width=width, depth=depth), event_queue.EventQueue(depth)

    async def bench(ctx):
        losses = 0
        for clock in range(3000):
            # Filling, draining and level phases: full, empty and wrapping pointers all come.
            fill = (0.9, 0.5, 0.2)[clock // 100 % 3]
            push, pop = rng.random() < fill, rng.random() < 1 - fill
            data = rng.randrange(1 << width)
            for signal, value in ((dut.push, push), (dut.data, data), (dut.pop, pop)):
                ctx.set(signal, value)
            level = len(model.entries)
            head, full, lost = model.clock(push=push, data=data, pop=pop)
            await settle(ctx)
            assert ctx.get(dut.valid) == (head is not None)
            assert head is None or ctx.get(dut.head) == head
            assert ctx.get(dut.full) == full
            assert ctx.get(dut.level) == level
            assert ctx.get(dut.lost) == lost
            losses += lost
            await ctx.tick()
        assert losses > 10

    simulate(dut, bench)


@pytest.mark.parametrize(("wrong", "message"), [
    (dict(width=0),           r"queue width must be at least 1 bit, not 0"),
    (dict(width=8, depth=1),  r"queue depth must be a power of two from 2 on, not 1"),
    (dict(width=8, depth=12), r"queue depth must be a power of two from 2 on, not 12"),
])
def test_queue_refuses_wrong_parameters(wrong, message):
    refuses(EventQueue, message, **wrong)
