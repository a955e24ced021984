# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.safety.interlock``, against the exact model."""

import pytest

from rtl.safety.interlock import Cause, Interlock
from softcore.tables import causes
from testbench.models import interlock as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle

BY_AXIS = model.BY_AXIS
LONE = ("contact", "gate", "memory", "guard")
QUIET = dict(dict.fromkeys(BY_AXIS + LONE, 0), estop=0, fluid_low=0, watchdog=0, stop=0, clear=0,
             key=0, leave=0, leave_key=0, onto=0, discharging=1, fluid_required=1)
CLEAR = dict(clear=1, key=0x5A)
LEAVE = dict(leave=1, leave_key=0x5A)


class Bench:
    """The interlock and its model side by side: release after 3 clocks, splashing for 5."""

    def __init__(self):
        self.dut = Interlock(clock_hz=1000, limit_release_us=3000, fluid_ms=5)
        self.model = model.Interlock(release=3, splash=5)
        self.trips = 0

    async def clock(self, ctx, times=1, **inputs):
        dut = self.dut
        for _ in range(times):
            for name, value in (QUIET | inputs).items():
                ctx.set(getattr(dut, name), value)
            self.model.begin(**QUIET | inputs)
            await settle(ctx)
            for name in ("live", "latched"):
                assert ctx.get(getattr(dut, name)) == model.vector(getattr(self.model, name)), name
            assert ctx.get(dut.safe) == self.model.safe
            assert ctx.get(dut.tripped) == self.model.tripped
            assert ctx.get(dut.first) == model.CAUSES.index(self.model.first)
            assert ctx.get(dut.simultaneous) == model.vector(self.model.told)
            assert ctx.get(dut.blamed) == self.model.blamed
            assert ctx.get(dut.leaving) == self.model.leaving
            for end in "low", "high":
                assert ctx.get(getattr(dut, f"at_{end}")) == self.model.at(f"limit_{end}")
                assert ctx.get(getattr(dut, f"left_{end}")) == self.model.left[f"limit_{end}"]
            self.model.end()
            self.trips += self.model.tripped
            await ctx.tick()


def test_causes_have_the_numbers_of_the_register_table():
    names = list(causes.numbers())
    assert [cause.name.lower() for cause in Cause] == names
    assert [cause.value for cause in Cause] == list(range(len(names)))
    assert list(model.CAUSES) == names


def test_follows_the_model(simulate, rng):
    bench = Bench()
    left = set()

    async def run(ctx):
        calm = {}
        for clock in range(3000):
            busy = clock % 60 < 20
            if clock % 7 == 0:
                calm = dict(discharging=rng.random() < 0.8, fluid_required=rng.random() < 0.8,
                            fluid_low=rng.random() < 0.3)
            inputs = dict(calm, clear=rng.random() < 0.3,
                          key=rng.choice((0x5A, 0x5A, 0xA5, rng.randrange(256))),
                          leave=rng.random() < 0.1, leave_key=rng.choice((0x5A, 0x5A, 0x5B)),
                          onto=rng.random() < 0.02)
            for name in (*BY_AXIS, *LONE, "estop", "watchdog", "stop"):
                if busy and rng.random() < 0.03:
                    inputs[name] = rng.choice((1, 2, 4, 5)) if name in BY_AXIS else 1
            if busy and rng.random() < 0.2:
                inputs |= dict.fromkeys(rng.sample(("limit_low", "limit_high"), 1), 2)
            elif clock % 200 > 100:
                inputs |= {rng.choice(("limit_low", "limit_high")): 5} if rng.random() < 0.9 else {}
            await bench.clock(ctx, **inputs)
            left.add((bench.model.leaving, bench.model.safe))

    simulate(bench.dut, run)
    assert bench.trips > 30
    assert len(left) == 4


def test_safe_until_acknowledged_after_reset(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 5)
        assert ctx.get(bench.dut.safe)
        await bench.clock(ctx, clear=1, key=0xA5)
        assert ctx.get(bench.dut.safe), "another key"
        await bench.clock(ctx, key=0x5A)
        assert ctx.get(bench.dut.safe), "no strobe"
        await bench.clock(ctx, **CLEAR)
        assert not ctx.get(bench.dut.safe)
        assert not ctx.get(bench.dut.tripped)

    simulate(bench.dut, run)
    assert bench.trips == 0


@pytest.mark.parametrize("cause", [cause for cause in Cause if cause is not Cause.POWER_ON],
                         ids=lambda cause: cause.name.lower())
def test_every_cause_acts_in_its_clock_and_holds(simulate, cause):
    bench = Bench()
    name = "stop" if cause is Cause.FIRMWARE else cause.name.lower()
    # Clocks from an input to its cause, and from its end to the end of the cause.
    before, after = {Cause.LIMIT_LOW: (2, 3), Cause.LIMIT_HIGH: (2, 3),
                     Cause.FLUID_LOW: (5, 5)}.get(cause, (0, 0))
    level = {name: 1 if name not in BY_AXIS else 4}

    async def run(ctx):
        dut = bench.dut
        await bench.clock(ctx, **CLEAR)
        await bench.clock(ctx, before, **level)
        await bench.clock(ctx, 1, **level)   # in the clock of the cause: compared by the bench
        assert ctx.get(dut.tripped)
        assert ctx.get(dut.first) == cause.value
        assert ctx.get(dut.simultaneous) == 1 << cause.value
        assert ctx.get(dut.blamed) == (4 if name in BY_AXIS else 0)
        await bench.clock(ctx, **level, **CLEAR)
        await bench.clock(ctx, after)
        await bench.clock(ctx, 3)
        assert ctx.get(dut.safe), "not cleared while it was present"
        await bench.clock(ctx, **CLEAR)
        assert not ctx.get(dut.safe)

    simulate(bench.dut, run)
    assert bench.trips == 1


def test_only_what_is_gone_is_cleared(simulate):
    bench = Bench()

    async def run(ctx):
        dut = bench.dut
        await bench.clock(ctx, **CLEAR)
        await bench.clock(ctx, watchdog=1, encoder=2)
        await bench.clock(ctx, estop=1)
        assert ctx.get(dut.first) == Cause.WATCHDOG.value, "the first, not the lowest"
        assert ctx.get(dut.simultaneous) == 1 << 6 | 1 << 8
        await bench.clock(ctx, estop=1, **CLEAR)
        assert ctx.get(dut.latched) == 1 << Cause.ESTOP.value
        assert ctx.get(dut.first) == Cause.ESTOP.value, "what is left"
        await bench.clock(ctx, **CLEAR)
        assert not ctx.get(dut.safe)

    simulate(bench.dut, run)


def test_a_cause_in_the_clock_of_the_clear_stays(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, stop=1, **CLEAR)
        await bench.clock(ctx, 3)
        assert ctx.get(bench.dut.latched) == 1 << Cause.FIRMWARE.value

    simulate(bench.dut, run)


def test_one_clock_of_a_limit_switch_is_a_disturbance(simulate):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, **CLEAR)
        for axis in range(3):
            await bench.clock(ctx, limit_low=1 << axis)
            await bench.clock(ctx)
        assert not ctx.get(bench.dut.safe)

    simulate(bench.dut, run)


@pytest.mark.parametrize("end", ["low", "high"])
def test_a_limit_switch_can_be_left(simulate, end):
    bench = Bench()
    on = {f"limit_{end}": 2}
    left = getattr(bench.dut, f"left_{end}")

    async def run(ctx):
        dut = bench.dut
        await bench.clock(ctx, **CLEAR)
        await bench.clock(ctx, 5, **LEAVE)
        assert not ctx.get(dut.leaving), "there is nothing to leave"
        await bench.clock(ctx, 3, **on)
        await bench.clock(ctx, **on, **CLEAR)
        assert ctx.get(dut.safe), "a live switch is not cleared"
        await bench.clock(ctx, **on, leave=1, leave_key=0xA5)
        assert not ctx.get(dut.leaving), "another key"
        await bench.clock(ctx, **on, **LEAVE)
        assert ctx.get(left) == 2
        assert ctx.get(dut.safe), "not yet acknowledged"
        await bench.clock(ctx, **on, **CLEAR)
        await bench.clock(ctx, 10, **on)
        assert not ctx.get(dut.safe)
        await bench.clock(ctx, 2)
        assert ctx.get(dut.leaving), "a contact bounces"
        await bench.clock(ctx, 5, **on)
        await bench.clock(ctx, 4)
        assert not ctx.get(dut.leaving)
        await bench.clock(ctx, 3, **on)
        assert ctx.get(dut.safe), "once left it is a switch like any other"

    simulate(bench.dut, run)
    assert bench.trips == 2


@pytest.mark.parametrize("cause", ["onto", "limit_low", "limit_high", "estop"])
def test_nothing_else_is_let_pass_while_a_switch_is_left(simulate, cause):
    bench = Bench()

    async def run(ctx):
        dut = bench.dut
        await bench.clock(ctx, 3, limit_high=2)
        await bench.clock(ctx, limit_high=2, **LEAVE)
        await bench.clock(ctx, limit_high=2, **CLEAR)
        await bench.clock(ctx, 5, limit_high=2)
        assert not ctx.get(dut.safe)
        also = {"limit_high": 6} if cause == "limit_high" else {"limit_high": 2, cause: 1}
        await bench.clock(ctx, **also)
        await bench.clock(ctx, 4, **(also if cause.startswith("limit") else {"limit_high": 2}))
        assert ctx.get(dut.safe)
        assert not ctx.get(dut.leaving)
        first = "limit_high" if cause == "onto" else cause
        assert ctx.get(dut.first) == model.CAUSES.index(first)
        assert ctx.get(dut.blamed) == dict(onto=2, limit_low=1, limit_high=4, estop=0)[cause]
        await bench.clock(ctx, limit_high=2, **CLEAR)
        assert ctx.get(dut.safe), "the switch is still there"

    simulate(bench.dut, run)


def test_only_a_machine_that_is_safe_leaves_a_switch(simulate):
    """A request in the clock of a pulse onto the switch would let that pulse pass."""
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, 3, limit_high=2)
        await bench.clock(ctx, limit_high=2, **LEAVE)
        await bench.clock(ctx, limit_high=2, **CLEAR)
        await bench.clock(ctx, limit_high=2, onto=1, **LEAVE)
        assert ctx.get(bench.dut.safe)

    simulate(bench.dut, run)


@pytest.mark.parametrize("off", ["discharging", "fluid_required"])
def test_low_fluid_counts_while_discharging_only(simulate, off):
    bench = Bench()

    async def run(ctx):
        await bench.clock(ctx, **CLEAR)
        await bench.clock(ctx, 20, fluid_low=1, **{off: 0})
        assert not ctx.get(bench.dut.safe)
        await bench.clock(ctx, fluid_low=1)
        assert ctx.get(bench.dut.tripped), "at once: the level is known"

    simulate(bench.dut, run)


@pytest.mark.parametrize("register", ["latched", "double"])
@pytest.mark.parametrize("cause", [None, Cause.ESTOP], ids=["quiet", "tripped"])
def test_a_bit_of_the_latch_that_turns_over_makes_safe(simulate, register, cause):
    """It is the cause ``guard`` in the same clock; the causes of latch and double stay."""
    dut = Interlock(clock_hz=1000, limit_release_us=3000, fluid_ms=5)
    guard = 1 << Cause.GUARD.value
    held = 0 if cause is None else 1 << cause.value

    async def bench(ctx):
        signal = getattr(dut, register)
        ctx.set(dut.key, 0x5A)
        for bit in range(len(Cause)):
            ctx.set(dut.clear, 1)
            await ctx.tick().repeat(2)
            ctx.set(dut.clear, 0)
            ctx.set(dut.estop, cause is not None)
            await ctx.tick()
            ctx.set(dut.estop, 0)
            await ctx.tick().repeat(2)
            assert (ctx.get(dut.latched), ctx.get(dut.safe)) == (held, held != 0)
            ctx.set(signal, ctx.get(signal) ^ 1 << bit)
            alone = (held & ~(1 << bit)) == 0
            await settle(ctx)
            assert ctx.get(dut.safe)
            assert ctx.get(dut.torn)
            await ctx.tick()
            assert ctx.get(dut.tripped) == alone
            assert ctx.get(dut.first) == (Cause.GUARD if alone else cause).value
            for _ in range(3):
                assert ctx.get(dut.safe)
                assert not ctx.get(dut.torn)
                turned = 0 if held >> bit & 1 else 1 << bit
                assert ctx.get(dut.latched) == held | turned | guard
                await ctx.tick()

    simulate(dut, bench)


def test_refuses_no_axis():
    refuses(Interlock, r"there must be at least 1 axis, not 0", clock_hz=1000, axes=0)
