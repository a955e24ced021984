# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.discriminator``, against the exact model."""

import pytest

from rtl.gap.discriminator import Discriminator, PulseClass
from testbench.models import discriminator as model

QUIET = dict(on=0, sense=0, arc=0, short=0, current=0, blanking=2)
COUNTS = "open_count", "ok_count", "dame_count", "short_count"


class Bench:
    """The discriminator and its model side by side; keeps the samples."""

    def __init__(self):
        self.dut = Discriminator()
        self.model = model.Discriminator()
        self.samples = []

    async def clock(self, ctx, **inputs):
        dut = self.dut
        inputs = QUIET | inputs
        for name, value in inputs.items():
            ctx.set(getattr(dut, name), value)
        counted = [self.model.main[kind] for kind in range(4)]
        assert [ctx.get(getattr(dut, name)) for name in COUNTS] == counted
        assert ctx.get(dut.last) == PulseClass(self.model.last)
        sample, shorted_now = self.model.clock(**inputs)
        assert ctx.get(dut.shorted_now) == shorted_now
        assert ctx.get(dut.sample) == (sample is not None)
        if sample:
            assert ctx.get(dut.kind) == PulseClass(sample.kind)
            assert ctx.get(dut.sample_sensing) == sample.sensing
            assert ctx.get(dut.sample_shorted) == (sample.kind == model.SHORT)
            self.samples.append(sample)
        await ctx.tick()


def test_follows_the_model(simulate, rng):
    bench = Bench()

    async def run(ctx):
        pause = 1
        for _ in range(900):
            if pause:  # the blanking changes while no pulse is on
                blanking = rng.choice((0, 0, 1, 2, 3, 5))
            # Also what the generator never does: both gates, and a change without a pause.
            gates = rng.choice(((1, 0), (1, 0), (0, 1), (0, 0), (1, 1)))
            likely = {name: rng.choice((0, 0.1, 0.5, 0.9, 1))
                      for name in ("arc", "short", "current")}
            for _ in range(rng.choice((1, blanking, blanking + 1, rng.randrange(1, 12)))):
                await bench.clock(ctx, on=gates[0], sense=gates[1], blanking=blanking,
                                  **{name: int(rng.random() < p) for name, p in likely.items()})
            pause = rng.randrange(3)
            for _ in range(pause):
                await bench.clock(ctx, blanking=blanking, short=rng.random() < 0.5)

    simulate(bench.dut, run)
    assert {(sample.kind, sample.sensing) for sample in bench.samples} == {
        (kind, sensing) for kind in range(4) for sensing in (False, True)
        if not sensing or kind in (model.OPEN, model.SHORT)}


@pytest.mark.parametrize(("pulse", "kind"), [
    # Per clock of a pulse with a blanking of 2: a arc, s short, c current, . nothing.
    ("....", model.OPEN), ("cc..", model.OPEN), ("..c.", model.OK), ("...c", model.OK),
    ("..ca", model.DAME), ("..ac", model.OK), ("ccaa", model.OPEN), ("...s", model.SHORT),
    ("..cs", model.SHORT), ("..sc", model.OK), ("ssss", model.SHORT), ("ss.", model.OPEN),
    ("c", None), ("ss", None),
])
def test_classes(simulate, pulse, kind):
    bench = Bench()

    async def run(ctx):
        for letter in pulse:
            await bench.clock(ctx, on=1, arc=letter == "a", short=letter == "s",
                              current=letter == "c")
        await bench.clock(ctx)
        await bench.clock(ctx)

    simulate(bench.dut, run)
    assert bench.samples == ([] if kind is None else [model.Sample(kind, sensing=False)])


def test_longest_blanking(simulate):
    """The age of a pulse stops at its highest count: it does not begin anew."""
    dut = Discriminator()

    async def bench(ctx):
        ctx.set(dut.blanking, (1 << 16) - 1)
        ctx.set(dut.on, 1)
        ctx.set(dut.short, 1)
        await ctx.tick().repeat((1 << 16) - 2)
        assert not ctx.get(dut.shorted_now)
        await ctx.tick()
        for _ in range(5):
            assert ctx.get(dut.shorted_now)
            await ctx.tick()

    simulate(dut, bench)


def test_counters_wrap(simulate):
    dut = Discriminator()

    async def bench(ctx):
        ctx.set(dut.short_count, (1 << 32) - 1)
        ctx.set(dut.on, 1)
        ctx.set(dut.short, 1)
        await ctx.tick()
        ctx.set(dut.on, 0)
        await ctx.tick()
        assert ctx.get(dut.short_count) == 0

    simulate(dut, bench)
