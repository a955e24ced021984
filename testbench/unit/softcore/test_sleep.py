# SPDX-License-Identifier: Apache-2.0
"""The processor's clock stops and starts where it is allowed to."""

from softcore.sleep import Sleep
from testbench.simulators.benches import settle


def test_sleeps_for_so_long(simulate):
    dut = Sleep()

    async def bench(ctx):
        for clocks in (0, 1, 5, 300):
            ctx.set(dut.strobe, 1)
            ctx.set(dut.clocks, clocks)
            await settle(ctx)
            assert ctx.get(dut.running), "from the next clock on"
            await ctx.tick()
            ctx.set(dut.strobe, 0)
            asleep = 0
            await settle(ctx)
            while not ctx.get(dut.running):
                asleep += 1
                await ctx.tick()
            assert asleep == clocks

    simulate(dut, bench)


def test_wakes_at_once_and_stays_awake(simulate):
    dut = Sleep()

    async def bench(ctx):
        ctx.set(dut.strobe, 1)
        ctx.set(dut.clocks, 100)
        await ctx.tick()
        ctx.set(dut.strobe, 0)
        await ctx.tick().repeat(10)
        assert not ctx.get(dut.running)
        ctx.set(dut.wake, 1)
        await settle(ctx)
        assert ctx.get(dut.running), "in the same clock"
        await ctx.tick()
        ctx.set(dut.wake, 0)
        await settle(ctx)
        assert ctx.get(dut.running), "the rest of the sleep is off"

    simulate(dut, bench)


def test_does_not_sleep_while_there_is_something_to_do(simulate):
    dut = Sleep()

    async def bench(ctx):
        ctx.set(dut.strobe, 1)
        ctx.set(dut.clocks, 100)
        ctx.set(dut.wake, 1)
        await ctx.tick()
        ctx.set(dut.strobe, 0)
        ctx.set(dut.wake, 0)
        await settle(ctx)
        assert ctx.get(dut.running)

    simulate(dut, bench)


def test_lets_an_access_end(simulate):
    dut = Sleep()

    async def bench(ctx):
        ctx.set(dut.strobe, 1)
        ctx.set(dut.clocks, 100)
        await ctx.tick()
        ctx.set(dut.strobe, 0)
        ctx.set(dut.ack, 1)
        await settle(ctx)
        assert ctx.get(dut.running)
        await ctx.tick()
        ctx.set(dut.ack, 0)
        await settle(ctx)
        assert not ctx.get(dut.running)

    simulate(dut, bench)
