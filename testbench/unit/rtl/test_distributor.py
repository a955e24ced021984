# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.distributor``, against the closed form."""

from fractions import Fraction

import pytest

from rtl.motion.distributor import LineDistributor
from testbench.checkers.steps import Steps
from testbench.models.distributor import steps
from testbench.refusal import refuses
from testbench.some import some

LONGEST = (1 << 30) - 1


class Bench(Steps):
    """A distributor with a place on its segment."""

    async def segment(self, ctx, length, travel):
        self.length, self.travel = length, travel
        self.place = 0
        self.origin = list(self.position)
        self.set_segment(ctx, length, travel)

    async def pulse(self, ctx, step, spacing=3):
        """One path pulse; the axes reach their new places 2 clocks later."""
        dut = self.dut
        ctx.set(dut.pulse, 1)
        ctx.set(dut.reverse, step < 0)
        before = list(self.position)
        await self.clock(ctx)
        ctx.set(dut.pulse, 0)
        ctx.set(dut.reverse, step > 0)
        assert self.position == before
        await self.clock(ctx)
        self.place += step
        self.check()
        now = list(self.position)
        for _ in range(spacing - 2):
            await self.clock(ctx)
        assert self.position == now

    def check(self):
        for axis, travel in enumerate(self.travel):
            moved = self.position[axis] - self.origin[axis]
            assert moved == steps(self.place, self.length, travel)
            assert abs(moved - Fraction(self.place * travel, self.length)) <= Fraction(1, 2)


def travels(rng, length, axes):
    """Travels at the bounds of the range and within it."""
    edges = [0, 1, length // 2, length - 1, length]
    return [rng.choice((1, -1)) * min(length, rng.choice([*edges, rng.randint(0, length)]))
            for _ in range(axes)]


@pytest.mark.parametrize("axes", some([1, 3, 5], 1, 3))
def test_is_the_closed_form_at_every_pulse(simulate, rng, axes):
    bench = Bench(LineDistributor(axes=axes))

    async def run(ctx):
        for length in [1, 1, 2, 3, 7, 8] + [rng.randint(1, 40) for _ in range(15)]:
            await bench.segment(ctx, length, travels(rng, length, axes))
            for _ in range(length):
                await bench.pulse(ctx, +1, rng.choice((3, 3, 4, 7)))
            for axis, travel in enumerate(bench.travel):
                assert bench.position[axis] == bench.origin[axis] + travel

    simulate(bench.dut, run)


def test_mirrors_itself_wherever_it_turns(simulate, rng):
    bench = Bench(LineDistributor(axes=4))

    async def run(ctx):
        for length in [2, 8, 40] + [rng.randint(1, 50) for _ in range(12)]:
            await bench.segment(ctx, length, travels(rng, length, 4))
            if length % 2 == 0:     # an axis that lies half way between two steps at some places
                await bench.segment(ctx, length, [*bench.travel[:3], length // 2])
                for step in [1] * (length - 1) + [-1] * (length - 1):
                    await bench.pulse(ctx, step)
            while bench.place < length:
                target = rng.choice((rng.randint(0, length), length))
                while bench.place != target:
                    await bench.pulse(ctx, 1 if bench.place < target else -1)

    simulate(bench.dut, run)


@pytest.mark.parametrize("place", [0, LONGEST // 3, LONGEST], ids=["start", "middle", "end"])
def test_holds_on_the_longest_segment(simulate, rng, place):
    """The test sets the remainders for a place; they take values all over their range."""
    bench = Bench(LineDistributor(axes=6))

    async def run(ctx):
        travel = [LONGEST, LONGEST // 2, LONGEST // 2 + 1, -(LONGEST - 1),
                  rng.randint(0, LONGEST), -rng.randint(0, LONGEST)]
        await bench.segment(ctx, LONGEST, travel)
        bench.place = place
        bench.origin = [-steps(place, LONGEST, value) for value in travel]
        for axis, value, origin in zip(bench.dut.remainders, travel, bench.origin, strict=True):
            ctx.set(axis, 2 * place * abs(value) - 2 * LONGEST * abs(origin))
        forward = -1 if place == LONGEST else 1
        for step in [1] * 120 + [-1] * 90 + [1] * 60:
            await bench.pulse(ctx, step * forward)

    simulate(bench.dut, run)


def test_restart_forgets_the_remainder(simulate):
    bench = Bench(LineDistributor(axes=1))

    async def run(ctx):
        await bench.segment(ctx, 10, [4])
        await bench.pulse(ctx, 1)
        ctx.set(bench.dut.restart, 1)
        await bench.clock(ctx)
        ctx.set(bench.dut.restart, 0)
        await bench.segment(ctx, 10, [4])
        for _ in range(10):
            await bench.pulse(ctx, 1)

    simulate(bench.dut, run)


def test_refuses_no_axis():
    refuses(LineDistributor, "at least 1 axis, not 0", axes=0)
