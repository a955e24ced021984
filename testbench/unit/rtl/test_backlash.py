# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.backlash``, against the exact model, and around a drive with play.

The drive's screw may be wrong, too.
"""

from rtl.motion.backlash import Backlash
from testbench.models import backlash as model
from testbench.simulators.benches import settle


class Bench:
    """The block and its model; the sums of what goes in and out."""

    def __init__(self, dut, size):
        self.dut = dut
        self.size = size
        self.model = model.Backlash()
        self.moved = self.fed = self.commanded = 0

    async def clock(self, ctx, *, tick=False, pi=0, moved=0, safe=False, clear=False,
                    pitch=0):
        dut = self.dut
        for signal, value in ((dut.size, self.size), (dut.pitch, pitch), (dut.tick, tick),
                              (dut.pi, pi != 0),
                              (dut.pi_reverse, pi < 0), (dut.moved, moved != 0),
                              (dut.moved_reverse, moved < 0), (dut.safe, safe),
                              (dut.clear, clear)):
            ctx.set(signal, value)
        await settle(ctx)
        fp = ctx.get(dut.fp) * (-1 if ctx.get(dut.fp_reverse) else 1)
        assert fp == self.model.pulse(moved)
        assert ctx.get(dut.done) == (self.model.taken_up == self.model.goal(self.size, pitch))
        self.model.tick(size=self.size, pitch=pitch, tick=tick, pi=pi, moved=moved, safe=safe,
                        clear=clear)
        await ctx.tick()
        self.moved += moved
        self.fed += fp
        self.commanded += pi
        if clear:
            self.moved = self.fed
        assert not ctx.get(dut.damaged)
        taken_up = ctx.get(dut.taken_up)
        assert taken_up == self.model.taken_up
        assert self.moved == self.fed - taken_up


def test_follows_the_model_and_keeps_the_sums(simulate, rng):
    dut = Backlash()
    bench = Bench(dut, 0)

    async def run(ctx):
        pitch = 0
        for clock in range(6000):
            begin = clock % 1500 == 0
            if begin:
                bench.size = (7, 0, 40, 8191)[clock // 1500]
            if rng.random() < (0.01, 0, 0.3)[clock // 250 % 3]:
                pitch = rng.choice((0, rng.randint(-9, 9), rng.randint(-9, 9), -4096, 4095))
            await bench.clock(
                ctx, pitch=pitch, tick=clock % 5 == 0 and rng.random() < 0.8,
                pi=rng.choice((-1, 1)) if rng.random() < (0.2, 0.01)[clock // 300 % 2] else 0,
                moved=rng.choice((0, 0, 1, -1, 1, 1)) if clock % 900 < 600 else 0,
                safe=rng.random() < 0.01, clear=begin)

    simulate(dut, run, deadline=1e-3)


def test_an_axis_with_backlash_stands_at_its_count_both_ways(simulate):
    """A drive that follows at once, and a table with play behind it."""
    dut = Backlash()
    play = 9
    bench = Bench(dut, play)

    async def run(ctx):
        await bench.clock(ctx, clear=True)
        table = places = 0
        for way in (1, -1, 1, -1, -1, 1):
            for _ in range(50):
                await bench.clock(ctx, tick=True, pi=way)
                for _ in range(8):
                    # The drive makes up Er: the command less what the error counter got.
                    er = bench.commanded - bench.fed
                    await bench.clock(ctx, tick=True, moved=(er > 0) - (er < 0))
                table = min(max(table, bench.moved), bench.moved + play)
                if bench.model.taken_up == bench.model.goal(play):
                    assert table == bench.commanded
                    places += 1
        assert places > 250
        assert bench.fed == bench.commanded

    simulate(dut, run, deadline=1e-3)


def test_a_wrong_screw_leads_to_the_same_place_both_ways(simulate):
    """The pitch is set from the place alone, somewhat late, as the firmware does."""
    dut = Backlash()
    play = 4
    bench = Bench(dut, play)

    def error(place):
        return -5 + place // 7

    async def run(ctx):
        await bench.clock(ctx, clear=True)
        stood = {}
        for way in (1, -1, 1, -1, -1, 1):
            for _ in range(40):
                await bench.clock(ctx, tick=True, pi=way, pitch=error(bench.commanded - way))
                for _ in range(20):
                    er = bench.commanded - bench.fed
                    await bench.clock(ctx, tick=True, moved=(er > 0) - (er < 0),
                                      pitch=error(bench.commanded))
                assert ctx.get(dut.done)
                assert bench.fed == bench.commanded
                at = bench.commanded, way
                assert stood.setdefault(at, bench.moved) == bench.moved
                assert bench.moved == bench.commanded - error(bench.commanded) - play * (way < 0)
        assert len(stood) == 160

    simulate(dut, run, deadline=1e-3)


def test_a_long_walk_to_a_pitch_ends_at_it(simulate):
    dut = Backlash()
    bench = Bench(dut, 3)

    async def run(ctx):
        await bench.clock(ctx, clear=True)
        for pitch in (300, -300, 0):
            for _ in range(620):
                await bench.clock(ctx, tick=True, pitch=pitch)
                await bench.clock(ctx, pitch=pitch)
            assert ctx.get(dut.done)
            assert ctx.get(dut.taken_up) == pitch
        for _ in range(50):
            await bench.clock(ctx, tick=True, pitch=100, safe=True)
        assert ctx.get(dut.taken_up) == 0, "never while safe"

    simulate(dut, run, deadline=1e-3)


def test_a_bit_of_its_state_that_turns_over_is_told_until_it_is_cleared(simulate, rng):
    dut = Backlash()
    state = [(dut.taken_up, bit) for bit in range(15)] + [
        (one, 0) for one in (dut.down, dut.grow, dut.due, dut.parity)]

    async def run(ctx):
        for size in (0, 30, 8191):
            for signal, bit in state:
                ctx.set(dut.size, size)
                ctx.set(dut.clear, 1)
                await ctx.tick()
                ctx.set(dut.clear, 0)
                await ctx.tick()
                ctx.set(dut.tick, 1)
                for _ in range(rng.randrange(1, 60)):
                    ctx.set(dut.pi, rng.random() < 0.1)
                    ctx.set(dut.pi_reverse, rng.random() < 0.8)
                    await ctx.tick()
                    assert not ctx.get(dut.damaged)
                ctx.set(signal, ctx.get(signal) ^ 1 << bit)
                for _ in range(20):
                    await ctx.tick()
                    assert ctx.get(dut.damaged), (size, signal.name, bit)
                    ctx.set(dut.pi, rng.random() < 0.3)

    simulate(dut, run, deadline=1e-3)
