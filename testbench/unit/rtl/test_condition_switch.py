# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.power.condition_switch``, against the exact model."""

import pytest

from rtl.power.condition_switch import ConditionSwitch
from testbench.models import condition_switch as model
from testbench.simulators.benches import settle
from testbench.some import some

ORDERS = "arm", "disarm", "commit", "restart"
REST = dict.fromkeys(ORDERS, 0) | {"between": 1}


class Bench:
    """The switch and its model side by side, from a position ``origin`` on."""

    def __init__(self, dut, origin=0):
        self.dut = dut
        self.origin = origin
        self.model = model.ConditionSwitch()
        self.position = 0
        self.depth = 0
        self.found = []     # positions of the switches

    def wrapped(self, value):
        half = 1 << (self.dut.width - 1)
        return (value + self.origin + half) % (2 * half) - half

    async def start(self, ctx):
        """Begin at the machine's place."""
        ctx.set(self.dut.position, self.wrapped(0))
        await ctx.tick()
        ctx.set(self.dut.restart, 1)
        await ctx.tick()
        ctx.set(self.dut.restart, 0)
        self.model.at = -self.origin

    async def clock(self, ctx, **orders):
        dut, inputs = self.dut, REST | orders
        for name, value in inputs.items():
            ctx.set(getattr(dut, name), value)
        ctx.set(dut.position, self.wrapped(self.position))
        ctx.set(dut.depth, self.wrapped(self.depth))
        await settle(ctx)
        got = [ctx.get(getattr(dut, name))
               for name in ("take", "armed", "pending", "switched", "at", "count")]
        expected = list(self.model.outputs(between=inputs["between"]))
        expected[4] = self.wrapped(expected[4])
        assert got == expected
        if got[3]:
            self.found.append(self.model.at)
        self.model.edge(position=self.position, depth=self.depth, **inputs)
        await ctx.tick()


# At the wrap of 32 bits the numbers of depth and position differ by the whole range.
@pytest.mark.parametrize("origin", some([0, -(1 << 31), (1 << 31) - 20, 1 << 30], 0, -(1 << 31)))
def test_follows_the_model_over_random_walks(simulate, rng, origin):
    bench = Bench(ConditionSwitch(), origin)

    async def run(ctx):
        await bench.start(ctx)
        drift, switches = 0.5, 0
        for _ in range(12_000):
            if rng.random() < 0.02:
                drift = rng.choice((0.1, 0.5, 0.6, 0.9))    # a retraction, machining, a jump back
            orders = {name: int(rng.random() < chance) for name, chance in
                      (("disarm", 0.01), ("commit", 0.01), ("restart", 0.003))}
            orders["between"] = int(rng.random() < 0.3)
            if not any(orders[name] for name in ORDERS[1:]) and rng.random() < 0.05:
                orders["arm"] = 1
                bench.depth = min(bench.model.record) - rng.randrange(-5, 25)
            await bench.clock(ctx, **orders)
            if rng.random() < 0.5:
                bench.position -= 1 if rng.random() < drift else -1
            switches = bench.model.count
        assert switches > 100

    simulate(bench.dut, run)


@pytest.mark.parametrize("origin", some([0, -(1 << 31) + 100]))
def test_every_step_switches_at_its_depth_to_the_pulse(simulate, rng, origin):
    """As in machining: back and forth by retractions and jumps, each step armed in time."""
    bench = Bench(ConditionSwitch(), origin)
    depths = [-(10 + 37 * step) for step in range(30)]

    async def run(ctx):
        await bench.start(ctx)
        for step, bench.depth in enumerate(depths):
            await bench.clock(ctx, arm=1)
            while len(bench.found) == step:
                if rng.random() < 0.03:
                    length = rng.randrange(1, 80)
                    for way in (1, -1):     # up and back again
                        for _ in range(length):
                            bench.position += way
                            await bench.clock(ctx)
                            await bench.clock(ctx)
                bench.position -= 1
                for _ in range(4):
                    await bench.clock(ctx)
            while bench.model.pending:
                await bench.clock(ctx)

    simulate(bench.dut, run)
    assert bench.found == depths


def test_steps_that_lie_closer_than_they_are_loaded_come_late_and_in_order(simulate):
    bench = Bench(ConditionSwitch())
    depths, load = [-10, -11, -12, -40, -41], 50    # clocks from a switch to the next step

    async def run(ctx):
        await bench.start(ctx)
        waits = 0
        for clock in range(400):
            step = len(bench.found)
            orders = {}
            if not bench.model.armed and step < len(depths):
                waits += 1
                if waits > load:
                    waits, bench.depth, orders = 0, depths[step], {"arm": 1}
            await bench.clock(ctx, **orders)
            if clock % 5 == 0:
                bench.position -= 1

    simulate(bench.dut, run)
    assert len(bench.found) == len(depths)
    for at, depth in zip(bench.found, depths, strict=True):
        assert depth - (len(depths) * load) // 5 <= at <= depth
    assert bench.found == sorted(bench.found, reverse=True)
    assert bench.found[3] < bench.found[2]


def test_a_pulse_under_way_is_waited_for(simulate):
    bench = Bench(ConditionSwitch())
    taken = []

    async def run(ctx):
        await bench.start(ctx)
        bench.depth = -5
        await bench.clock(ctx, arm=1, between=0)
        for clock in range(60):
            bench.position = -clock
            between = int(clock >= 30)
            await bench.clock(ctx, between=between)
            if bench.model.pending:
                taken.append(clock)

    simulate(bench.dut, run)
    assert bench.found == [-5]
    assert taken == list(range(6, 30))


def test_nothing_switches_after_a_commit_or_a_disarm(simulate):
    bench = Bench(ConditionSwitch())

    async def run(ctx):
        await bench.start(ctx)
        for order in ("disarm", "commit"):
            bench.position, bench.depth = 0, -5
            await bench.clock(ctx, restart=1)
            await bench.clock(ctx, arm=1)
            await bench.clock(ctx, **{order: 1})
            for _ in range(20):
                bench.position -= 1
                await bench.clock(ctx)

    simulate(bench.dut, run)
    assert bench.found == []
