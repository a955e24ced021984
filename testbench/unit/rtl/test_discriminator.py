# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.discriminator``, against the exact model."""

from dataclasses import replace

import pytest

from rtl.gap.discriminator import Discriminator, PulseClass
from testbench.models import discriminator as model
from testbench.simulators.benches import settle

LEVELS = "high", "arc", "short", "current", "noise"
COUNTS = "open_count", "ok_count", "dame_count", "short_count"
Rules = model.Rules
CAPACITOR = Rules(blanking=5, from_ignition=1, relaxation=1)


class Bench:
    """The discriminator and its model side by side; keeps the samples."""

    def __init__(self, rules=None):
        self.dut = Discriminator()
        self.model = model.Discriminator()
        self.rules = rules or Rules()
        self.samples = []
        self.abnormal = []  # clocks
        self.clocks = 0

    async def clock(self, ctx, *, on=0, sense=0, **levels):
        dut = self.dut
        levels = dict.fromkeys(LEVELS, 0) | levels
        for name, value in (vars(self.rules) | levels | dict(on=on, sense=sense)).items():
            ctx.set(getattr(dut, name), value)
        counted = [self.model.main[kind] for kind in range(4)]
        await settle(ctx)
        assert [ctx.get(getattr(dut, name)) for name in COUNTS] == counted
        assert ctx.get(dut.last) == PulseClass(self.model.last)
        sample, shorted_now, abnormal = self.model.clock(
            on=on, sense=sense, rules=self.rules, **levels)
        assert ctx.get(dut.ignited) == self.model.ignited
        assert ctx.get(dut.shorted_now) == shorted_now
        assert ctx.get(dut.abnormal) == abnormal
        assert ctx.get(dut.sample) == (sample is not None)
        if sample:
            assert ctx.get(dut.kind) == PulseClass(sample.kind)
            assert ctx.get(dut.sample_sensing) == sample.sensing
            assert ctx.get(dut.sample_shorted) == (sample.kind == model.SHORT)
            self.samples.append(sample)
        if abnormal:
            self.abnormal.append(self.clocks)
        self.clocks += 1
        await ctx.tick()


def rules(rng):
    return Rules(
        blanking=rng.choice((0, 0, 1, 2, 3, 5)), settle=rng.choice((0, 0, 1, 2, 4)),
        confirm=rng.choice((0, 1, 1, 2, 3)), delay_least=rng.choice((0, 2, 4, 7)),
        use_current=rng.random() < 0.2, use_delay=rng.random() < 0.4,
        use_noise=rng.random() < 0.4, from_ignition=rng.random() < 0.5,
        relaxation=rng.random() < 0.4)


def test_follows_the_model(simulate, rng):
    bench = Bench()
    ends = set()  # class, and whether a pulse was abnormal

    async def run(ctx):
        for _ in range(1500):
            # Also inputs that the generator never makes: both gates, and a change without a pause.
            gates = rng.choice(((1, 0), (1, 0), (1, 0), (0, 1), (0, 0), (1, 1)))
            likely = {name: rng.choice((0, 0.1, 0.5, 0.9, 1)) for name in LEVELS}
            blanking, had = bench.rules.blanking, len(bench.abnormal)
            for _ in range(rng.choice((1, blanking, blanking + 1, rng.randrange(1, 14)))):
                await bench.clock(ctx, on=gates[0], sense=gates[1],
                                  **{name: int(rng.random() < p) for name, p in likely.items()})
            pause = rng.randrange(3)
            for number in range(pause):
                if number == 1:
                    bench.rules = rules(rng)
                await bench.clock(ctx, short=rng.random() < 0.5)
            if pause and bench.samples:
                ends.add((bench.samples[-1].kind, len(bench.abnormal) > had))

    simulate(bench.dut, run)
    assert {(sample.kind, sample.sensing) for sample in bench.samples} == {
        (kind, sensing) for kind in range(4) for sensing in (False, True)
        if not sensing or kind in (model.OPEN, model.SHORT)}
    assert {(kind, abnormal) for kind in range(1, 4) for abnormal in (False, True)} <= ends


# Per clock of a pulse: h high, a arc, s short, n noise, . a discharge.
@pytest.mark.parametrize(("rules", "pulse", "kind"), [
    (Rules(), "hhhh", model.OPEN), (Rules(), "..hh", model.OPEN), (Rules(), "hhh.", model.OK),
    (Rules(), "hh.h", model.OK), (Rules(), "hhha", model.DAME), (Rules(), "hha.", model.OK),
    (Rules(), "hhhs", model.SHORT), (Rules(), "hhs.", model.OK), (Rules(), "ssss", model.SHORT),
    (Rules(), "sshh", model.OPEN), (Rules(), "h", None), (Rules(), "ss", None),
    (Rules(settle=2), "hh.aa", model.DAME), (Rules(settle=2), "hh.a", model.OK),
    (Rules(settle=2), "hh.s", model.OK), (Rules(settle=2), "hhas.", model.OK),
    (Rules(use_delay=1, delay_least=4), "hhh.", model.DAME),
    (Rules(use_delay=1, delay_least=4), "hhhh.", model.OK),
    (Rules(use_delay=1, delay_least=4), "hhhhh", model.OPEN),
    (Rules(use_noise=1), "hh..", model.DAME), (Rules(use_noise=1), "hh.n", model.OK),
    (Rules(use_noise=1), "nn..", model.DAME), (Rules(use_noise=1), "hhn.", model.OK),
    (Rules(use_noise=1), "hhna", model.DAME),
    (Rules(use_noise=1, use_delay=1, delay_least=3), "hh...", model.DAME),
    (Rules(use_noise=1, use_delay=1, delay_least=3), "hhh..", model.OK),
    (Rules(use_noise=1, use_delay=1, delay_least=3), "hh.n.", model.OK),
    (Rules(use_current=1), "....", model.OPEN), (Rules(use_current=1), "...c", model.OK),
    # Within the blanking of 5 clocks.
    (Rules(blanking=5), "hh..", None), (Rules(blanking=5, from_ignition=1), "hh..", model.OK),
    (Rules(blanking=5, from_ignition=1), "....", None),
    (Rules(blanking=5, from_ignition=1), "......", model.OK),
    (Rules(blanking=5, from_ignition=1), "ssssss", model.SHORT),
    (Rules(blanking=5, from_ignition=1), "h", None),
    (Rules(blanking=5, from_ignition=1), "hhhh", model.OPEN),
    (Rules(blanking=5, from_ignition=1), "hhhhhh", model.OPEN),
    (Rules(blanking=5, from_ignition=1), "hhsa", model.DAME),
    (Rules(blanking=5, from_ignition=1, settle=2), "hh.s", model.OK),
    (Rules(blanking=5, from_ignition=1, settle=2), "hhs.s", model.SHORT),
    (Rules(blanking=5, from_ignition=1, use_current=1), "c", None),
    (Rules(blanking=5, from_ignition=1, use_current=1), "cc", model.OK),
    (Rules(blanking=5, from_ignition=1, use_current=1), "..c", model.OK),
    (Rules(blanking=5, from_ignition=1, use_current=1), "...", model.OPEN),
    (Rules(blanking=5, use_current=1), "cccc", None),
    (Rules(blanking=5, from_ignition=1, use_delay=1, delay_least=3), "hh..", model.DAME),
    (Rules(blanking=5, from_ignition=1, use_delay=1, delay_least=3), "hhh.", model.OK),
    # A capacitor is charged, full, and empty after its discharge.
    (CAPACITOR, "ss...hhh", model.OPEN), (CAPACITOR, "ss......", model.OPEN),
    (CAPACITOR, "ss...hh.s", model.OK), (CAPACITOR, "ss...hhs", model.OK),
    (CAPACITOR, "s.hs", model.OK), (CAPACITOR, "s.s", model.DAME),
    (CAPACITOR, "ss....s", model.DAME), (CAPACITOR, "ss....s.h", model.DAME),
    (CAPACITOR, "ss.aaah.", model.OK), (CAPACITOR, "ss...hhss", model.OK),
    (CAPACITOR, "ssssss", model.SHORT), (CAPACITOR, "sssss", None), (CAPACITOR, "ss", None),
    (CAPACITOR, "sssssss.", model.OPEN),
    (replace(CAPACITOR, use_current=1), "ss.h.", model.OPEN),
    (replace(CAPACITOR, use_current=1), "ss.hc", model.OK),
    (replace(CAPACITOR, use_current=1), "ss.c", model.DAME),
    (replace(CAPACITOR, use_delay=1, delay_least=4), "s.hs", model.DAME),
])
def test_classes(simulate, rules, pulse, kind):
    bench = Bench(rules)

    async def run(ctx):
        await bench.clock(ctx)  # the rules come before the pulse
        for letter in pulse:
            await bench.clock(ctx, on=1, high=letter == "h", arc=letter == "a",
                              short=letter == "s", noise=letter == "n", current=letter == "c")
        await bench.clock(ctx)
        await bench.clock(ctx)

    simulate(bench.dut, run)
    assert bench.samples == ([] if kind is None else [model.Sample(kind, sensing=False)])


@pytest.mark.parametrize(("confirm", "clock"), [(0, 4), (1, 4), (2, 5), (3, 9), (4, None)])
def test_abnormal_once_confirmed(simulate, confirm, clock):
    bench = Bench(Rules(confirm=confirm))

    async def run(ctx):
        for letter in "hhh.as.aasa" + "ah"[confirm == 4]:
            await bench.clock(ctx, on=1, high=letter == "h", arc=letter == "a",
                              short=letter == "s")

    simulate(bench.dut, run)
    first = bench.abnormal[0] if bench.abnormal else None
    assert first == (clock if confirm < 4 else 10)


@pytest.mark.parametrize("level", ["arc", "short"])
def test_verdict_in_time(simulate, level):
    """The class comes within 4 clocks of the deciding sample, within a pulse and at its end."""
    bench = Bench(Rules(settle=1, confirm=2))

    async def run(ctx):
        for clock in range(20):
            await bench.clock(ctx, on=clock < 15, high=clock < 6, **{level: clock >= 8})
            if bench.samples:
                assert clock - 14 <= 4
                return
        raise AssertionError

    simulate(bench.dut, run)
    decided = 9  # two low clocks from 8 on
    assert bench.abnormal[0] - decided <= 4


def test_longest_blanking(simulate):
    """The age of a pulse stops at its highest count: it does not wrap."""
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


def test_ignition_after_the_longest_age_is_late(simulate):
    dut = Discriminator()

    async def bench(ctx):
        ctx.set(dut.delay_least, 100)
        ctx.set(dut.use_delay, 1)
        ctx.set(dut.on, 1)
        ctx.set(dut.high, 1)
        await ctx.tick().repeat((1 << 16) + 20)
        ctx.set(dut.high, 0)
        await ctx.tick()
        ctx.set(dut.on, 0)
        await settle(ctx)
        assert ctx.get(dut.sample)
        assert ctx.get(dut.kind) == PulseClass.OK

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
