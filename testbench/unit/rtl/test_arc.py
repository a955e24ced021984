# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.arc`` against the closed form, and of that form against the circle."""

import math

import pytest

from rtl.motion.arc import ArcDistributor
from testbench.checkers.steps import Steps
from testbench.models.arc_piece import circle_piece
from testbench.refusal import refuses

RADII = (2, 3.5, 7, 20, 100.4, 1000, 30_000, 10_000_000)


class Bench(Steps):
    """A distributor and its place on the piece."""

    def __init__(self, *, axes=3, major=0, minor=1):
        super().__init__(ArcDistributor(axes=axes))
        self.axes = major, minor

    def set_piece(self, ctx, piece, *, at_end=False):
        """Enter a piece at either end."""
        dut = self.dut
        self.piece = piece
        self.place = piece.length if at_end else 0
        self.origin = list(self.position)
        for index, axis in enumerate(self.axes):
            taken = (piece.major, piece.minor)[index] if at_end else 0
            self.origin[axis] -= piece.signs[index] * taken
        ctx.set(dut.major, self.axes[0])
        ctx.set(dut.minor, self.axes[1])
        ctx.set(dut.divisor, piece.divisor)
        ctx.set(dut.change, piece.change)
        ctx.set(dut.outward, piece.outward)
        ctx.set(dut.negative, sum((sign < 0) << axis for axis, sign in zip(
            self.axes, piece.signs, strict=True)))
        state = piece.state(self.place)
        for name in ("pace", "error", "along", "across"):
            ctx.set(getattr(dut.state, name), getattr(state, name))
        ctx.set(dut.enter, 1)

    async def enter(self, ctx, piece, *, at_end=False):
        self.set_piece(ctx, piece, at_end=at_end)
        await self.clock(ctx)
        ctx.set(self.dut.enter, 0)
        await self.clock(ctx)

    def expected(self):
        """Places of the axes by the closed form."""
        position = list(self.origin)
        for axis, sign, steps in zip(self.axes, self.piece.signs, self.piece.steps(self.place),
                                     strict=True):
            position[axis] += sign * steps
        return position

    async def pulse(self, ctx, step):
        """One path pulse, while the steps of the pulse before come out."""
        ctx.set(self.dut.pulse, 1)
        ctx.set(self.dut.reverse, step < 0)
        await self.clock(ctx)
        ctx.set(self.dut.pulse, 0)
        ctx.set(self.dut.reverse, step > 0)
        self.place += step

    async def checked(self, ctx, step, spacing=5):
        """One path pulse; the axes reach their new places exactly 5 clocks later, not before."""
        before = list(self.position)
        await self.pulse(ctx, step)
        for _ in range(self.dut.LATENCY - 1):
            assert self.position == before
            await self.clock(ctx)
        assert self.position == self.expected()
        now = list(self.position)
        for _ in range(spacing - self.dut.LATENCY):
            await self.clock(ctx)
        assert self.position == now


@pytest.mark.parametrize("radius", RADII)
def test_is_the_closed_form_both_ways(simulate, rng, radius, cases):
    bench = Bench(major=1, minor=2)

    async def run(ctx):
        for _ in range(cases(6)):
            piece = circle_piece(rng, radius, longest=60)
            at_end = rng.random() < 0.5
            await bench.enter(ctx, piece, at_end=at_end)
            for target in [rng.randint(0, piece.length) for _ in range(3)] + [
                    0 if at_end else piece.length]:
                while bench.place != target:
                    await bench.checked(ctx, 1 if bench.place < target else -1)
            signs = piece.signs
            assert bench.position[0] == 0
            assert bench.expected() == [
                0, bench.origin[1] + (not at_end) * signs[0] * piece.major,
                bench.origin[2] + (not at_end) * signs[1] * piece.minor]

    simulate(bench.dut, run)


def test_at_full_rate_no_pulse_is_lost(simulate, rng):
    """A pulse every 4 clocks, turned at random, from piece to piece at either end."""
    bench = Bench()

    async def run(ctx):
        for radius in (3, 12, 400):
            for _ in range(5):
                piece = circle_piece(rng, radius, longest=80)
                await bench.enter(ctx, piece, at_end=rng.random() < 0.5)
                for _ in range(4):
                    target = rng.randint(0, piece.length)
                    while bench.place != target:
                        await bench.pulse(ctx, 1 if bench.place < target else -1)
                        for _ in range(3):
                            await bench.clock(ctx)
                await bench.clock(ctx)
                assert bench.position == bench.expected()

    simulate(bench.dut, run)


def test_enters_the_next_piece_in_time(simulate, rng):
    """Loading the state 4 clocks after a pulse and 2 before the next disturbs nothing."""
    bench = Bench()

    async def run(ctx):
        for _ in range(20):
            piece = circle_piece(rng, 9, longest=12)
            await bench.enter(ctx, piece)
            for _ in range(piece.length):
                await bench.pulse(ctx, 1)
                for _ in range(3):
                    await bench.clock(ctx)
            expected = bench.expected()
            bench.set_piece(ctx, piece)  # in the clock of the last steps
            await bench.clock(ctx)
            ctx.set(bench.dut.enter, 0)
            assert bench.position == expected
            bench.origin = list(expected)

    simulate(bench.dut, run)


@pytest.mark.parametrize("radius", RADII)
def test_the_closed_form_lies_within_half_a_pulse_of_the_circle(rng, radius):
    """The place is right up to the rounding of the error to 1/64 pulse."""
    for _ in range(40):
        piece = circle_piece(rng, radius, longest=1500)
        x0, y0 = piece.centre
        # The error is rounded by up to half of its unit: that much of the radius' square.
        rounded = 1 / 128 / (piece.radius + math.sqrt(piece.radius ** 2 - 1 / 128))
        before = 0, 0
        for place in range(piece.length + 1):
            major, minor = piece.steps(place)
            x = x0 + piece.signs[0] * major
            y = y0 + (minor if piece.outward else -minor)
            assert abs(math.hypot(x, y) - piece.radius) <= 0.5 + rounded
            assert major - before[0] in (0, 1)
            assert minor - before[1] in (0, major - before[0])
            before = major, minor
        assert before == (piece.major, piece.minor)
        assert piece.pace(piece.length) == piece.major * piece.divisor


def test_refuses_one_axis():
    refuses(ArcDistributor, "at least 2 axes, not 1", axes=1)


def test_refuses_parts_that_have_no_quarter():
    refuses(ArcDistributor, "must be a multiple of 4, not 6", fine=6)
