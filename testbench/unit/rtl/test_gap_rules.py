# SPDX-License-Identifier: Apache-2.0
"""``rtl.gap.gap``: every pulse is judged and counted by the condition that it began with."""

import pytest

from rtl.gap.feed_mode import FeedMode
from rtl.gap.gap import Gap
from softcore.csr import interfaces
from softcore.regmap import OWNED
from testbench.models import discriminator as model
from testbench.models.preset_counter import OK_ALONE

PULSE, PAUSE = 20, 8    # clocks
BLANKING = 3
CLASSES = "open", "ok", "dame", "short"


def made():
    return Gap(registers=interfaces(OWNED), clock_hz=2_000_000)


def put(ctx, condition, rules):
    """Words of a condition, as they come into force."""
    ctx.set(condition.gap_delay_least, rules.delay_least)
    for name in ("current", "delay", "noise"):
        ctx.set(getattr(condition, f"gap_criteria_{name}"), getattr(rules, f"use_{name}"))


def at_random(rng):
    return model.Rules(blanking=BLANKING, delay_least=rng.choice((0, 4, 5, 6, 9, 30)),
                       use_delay=rng.randrange(2), use_noise=rng.randrange(2),
                       use_current=rng.randrange(2))


@pytest.mark.parametrize("switch", [1, PAUSE - 1], ids=["first", "last"])
def test_a_pulse_is_judged_by_the_condition_that_it_began_with(simulate, rng, switch):
    """The words change ``switch`` clocks after the end of a pulse: as soon, and as late, as may be.

    They do so in the clock after ``between`` of ``rtl.power.pulse_generator`` is high.
    """
    dut, reference = made(), model.Discriminator()

    async def bench(ctx):
        following = at_random(rng)
        ctx.set(dut.registers.gap.blanking, BLANKING)
        put(ctx, dut.condition, following)
        await ctx.tick()
        seen = set()
        for _ in range(150):
            rules, following = following, at_random(rng)
            delay, noise = rng.randrange(2, 12), rng.randrange(2)
            for clock in range(PULSE + PAUSE):
                if clock == PULSE + switch:
                    put(ctx, dut.condition, following)
                on, burning = clock < PULSE, delay <= clock - 1 < PULSE
                ctx.set(dut.on, on)
                # What the comparators say of a clock reaches the gap with its gates, a clock later.
                levels = dict(high=clock <= PULSE and not burning, arc=0, short=0,
                              current=burning, noise=burning and noise)
                for name, level in levels.items():
                    ctx.set(getattr(dut, name), level)
                await ctx.tick()
            for clock in range(PULSE + PAUSE):
                burning = delay <= clock < PULSE
                reference.clock(on=clock < PULSE, sense=0, rules=rules, high=not burning,
                                current=burning, noise=burning and noise)
            assert ctx.get(dut.registers.gap.status_last) == reference.last, rules
            seen.add(reference.last)
        assert [ctx.get(getattr(dut.registers.gap, f"{name}_count")) for name in CLASSES] == [
            reference.main[kind] for kind in (model.OPEN, model.OK, model.DAME, model.SHORT)]
        assert seen == {model.OK, model.DAME}

    simulate(dut, bench)


@pytest.mark.parametrize(("mode", "presets", "steps"), [
    # Good pulses only, and a strobe every five of them.
    (OK_ALONE, dict(dame=0, open=0, ok=4), (4, 0)), (OK_ALONE, dict(dame=0, open=0, ok=9), (0, 4)),
])
def test_the_condition_chooses_how_pulses_are_counted(simulate, mode, presets, steps):
    dut = made()

    async def bench(ctx):
        ctx.set(dut.registers.gap.blanking, BLANKING)
        ctx.set(dut.registers.servo.control, 1)
        ctx.set(dut.registers.servo.period, 5 * (PULSE + PAUSE))
        ctx.set(dut.machining, 1)
        ctx.set(dut.condition.servo_counting_mode, mode)
        for name, preset in presets.items():
            ctx.set(getattr(dut.condition, f"servo_presets_{name}"), preset)
        for _ in range(21):
            for clock in range(PULSE + PAUSE):
                ctx.set(dut.on, clock < PULSE)
                ctx.set(dut.high, clock < BLANKING + 4)
                await ctx.tick()
        servo = dut.registers.servo
        assert (ctx.get(servo.ups), ctx.get(servo.downs)) == steps
        assert ctx.get(dut.registers.gap.ok_count) == 21

    simulate(dut, bench)


def test_the_servo_holds_while_the_outside_is_waited_for(simulate):
    """Silence is no open gap: by ``OK_ALONE`` every strobe without good pulses is a step DOWN."""
    dut = made()

    async def bench(ctx):
        ctx.set(dut.registers.servo.control, 1)
        ctx.set(dut.registers.servo.period, 10)
        ctx.set(dut.machining, 1)
        ctx.set(dut.condition.servo_counting_mode, OK_ALONE)
        ctx.set(dut.condition.servo_presets_ok, 5)
        servo = dut.registers.servo
        for waiting, steps in ((1, 0), (0, 10), (1, 10), (0, 20)):
            ctx.set(dut.waiting, waiting)
            await ctx.tick().repeat(101)
            assert (ctx.get(servo.ups), ctx.get(servo.downs)) == (0, steps)

    simulate(dut, bench)


def test_mean_and_its_steps_hold_while_the_outside_is_waited_for(simulate):
    """The mean voltage is 0 and the reference half of the scale: feed mode 1 steps backward."""
    dut = made()

    async def bench(ctx):
        feed = dut.registers.feed
        for signal, value in ((dut.registers.fluid.control_convert, 1), (dut.adc_data, 0),
                              (feed.control_measure, 1), (dut.wanted, 1), (feed.window, 100),
                              (dut.motion.at_front, 1), (feed.control_mode, FeedMode.ZERO),
                              (feed.gain, 1 << 24), (dut.machining, 1),
                              (dut.condition.feed_reference_voltage, 1 << 15)):
            ctx.set(signal, value)
        await ctx.tick().repeat(700)
        for waiting in (0, 1, 0):    # all before the fluid's turn at the converter, which is mute
            ctx.set(dut.waiting, waiting)
            await ctx.tick().repeat(3)
            windows, steps = ctx.get(feed.status_windows), 0
            for _ in range(500):
                await ctx.tick()
                steps += ctx.get(dut.motion.up)
            assert (steps > 0) == (not waiting)
            # The one that was under way when the wait began may have been computed in it.
            assert (ctx.get(feed.status_windows) - windows > 1) == (not waiting)

    simulate(dut, bench)


def test_sensing_pulses_of_the_wait_are_no_short_by_the_mean_voltage(simulate):
    dut = made()

    async def bench(ctx):
        for signal, value in ((dut.registers.fluid.control_convert, 1), (dut.machining, 1),
                              (dut.registers.gap.short_mean, 100), (dut.waiting, 1),
                              (dut.registers.gap.short_mean_time, 200), (dut.on, 1)):
            ctx.set(signal, value)
        await ctx.tick().repeat(1000)
        assert not ctx.get(dut.motion.shorted)
        ctx.set(dut.waiting, 0)
        await ctx.tick().repeat(190)
        assert not ctx.get(dut.motion.shorted)      # a new window
        await ctx.tick().repeat(20)
        assert ctx.get(dut.motion.shorted)

    simulate(dut, bench)


def test_a_short_is_found_while_the_outside_is_waited_for(simulate):
    dut = made()

    async def bench(ctx):
        for signal, value in ((dut.waiting, 1), (dut.machining, 1), (dut.short, 1),
                              (dut.registers.gap.blanking, BLANKING),
                              (dut.registers.gap.short_ratio_needed, 3),
                              (dut.registers.gap.short_ratio_window, 5)):
            ctx.set(signal, value)
        await ctx.tick()
        for _ in range(3):
            assert not ctx.get(dut.motion.shorted)
            for clock in range(PULSE + PAUSE):
                ctx.set(dut.sense, clock < PULSE)
                await ctx.tick()
        assert ctx.get(dut.motion.shorted)

    simulate(dut, bench)


@pytest.mark.parametrize("gate", ["on", "sense"])
@pytest.mark.parametrize(("current", "short"), [(0, 1), (1, 0)], ids=["voltage", "current"])
def test_a_short_goes_by_what_is_set(simulate, gate, current, short):
    """The voltage says one thing and the current the other; either is set to count."""
    dut = made()

    async def bench(ctx):
        registers = dut.registers.gap
        for signal, value in ((dut.machining, 1), (dut.short, short),
                              (registers.blanking, BLANKING), (registers.clear_needed, 1),
                              (registers.short_ratio_needed, 3), (registers.short_ratio_window, 5)):
            ctx.set(signal, value)
        for by_current in (1, 0, 1, 0):
            ctx.set(registers.short_current, 6 * by_current)
            for _ in range(4):
                for clock in range(PULSE + PAUSE):
                    ctx.set(getattr(dut, gate), clock < PULSE)
                    ctx.set(dut.current, current and clock > 1)
                    await ctx.tick()
            assert ctx.get(dut.motion.shorted) == (current if by_current else short)

    simulate(dut, bench)


def test_the_converter_runs_for_the_oscilloscope_and_nothing_else_hears_of_it(simulate):
    """Its answers are wrong here: with the converter wanted they would be a fault."""
    dut = made()
    scope, fluid = dut.registers.scope, dut.registers.fluid
    longest = 34 * 16 * 5

    async def bench(ctx):
        selected = 0
        ctx.set(scope.after, 4000)
        for wanted in (False, True):
            ctx.set(scope.order_arm, not wanted)
            ctx.set(scope.order_stop, wanted)
            ctx.set(scope.order_strobe, 1)
            ctx.set(fluid.control_convert, wanted)
            await ctx.tick()
            ctx.set(scope.order_strobe, 0)
            for _ in range(longest):
                await ctx.tick()
                if not wanted:
                    selected += ctx.get(dut.adc_select)
                    assert not ctx.get(dut.fluid_news)
                    assert not ctx.get(dut.voltage_valid)
                    assert not ctx.get(fluid.status_fault)
            if not wanted:
                # Samples, up to the fourth wrong answer for the fluid cell.
                assert ctx.get(scope.status_count) >= 15 * 4
        assert selected
        assert ctx.get(fluid.status_fault)

    simulate(dut, bench)
