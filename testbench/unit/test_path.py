# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.path``, against the exact model."""

import pytest

from rtl.motion.path import SegmentWindow
from testbench.models.path import Window
from testbench.refusal import refuses

SETTLE = 4  # clocks after a pulse until the next may come, and until everything is told


def wrapped(value):
    """As a signed 32-bit number."""
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


class Bench:
    """A window and its model, with the firmware that writes segments in time."""

    def __init__(self, segments, start=0, *, axes=2, offset=0):
        self.dut = SegmentWindow(axes=axes)
        self.segments = segments    # (length, rate, travel)
        self.model = Window([length for length, _, _ in segments], start)
        self.offset = offset
        self.first, self.last = max(0, start - 5), min(len(segments), start + 10)
        self.entered = []
        self.busy = False

    def ahead(self):
        return self.model.borders[self.last]

    def behind(self):
        return self.model.borders[self.first]

    async def tick(self, ctx):
        """One clock. What is entered is told in the same clock as the slot, at the border."""
        dut = self.dut
        await ctx.tick()
        if ctx.get(dut.entered):
            self.entered.append((ctx.get(dut.slot), wrapped(ctx.get(dut.position) - self.offset)))

    async def write(self, ctx, number):
        dut = self.dut
        length, rate, travel = self.segments[number]
        ctx.set(dut.slot_length, length)
        ctx.set(dut.slot_rate, rate)
        for port, value in zip(dut.slot_travel, travel, strict=True):
            ctx.set(port.magnitude, abs(value))
            ctx.set(port.negative, value < 0)
        ctx.set(dut.slot_write, number % 16)
        ctx.set(dut.slot_write_strobe, 1)
        await self.tick(ctx)
        ctx.set(dut.slot_write_strobe, 0)

    async def begin(self, ctx):
        dut = self.dut
        for number in range(self.first, self.last):
            await self.write(ctx, number)
        ctx.set(dut.load_slot, self.model.start % 16)
        ctx.set(dut.load, 1)
        await self.tick(ctx)
        ctx.set(dut.load, 0)
        if self.offset:
            ctx.set(dut.position, wrapped(self.offset))
            ctx.set(dut.front, wrapped(self.offset))
        ctx.set(dut.ahead, wrapped(self.ahead() + self.offset))
        await self.settle(ctx)

    async def slide(self, ctx, *, back):
        """Move the loaded window by one segment, as firmware does; at most 15 are loaded."""
        here = self.model.segment(more=True)
        if back and self.first > 0 and here - self.first < 7:
            self.first -= 1
            if self.last - self.first > 15:
                self.last -= 1
            await self.write(ctx, self.first)
        elif not back and self.last < len(self.segments) and self.last - here < 8:
            await self.write(ctx, self.last)
            self.last += 1
            if self.last - self.first > 15:
                self.first += 1
        ctx.set(self.dut.ahead, wrapped(self.ahead() + self.offset))
        await self.settle(ctx)

    @property
    def more(self):
        return self.model.position < self.ahead()

    def compare(self, ctx):
        dut, model = self.dut, self.model
        assert ctx.get(dut.position) == wrapped(model.position + self.offset)
        assert ctx.get(dut.front) == wrapped(model.front + self.offset)
        assert ctx.get(dut.slot) == model.slot(more=self.more)
        rate = self.segments[model.segment(more=self.more)][1]
        assert ctx.get(dut.rate) == rate

    async def settle(self, ctx):
        for _ in range(SETTLE):
            await self.tick(ctx)
        self.told()
        self.compare(ctx)

    def told(self):
        segment = self.model.look(more=self.more)
        expected = [] if segment is None else [(segment % 16, self.model.position)]
        assert self.entered == expected
        self.entered.clear()

    async def pulse(self, ctx, step, spacing=SETTLE):
        """A path pulse, and its segment one clock later; every 4 clocks, or less often."""
        dut = self.dut
        ctx.set(dut.pulse, 1)
        ctx.set(dut.reverse, step < 0)
        if self.busy:  # the slot written last, again and again, while pulses come
            ctx.set(dut.slot_write_strobe, 1)
        await self.tick(ctx)
        ctx.set(dut.pulse, 0)
        segment, _ = self.model.pulse(step)
        length, _, travel = self.segments[segment]
        assert ctx.get(dut.distribute)
        for clock in range(2):  # the distributor reads them in two clocks
            assert ctx.get(dut.distribute_reverse) == (step < 0) or clock
            assert ctx.get(dut.length) == length
            for port, value in zip(dut.travel, travel, strict=True):
                assert ctx.get(port.magnitude) == abs(value)
                assert ctx.get(port.negative) == (value < 0) or not value
            await self.tick(ctx)
            assert not ctx.get(dut.distribute)
        for _ in range(spacing - 3):
            await self.tick(ctx)
        ctx.set(dut.slot_write_strobe, 0)
        self.told()
        self.compare(ctx)


def random_segments(rng, count, longest=50):
    return [(rng.choice((1, 1, 2, rng.randint(1, longest))), rng.getrandbits(30),
             [rng.choice((1, -1)) * rng.randint(0, longest) for _ in range(2)])
            for _ in range(count)]


@pytest.mark.parametrize("offset", [0, (1 << 31) - 40, -30], ids=hex)
@pytest.mark.parametrize("longest", [3, 50])
def test_follows_the_model_both_ways(simulate, rng, longest, offset):
    bench = Bench(random_segments(rng, 45, longest), start=6, offset=offset)

    async def run(ctx):
        await bench.begin(ctx)
        for _ in range(25):
            position = bench.model.position
            target = rng.choice((bench.ahead(), bench.behind(), position + rng.randint(-9, 12)))
            target = max(bench.behind(), min(bench.ahead(), target, position + 150))
            step = 1 if target > position else -1
            bench.busy = rng.random() < 0.5
            for _ in range(abs(target - position)):
                await bench.pulse(ctx, step, rng.choice((4, 4, 4, 5, 9)))
            await bench.slide(ctx, back=step < 0)

    simulate(bench.dut, run, deadline=1)
    assert bench.model.entered == sorted(set(bench.model.entered))


def test_every_segment_is_entered_once_also_of_length_1(simulate, rng):
    bench = Bench(random_segments(rng, 40, 2), start=0)

    async def run(ctx):
        await bench.begin(ctx)
        while bench.model.position < bench.model.borders[-1]:
            while bench.model.position < bench.ahead():
                await bench.pulse(ctx, 1)
                if rng.random() < 0.2:
                    for step in [-1] * 3 + [1] * 3:
                        if bench.behind() <= bench.model.position + step <= bench.ahead():
                            await bench.pulse(ctx, step)
            await bench.slide(ctx, back=False)

    simulate(bench.dut, run, deadline=1)
    assert bench.model.entered == list(range(40))


def test_waits_at_a_border_until_there_is_more(simulate):
    bench = Bench([(3, 7, [3, 0]), (5, 8, [0, 5]), (2, 9, [1, 1])])

    async def run(ctx):
        bench.last = 1
        await bench.begin(ctx)
        for _ in range(3):
            await bench.pulse(ctx, 1)
        await bench.settle(ctx)
        assert ctx.get(bench.dut.slot) == 0
        await bench.slide(ctx, back=False)
        assert ctx.get(bench.dut.slot) == 1
        assert bench.model.entered == [0, 1]
        await bench.pulse(ctx, -1)
        assert ctx.get(bench.dut.slot) == 0
        await bench.pulse(ctx, 1)
        assert ctx.get(bench.dut.slot) == 1

    simulate(bench.dut, run)


def test_load_stands_at_the_start_of_any_slot(simulate, rng):
    bench = Bench(random_segments(rng, 16), start=0)

    async def run(ctx):
        bench.last = 16
        await bench.begin(ctx)
        for _ in range(20):
            await bench.pulse(ctx, 1)
        for start in (15, 3, 3):
            bench.model = Window(bench.model.lengths, start)
            bench.first, bench.last = 0, 16
            ctx.set(bench.dut.ahead, 0)
            ctx.set(bench.dut.load_slot, start)
            ctx.set(bench.dut.load, 1)
            await bench.tick(ctx)
            ctx.set(bench.dut.load, 0)
            bench.last = start
            await bench.settle(ctx)
            bench.last = 16
            ctx.set(bench.dut.ahead, bench.ahead())
            await bench.settle(ctx)
            for _ in range(min(20, bench.ahead())):
                await bench.pulse(ctx, 1)

    simulate(bench.dut, run)


@pytest.mark.parametrize("slots", [0, 1, 12])
def test_refuses_a_ring_that_does_not_wrap(slots):
    refuses(SegmentWindow, f"must be a power of two, not {slots}", slots=slots)
