# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.safety.watchdog``, against the exact model."""

import pytest

from rtl.safety.watchdog import Watchdog
from testbench.models import watchdog as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle


class Bench:
    """The watchdog and its model side by side."""

    def __init__(self, period):
        self.dut = Watchdog(clock_hz=1_000_000, period_us=period)
        self.model = model.Watchdog(period)

    async def clock(self, ctx, key=None, times=1):
        dut = self.dut
        for _ in range(times):
            self.agrees(ctx)
            ctx.set(dut.pet, key is not None)
            ctx.set(dut.key, key or 0)
            self.model.write(key)
            await ctx.tick()
        ctx.set(dut.pet, 0)
        await settle(ctx)
        self.agrees(ctx)

    def agrees(self, ctx):
        for name in ("expired", "late", "silent", "asked", "open"):
            assert ctx.get(getattr(self.dut, name)) == getattr(self.model, name), name


@pytest.mark.parametrize("period", [4, 5, 8, 16, 64])
@pytest.mark.parametrize("hurry", [0.1, 0.9])
def test_follows_the_model(simulate, rng, period, hurry):
    """Keys at random, and keys as a working firmware writes them."""
    bench = Bench(period)
    seen = set()

    async def run(ctx):
        ctx.set(bench.dut.key, 0xA5)  # without the strobe it is nothing
        await settle(ctx)
        for _ in range(800):
            key = rng.choice((0xA5, 0xA5, 0x5A, 0x5A, 0x5A, 0xC3, 0xC3, 0x00, rng.randrange(256)))
            if rng.random() > hurry:
                key = (0xC3 if bench.model.asked else 0x5A if bench.model.begun is not None
                       and bench.model.open else 0xA5)
            await bench.clock(ctx, key)
            seen.add((bench.model.expired, bench.model.silent))
            pause = rng.choice((0, 0, 1, period // 8, period // 4, period // 2, period - 2,
                                period - 1, period, 2 * period))
            if rng.random() < 0.7:
                pause = rng.randrange(max(2, period // 4))
            await bench.clock(ctx, times=max(0, pause - rng.randrange(2)))
            seen.add((bench.model.expired, bench.model.silent))

    simulate(bench.dut, run, deadline=5e-3)
    # It is silent in the clock in which the call comes that ends it, too.
    assert seen == {(True, False), (False, False), (True, True), (False, True)}


@pytest.mark.parametrize(("keys", "quiet"), [
    ((), False), ((0xA5,), False), ((0x5A,), False), ((0x5A, 0xA5), False),
    ((0xA5, 0x5A), True), ((0xA5, 0xA5, 0x5A), True), ((0x5A, 0xA5, 0x5A), True),
    ((0xA5, 0x00, 0x5A), False), ((0xA5, 0x5A, 0x5A), True), ((0xA5, 0xC3, 0x5A), True),
    ((0xA5, 0x5A, 0xA5, 0x5A), False),
])
def test_only_both_keys_in_order_count_and_not_too_soon(simulate, keys, quiet):
    bench = Bench(100)

    async def run(ctx):
        await bench.clock(ctx, times=5)
        await bench.clock(ctx, 0xC3)
        assert ctx.get(bench.dut.expired), "asleep until the first call"
        for key in keys:
            await bench.clock(ctx, key)
        assert ctx.get(bench.dut.expired) != quiet

    simulate(bench.dut, run)


def test_a_call_is_in_time_from_a_quarter_of_the_period_to_all_of_it(simulate):
    bench = Bench(80)

    async def call(ctx):
        await bench.clock(ctx, 0xA5)
        await bench.clock(ctx, 0x5A)       # clock k

    async def run(ctx):
        await bench.clock(ctx, 0xC3)
        for pause in (17, 18, 77, 78):
            await call(ctx)
            for _ in range(pause):
                await bench.clock(ctx, 0xC3 if bench.model.asked else None)
            await bench.clock(ctx, 0xA5)
            assert ctx.get(bench.dut.expired) == (pause > 77), "k + pause + 2"
            await bench.clock(ctx, 0x5A)
            # The first key of the late one came before it was late, and is forgotten.
            assert ctx.get(bench.dut.expired) == (pause not in (18, 77))
            await bench.clock(ctx, times=20)
            await bench.clock(ctx, 0xC3)

    simulate(bench.dut, run)


def test_interrupts_are_alive_or_it_expires(simulate):
    bench = Bench(80)

    async def run(ctx):
        for number in range(60):
            await bench.clock(ctx, 0xA5)
            await bench.clock(ctx, 0x5A)
            if number == 0:
                assert ctx.get(bench.dut.asked)
                assert ctx.get(bench.dut.expired), "calls alone are not enough"
            if number < 40:
                await bench.clock(ctx, 0xC3 if ctx.get(bench.dut.asked) else None)
                assert not ctx.get(bench.dut.expired)
            await bench.clock(ctx, times=20)
            if number == 44:
                assert ctx.get(bench.dut.expired), "nobody answers"
                assert not ctx.get(bench.dut.silent)
            if number == 50:
                assert ctx.get(bench.dut.silent), "nor for one period more"

    simulate(bench.dut, run)


@pytest.mark.parametrize("clock_hz", [2_000_000, 25_000_000, 50_000_000])
def test_standard_period_is_5_ms(simulate, clock_hz):
    watchdog = Watchdog(clock_hz=clock_hz)

    async def bench(ctx):
        assert ctx.get(watchdog.limit) == clock_hz // 200

    simulate(watchdog, bench)


@pytest.mark.parametrize(("wrong", "message"), [
    (dict(period_us=5001), r"watchdog period must be at most 5000 us, not 5001"),
    (dict(period_us=3),    r"watchdog period must be at least 4 clocks, not 3"),
])
def test_refuses_wrong_parameters(wrong, message):
    refuses(Watchdog, message, clock_hz=1_000_000, **wrong)
