# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.path``, against the exact model."""

from dataclasses import dataclass

import pytest
from amaranth.hdl import Cat

from rtl.motion.path import SegmentWindow
from testbench.models.path import Window
from testbench.refusal import refuses
from testbench.simulators.benches import settle

SETTLE = 4   # clocks from a pulse to the next, and until all outputs have followed
LONGEST = 14  # the same if a segment must be fetched
SLOTS = 64
STATE = ("pace", "error", "along", "across")


def wrapped(value, bits=32):
    """As a signed number."""
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


@dataclass
class Arc:
    """Words that an arc has beyond those of a line."""

    major: int
    minor: int
    outward: int
    change: int
    divisor: int
    start: list
    end: list


@dataclass
class Segment:
    """A segment to be written."""

    length: int
    rate: int
    travel: list
    arc: Arc | None = None
    highest: int = 0
    away: int = 0

    def words(self):
        """Its words in a slot."""
        travel = [abs(value) | (value < 0) << 31 for value in self.travel]
        words = [self.length, self.rate, *travel, *[0] * (3 - len(travel))]
        if self.arc is None:
            return [*words, self.away << 5 | self.highest << 6]
        arc = self.arc
        shape = 1 | arc.major << 1 | arc.minor << 3 | arc.outward << 5 | self.highest << 6
        return [*words, shape, arc.change, arc.divisor, *arc.start, *arc.end]


class Bench:
    """A window and its model, with the firmware that writes segments in time."""

    def __init__(self, segments, start=0, *, axes=2, offset=0):
        self.dut = SegmentWindow(axes=axes)
        self.segments = segments
        self.model = Window([segment.length for segment in segments], start)
        self.offset = offset
        self.first, self.last = max(0, start - 5), min(len(segments), start + 10)
        self.entered = []
        self.state, self.expected = [], []  # states with which segments were entered
        self.here = None     # segment entered last
        self.damaged = False
        self.busy = False    # firmware writes the last slot again and again

    def ahead(self):
        return self.model.borders[self.last]

    def behind(self):
        return self.model.borders[self.first]

    async def tick(self, ctx):
        """One clock. ``entered`` comes in the same clock as the new slot, at the border."""
        dut = self.dut
        if self.busy:
            ctx.set(dut.data, self.again[self.word])
            self.word = (self.word + 1) % len(self.again)
        await ctx.tick()
        if not self.damaged:
            assert not ctx.get(Cat(dut.damaged_word, dut.damaged_segment, dut.damaged_place))
        if ctx.get(dut.entered):
            self.entered.append((ctx.get(dut.slot), wrapped(ctx.get(dut.position) - self.offset)))
        if ctx.get(dut.enter):
            self.state.append([ctx.get(getattr(dut.state, name)) for name in STATE])

    async def write(self, ctx, number):
        dut = self.dut
        ctx.set(dut.select, number % SLOTS)
        ctx.set(dut.select_strobe, 1)
        await self.tick(ctx)
        ctx.set(dut.select_strobe, 0)
        words = [word % (1 << 32) for word in self.segments[number].words()]
        for word in words:
            ctx.set(dut.data, word)
            ctx.set(dut.data_strobe, 1)
            await self.tick(ctx)
        ctx.set(dut.data_strobe, 0)
        self.again = words + [0] * (16 - len(words))

    async def occupy(self, ctx, busy):
        """Start or stop writing the last slot in every clock."""
        self.busy = False
        ctx.set(self.dut.data_strobe, 0)
        ctx.set(self.dut.select_strobe, 1)
        await self.tick(ctx)
        ctx.set(self.dut.select_strobe, 0)
        self.busy, self.word = busy, 0
        ctx.set(self.dut.data_strobe, busy)

    async def begin(self, ctx):
        """Load, and write the segments, in any order."""
        dut = self.dut
        ctx.set(dut.load_slot, self.model.start % SLOTS)
        ctx.set(dut.load, 1)
        await self.tick(ctx)
        ctx.set(dut.load, 0)
        for number in range(self.first, self.last):
            await self.write(ctx, number)
        if self.offset:
            for name in "position", "front":
                ctx.set(getattr(dut, name), wrapped(self.offset))
                ctx.set(dut.again[name], ~self.offset % (1 << 32))
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
        if self.here is None:  # loaded, but there is no path yet
            return
        segment = self.segments[model.segment(more=self.more)]
        assert ctx.get(dut.rate) == segment.rate
        assert ctx.get(dut.highest) == segment.highest
        assert ctx.get(dut.arc) == (segment.arc is not None)
        assert ctx.get(dut.away) == segment.away
        if segment.arc:
            for name in ("major", "minor", "outward", "change", "divisor"):
                assert ctx.get(getattr(dut, name)) == getattr(segment.arc, name)

    async def settle(self, ctx):
        """Wait until a segment is entered, after a load or when the path goes on."""
        here = self.model.segment(more=self.more)
        if here != self.here and (self.here is not None or self.more):
            self.entering(here, at_end=False)
        for _ in range(LONGEST):
            await self.tick(ctx)
        assert ctx.get(self.dut.ready)
        self.left(ctx)
        self.told()
        self.compare(ctx)

    def told(self):
        segment = self.model.look(more=self.more)
        expected = [] if segment is None else [(segment % SLOTS, self.model.position)]
        assert self.entered == expected
        self.entered.clear()

    async def pulse(self, ctx, step, spacing=SETTLE):
        """A path pulse; its segment comes one clock later, or as soon as it is fetched."""
        dut = self.dut
        before = self.model.segment(more=self.more)
        ctx.set(dut.pulse, 1)
        ctx.set(dut.reverse, step < 0)
        await self.tick(ctx)
        ctx.set(dut.pulse, 0)
        await settle(ctx)
        number, _ = self.model.pulse(step)
        segment = self.segments[number]
        clocks = 1
        if step < 0 and number != before:  # fetched from the ring, with the state at its end
            self.entering(number, at_end=True)
            while not ctx.get(dut.distribute):
                assert not ctx.get(dut.ready)
                await self.tick(ctx)
                clocks += 1
                assert clocks < LONGEST
            self.left(ctx)
        assert ctx.get(dut.distribute)
        for clock in range(2):  # the distributors read them in two clocks
            assert ctx.get(dut.distribute_reverse) == (step < 0)
            assert ctx.get(dut.length) == segment.length
            for port, value in zip(dut.travel, segment.travel, strict=True):
                assert ctx.get(port.magnitude) == abs(value)
                assert ctx.get(port.negative) == (value < 0)
            assert clock or ctx.get(dut.arc) == (segment.arc is not None)
            await self.tick(ctx)
            assert not ctx.get(dut.distribute)
        after = self.model.segment(more=self.more)
        if after != number:
            self.entering(after, at_end=False)
        for _ in range(max(0, spacing - 2 - clocks)):
            await self.tick(ctx)
        while not ctx.get(dut.ready):
            await self.tick(ctx)
            clocks += 1
            assert clocks < LONGEST
        self.left(ctx)
        self.told()
        self.compare(ctx)

    def entering(self, number, *, at_end):
        self.here = number
        arc = self.segments[number].arc
        self.expected = [arc.end if at_end else arc.start] if arc else []

    def left(self, ctx):
        """Check that the states passed on are those expected."""
        assert self.state == self.expected
        self.state, self.expected = [], []


def random_segments(rng, count, longest=50):
    def arc():
        state = [[rng.getrandbits(30), *(rng.getrandbits(32) - (1 << 31) for _ in range(3))]
                 for _ in range(2)]
        return Arc(rng.randrange(3), rng.randrange(3), rng.randrange(2),
                   rng.getrandbits(32) - (1 << 31), rng.getrandbits(30), *state)

    found = [Segment(rng.choice((1, 1, 2, rng.randint(1, longest))), rng.getrandbits(30),
                     [rng.choice((1, -1)) * rng.randint(1, longest) for _ in range(2)],
                     arc() if rng.random() < 0.4 else None, rng.choice((0, rng.getrandbits(26))))
             for _ in range(count)]
    for segment in found:
        segment.away = 0 if segment.arc else rng.randrange(2)
    return found


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
            await bench.occupy(ctx, rng.random() < 0.5)
            for _ in range(abs(target - position)):
                await bench.pulse(ctx, step, rng.choice((4, 4, 4, 5, 9)))
            await bench.occupy(ctx, False)
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
    bench = Bench([Segment(3, 7, [3, 0]), Segment(5, 8, [0, 5]), Segment(2, 9, [1, 1])])

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


def test_first_segment_is_entered_once_also_from_before_it(simulate, rng):
    """The machine goes back before the path's first point while its segment is being written."""
    segments = random_segments(rng, 8)
    while segments[4].arc is None:
        segments = random_segments(rng, 8)
    bench = Bench(segments, start=4)

    async def run(ctx):
        bench.last = 4
        await bench.begin(ctx)
        for step in [-1] * 3 + [1] * 3:
            await bench.pulse(ctx, step)
        assert bench.model.entered == []
        await bench.slide(ctx, back=False)
        assert bench.model.entered == [4]
        for _ in range(segments[4].length):
            await bench.pulse(ctx, 1)

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
            bench.here = None
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


def test_a_border_crossed_is_the_next_place_to_be_slow_until_firmware_has_looked(simulate):
    bench = Bench([Segment(4, 7, [3, 0]) for _ in range(4)])
    dut = bench.dut

    async def looked(ctx, slot, ahead, behind, rates=(0, 0)):
        ctx.set(dut.fast_slot, slot)
        ctx.set(dut.fast_ahead_new, ahead)
        ctx.set(dut.fast_behind_new, behind)
        ctx.set(dut.fast_ahead_rate_new, rates[0])
        ctx.set(dut.fast_behind_rate_new, rates[1])
        ctx.set(dut.fast_strobe, 1)
        await bench.tick(ctx)
        ctx.set(dut.fast_strobe, 0)
        await settle(ctx)
        return fast(ctx)

    def fast(ctx):
        return ctx.get(dut.fast_ahead), ctx.get(dut.fast_behind)

    def rates(ctx):
        return ctx.get(dut.fast_ahead_rate), ctx.get(dut.fast_behind_rate)

    async def go(ctx, pulses):
        for _ in range(abs(pulses)):
            await bench.pulse(ctx, 1 if pulses > 0 else -1)
        return fast(ctx)

    async def run(ctx):
        await bench.begin(ctx)
        assert fast(ctx) == (0, 0)
        assert await looked(ctx, 1, 16, -3) == (0, 0)    # as seen from another segment
        assert await looked(ctx, 0, 16, -3) == (16, -3)
        assert await go(ctx, 3) == (16, -3)
        assert await go(ctx, 1) == (16, 4)               # it stands in segment 1
        assert await looked(ctx, 0, 12, -9) == (16, 4)   # made for the one before
        assert await looked(ctx, 1, 12, -9, (7, 5)) == (12, -9)
        assert rates(ctx) == (7, 5)
        assert await looked(ctx, 2, 13, -8, (6, 4)) == (12, -9)
        assert rates(ctx) == (7, 5)
        assert await go(ctx, 2) == (12, -9)
        assert await go(ctx, -2) == (12, -9)
        assert rates(ctx) == (7, 5)
        assert await go(ctx, -1) == (4, -9)
        assert rates(ctx) == (0, 5)      # nothing is known of the border
        assert await go(ctx, 1) == (4, 4)
        assert rates(ctx) == (0, 0)

    simulate(dut, run)


def test_refuses_a_fourth_axis():
    refuses(SegmentWindow, "1 to 3 axes, not 4", axes=4)


@pytest.mark.parametrize("slots", [0, 1, 12])
def test_refuses_a_ring_that_does_not_wrap(slots):
    refuses(SegmentWindow, f"must be a power of two, not {slots}", slots=slots)


def registers_of(dut):
    """Guarded registers, each with the output that reports damage."""
    segment = [dut.length, dut.rate, dut.highest, dut.arc, dut.major, dut.minor, dut.outward,
               dut.change, dut.divisor]
    segment += [part for travel in dut.travel for part in (travel.magnitude, travel.negative)]
    place = [dut.position, dut.front, dut.offset, dut.slot, *dut.again.values()]
    return [(one, dut.damaged_segment) for one in segment] + [
        (one, dut.damaged_place) for one in place]


@pytest.mark.parametrize("arc", [False, True], ids=["line", "arc"])
def test_every_bit_of_a_register_that_turns_over_is_found(simulate, rng, arc):
    shape = Arc(0, 1, 1, -77, 1234, [1, 2, 3, 4], [5, 6, 7, 8]) if arc else None
    bench = Bench([Segment(40, 7, [-40, 17], shape, 99)])
    dut = bench.dut
    alarms = Cat(dut.damaged_word, dut.damaged_segment, dut.damaged_place)

    async def run(ctx):
        await bench.begin(ctx)
        for _ in range(17):
            await bench.pulse(ctx, 1)
        bench.damaged = True
        for register, alarm in registers_of(dut):
            kept = ctx.get(register)
            for bit in range(len(register)):
                flipped = kept & ((1 << len(register)) - 1) ^ 1 << bit
                if register.shape().signed:
                    flipped = wrapped(flipped, len(register))
                ctx.set(register, flipped)
                await bench.tick(ctx)
                assert not ctx.get(alarms)
                await bench.tick(ctx)
                assert ctx.get(alarm), (register.name, bit)
                assert ctx.get(alarms) in (1 << 1, 1 << 2), "only this output"
                ctx.set(register, kept)
                await bench.tick(ctx)
                await bench.tick(ctx)
                assert not ctx.get(alarms)

    simulate(dut, run, deadline=1)


@pytest.mark.parametrize("arc", [False, True], ids=["line", "arc"])
def test_every_bit_of_a_word_that_turns_over_is_found_before_a_pulse(simulate, rng, arc):
    shape = Arc(0, 1, 1, -77, 1234, [1, 2, 3, 4], [5, 6, 7, 8]) if arc else None
    segment = Segment(40, 7, [-40, 17], shape, 99)
    bench = Bench([segment])
    dut = bench.dut
    words = 12 if arc else 6  # of an arc those of its start

    async def run(ctx):
        await bench.begin(ctx)
        bench.damaged = True
        for word in range(words):
            row = dut.banks[word % 2].data[word // 2]
            for bit in rng.sample(range(32), 6) + [32]:
                ctx.set(dut.load, 1)
                ctx.set(dut.ahead, 0)
                await bench.tick(ctx)
                ctx.set(dut.load, 0)
                await settle(ctx)
                ctx.set(row, ctx.get(row) ^ 1 << bit)
                ctx.set(dut.ahead, 40)
                found = begun = False
                await settle(ctx)
                while not (begun and ctx.get(dut.ready)):
                    await bench.tick(ctx)
                    begun = begun or not ctx.get(dut.ready)
                    found = found or ctx.get(dut.damaged_word)
                assert found, (word, bit)
                ctx.set(row, ctx.get(row) ^ 1 << bit)

    simulate(dut, run, deadline=1)
