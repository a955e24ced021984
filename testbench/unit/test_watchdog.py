# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.safety.watchdog``, against the exact model."""

import pytest

from rtl.safety.watchdog import Watchdog
from testbench.models import watchdog as model
from testbench.refusal import refuses


class Bench:
    """The watchdog and its model side by side."""

    def __init__(self, period):
        self.dut = Watchdog(clock_hz=1_000_000, period_us=period)
        self.model = model.Watchdog(period)

    async def clock(self, ctx, key=None, times=1):
        dut = self.dut
        for _ in range(times):
            assert ctx.get(dut.expired) == self.model.expired
            ctx.set(dut.pet, key is not None)
            ctx.set(dut.key, key or 0)
            self.model.write(key)
            await ctx.tick()
        ctx.set(dut.pet, 0)
        assert ctx.get(dut.expired) == self.model.expired


@pytest.mark.parametrize("period", [2, 3, 4, 10, 64])
def test_follows_the_model(simulate, rng, period):
    bench = Bench(period)
    seen = set()

    async def run(ctx):
        ctx.set(bench.dut.key, 0xA5)  # without the strobe it is nothing
        for _ in range(500):
            key = rng.choice((0xA5, 0xA5, 0x5A, 0x5A, 0x5A, 0x00, 0xFF, rng.randrange(256)))
            await bench.clock(ctx, key)
            seen.add(bench.model.expired)
            pause = rng.choice((0, 0, 1, period // 2, period - 2, period - 1, period, 2 * period))
            await bench.clock(ctx, times=max(0, pause - rng.randrange(2)))
            seen.add(bench.model.expired)

    simulate(bench.dut, run)
    assert seen == {True, False}


@pytest.mark.parametrize(("keys", "quiet"), [
    ((), False), ((0xA5,), False), ((0x5A,), False), ((0x5A, 0xA5), False),
    ((0xA5, 0x5A), True), ((0xA5, 0xA5, 0x5A), True), ((0x5A, 0xA5, 0x5A), True),
    ((0xA5, 0x00, 0x5A), False), ((0xA5, 0x5A, 0x5A), True),
])
def test_only_both_keys_in_order_count(simulate, keys, quiet):
    bench = Bench(100)

    async def run(ctx):
        await bench.clock(ctx, times=5)
        assert ctx.get(bench.dut.expired), "asleep until the first call"
        for key in keys:
            await bench.clock(ctx, key)
        assert ctx.get(bench.dut.expired) != quiet

    simulate(bench.dut, run)


def test_expires_after_the_period_exactly(simulate):
    bench = Bench(50)

    async def run(ctx):
        for _ in range(3):
            await bench.clock(ctx, 0xA5)
            await bench.clock(ctx, 0x5A)   # clock k
            await bench.clock(ctx, times=47)
            await bench.clock(ctx, 0x5A)   # k + 48: a second key alone does not count
            assert not ctx.get(bench.dut.expired), "k + 49"
            await bench.clock(ctx)
            assert ctx.get(bench.dut.expired), "k + 50"
        await bench.clock(ctx, 0xA5)
        await bench.clock(ctx, 0x5A)
        for _ in range(5):
            await bench.clock(ctx, times=47)
            await bench.clock(ctx, 0xA5)
            await bench.clock(ctx, 0x5A)   # k + 49: just in time
            assert not ctx.get(bench.dut.expired)

    simulate(bench.dut, run)


@pytest.mark.parametrize("clock_hz", [2_000_000, 25_000_000, 50_000_000])
def test_standard_period_is_5_ms(simulate, clock_hz):
    watchdog = Watchdog(clock_hz=clock_hz)

    async def bench(ctx):
        assert ctx.get(watchdog.limit) == clock_hz // 200

    simulate(watchdog, bench)


@pytest.mark.parametrize(("wrong", "message"), [
    (dict(period_us=5001), r"watchdog period must be at most 5000 us, not 5001"),
    (dict(period_us=1),    r"watchdog period must be at least 2 clocks, not 1"),
])
def test_refuses_wrong_parameters(wrong, message):
    refuses(Watchdog, message, clock_hz=1_000_000, **wrong)
