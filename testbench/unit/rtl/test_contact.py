# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.contact``, against the exact model."""

import pytest

from rtl.gap.contact import ContactGuard
from testbench.models import contact as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle
from testbench.some import some

QUIET = dict(off=1, safe=0, quiet=0, wanted=0, moving=0, reverse=0, fast=0, settled=1, away=0,
             lag_time=20, sample=0, sample_shorted=0, clear_needed=3, shorted=0)
SEEN = ("off", "safe", "quiet", "fast", "reverse", "away", "shorted")
OUTPUTS = ("look", "wait", "contact", "trip")
SETTLE = 12  # clocks


class Bench:
    """The guard and its model side by side; ``seen`` are the outputs clock by clock."""

    def __init__(self, settle=SETTLE):
        self.dut = ContactGuard(clock_hz=1000, settle_ms=settle)
        self.model = model.ContactGuard(settle)
        self.seen = []

    async def clock(self, ctx, times=1, **inputs):
        inputs = QUIET | inputs
        for name, value in inputs.items():
            ctx.set(getattr(self.dut, name), value)
        for _ in range(times):
            await settle(ctx)
            got = tuple(ctx.get(getattr(self.dut, name)) for name in OUTPUTS)
            assert got == self.model.outputs(**{name: inputs[name] for name in SEEN}), inputs
            self.seen.append(dict(zip(OUTPUTS, got, strict=True)))
            self.model.edge(**{name: value for name, value in inputs.items()
                               if name not in ("reverse", "away", "shorted")})
            await ctx.tick()

    async def samples(self, ctx, text, **inputs):
        """Give samples, ``s`` shorted and ``c`` clear, some clocks apart."""
        for letter in text:
            await self.clock(ctx, sample=1, sample_shorted=letter == "s", **inputs)
            await self.clock(ctx, **inputs)


@pytest.mark.parametrize("part", some(range(3)))
def test_follows_the_model(simulate, rng, part):
    bench = Bench()
    rates = dict(off=0.02, safe=0.02, quiet=0.02, wanted=0.05, moving=0.05, reverse=0.05, fast=0.05,
                 settled=0.1, away=0.1, shorted=0.2)

    async def run(ctx):
        inputs = dict(QUIET)
        for _ in range(1500):
            for name, rate in rates.items():
                if rng.random() < rate:
                    inputs[name] ^= 1
            # Most inputs allow a look.
            for name, usual in (("off", 1), ("safe", 0), ("quiet", 0)):
                if rng.random() < 0.2:
                    inputs[name] = usual
            inputs |= dict(sample=rng.random() < 0.5, sample_shorted=rng.random() < 0.3)
            if rng.random() < 0.05:
                inputs |= dict(lag_time=rng.choice((0, 1, 5, 30)),
                               clear_needed=rng.choice((0, 1, 2, 3)))
            await bench.clock(ctx, rng.choice((1, 1, 1, SETTLE - 1, SETTLE, SETTLE + 1))
                              if not inputs["sample"] else 1, **inputs)

    simulate(bench.dut, run)
    for name in OUTPUTS:
        assert {one[name] for one in bench.seen} == {0, 1}


def test_it_looks_before_the_first_pulse(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 5)
        assert bench.seen[-1] == dict(look=0, wait=1, contact=0, trip=0)
        await bench.clock(ctx, 2, wanted=1)
        assert [one["look"] for one in bench.seen[-2:]] == [0, 1]
        await bench.samples(ctx, "ccscc", wanted=1)
        assert all(one["wait"] for one in bench.seen)
        await bench.samples(ctx, "c", wanted=1)
        assert [one["wait"] for one in bench.seen[-2:]] == [1, 0]
        await bench.samples(ctx, "ss", wanted=1)
        assert not bench.seen[-1]["wait"]

    simulate(bench.dut, run)


def test_a_look_lasts_until_the_axes_have_settled(simulate):
    bench = Bench()

    async def run(ctx):
        for clocks, settled in ((4, 1), (SETTLE, 0)):
            await bench.clock(ctx, 3, moving=1, settled=0)
            await bench.clock(ctx, clocks - 1, settled=0)
            await bench.clock(ctx, settled=settled)
            assert bench.seen[-1]["look"]
            await bench.clock(ctx, 3, settled=0)
            assert not any(one["look"] for one in bench.seen[-3:])

    simulate(bench.dut, run)


@pytest.mark.parametrize("stop", [dict(off=0), dict(safe=1), dict(quiet=1)])
def test_a_look_ends_at_once_and_what_was_known_with_it(simulate, stop):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 2, wanted=1)
        await bench.samples(ctx, "ccc", wanted=1)
        assert bench.seen[-1] == dict(look=1, wait=0, contact=0, trip=0)
        await bench.clock(ctx, wanted=1, shorted=1, **stop)
        assert bench.seen[-1] == dict(look=0, wait=0, contact="safe" in stop, trip=0)
        await bench.clock(ctx, wanted=1)
        assert bench.seen[-1]["wait"]

    simulate(bench.dut, run)


def test_contact_on_the_way_away_counts_once_it_has_parted(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 10, wanted=1, moving=1, shorted=1, away=1)
        assert not any(one["wait"] or one["contact"] for one in bench.seen)
        # Another segment: in force at once.
        await bench.clock(ctx, wanted=1, moving=1, shorted=1)
        assert bench.seen[-1] == dict(look=1, wait=1, contact=1, trip=0)
        await bench.samples(ctx, "ccc", moving=1, away=1)
        await bench.clock(ctx, moving=1, away=1, shorted=1)
        assert bench.seen[-1] == dict(look=1, wait=0, contact=1, trip=0)
        await bench.clock(ctx, moving=1, away=1, shorted=1, reverse=1)
        assert not bench.seen[-1]["contact"]

    simulate(bench.dut, run)


def test_it_trips_while_the_axes_are_fast(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 3, moving=1, lag_time=5)
        await bench.clock(ctx, moving=1, fast=1, lag_time=5, shorted=1)
        await bench.clock(ctx, 7, moving=1, lag_time=50, shorted=1)
        assert [one["trip"] for one in bench.seen[-8:]] == [1] * 6 + [0] * 2
        assert all(one["contact"] for one in bench.seen[-8:])

    simulate(bench.dut, run)


def test_refuses_a_look_without_an_end():
    refuses(ContactGuard, "a look lasts at least 1 ms longer than the motion, not 0",
            clock_hz=1000, settle_ms=0)
