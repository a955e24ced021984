# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.scope``, against the exact model."""

import pytest

from rtl.gap.discriminator import PulseClass
from rtl.gap.scope import GapScope, Recording, Trigger
from rtl.states import Pulse
from testbench.models import scope as model
from testbench.refusal import refuses

DEPTH = 16
SOURCES = [source.name.lower() for source in Trigger]
BITS = ("high", "arc", "short", "current", "noise", "on", "sense", "shorted")
QUIET = dict.fromkeys((*BITS, "voltage", "sampled", "pulse", "state", "force"), 0)
CLASSES = {Pulse.OPEN: (PulseClass.OPEN, 0), Pulse.OK: (PulseClass.OK, 0),
           Pulse.DAME: (PulseClass.DAME, 0), Pulse.SHORT: (PulseClass.SHORT, 0),
           Pulse.SENSED_OPEN: (PulseClass.OPEN, 1), Pulse.SENSED_SHORT: (PulseClass.SHORT, 1)}


class Bench:
    """The block and its model side by side."""

    def __init__(self, depth=DEPTH):
        self.dut = GapScope(depth=depth)
        self.model = model.Scope(depth)
        self.cycle = 0
        self.last = dict(QUIET)

    async def arm(self, ctx, source="now", after=0, classes=frozenset(), level=0):
        """Arm in this clock, which is not looked at."""
        dut = self.dut
        ctx.set(dut.source, Trigger[source.upper()])
        ctx.set(dut.classes, sum(1 << model.PULSES.index(name) - 1 for name in classes))
        ctx.set(dut.level, level)
        ctx.set(dut.after, after)
        self.model = model.Scope(dut.depth, source, classes, level, after)
        ctx.set(dut.arm, 1)
        await self.clock(ctx, order=True)
        ctx.set(dut.arm, 0)
        self.model.arm()

    async def stop(self, ctx):
        ctx.set(self.dut.stop, 1)
        await self.clock(ctx, order=True)
        ctx.set(self.dut.stop, 0)
        self.model.stop()

    async def clock(self, ctx, order=False, **inputs):
        """One clock; ``inputs`` differ from the clock before, but for samples, classes, force."""
        dut = self.dut
        self.last |= dict(sampled=0, pulse=0, force=0) | inputs
        now = dict(self.last, cycle=self.cycle)
        for name in (*BITS, "voltage", "state", "force", "cycle"):
            ctx.set(getattr(dut, name), now[name])
        ctx.set(dut.voltage_valid, now["sampled"])
        ctx.set(dut.sample, now["pulse"] != 0)
        kind, sensing = CLASSES.get(Pulse(now["pulse"]), (PulseClass.DAME, 1))
        ctx.set(dut.kind, kind)
        ctx.set(dut.sample_sensing, sensing)
        await ctx.tick()
        self.cycle = (self.cycle + 1) % 2**32
        if not order:
            self.model.look(now)

    async def compare(self, ctx):
        """Both are in the same state, and have the same entries; needs a clock that counts."""
        dut = self.dut
        await self.clock(ctx)       # a look takes two
        assert ctx.get(dut.recording) == Recording[self.model.state.upper()]

    async def read(self, ctx):
        """Words of the record, read in its order."""
        dut = self.dut
        ctx.set(dut.place, 0)
        ctx.set(dut.choose, 1)
        await ctx.tick()
        count, words = ctx.get(dut.count), []
        ctx.set(dut.choose, 0)
        for _ in range(count):
            await ctx.tick()
            words.append(ctx.get(dut.entry.as_value()))
            ctx.set(dut.following, 1)
            await ctx.tick()
            ctx.set(dut.following, 0)
        return words

    async def check(self, ctx):
        """The record of a full oscilloscope is the model's."""
        dut = self.dut
        assert self.model.state == "full"
        await self.clock(ctx)
        assert ctx.get(dut.recording) == Recording.FULL
        assert ctx.get(dut.count) == len(self.model.entries)
        assert ctx.get(dut.time) == (self.model.time + 1) % 2**32
        assert await self.read(ctx) == [entry.word() for entry in self.model.entries]


def changes(rng, dense):
    """Inputs of a clock at random; the denser the more change."""
    found = {name: rng.randrange(2) for name in BITS if rng.random() < dense / 4}
    if rng.random() < dense:
        found |= dict(sampled=1, voltage=rng.choice((0, 4095, rng.randrange(4096))))
    if rng.random() < dense:
        found |= dict(pulse=rng.randrange(7))
    if rng.random() < dense:
        found |= dict(state=rng.randrange(7))
    return found


@pytest.mark.parametrize("source", SOURCES)
def test_follows_the_model(simulate, rng, source):
    bench = Bench()
    full = []

    async def run(ctx):
        for _ in range(25):
            await bench.arm(ctx, source, rng.choice((0, 1, DEPTH - 1, rng.randrange(DEPTH))),
                            frozenset(name for name in model.PULSES[1:] if rng.random() < 0.4),
                            rng.choice((0, 1, 2048, 4095)))
            dense = rng.choice((0.02, 0.2, 0.9))
            for _ in range(rng.randrange(300)):
                inputs = changes(rng, dense)
                if rng.random() < 0.003:
                    inputs["force"] = 1
                await bench.clock(ctx, **inputs)
                if bench.model.state == "full":
                    break
            if bench.model.state == "full":
                full.append(len(bench.model.entries))
                await bench.check(ctx)
            else:
                await bench.compare(ctx)

    simulate(bench.dut, run)
    assert len(full) > 5
    assert max(full) == DEPTH or source == "now"


def test_a_stamp_that_is_full_makes_an_entry(simulate):
    """Without any change the time is still in the stamps: none is longer than 511 clocks."""
    bench = Bench()

    async def run(ctx):
        await bench.arm(ctx, "short", 2)
        for _ in range(1200):
            await bench.clock(ctx)
        await bench.clock(ctx, shorted=1)
        for _ in range(511 + 511):
            await bench.clock(ctx)
        await bench.check(ctx)

    simulate(bench.dut, run)
    stamps = [entry.stamp for entry in bench.model.entries]
    assert stamps == [0, 511, 511, 178, 511, 511]


def test_what_was_there_when_it_was_armed_is_no_trigger(simulate):
    bench = Bench()

    async def run(ctx):
        for source, level in (("short", dict(shorted=1)), ("retraction", dict(state=2)),
                              ("rise", dict(sampled=1, voltage=4095))):
            await bench.clock(ctx, **level)
            await bench.arm(ctx, source, 1, level=100)
            await bench.clock(ctx, **level)
            for _ in range(20):
                await bench.clock(ctx)
            await bench.compare(ctx)
            assert bench.model.state == "armed"
            await bench.clock(ctx, force=1)
            await bench.clock(ctx, high=not bench.last["high"])
            await bench.check(ctx)

    simulate(bench.dut, run)


def test_stop_and_arm_again(simulate):
    bench = Bench()

    async def run(ctx):
        dut = bench.dut
        await bench.arm(ctx, "short")
        for n in range(40):
            await bench.clock(ctx, high=n % 2)
        await bench.stop(ctx)
        await bench.clock(ctx, shorted=1)
        await bench.compare(ctx)
        assert ctx.get(dut.count) == DEPTH
        assert await bench.read(ctx) == [entry.word() for entry in bench.model.entries]
        ctx.set(dut.stop, 1)        # arming wins
        await bench.arm(ctx, "now", 3)
        ctx.set(dut.stop, 0)
        for n in range(4):
            await bench.clock(ctx, high=n % 2)
        await bench.check(ctx)
        assert len(bench.model.entries) == 4

    simulate(bench.dut, run)


def test_an_idle_one_changes_no_register(simulate, rng):
    """So that it costs a simulation nothing."""
    bench = Bench()

    async def run(ctx):
        dut = bench.dut
        for _ in range(200):
            await bench.clock(ctx, **changes(rng, 0.9))
            assert ctx.get(dut.recording) == Recording.IDLE
            assert ctx.get(dut.count) == 0
            assert ctx.get(dut.time) == 0
            assert ctx.get(dut.now.as_value()) == 0

    simulate(bench.dut, run)


@pytest.mark.parametrize("depth", [8, 17, 1000, 65536])
def test_a_depth_that_is_not_possible_is_refused(depth):
    refuses(GapScope, f"power of two from 16 to 32768, not {depth}", depth=depth)
