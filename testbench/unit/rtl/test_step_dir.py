# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.step_dir``, against the exact model and by its times."""

import pytest

from rtl.motion.step_dir import StepDir
from testbench.models import step_dir as model
from testbench.simulators.benches import settle


class Queue:
    """The counter that the block serves, and a record of its outputs, clock by clock."""

    def __init__(self, dut):
        self.dut = dut
        self.steps = 0
        self.record = []  # (step, dir)
        self.sent = 0

    async def clock(self, ctx, added, times, safe=False):
        dut = self.dut
        for signal, value in zip((dut.width, dut.space, dut.setup), times, strict=True):
            ctx.set(signal, value)
        ctx.set(dut.pending, self.steps != 0)
        ctx.set(dut.negative, self.steps < 0)
        ctx.set(dut.safe, safe)
        await settle(ctx)
        taken = ctx.get(dut.taken) * (-1 if ctx.get(dut.dir) else 1)
        await ctx.tick()
        self.steps += added - taken
        self.sent += taken
        self.record.append((ctx.get(dut.step), ctx.get(dut.dir)))


def runs(record):
    """Lengths of the runs of equal records, as ``[(record, length), …]``."""
    out = []
    for item in record:
        if out and out[-1][0] == item:
            out[-1][1] += 1
        else:
            out.append([item, 1])
    return [tuple(run) for run in out]


@pytest.mark.parametrize("times", [(2, 3, 4), (0, 0, 0), (1, 1, 1), (5, 1, 9), None], ids=str)
def test_follows_the_model(simulate, rng, times):
    dut, reference = StepDir(), model.StepDir()
    queue = Queue(dut)

    async def bench(ctx):
        steps = 0
        for _ in range(3000):
            width, space, setup = times or (rng.choice((0, 1, 2, 3, 7)) for _ in range(3))
            added = rng.choice((0, 0, 0, 0, 0, 0, 1, -1)) if rng.random() < 0.7 else 0
            safe = rng.random() < 0.01
            taken = reference.taken * (-1 if reference.dir else 1)
            reference.tick(steps, width=width, space=space, setup=setup, safe=safe)
            steps += added - taken
            await queue.clock(ctx, added, (width, space, setup), safe)
            assert queue.record[-1] == (reference.step, reference.dir)
            assert ctx.get(dut.taken) == reference.taken
            assert queue.steps == steps

    simulate(dut, bench)


@pytest.mark.parametrize("times", [(4, 2, 1), (1, 1, 1), (2, 3, 4), (255, 255, 255)], ids=str)
def test_keeps_its_times_and_loses_no_step(simulate, rng, times):
    dut = StepDir()
    queue = Queue(dut)
    width, space, setup = times

    async def bench(ctx):
        for added in (3, -5, 1, 1, -1):
            for part in [added // abs(added)] * abs(added):
                await queue.clock(ctx, part, times)
            for _ in range(8 * (width + space + setup)):
                await queue.clock(ctx, 0, times)
        assert queue.steps == 0
        assert queue.sent == -1

        up = sum(1 for (step, down), _ in runs(queue.record) if step and not down)
        assert 2 * up - sum(1 for (step, _), _ in runs(queue.record) if step) == -1
        low, steady = 10**6, 10**6  # clocks of low step, clocks of steady dir
        for ((_, before), _), ((step, down), length) in zip(runs(queue.record),
                                                            runs(queue.record)[1:], strict=False):
            if down != before:
                assert low >= space, "direction is held after the pulse"
                steady = 0
            if step:
                assert length == width
                assert low >= space
                assert steady >= setup
            low = 0 if step else low + length
            steady += length

    simulate(dut, bench, deadline=1e-3)


def test_safe_stops_in_the_next_clock_and_keeps_the_count(simulate):
    dut = StepDir()
    queue = Queue(dut)

    async def bench(ctx):
        await queue.clock(ctx, 1, (9, 3, 3))
        await queue.clock(ctx, 1, (9, 3, 3))
        await queue.clock(ctx, 0, (9, 3, 3))
        assert queue.record[-1] == (1, 0)
        for _ in range(20):
            await queue.clock(ctx, 0, (9, 3, 3), safe=True)
            assert queue.record[-1] == (0, 0)
        assert (queue.steps, queue.sent) == (1, 1)
        for clock in range(4):
            await queue.clock(ctx, 0, (9, 3, 3))
            assert queue.record[-1][0] == (clock >= 3 - 1)

    simulate(dut, bench)
