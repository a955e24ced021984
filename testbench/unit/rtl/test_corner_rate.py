# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.motion``: the bound of the rate from a place before a corner on."""

from itertools import pairwise

import pytest

from rtl.states import State
from testbench.checkers.motion import Motion
from testbench.checkers.motion_bench import FOREVER, ONE, Ordered, change
from testbench.models.retraction import Gap
from testbench.simulators.benches import settle
from testbench.some import some

SLOW = ONE // 20     # start/stop speed
STEP = ONE // 200    # per 16 clocks
TOP = (1 << 30) - 1
CRAWL = 10           # pulses at the start/stop speed before the place
UNIT = 4             # bits between the two units of rate
FAST = change(rate=TOP, limit=400, high_rate=TOP, low_rate=TOP, changeover=0)
CORNER, ZONE = 250, 30


class Timed(Ordered):
    """Notes the clock of every pulse by the coordinate that it leads to, each way."""

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        self.forward, self.backward = {}, {}

    async def tick(self, ctx):
        before = self.position
        await super().tick(ctx)
        if self.position != before:
            (self.forward if self.position > before else self.backward)[self.position] = self.clock


def timed():
    dut = Motion()
    return dut, Timed(dut, [(450, TOP, [450]), (700, TOP, [700])], Gap([]), before=1,
                      start_rate=SLOW, acceleration=STEP)


def gaps(clocks, places):
    """Clocks between the pulses to places that follow one another."""
    return [clocks[b] - clocks[a] for a, b in pairwise(places)]


@pytest.mark.parametrize("divisor", some([25, 50, 333, 4], 50))
def test_from_the_place_on_no_pulse_comes_sooner_than_at_the_rate(simulate, divisor):
    """A rate above the start/stop speed (a pulse in 4 clocks) leaves that speed."""
    dut, bench = timed()
    rate = ONE // divisor >> UNIT

    async def run(ctx):
        bench.set(ctx, fast_ahead_rate=rate)
        await bench.begin(ctx, FAST, fast_ahead=CORNER - ZONE)
        await bench.to(ctx, CORNER, clocks=30_000)
        bench.set(ctx, fast_ahead_rate=0)
        bench.place(ctx, fast_ahead=FOREVER)
        await bench.to(ctx, CORNER + 200)

    simulate(dut, run)
    least = ONE // max(rate << UNIT, 1) if divisor > 20 else ONE // SLOW
    before = gaps(bench.forward, range(100, CORNER - ZONE - CRAWL - 10))
    zone = gaps(bench.forward, range(CORNER - ZONE, CORNER + 1))
    beyond = gaps(bench.forward, range(CORNER + 100, CORNER + 200))
    assert min(before) < 20, "fast before it"
    assert all(least - 1 <= one <= least + 2 for one in zone), zone
    assert max(beyond) < 20, "and behind it"


def test_the_way_back_has_a_place_and_a_rate_of_its_own(simulate):
    dut, bench = timed()
    back = ONE // 70 >> UNIT

    async def run(ctx):
        bench.set(ctx, fast_ahead_rate=ONE // 400 >> UNIT, fast_behind_rate=back)
        await bench.begin(ctx, FAST, fast_ahead=FOREVER, fast_behind=CORNER + ZONE)
        await bench.to(ctx, CORNER + 200, clocks=30_000)
        bench.short = True
        await bench.to(ctx, CORNER, clocks=30_000)
        bench.set(ctx, fast_behind_rate=0)
        bench.place(ctx, fast_behind=-FOREVER)
        await bench.to(ctx, CORNER - 100)
        bench.short = False
        await bench.until(ctx, State.FRONT, clocks=30_000)

    simulate(dut, run)
    least = ONE // (back << UNIT)
    forward = gaps(bench.forward, range(CORNER - 50, CORNER + 100))
    zone = gaps(bench.backward, range(CORNER + ZONE, CORNER - 1, -1))
    assert max(forward) <= 20
    assert all(least - 1 <= one <= least + 2 for one in zone), zone
    assert max(gaps(bench.backward, range(CORNER - 70, CORNER - 90, -1))) < 20


@pytest.mark.parametrize(("highest", "rate", "taken"), [
    (ONE // 60, ONE // 40, 60), (ONE // 40, ONE // 60, 60), (0, ONE // 60, 60)])
def test_the_lower_of_two_bounds_counts(simulate, highest, rate, taken):
    dut, bench = timed()
    bench.highest = {1: highest >> UNIT}

    async def run(ctx):
        bench.set(ctx, fast_ahead_rate=rate >> UNIT)
        await bench.begin(ctx, FAST, fast_ahead=20)
        await bench.to(ctx, 60, clocks=30_000)

    simulate(dut, run)
    assert all(abs(one - taken) <= 2 for one in gaps(bench.forward, range(30, 60)))


def test_a_retraction_leaves_the_zone_of_the_way_forward_at_its_own_rate(simulate):
    """The bound holds on the way to the corner only."""
    dut, bench = timed()

    async def run(ctx):
        bench.set(ctx, fast_ahead_rate=ONE // 400 >> UNIT)
        await bench.begin(ctx, FAST, fast_ahead=CORNER - ZONE)
        await bench.to(ctx, CORNER - 10, clocks=30_000)
        bench.short = True
        await bench.to(ctx, CORNER - 60, clocks=3000)
        await settle(ctx)

    simulate(dut, run)
    assert max(gaps(bench.backward, range(CORNER - 20, CORNER - 60, -1))) <= 20
