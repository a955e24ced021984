# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.dac`` against the exact models, and of the models' promises."""

import numpy
import pytest

from rtl.motion.dac import Dac, PulseWidth
from testbench.models import dac as model
from testbench.refusal import refuses

FULL = 32767
EDGES = (0, 1, -1, 2, -2, 16383, 16384, 16385, FULL - 1, FULL, 1 - FULL, -FULL)
KINDS = {
    "sigma_delta": (dict(), dict(kind=model.SigmaDelta)),
    "pwm": (dict(modulator="pwm", bits=4), dict(kind=model.PulseWidth, options=dict(bits=4))),
    "slow_pwm": (dict(modulator="pwm"), dict(kind=model.PulseWidth)),
    "finest_pwm": (dict(modulator="pwm", bits=15), dict(kind=model.PulseWidth,
                                                        options=dict(bits=15))),
}


@pytest.fixture(params=KINDS)
def pair(request):
    options, reference = KINDS[request.param]
    return Dac(**options), model.Dac(**reference)


async def clock(ctx, dut, reference, value, safe=False):
    ctx.set(dut.magnitude, abs(value))
    ctx.set(dut.reverse, value < 0)
    ctx.set(dut.safe, safe)
    await ctx.tick()
    reference.tick(value, safe)
    assert ctx.get(dut.pulse) == reference.pulse
    assert ctx.get(dut.negative) == reference.negative


def test_follows_the_model(simulate, rng, pair):
    follows(simulate, rng, pair)


@pytest.mark.parametrize("pair", ["pwm"], indirect=True)
def test_pwm_follows_the_model(simulate, rng, pair):
    """Under cocotb, too: of the test above only the first modulator is."""
    follows(simulate, rng, pair)


def follows(simulate, rng, pair):
    async def bench(ctx):
        value = 0
        for _ in range(5000):
            chance = rng.random()
            if chance < 0.005:
                value = rng.choice(EDGES)
            elif chance < 0.01:
                value = rng.randint(-FULL, FULL)
            elif chance < 0.3:
                value = max(-FULL, min(FULL, value + rng.randint(-99, 99)))
            await clock(ctx, *pair, value, safe=rng.random() < 0.002)

    simulate(pair[0], bench)


@pytest.mark.parametrize("pair", ["sigma_delta"], indirect=True)
def test_limits_the_noise_of_sigma_delta_at_both_ends(simulate, rng, pair):
    """It is there after some clocks near an end of the scale, and seen when that is left."""
    async def bench(ctx):
        for value in (31_000, 2000) * 8 + (FULL, 1, FULL - 1, 300):
            for _ in range(rng.randint(50, 150)):
                await clock(ctx, *pair, value)

    simulate(pair[0], bench)


def test_is_silent_at_zero_and_while_safe(simulate, pair):
    dut, _ = pair

    async def bench(ctx):
        for value, safe in ((0, False), (FULL, True), (-FULL, True)):
            await clock(ctx, *pair, FULL)
            for _ in range(100):
                await clock(ctx, *pair, value, safe)
                assert not ctx.get(dut.pulse)

    simulate(dut, bench)


# The first runs under cocotb: that of a board with PWM.
@pytest.mark.parametrize("pair", ["slow_pwm", "pwm", "finest_pwm", "sigma_delta"], indirect=True)
def test_turns_in_a_clock_without_a_pulse(simulate, pair):
    dut, _ = pair

    async def bench(ctx):
        for value in (FULL, -FULL) * 20:
            before = ctx.get(dut.negative)
            await clock(ctx, *pair, value)
            if before != ctx.get(dut.negative):
                assert not ctx.get(dut.pulse)
            assert ctx.get(dut.negative) == (value < 0)
            for _ in range(5):
                await clock(ctx, *pair, value)

    simulate(dut, bench)


@pytest.mark.parametrize("bits", [1, 4, 10, 15])
def test_pwm_has_the_exact_mean_in_every_window(rng, bits):
    window = 1 << model.BITS
    for magnitude in (1, 2, 31, 32, 33, 12345, FULL, rng.randrange(1, FULL)):
        pwm = model.PulseWidth(bits)
        outputs = [pwm.tick(magnitude) for _ in range(3 * window)]
        count = sum(outputs[:window])
        assert count == magnitude
        for old, new in zip(outputs, outputs[window:], strict=False):
            count += new - old
            assert count == magnitude


def test_sigma_delta_has_its_bounds_at_any_constant_magnitude():
    # The model's recurrence, for all magnitudes side by side.
    pulse = 1 << model.BITS
    magnitude = numpy.arange(1, pulse)
    due, noise = numpy.zeros_like(magnitude), numpy.full_like(magnitude, -pulse // 2)
    sent = numpy.zeros_like(magnitude)
    inside = (magnitude >= 0.15 * pulse) & (magnitude <= 0.9 * pulse)
    clocks = 6000
    for _ in range(clocks):
        high = noise + due >= 0
        whole, part = numpy.divmod(noise + due - high * pulse, pulse)
        assert numpy.all((abs(whole + 0.5) < 4)[inside]), "second order to the end of its range"
        noise = numpy.clip(whole, -4, 3) * pulse + part
        due += magnitude - high * pulse
        sent += high
        assert due.max() < 2 * pulse
        assert due.min() > -pulse
    assert numpy.array_equal(sent * pulse, clocks * magnitude - due), "nothing is lost"


def test_sigma_delta_has_its_bounds_whatever_it_is_asked():
    bits, reached = 3, {}
    start = model.SigmaDelta(bits)
    waiting = [(start.due, start.noise)]
    while waiting:
        state = waiting.pop()
        for magnitude in range(1, 1 << bits):
            modulator = model.SigmaDelta(bits, due=state[0], noise=state[1])
            modulator.tick(magnitude)
            following = modulator.due, modulator.noise
            if following not in reached:
                reached[following] = state
                waiting.append(following)
    # The bounds widen a little with finer magnitudes: 3.00, 3.19, 3.25 pulses for 3, 4, 5 bits.
    assert max(due for due, _ in reached) <= 3.5 * (1 << bits)
    assert min(due for due, _ in reached) >= -2.75 * (1 << bits)


def test_sigma_delta_noise_is_of_second_order():
    modulator = model.SigmaDelta()
    length = 1 << 14
    bits = numpy.array([modulator.tick(12_345) for _ in range(length)])
    window = numpy.hanning(length)
    spectrum = numpy.abs(numpy.fft.rfft((bits - 12_345 / 32_768) * window)) ** 2
    low, high = spectrum[32:64].sum(), spectrum[512:1024].sum()
    # Four octaves up, power density rises by 12 dB each, in bands that are 16 times as wide: 60 dB
    # for white quantisation noise. First order: 36 (49 with its tones).
    assert 10 * numpy.log10(high / low) > 56


@pytest.mark.parametrize(("block", "wrong", "message"), [
    (Dac, dict(modulator="pdm"), r"must be sigma_delta or pwm, not 'pdm'"),
    (Dac, dict(bits=16), r"1 to 15 bits, not 16"),
    (PulseWidth, dict(bits=0), r"1 to 15 bits, not 0"),
])
def test_refuses_wrong_parameters(block, wrong, message):
    refuses(block, message, **wrong)
