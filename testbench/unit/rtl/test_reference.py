# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.reference``."""

from rtl.gap.reference import References

PERIOD = 1 << References.BITS


def test_share_of_ones_is_exact_and_even(simulate, rng):
    """After n clocks there were ``floor(n * level / 1024)`` ones, for every level and every n."""
    dut = References()
    levels = 0, PERIOD - 1, rng.randrange(1, PERIOD - 1)

    async def bench(ctx):
        for index, level in enumerate(levels):
            ctx.set(dut.level[index], level)
        ones = [0, 0, 0]
        for clock in range(1, 2 * PERIOD + 1):
            await ctx.tick()
            for index, level in enumerate(levels):
                ones[index] += ctx.get(dut.stream) >> index & 1
                assert ones[index] == clock * level // PERIOD

    simulate(dut, bench)
