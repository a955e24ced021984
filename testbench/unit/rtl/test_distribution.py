# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.distribution``: lines, arcs and helices one after the other."""

import pytest

from rtl.motion.arc import ArcDistributor
from rtl.motion.distribution import Distributor
from rtl.motion.distributor import LineDistributor
from testbench.checkers.steps import Steps
from testbench.models.arc_piece import circle_piece
from testbench.models.distributor import steps

AXES = 3
PLANES = ((0, 1), (2, 0), (1, 2))   # major axis, minor axis


class Bench(Steps):
    """A distributor, and its place on a segment whose axes' steps have a closed form."""

    def __init__(self):
        super().__init__(Distributor(axes=AXES))
        self.forms = [lambda _: 0] * AXES
        self.arc = ()           # axes of the arc
        self.place = self.length = 0

    async def line(self, ctx, length, travel):
        self._begin(ctx, length, travel)
        ctx.set(self.dut.arc, 0)
        await ctx.tick()

    async def piece(self, ctx, piece, plane, travel):
        """Enter a piece of an arc; the axis outside the plane travels so far on it."""
        dut = self.dut
        self._begin(ctx, piece.length, [
            piece.signs[plane.index(axis)] if axis in plane else travel for axis in range(AXES)])
        self.arc = plane
        for index, axis in enumerate(plane):
            self.forms[axis] = lambda place, index=index: (
                piece.signs[index] * piece.steps(place)[index])
        for port, value in ((dut.arc, 1), (dut.major, plane[0]), (dut.minor, plane[1]),
                            (dut.divisor, piece.divisor), (dut.change, piece.change),
                            (dut.outward, piece.outward), (dut.enter, 1)):
            ctx.set(port, value)
        state = piece.state(0)
        for name in ("pace", "error", "along", "across"):
            ctx.set(getattr(dut.state, name), getattr(state, name))
        await ctx.tick()
        ctx.set(dut.enter, 0)
        await ctx.tick()

    def _begin(self, ctx, length, travel):
        self.origin = list(self.position)
        self.place, self.length, self.arc = 0, length, ()
        self.forms = [lambda place, whole=whole: steps(place, length, whole) for whole in travel]
        self.set_segment(ctx, length, travel)

    async def pulse(self, ctx, step):
        """One path pulse: each axis steps 2 clocks later, those of an arc 5 clocks later."""
        dut = self.dut
        ctx.set(dut.pulse, 1)
        ctx.set(dut.reverse, step < 0)
        before = list(self.position)
        self.place += step
        after = [origin + form(self.place)
                 for origin, form in zip(self.origin, self.forms, strict=True)]
        for clock in range(1, ArcDistributor.LATENCY + 1):
            await self.clock(ctx)
            ctx.set(dut.pulse, 0)
            for axis in range(AXES):
                late = ArcDistributor if axis in self.arc else LineDistributor
                assert self.position[axis] == (
                    after[axis] if clock >= late.LATENCY else before[axis])

    async def walk(self, ctx, rng):
        """To places chosen at random, and to an end."""
        for target in [rng.randint(0, self.length) for _ in range(2)] + [
                rng.choice((0, self.length, self.length))]:
            while self.place != target:
                await self.pulse(ctx, 1 if self.place < target else -1)


@pytest.mark.parametrize("plane", PLANES, ids=str)
def test_each_axis_goes_by_its_closed_form(simulate, rng, plane):
    bench = Bench()
    moved = [0] * AXES

    async def run(ctx):
        for kind in rng.sample(["line", "arc", "helix"] * 3, 9):
            before = list(bench.position)
            if kind == "line":
                length = rng.randint(1, 40)
                await bench.line(ctx, length, [rng.randint(-length, length) for _ in range(AXES)])
            else:
                piece = circle_piece(rng, rng.choice((3.5, 20, 1000)), longest=40)
                travel = rng.randint(-piece.length, piece.length) if kind == "helix" else 0
                await bench.piece(ctx, piece, plane, travel)
            await bench.walk(ctx, rng)
            for axis in range(AXES):
                moved[axis] += bench.position[axis] != before[axis]

    simulate(bench.dut, run)
    assert min(moved) > 1


def test_a_restart_at_a_border_forgets_the_remainders_of_a_line(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.line(ctx, 4, [2, 0, 0])
        await bench.pulse(ctx, 1)
        ctx.set(bench.dut.restart, 1)
        await bench.clock(ctx)
        ctx.set(bench.dut.restart, 0)
        before = bench.position[0]
        await bench.line(ctx, 4, [1, 0, 0])
        for _ in range(4):
            await bench.pulse(ctx, 1)
        assert bench.position[0] == before + 1

    simulate(bench.dut, run)
