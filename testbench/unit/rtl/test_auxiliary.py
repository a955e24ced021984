# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.auxiliary.functions``, against the exact model."""

import pytest

from rtl.auxiliary.functions import AuxiliaryFunctions
from testbench.models import auxiliary as model

QUIET = dict(send=0, code=0, letter=0, timeout=20, safe=0, fin=0)


class Bench:
    """The block and its model side by side."""

    def __init__(self):
        self.dut = AuxiliaryFunctions()
        self.model = model.AuxiliaryFunctions()

    async def clock(self, ctx, times=1, **inputs):
        dut = self.dut
        for _ in range(times):
            for name, value in (QUIET | inputs).items():
                ctx.set(getattr(dut, name), value)
            self.model.clock(**QUIET | inputs)
            await ctx.tick()
            assert ctx.get(dut.function) == self.model.code
            for name in ("strobe", "busy", "timed_out"):
                assert ctx.get(getattr(dut, name)) == getattr(self.model, name), name


def test_follows_the_model(simulate, rng):
    bench = Bench()
    ends = {"done": 0, "timed out": 0}

    async def run(ctx):
        fin, answer = 0, 0
        for clock in range(6000):
            if clock % 50 == 0:
                answer = rng.choice((0.1, 0.3, 1))  # how soon the machine side answers
            if rng.random() < answer:
                fin = int(bench.model.strobe != 0) if rng.random() < 0.95 else 1 - fin
            busy = bench.model.busy
            await bench.clock(ctx, send=rng.random() < 0.3, code=rng.randrange(1 << 16), fin=fin,
                              letter=rng.randrange(4), timeout=rng.choice((0, 1, 3, 8, 20)),
                              safe=rng.random() < 0.01)
            if busy and not bench.model.busy:
                ends["timed out" if bench.model.timed_out else "done"] += 1

    simulate(bench.dut, run)
    assert min(ends.values()) > 50


@pytest.mark.parametrize("letter", [0, 1, 2])
def test_handshake(simulate, letter):
    bench = Bench()

    async def run(ctx):
        dut = bench.dut
        await bench.clock(ctx, send=1, code=0xBEEF, letter=letter)
        assert (ctx.get(dut.function), ctx.get(dut.strobe), ctx.get(dut.busy)) == (0xBEEF, 0, 1)
        await bench.clock(ctx)
        assert ctx.get(dut.strobe) == 1 << letter, "a clock after the code"
        await bench.clock(ctx, 10)
        assert ctx.get(dut.strobe) == 1 << letter
        await bench.clock(ctx, fin=1)
        assert ctx.get(dut.strobe) == 0
        await bench.clock(ctx, 10, fin=1)
        assert ctx.get(dut.busy)
        await bench.clock(ctx)
        assert not ctx.get(dut.busy)
        assert not ctx.get(dut.timed_out)

    simulate(bench.dut, run)


@pytest.mark.parametrize("stuck", [0, 1])
@pytest.mark.parametrize("timeout", [0, 1, 7])
def test_fin_that_does_not_move_times_out(simulate, stuck, timeout):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, send=1, code=3, fin=stuck, timeout=timeout)
        # With FIN stuck low one clock passes before the strobe.
        await bench.clock(ctx, max(1, timeout) + 1 - stuck, fin=stuck, timeout=timeout)
        assert ctx.get(bench.dut.timed_out)
        assert not ctx.get(bench.dut.strobe)
        assert not ctx.get(bench.dut.busy)

    simulate(bench.dut, run)


def test_fourth_letter_and_a_second_function_are_refused(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, send=1, code=1, letter=3)
        assert not ctx.get(bench.dut.busy)
        await bench.clock(ctx, send=1, code=2, letter=0)
        await bench.clock(ctx, 3, send=1, code=3, letter=1)
        assert ctx.get(bench.dut.function) == 2
        assert ctx.get(bench.dut.strobe) == 1

    simulate(bench.dut, run)


def test_safe_drops_the_strobe(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, send=1, code=1)
        await bench.clock(ctx, 3)
        assert ctx.get(bench.dut.strobe)
        await bench.clock(ctx, safe=1)
        assert not ctx.get(bench.dut.strobe)
        await bench.clock(ctx, 3, safe=1, send=1)
        assert not ctx.get(bench.dut.busy)

    simulate(bench.dut, run)
