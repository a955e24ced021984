# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.retraction``: orders of the contact guard."""

import pytest

from rtl.states import State
from testbench.checkers.motion_bench import (
    DATA,
    ONE,
    START_RATE,
    change,
    ordered,
    outline,
    wrapped,
)
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
from testbench.simulators.benches import settle
from testbench.some import some


@pytest.mark.parametrize("start_rate", some([START_RATE, ONE // 9, ONE // 6 + 12345]), ids=hex)
def test_contact_halts(simulate, rng, start_rate):
    """The last forward pulse comes at most 8 clocks after the sample; there is no retraction.

    The pulses stored in the ramp are dropped, and the command is set back.
    """
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
            await settle(ctx)
            last = bench.clock - sample if ctx.get(dut.ramp.pp) else 0
            at = bench.position
            await bench.tick(ctx)
            bench.set(ctx, contact=0)
            for _ in range(40):
                await settle(ctx)
                assert not ctx.get(dut.ramp.pp)
                await bench.tick(ctx)
            assert at <= bench.position <= at + 1
            assert wrapped(ctx.get(dut.feed.command)) == bench.position
            assert ctx.get(dut.retraction.state) == State.HALTED
            assert ctx.get(dut.retraction.quiet)
            assert [event[:2] for event in bench.events] == [(HALT, CONTACT)]
            await bench.idle(ctx, 100)
            assert ctx.get(dut.retraction.state) == State.HALTED, "it stays"
            latencies.append(last)
            bench.set(ctx, run=0)
            bench.place(ctx, ahead=0)

    simulate(dut, run)
    assert set(latencies) <= {0, 1}


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
    assert outline(bench) == [(START, OPERATOR, 30), (END, 2, -10), (ADVANCE, HIGH, -10),
                            (ADVANCE, LOW, 22), (RESUME, 0, 30)]


@pytest.mark.parametrize("state", [State.HIGH, State.LOW])
def test_contact_halts_the_way_forward_again(simulate, state):
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, change(limit=30))
        await bench.to(ctx, 30)
        bench.gap.order = OPERATOR
        await bench.until(ctx, state)
        await bench.idle(ctx, 20)
        bench.set(ctx, contact=1)
        await bench.tick(ctx)
        bench.set(ctx, contact=0)
        at = bench.position
        await bench.idle(ctx, 20)
        assert ctx.get(dut.retraction.state) == State.HALTED
        assert at <= bench.position <= at + 1

    simulate(dut, run)
    phases = [(ADVANCE, HIGH)] if state is State.HIGH else [(ADVANCE, HIGH), (ADVANCE, LOW)]
    assert [event[:2] for event in bench.events] == [(START, OPERATOR), (END, 2), *phases,
                                                     (HALT, CONTACT)]


def test_outputs_that_are_safe_win(simulate):
    """A trip gives its own event, so the retraction gives none."""
    dut, bench = ordered()

    async def run(ctx):
        await bench.begin(ctx, DATA)
        await bench.to(ctx, 30)
        bench.set(ctx, contact=1, safe=1)
        await bench.idle(ctx, 20)
        assert ctx.get(dut.retraction.state) == State.HALTED

    simulate(dut, run)
    assert bench.events == []
