# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``softcore.flash``: every clock of an exchange, and the byte that came."""

import pytest

from softcore.flash import FlashPort
from testbench.models.flash_port import exchange
from testbench.refusal import refuses
from testbench.simulators.benches import settle


@pytest.mark.parametrize(("clock_hz", "latency"), [
    (50_000_000, 4), (2_000_000, 4), (25_000_001, 1), (100_000_000, 7)])
def test_an_exchange_follows_the_model(simulate, rng, clock_hz, latency):
    dut = FlashPort(clock_hz=clock_hz, latency=latency)
    sent = [0, 0xFF, 0x80, 0x01, *(rng.randrange(256) for _ in range(12))]

    async def bench(ctx):
        for send in sent:
            for _ in range(rng.randrange(3)):
                await settle(ctx)
                assert not ctx.get(dut.busy)
                assert not ctx.get(dut.clock)
                await ctx.tick()
            ctx.set(dut.start, 1)
            ctx.set(dut.send, send)
            await ctx.tick()
            levels, taken = exchange(send, clock_hz=clock_hz, latency=latency)
            came = 0
            for clock, (level, command) in enumerate(levels):
                data = rng.randrange(2)
                ctx.set(dut.data, data)
                # Another start, of another byte, does nothing meanwhile.
                ctx.set(dut.start, rng.randrange(2))
                ctx.set(dut.send, rng.randrange(256))
                await settle(ctx)
                assert ctx.get(dut.busy)
                assert ctx.get(dut.clock) == level
                assert command is None or ctx.get(dut.command) == command
                if clock in taken:
                    came = came << 1 | data
                await ctx.tick()
                if clock == len(levels) - 1:
                    ctx.set(dut.start, 0)
            await settle(ctx)
            assert not ctx.get(dut.busy)
            assert ctx.get(dut.received) == came

    simulate(dut, bench)


@pytest.mark.parametrize(("wrong", "said"), [
    ({"clock_hz": 0}, "clock_hz must be at least 1"),
    ({"clock_hz": 1, "latency": 0}, "latency must be 1 to 31"),
    ({"clock_hz": 1, "latency": 32}, "latency must be 1 to 31")])
def test_refuses_wrong_parameters(wrong, said):
    refuses(FlashPort, said, **wrong)
