# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.conduction``, against the exact model."""

import pytest

from rtl.gap.conduction import Conduction
from testbench.models import conduction as model
from testbench.simulators.benches import settle


class Bench:
    """The block and its model side by side; ``said`` has the model's words of each clock."""

    def __init__(self):
        self.dut = Conduction()
        self.model = model.Conduction()
        self.said = [False]

    async def clock(self, ctx, delay, *, on=0, sense=0, current=0):
        for name, value in dict(on=on, sense=sense, current=current, delay=delay).items():
            ctx.set(getattr(self.dut, name), value)
        await settle(ctx)
        assert ctx.get(self.dut.last) == self.said[-1]
        self.said.append(self.model.clock(on=on, sense=sense, current=current, delay=delay))
        assert ctx.get(self.dut.now) == self.said[-1]
        await ctx.tick()


def test_follows_the_model(simulate, rng):
    bench = Bench()
    ends = set()

    async def run(ctx):
        delay = 0
        for _ in range(600):
            # Also inputs that the generator never makes: both gates, and a change without a pause.
            gates = rng.choice(((1, 0), (1, 0), (0, 1), (1, 1)))
            likely, late = rng.choice((0.1, 0.5, 0.9, 1)), rng.randrange(6)
            for clock in range(rng.randrange(1, 14)):
                await bench.clock(ctx, delay, on=gates[0], sense=gates[1],
                                  current=clock >= late and rng.random() < likely)
            ends.add((gates, bench.said[-1], delay))
            pause = rng.randrange(3)
            for number in range(pause):
                if number == 1:
                    delay = rng.choice((0, 1, 2, 4, 7, 30))
                await bench.clock(ctx, delay, current=rng.random() < 0.5)

    simulate(bench.dut, run)
    assert {(gates, said) for gates, said, _ in ends} == {
        (gates, said) for gates in ((1, 0), (0, 1), (1, 1)) for said in (False, True)}
    assert len({delay for _, said, delay in ends if said}) == 6


# c: current, . none.
@pytest.mark.parametrize(("delay", "pulse", "conducts"), [
    (4, "......", 0), (4, "cccccc", 1), (4, "....cc", 1), (4, ".....c", 0), (4, "..c.cc", 1),
    (4, "cccc.c", 0), (4, "ccccc.", 0), (4, "c..", 0), (4, "..c", 1), (1, ".ccc", 1),
    (1, "..cc", 0), (0, "cccc", 1), (0, ".ccc", 0), (30, "cc...c", 1), (30, "ccccc.", 0),
])
@pytest.mark.parametrize("gate", ["on", "sense"])
def test_a_delay_is_no_short(simulate, delay, pulse, conducts, gate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, delay, current=1)
        for letter in pulse:
            await bench.clock(ctx, delay, **{gate: 1}, current=letter == "c")
        await settle(ctx)
        assert ctx.get(bench.dut.last) == conducts
        await bench.clock(ctx, delay, current=1)
        await bench.clock(ctx, delay)

    simulate(bench.dut, run)
