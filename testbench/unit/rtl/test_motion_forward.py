# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.motion``: velocity feed-forward, and the ramp of the way back."""

import pytest

from rtl.motion.feed_forward import FeedForward
from rtl.states import State
from testbench.checkers.motion import Motion
from testbench.checkers.motion_bench import ONE, Ordered, change
from testbench.models.retraction import Gap
from testbench.simulators.benches import settle
from testbench.some import some

SLOW = ONE // 400      # start/stop speed
STEP = ONE // 40_000   # per 16 clocks
LEAD = 40_000
DATA = change(rate=ONE // 80, limit=400, high_rate=ONE // 80, low_rate=ONE // 500, changeover=20,
              jump_distance=60, jump_rate=ONE // 80, jump_high_rate=ONE // 80)
TAIL = 4 * FeedForward.ROUND   # clocks in which the feed-forward follows a change of speed


class Watched(Ordered):
    """Sums up the feed-forward of each axis: the way that it stands for."""

    async def tick(self, ctx):
        await super().tick(ctx)
        dut = self.dut
        self.forward = [ctx.get(speed) for speed in dut.joined.forward]
        self.way = [way + speed / LEAD for way, speed in zip(self.way, self.forward, strict=True)]
        self.rate = ctx.get(dut.ramp.rate)
        rests = ctx.get(dut.joined.feed_forward.rate) == 0
        assert ctx.get(dut.joined.resting) == rests
        if rests:
            self.still += 1
        else:
            self.still = 0
        assert not any(self.forward) or self.still < 2, "at rest"

    def start(self):
        self.way, self.still, self.forward = [0.0] * self.dut.axes, 0, []
        return self


def watched(segments, *, axes=1, **options):
    dut = Motion(axes=axes)
    return dut, Watched(dut, segments, Gap([]), start_rate=SLOW, acceleration=STEP,
                        **options).start()


@pytest.mark.parametrize(("rate", "slope"), some([
    (ONE // 100, 3), (ONE // 100, -1), (ONE // 1000, -2)]))
def test_feed_forward_goes_the_way_of_the_pulses(simulate, rate, slope):
    length = 100 if rate > SLOW else 20
    travel = [length, slope * length // 5]
    dut, bench = watched([(length, rate, [-part for part in travel]), (length, rate, travel)],
                         axes=2, before=1)

    def near(way):
        # A change of speed is followed within a round or two; a share is rounded to a pulse.
        slack = 2.5 * max(1, TAIL * DATA.rate / ONE) + 0.03 * length
        return all(abs(found - part) <= slack for found, part in zip(bench.way, way, strict=True))

    async def run(ctx):
        await bench.begin(ctx, DATA, lead=LEAD)
        await bench.to(ctx, length * 3 // 4, clocks=400_000)
        there = [bench.axis(bench.position, axis) for axis in range(2)]
        assert near(there), (bench.way, there)
        bench.short = True
        await bench.to(ctx, -length // 2, clocks=400_000)
        assert ctx.get(dut.retraction.state) == State.RETRACTING
        there = [bench.axis(bench.position, axis) for axis in range(2)]
        assert near(there), (bench.way, there)
        bench.short = False
        await bench.until(ctx, State.FRONT, clocks=400_000)
        await bench.to(ctx, bench.end, clocks=400_000)
        await bench.idle(ctx, TAIL)
        assert bench.forward == [0, 0]
        assert near([bench.axis(bench.position, axis) for axis in range(2)])

    simulate(dut, run, deadline=5)


def test_a_stop_takes_the_feed_forward_away_at_once(simulate):
    dut, bench = watched([(300, ONE // 500, [300])])
    found = []

    async def run(ctx):
        await bench.begin(ctx, change(rate=ONE // 500), lead=LEAD)
        await bench.to(ctx, 20, clocks=40_000)
        assert bench.forward == [LEAD // 500]
        bench.short = True
        for _ in range(4):
            await bench.tick(ctx)
        found.extend(bench.forward)
        await bench.idle(ctx, 2 * FeedForward.ROUND)
        assert bench.forward == [-LEAD // 500]

    simulate(dut, run, deadline=5)
    assert found == [0]


@pytest.mark.parametrize("back", [
    (4 * SLOW, 5 * STEP), *(pytest.param(ramp, marks=pytest.mark.soak) for ramp in (
        (SLOW // 2, 7 * STEP), (2 * SLOW, STEP)))])
def test_the_way_back_has_a_ramp_of_its_own(simulate, back):
    """And the way forward keeps its own, also after a way back."""
    dut, bench = watched([(300, ONE // 100, [300]), (700, ONE // 100, [700])], before=1, back=back)
    own = SLOW, STEP

    async def climb(ctx, ramp):
        """From rest: the ramp begins at its own speed, and rises by its own steps."""
        start, step = ramp
        seen = []
        while bench.rate == start or not seen:
            assert bench.rate in (start, *seen)
            await bench.tick(ctx)
            seen = seen or [bench.rate] * (bench.rate > start)
        before = bench.rate
        for _ in range(40):
            await bench.tick(ctx)
            assert bench.rate - before in (0, step // 4, step // 4 + 1)
            before = bench.rate
        assert before - start >= 10 * (step // 4)

    async def run(ctx):
        await bench.begin(ctx, change(rate=ONE // 20, limit=400, high_rate=ONE // 80,
                                      low_rate=ONE // 200, changeover=2))
        bench.rate = SLOW
        await climb(ctx, own)
        await bench.to(ctx, 60, clocks=40_000)
        for _ in range(2):
            bench.short = True
            await bench.until(ctx, State.RETRACTING, clocks=40_000)
            await bench.idle(ctx, 8)
            bench.rate = ctx.get(dut.ramp.rate)
            assert bench.rate == back[0]
            await climb(ctx, back)
            await bench.idle(ctx, 100)
            bench.short = False
            await bench.until(ctx, State.HIGH, clocks=40_000)
            await bench.idle(ctx, 8)
            assert ctx.get(dut.ramp.rate) == SLOW
            await bench.until(ctx, State.FRONT, clocks=80_000)
            await bench.idle(ctx, 12)
            await settle(ctx)
            bench.rate = ctx.get(dut.ramp.rate)
            await bench.to(ctx, bench.position + 20, clocks=80_000)

    simulate(dut, run, deadline=5)
