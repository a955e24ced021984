# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.path``: feeds that firmware changes while the machine moves."""

import pytest

from testbench.unit.rtl.test_path import SLOTS, Bench, random_segments


class Pacing(Bench):
    """A window whose feeds change; the parity must stay right."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.orders = []     # what firmware sets in the next clocks
        self.rates = {}      # feeds by segment that may still be in force, and for how many clocks

    def pace(self, number, rate, after=0):
        """Change a segment's feed after ``after`` clocks, as firmware does, while pulses come."""
        assert not self.orders
        segment = self.segments[number]
        self.orders = [{}] * after + [
            {"select": number % SLOTS, "select_strobe": 1},
            {"select_strobe": 0, "data": segment.length, "data_strobe": 1}, {"data": rate},
            {"data_strobe": 0, "pace": rate}, {"pace_slot": number % SLOTS, "pace_strobe": 1},
            {"pace_strobe": 0}]
        self.rates[number] = segment.rate, len(self.orders) + 12
        segment.rate = rate

    async def tick(self, ctx):
        if self.orders:
            for name, value in self.orders.pop(0).items():
                ctx.set(getattr(self.dut, name), value)
        await super().tick(ctx)
        self.rates = {number: (rate, clocks - 1) for number, (rate, clocks) in self.rates.items()
                      if clocks}

    def compare(self, ctx):
        """Allow the old feed for some more clocks."""
        number = self.model.segment(more=self.more)
        segment = self.segments[number]
        rate = segment.rate
        if number in self.rates and ctx.get(self.dut.rate) == self.rates[number][0]:
            segment.rate = self.rates[number][0]
        super().compare(ctx)
        segment.rate = rate


def test_a_new_feed_is_in_force_at_once_and_whenever_the_segment_is_entered(simulate, rng):
    """Firmware changes feeds in any clock while the machine goes in either direction."""
    bench = Pacing(random_segments(rng, 15, 12), start=5)
    here = 0

    async def run(ctx):
        nonlocal here
        await bench.begin(ctx)
        for _ in range(1200):
            if not bench.orders:
                current = bench.model.segment(more=bench.more)
                number = rng.choice((current, current, rng.randrange(bench.first, bench.last)))
                bench.pace(number, rng.getrandbits(30))
                here += number == current
                for _ in range(rng.randrange(8)):
                    await bench.tick(ctx)
            step = rng.choice((1, -1))
            if bench.behind() <= bench.model.position + step <= bench.ahead():
                await bench.pulse(ctx, step, rng.choice((4, 4, 5, 9, 30)))
        while bench.rates:
            await bench.tick(ctx)
        bench.compare(ctx)

    simulate(bench.dut, run, deadline=1)
    assert here > 200


@pytest.mark.parametrize("step", [1, -1])
def test_a_new_feed_comes_in_any_clock_of_a_fetch(simulate, rng, step):
    """The border is crossed up to 15 clocks before or after firmware begins to change the feed."""
    bench = Pacing(random_segments(rng, 15, 9), start=5)
    number = 6 if step > 0 else 5           # behind the border, as one goes
    border = bench.segments[5].length

    async def run(ctx):
        await bench.begin(ctx)
        start = bench.model.position
        for clocks in range(-15, 16):
            while bench.model.position - start != border - (step > 0):
                away = bench.model.position - start - border + (step > 0)
                await bench.pulse(ctx, -1 if away > 0 else 1)
            bench.pace(number, rng.getrandbits(30), after=max(0, -clocks))
            for _ in range(clocks):
                await bench.tick(ctx)
            await bench.pulse(ctx, step)
            while bench.rates:
                await bench.tick(ctx)
            assert bench.model.segment(more=True) == number
            bench.compare(ctx)

    simulate(bench.dut, run)
