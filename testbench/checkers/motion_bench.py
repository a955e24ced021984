# SPDX-License-Identifier: Apache-2.0
"""Benches that drive the joined motion blocks: a path, a gap, and the reported events."""

from bisect import bisect_left
from dataclasses import replace
from itertools import accumulate

from rtl.events import Event
from rtl.states import State
from testbench.checkers.motion import Motion
from testbench.models.distributor import steps
from testbench.models.retraction import JUMP, OPERATOR, SHORT, Cue, Data, Gap
from testbench.simulators.benches import settle

__all__ = [
    "DATA",
    "FOREVER",
    "LINE",
    "ONE",
    "SLOTS",
    "START_RATE",
    "Bench",
    "Ordered",
    "change",
    "ordered",
    "outline",
    "wrapped",
]

SLOTS = 64
FOREVER = 10**9
ONE = 1 << 32                # 1 pulse/clock
START_RATE = (1 << 30) - 1   # nearly a pulse every 4 clocks: everything is at or below it
DATA = Data(rate=ONE // 8, limit=40, high_rate=ONE // 7, low_rate=ONE // 12, changeover=8,
            jump_distance=25, jump_rate=ONE // 9, jump_high_rate=ONE // 6)
LINE = [(60, ONE // 10, [60]), (120, ONE // 10, [120])]  # from -60 to 120


def change(**values):
    """``DATA`` with some values changed."""
    return replace(DATA, **values)


def outline(bench):
    """Kind, detail and position of every reported event."""
    return [event[:3] for event in bench.events]


def wrapped(value):
    """As a signed 32-bit number."""
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


class Bench:
    """A machine on a path of up to 64 segments, with a scripted gap; it records all events.

    ``segments`` are ``(length, rate, travel of each axis)``; the first ``before`` of them lie
    before coordinate 0. ``offset`` moves all coordinates, to make them wrap. ``highest`` has the
    bounds of segments by their number, 2**-28 pulse/clock. ``back`` is the ramp of the way back, if
    it has its own.
    """

    def __init__(self, dut, segments, gap, *, before=0, offset=0, start_rate=START_RATE,
                 acceleration=1, highest=None, back=None):
        self.dut = dut
        self.segments = segments
        self.before = before
        self.gap = gap
        self.offset = offset
        self.highest = highest or {}
        self.ramp = start_rate, acceleration
        self.back = back or self.ramp
        ends = list(accumulate(length for length, _, _ in segments))
        self.origin = ends[before - 1] if before else 0
        self.borders = [0 - self.origin] + [end - self.origin for end in ends]
        self.inputs = {}
        self.events = []
        self.position = self.lowest = self.clock = 0
        self.rose = False

    @property
    def end(self):
        return self.borders[-1]

    def feed(self, position):
        """Feed of the segment in which a position lies; None at a border."""
        if position in self.borders:
            return None
        return self.segments[bisect_left(self.borders, position) - 1][1]

    def axis(self, position, index):
        """Position of an axis, by the closed form over all segments."""
        def until(place):
            total = 0
            for start, (length, _, travel) in zip(self.borders, self.segments, strict=False):
                total += steps(min(max(place - start, 0), length), length, travel[index])
            return total
        return until(position) - until(0)

    def set(self, ctx, **values):
        """Set those inputs whose values differ."""
        for name, value in values.items():
            if self.inputs.get(name) != value:
                self.inputs[name] = value
                ctx.set(getattr(self.dut, name), value)

    def place(self, ctx, **values):
        """Set coordinates."""
        self.set(ctx, **{name: wrapped(value + self.offset) for name, value in values.items()})

    async def begin(self, ctx, data, **rules):
        """Load the path and the data, and run."""
        dut = self.dut
        self.set(ctx, start_rate=self.ramp[0], acceleration=self.ramp[1], gain=10, in_position=1,
                 settle=20, back_start_rate=self.back[0], back_acceleration=self.back[1])
        for slot, (length, rate, travel) in enumerate(self.segments):
            self.set(ctx, select=slot % SLOTS, select_strobe=1)
            await ctx.tick()
            self.set(ctx, select_strobe=0, data_strobe=1)
            words = [abs(steps_) | (steps_ < 0) << 31 for steps_ in travel]
            shape = self.highest.get(slot, 0) << 6
            for word in (length, rate, *words, *[0] * (3 - len(words)), shape):
                self.set(ctx, data=word)
                await ctx.tick()
            self.set(ctx, data_strobe=0)
        self.set(ctx, load_slot=self.before, load=1)
        await ctx.tick()
        self.set(ctx, load=0)
        if self.offset:
            for register in dut.path.position, dut.path.front, dut.feed.command:
                ctx.set(register, wrapped(self.offset))
            for name in "position", "front":
                ctx.set(dut.path.again[name], ~self.offset % (1 << 32))
        self.place(ctx, behind=self.borders[0], ahead=self.end, fast_ahead=FOREVER,
                   fast_behind=-FOREVER, back_limit=-FOREVER)
        await self.commit(ctx, data)
        self.set(ctx, run=1)
        for name in ("back_limit", "ahead", "behind", "fast_ahead", "fast_behind"):
            if name in rules:
                self.place(ctx, **{name: rules.pop(name)})
        self.set(ctx, **rules)
        await settle(ctx)

    async def commit(self, ctx, data):
        """Stage data and put them in force."""
        self.set(ctx, **{name: getattr(data, name) for name in data.__annotations__
                         if name != "valid"},
                 commit_valid=data.valid, commit_strobe=1)
        await self.tick(ctx)
        self.set(ctx, commit_strobe=0)
        await self.tick(ctx)

    async def tick(self, ctx):
        """One clock: the gap sees the position, then events are taken."""
        dut = self.dut
        retraction = dut.retraction
        await settle(ctx)
        position = wrapped(ctx.get(dut.path.position) - self.offset)
        if position != self.position:
            self.gap.see(position, position > self.position)
            self.position = position
            self.lowest = min(self.lowest, position)
        shorted = self.gap.shorted
        completed = shorted and not self.rose
        self.rose = shorted
        self.set(ctx, shorted=shorted, completed=completed, cycle=self.clock % (1 << 32))
        # An order acts at the front; a jump is ordered by machining time.
        order = self.gap.order
        await settle(ctx)
        if order and ctx.get(retraction.state) == State.STOPPING:
            self.gap.order = order = 0
        self.set(ctx, retract=order == OPERATOR, discharging=order == JUMP)
        event = retraction.event
        await settle(ctx)
        kind = ctx.get(event.kind)
        if kind != Event.NONE:
            self.events.append((
                kind.value, ctx.get(event.detail), position, ctx.get(event.first),
                ctx.get(event.second), ctx.get(event.cycle)))
            self.reported(kind)
        await ctx.tick()
        self.clock += 1

    def reported(self, kind):
        """Hook: an event was reported."""

    async def run(self, ctx, *, until=None, clocks=30_000):
        """Go on until the end of the path, a halt, or ``until()``."""
        retraction = self.dut.retraction
        idle = 0
        for _ in range(clocks):
            await self.tick(ctx)
            if until:
                if until():
                    return
                continue
            state = ctx.get(retraction.state)
            over = state == State.HALTED or (state == State.FRONT and self.position == self.end)
            idle = idle + 1 if over and not self.gap.order else 0
            if state == State.AT_LIMIT and self.inputs["settle"] > 10:
                self.gap.wait()
            if idle > 30:
                return
        raise TimeoutError(f"still at {self.position} after {clocks} clocks: {self.events}")

    def check_axes(self, ctx):
        """Compare every axis with the closed form."""
        for index in range(self.dut.axes):
            assert ctx.get(self.dut.axis[index]) == self.axis(self.position, index)


class Ordered(Bench):
    """A bench in which the test itself sets the short."""

    short = False

    async def tick(self, ctx):
        self.gap.short = Cue(SHORT, 0) if self.short else None
        await super().tick(ctx)

    async def until(self, ctx, state, clocks=3000):
        """Wait for a state."""
        await settle(ctx)
        for _ in range(clocks):
            if ctx.get(self.dut.retraction.state) == state:
                return
            await self.tick(ctx)
        raise TimeoutError(f"no {state}: {self.events}")

    async def to(self, ctx, position, clocks=3000):
        """Wait for a position."""
        await settle(ctx)
        for _ in range(clocks):
            if wrapped(ctx.get(self.dut.path.position) - self.offset) == position:
                return
            await self.tick(ctx)
        raise TimeoutError(f"never at {position}: {self.events}")

    async def idle(self, ctx, clocks=200):
        """Go on for so many clocks."""
        for _ in range(clocks):
            await self.tick(ctx)


def ordered(segments=LINE, **options):
    """Join the blocks for a path that begins one segment before coordinate 0."""
    dut = Motion()
    return dut, Ordered(dut, segments, Gap([]), before=1, **options)
