# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.axis``, against the exact model and around a small motor."""

from collections import deque

import pytest

from rtl.motion.axis import Axis
from testbench.models import axis as model
from testbench.models.dac import Dac, PulseWidth
from testbench.models.encoder import CYCLE
from testbench.models.error_counter import wrapped
from testbench.models.gear import steps_of
from testbench.models.supervision import CHECKS, Supervision
from testbench.refusal import refuses
from testbench.simulators.benches import settle
from testbench.some import some


class Bench:
    """An axis and its model side by side, and a motor that turns the encoder."""

    def __init__(self, dut, axis):
        self.dut = dut
        self.axis = axis
        self.place = 0  # place of the motor, in encoder edges
        self.overshoot = deque([0] * 3, maxlen=3)

    async def clock(self, ctx, *, pi=0, forward=0, ahead=False, move=0, safe=False, adopt=False,
                    mark=None, stopped=1 << 17, moving=1 << 17, mode_step=False, mode_reverse=False,
                    times=(2, 2, 2), window=1, tick=False, gain=0,
                    backlash=0, pitch=0, gear=None, swap=False, offset=0, friction=0, resting=False,
                    share=512):
        """Go on by one clock and compare every output."""
        dut, axis = self.dut, self.axis
        self.place += move
        a, b = CYCLE[self.place % 4]
        for signal, value in (
                (dut.pi, pi != 0), (dut.pi_reverse, pi < 0), (dut.enc_a, a), (dut.enc_b, b),
                (dut.forward, forward), (dut.ahead, ahead),
                (dut.safe, safe), (dut.adopt, adopt), (dut.mark, mark is not None),
                (dut.mark_reverse, bool(mark)), (dut.follow_stopped, stopped),
                (dut.follow_moving, moving), (dut.mode_step, mode_step),
                (dut.mode_reverse, mode_reverse), (dut.step_time_width, times[0]),
                (dut.step_time_space, times[1]), (dut.step_time_setup, times[2]),
                (dut.window, window), (dut.tick, tick), (dut.model_gain, gain),
                (dut.backlash_size, backlash), (dut.backlash_strobe, gear is not None),
                (dut.pitch, pitch),
                (dut.gear_strobe, gear is not None), (dut.mode_swap, swap),
                (dut.mode_offset, offset), (dut.mode_friction, friction), (dut.resting, resting),
                (dut.model_lag, share)):
            ctx.set(signal, value)
        if gear:
            axis.ratio = gear
            ctx.set(dut.gear_steps, gear[0])
            ctx.set(dut.gear_surplus, gear[1] - gear[0])
        fp = axis.feedback(mode_step=mode_step, mode_reverse=mode_reverse)
        await settle(ctx)
        assert ctx.get(dut.fp) == abs(fp)
        assert not fp or ctx.get(dut.fp_reverse) == (fp < 0)
        self.overshoot.append(axis.overshoot.furthest)
        axis.tick(pi=pi, forward=forward, ahead=ahead, a=a, b=b, safe=safe, adopt=adopt, mark=mark,
                  follow_stopped=stopped, follow_moving=moving, mode_step=mode_step,
                  mode_reverse=mode_reverse, times=times, window=window, tick=tick, gain=gain,
                  backlash=backlash, pitch=pitch, gear=gear, swap=swap, offset=offset,
                  friction=friction, resting=resting, share=share)
        await ctx.tick()

        counter = axis.counter
        for name, value in (
                ("command", wrapped(counter.commanded, 32)),
                ("position", wrapped(counter.moved, 32)), ("error", counter.error),
                ("status_saturated", counter.saturated),
                ("status_illegal", axis.encoder.illegal or axis.coder.lost),
                ("status_check", CHECKS.index(axis.supervision.check)),
                ("overshoot", self.overshoot[1]), ("backlash_taken_up", axis.backlash.taken_up),
                ("in_position", axis.in_position(window, backlash, pitch)),
                ("following_stopped", axis.following_stopped),
                ("following_moving", axis.following_moving), ("dac", axis.dac.pulse),
                ("dac_negative", axis.dac.negative),
                ("step", axis.gear.step_dir.step), ("dir", axis.gear.step_dir.dir ^ swap)):
            assert ctx.get(getattr(dut, name)) == value, name


@pytest.mark.parametrize("dac", some(["sigma_delta", "pwm"]))
@pytest.mark.parametrize("mode", [
    {}, {"mode_reverse": True, "backlash": 9}, {"mode_step": True, "swap": True, "backlash": 5}],
    ids=str)
def test_follows_the_model(simulate, rng, dac, mode):
    # The allowance is so small that the supervision often finds something.
    dut = Axis(dac=dac, rest_clocks=10, allowance=3, fastest=200)
    converter = Dac() if dac == "sigma_delta" else Dac(PulseWidth)
    bench = Bench(dut, model.Axis(rest_clocks=10, dac=converter,
                                  supervision=Supervision(allowance=3, fastest=200)))
    found = set()

    async def run(ctx):
        limits = dict(stopped=20, moving=40)
        forward = offset = friction = 0
        share = 512
        pitch = 0
        for clock in range(2500):
            if rng.random() < 0.02:
                pitch = rng.choice((0, rng.randint(-8, 8)))
            if rng.random() < 0.01:
                offset = rng.choice((0, rng.randint(-2048, 2047)))
                friction = rng.choice((0, rng.randrange(256)))
                share = rng.randint(256, 4000)
            if rng.random() < 0.05:
                forward = rng.choice((0, 0, 1, -1, -15, 40, rng.randint(-32767, 32767)))
            lean = (-1, 0, 1, 0)[clock // 200 % 4]
            busy = clock % 300 < 200
            await bench.clock(
                ctx, **mode, **limits, pitch=pitch, forward=forward, ahead=clock % 1300 > 400,
                window=(1, 9, 0)[clock // 100 % 3],
                times=(rng.randrange(4), rng.randrange(4), 3),
                pi=rng.choice((-1, 1, lean, lean)) if busy and rng.random() < 0.4 else 0,
                move=rng.choice((-1, 1, lean, 2)) if clock % 4 == 0 and rng.random() < 0.6 else 0,
                offset=offset, friction=friction, share=share, resting=rng.random() < 0.5,
                safe=rng.random() < (0.05 if clock % 1000 < 400 else 0.001),
                adopt=rng.random() < 0.05, mark=rng.choice((None,) * 20 + (False, True)),
                tick=clock % 24 == 0, gain=16_000,
                gear=(rng.randint(1, 9), 9) if clock % 900 == 0 else None)
            found.add(bench.axis.supervision.check)

    simulate(dut, run)
    assert (len(found) > 1) != ("mode_step" in mode)


def test_friction_is_made_up_for_in_motion_only(simulate):
    dut = Axis(rest_clocks=5)
    bench = Bench(dut, model.Axis(rest_clocks=5))
    options = dict(friction=200, gain=200, window=15)

    async def run(ctx):
        async def goes(ticks, **more):
            """Clocks with a pulse of the DAC, of the last tick."""
            for _ in range(ticks):
                high = 0
                for clock in range(24):
                    await bench.clock(ctx, tick=clock == 0, **options, **more)
                    high += ctx.get(dut.dac)
            return high

        assert await goes(20) == 0
        assert await goes(20, forward=8000) > 3
        assert not ctx.get(dut.dac_negative)
        assert await goes(20, forward=-8000) > 3
        assert ctx.get(dut.dac_negative)
        await goes(1100)        # the model's drive comes to rest
        assert await goes(1) == 0

    simulate(dut, run, deadline=0.1)


def test_output_is_limited_below_the_counter(simulate):
    dut, axis = Axis(rest_clocks=5), model.Axis(rest_clocks=5)
    bench = Bench(dut, axis)

    async def run(ctx):
        for stop in 32_760, 131_066:
            idle = stop - axis.counter.error
            ctx.set(dut.pi, 1)
            await ctx.tick().repeat(idle)
            for _ in range(idle):
                axis.tick(pi=1)
            for _ in range(20):
                await bench.clock(ctx, pi=1)
            for _ in range(100):
                await bench.clock(ctx)
            # Full scale leaves out one clock in 32768.
            assert sum([ctx.get(dut.dac)] + [await bench.clock(ctx) or ctx.get(dut.dac)
                                            for _ in range(99)]) >= 99
        assert ctx.get(dut.status_saturated)
        assert ctx.get(dut.error) == 131_071
        assert ctx.get(dut.command) == 131_086

    simulate(dut, run, deadline=3e-3)


def test_a_geared_axis_with_backlash_returns_to_its_steps(simulate, rng):
    """Er is ΣPi - ΣFP in every clock, and the drive stands at the count less the backlash."""
    dut = Axis(rest_clocks=5)
    axis = model.Axis(rest_clocks=5)
    bench = Bench(dut, axis)
    options = dict(mode_step=True, times=(1, 1, 2), backlash=6)
    n, m = 3, 7

    async def run(ctx):
        await bench.clock(ctx, safe=True, gear=(n, m), **options)
        steps, high, seen = 0, 0, {}
        for way in (1, -1, -1, 1, -1, 1):
            for _ in range(12):
                for clock in range(40):
                    await bench.clock(ctx, pi=way if clock == 0 else 0, tick=clock % 4 == 3,
                                      **options)
                    if ctx.get(dut.step) and not high:
                        steps += -1 if ctx.get(dut.dir) else 1
                    high = ctx.get(dut.step)
                    assert ctx.get(dut.command) == ctx.get(dut.position) + ctx.get(dut.error)
                assert ctx.get(dut.in_position)
                place = ctx.get(dut.position) - ctx.get(dut.backlash_taken_up)
                assert steps == steps_of(place, n, m)
                assert seen.setdefault((way, ctx.get(dut.position)), steps) == steps
        assert ctx.get(dut.position) == steps == 0
        # From above, each place has the steps of one that is lower by the backlash.
        assert all(steps == seen[1, place - 6] for (way, place), steps in seen.items()
                   if way < 0 and (1, place - 6) in seen)

    simulate(dut, run, deadline=2e-3)


def test_an_edge_that_a_coarse_coder_loses_is_told(simulate):
    dut = Axis(rest_clocks=5)
    bench = Bench(dut, model.Axis(rest_clocks=5))

    async def run(ctx):
        await bench.clock(ctx, gear=(1, 65_536))
        for clock in range(200):
            await bench.clock(ctx, move=clock % 4 == 0)
        assert ctx.get(dut.status_illegal)
        await bench.clock(ctx, safe=True, adopt=True)
        assert not ctx.get(dut.status_illegal)

    simulate(dut, run)


def test_a_bit_of_a_coarse_coder_that_turns_over_is_damage(simulate):
    dut = Axis(rest_clocks=5)
    bench = Bench(dut, model.Axis(rest_clocks=5))

    async def run(ctx):
        await bench.clock(ctx, gear=(1, 5))
        for clock in range(40):
            await bench.clock(ctx, move=clock % 4 == 0)
            assert not ctx.get(dut.damaged)
        ctx.set(dut.coder_gear.rest, ctx.get(dut.coder_gear.rest) ^ 2)
        await ctx.tick().repeat(3)
        assert ctx.get(dut.damaged)

    simulate(dut, run)


def test_step_axis_sends_every_pulse(simulate, rng):
    dut = Axis(rest_clocks=5)
    bench = Bench(dut, model.Axis(rest_clocks=5))
    options = dict(mode_step=True, times=(1, 1, 2))

    async def run(ctx):
        steps = 0
        for _ in range(400):
            await bench.clock(ctx, pi=rng.choice((0, 0, 0, 1, 1, -1)), **options)
            steps += ctx.get(dut.step) * (-1 if ctx.get(dut.dir) else 1)
        for _ in range(1000):
            await bench.clock(ctx, **options)
            steps += ctx.get(dut.step) * (-1 if ctx.get(dut.dir) else 1)
        assert ctx.get(dut.command) == ctx.get(dut.position) == steps != 0
        assert ctx.get(dut.error) == 0
        assert not ctx.get(dut.dac)

    simulate(dut, run)


@pytest.mark.parametrize("down", [False, True], ids=["up", "down"])
def test_overshoot_is_the_furthest_beyond_the_mark(simulate, down):
    dut = Axis(rest_clocks=5)
    bench = Bench(dut, model.Axis(rest_clocks=5))
    way = -1 if down else 1

    async def run(ctx):
        async def go(pulses, motor):
            for index in range(max(pulses, motor) * 4):
                order = way if pulses > index // 4 and index % 4 == 0 else 0
                move = way if motor > index // 4 and index % 4 == 0 else 0
                await bench.clock(ctx, pi=order, move=move)

        for _ in range(20):
            await bench.clock(ctx)
        await go(20, 12)
        await bench.clock(ctx, mark=down, pi=way)  # the mark is at 21
        await go(0, 13)                            # beyond it by 4
        for _ in range(10):
            await bench.clock(ctx)
        assert ctx.get(dut.overshoot) == 4
        for _ in range(10):
            await bench.clock(ctx, move=-way)
            for _ in range(3):
                await bench.clock(ctx)
        assert ctx.get(dut.overshoot) == 4
        await bench.clock(ctx, mark=not down)      # at 21 again, the other way, position 15
        for _ in range(3):
            await bench.clock(ctx)
        assert ctx.get(dut.overshoot) == 6

    simulate(dut, run)


@pytest.mark.parametrize("fp", [-1, 0, 1])
def test_adopts_only_while_safe_and_with_the_pulse_of_that_clock(simulate, fp):
    dut = Axis(rest_clocks=5)
    bench = Bench(dut, model.Axis(rest_clocks=5))

    async def run(ctx):
        for clock in range(30):
            await bench.clock(ctx, pi=int(clock < 9))
        await bench.clock(ctx, adopt=True)
        assert ctx.get(dut.error) == 9
        await bench.clock(ctx, move=fp, safe=True)
        await bench.clock(ctx, safe=True)
        await bench.clock(ctx, safe=True)
        assert ctx.get(dut.fp) == abs(fp)
        await bench.clock(ctx, safe=True, adopt=True)
        assert ctx.get(dut.position) == ctx.get(dut.command) == fp
        assert ctx.get(dut.error) == 0

    simulate(dut, run)


def test_safe_silences_the_outputs_in_one_clock(simulate):
    dut = Axis(rest_clocks=5)
    bench = Bench(dut, model.Axis(rest_clocks=5))

    async def run(ctx):
        for mode_step in False, True:
            pin = dut.step if mode_step else dut.dac
            for _ in range(2000):
                await bench.clock(ctx, pi=-1, mode_step=mode_step, times=(20, 1, 1))
                if ctx.get(pin):
                    break
            assert ctx.get(pin)
            for _ in range(50):
                await bench.clock(ctx, pi=-1, safe=True, mode_step=mode_step, times=(20, 1, 1))
                assert not ctx.get(pin)
                assert not ctx.get(dut.dac_negative)

    simulate(dut, run)


def test_following_error_has_a_limit_for_each_state(simulate):
    dut = Axis(rest_clocks=8)
    bench = Bench(dut, model.Axis(rest_clocks=8))

    async def run(ctx):
        seen = []
        for clock in range(60):
            await bench.clock(ctx, pi=-int(clock < 20), stopped=5, moving=15)
            seen.append((ctx.get(dut.following_moving), ctx.get(dut.following_stopped)))
        # Er passes 15 with the 16th pulse, of clock 15; the last pulse is that of clock 19.
        assert seen == ([(0, 0)] * 17 + [(1, 0)] * 11 + [(0, 1)] * 32)

    simulate(dut, run)


@pytest.mark.parametrize(("wrong", "message"), [
    (dict(error_bits=16), r"must have 17 to 32 bits, more than the DAC, not 16"),
    (dict(rest_clocks=0), r"at rest after 1 clock or more, not 0"),
    (dict(dac="ladder"), r"sigma_delta or pwm, not 'ladder'"),
])
def test_refuses_wrong_parameters(wrong, message):
    refuses(Axis, message, **wrong)
