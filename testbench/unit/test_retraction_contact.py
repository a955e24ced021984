# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.retraction``: what the contact guard orders."""

import pytest

from rtl.motion.retraction import State
from testbench.checkers.motion_bench import DATA, ONE, START_RATE, brief, change, ordered
from testbench.models.retraction import (
    ADVANCE,
    CONTACT,
    END,
    HALT,
    HIGH,
    LOW,
    OPERATOR,
    RESUME,
    START,
)


@pytest.mark.parametrize("start_rate", [START_RATE, ONE // 9, ONE // 6 + 12345], ids=hex)
def test_contact_halts(simulate, rng, start_rate):
    """Last forward pulse at most 8 clocks after the sample, as for a short; no way back."""
    feed = min(start_rate, ONE // 5)
    latencies = []
    dut, bench = ordered([(60, feed, [0]), (600, feed, [0])], start_rate=start_rate)

    async def run(ctx):
        for _ in range(20):
            await bench.begin(ctx, DATA)
            await bench.idle(ctx, rng.randint(60, 160))
            bench.events.clear()
            sample = bench.clock - 1
            bench.set(ctx, contact=1)
            last = 0
            for _ in range(40):
                if ctx.get(dut.ramp.pp):
                    last = bench.clock - sample
                await bench.tick(ctx)
            assert ctx.get(dut.retraction.state) == State.HALTED
            assert ctx.get(dut.retraction.quiet)
            assert [event[:2] for event in bench.events] == [(HALT, CONTACT)]
            bench.set(ctx, contact=0)
            await bench.idle(ctx, 100)
            assert not ctx.get(dut.ramp.stored)
            assert ctx.get(dut.retraction.state) == State.HALTED, "it stays"
            latencies.append(last)
            bench.set(ctx, run=0)
            bench.place(ctx, ahead=0)

    simulate(dut, run)
    assert max(latencies) <= 8
    assert len(set(latencies)) > 2


def test_wait_holds_forward_motion_back(simulate):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA, wait=1)
        await bench.idle(ctx)
        assert bench.position == 0
        assert ctx.get(dut.retraction.wanted)
        bench.set(ctx, wait=0)
        await bench.to(ctx, 30)
        bench.set(ctx, wait=1)
        bench.gap.order = OPERATOR
        await bench.until(ctx, State.HIGH)
        await bench.idle(ctx)
        assert (bench.position, ctx.get(dut.retraction.state)) == (-10, State.HIGH)
        assert ctx.get(dut.retraction.wanted)
        bench.set(ctx, wait=0)
        await bench.to(ctx, 40)
        bench.set(ctx, hold=1)
        await bench.tick(ctx)
        assert not ctx.get(dut.retraction.wanted)

    simulate(dut, run)
    assert brief(bench) == [(START, OPERATOR, 30), (END, 2, -10), (ADVANCE, HIGH, -10),
                            (ADVANCE, LOW, 22), (RESUME, 0, 30)]


@pytest.mark.parametrize("place", [5, 25])
def test_contact_on_the_way_back_halts_the_way_forward(simulate, place):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, change(limit=30))
        await bench.to(ctx, 30)
        bench.gap.order = OPERATOR
        await bench.to(ctx, 20)
        if place < 20:
            bench.set(ctx, contact=1)   # it goes on going back
        else:
            await bench.until(ctx, State.LOW)
            await bench.to(ctx, place)
            bench.set(ctx, contact=1)
        await bench.until(ctx, State.HALTED)
        await bench.idle(ctx, 20)

    simulate(dut, run)
    if place < 20:
        assert brief(bench) == [(START, OPERATOR, 30), (END, 2, 0), (ADVANCE, HIGH, 0),
                                (HALT, CONTACT, 0)]
    else:
        assert [event[:2] for event in bench.events] == [
            (START, OPERATOR), (END, 2), (ADVANCE, HIGH), (ADVANCE, LOW), (HALT, CONTACT)]
        assert place <= bench.position <= place + 1


def test_outputs_that_are_safe_win(simulate):
    """What trips tells its own event."""
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 30)
        bench.set(ctx, contact=1, safe=1)
        await bench.idle(ctx, 20)
        assert ctx.get(dut.retraction.state) == State.HALTED

    simulate(dut, run)
    assert bench.events == []
