# SPDX-License-Identifier: Apache-2.0
"""Conversions of the firmware against exact arithmetic."""

import ctypes
from fractions import Fraction
from math import isqrt

import pytest

from testbench.firmware import Controller

FASTEST = (1 << 30) - 1  # the rate registers have 30 bits


@pytest.fixture(params=[(2_000_000, 10_000), (25_000_000, 10_000), (50_000_000, 1000),
                        (25_000_000, 8192)], ids=str)
def scale(request):
    clock_hz, pulses_per_mm = request.param
    library = Controller(clock_hz=clock_hz, pulses_per_mm=pulses_per_mm).library
    return library, clock_hz, pulses_per_mm


def numbers(rng, count):
    """Programmed numbers as digits and decimals: random ones, and the edges."""
    yield from ((d, k) for d in (0, 1, 5, 9, 10**12 - 1, 10**11) for k in range(8))
    for _ in range(count):
        yield rng.randrange(10 ** rng.randint(1, 12)), rng.randint(0, 7)


def nearest(value):
    """Nearest whole number, half upwards, of what is not negative."""
    return int(value + Fraction(1, 2))


@pytest.mark.parametrize("inch", [0, 1])
def test_distances_are_exact(scale, rng, inch):
    library, _, pulses_per_mm = scale
    mm = Fraction(254, 10) if inch else 1
    for digits, decimals in numbers(rng, 2000):
        pulses = ctypes.c_int32()
        fits = library.gk_distance(ctypes.c_uint64(digits), decimals, inch, ctypes.byref(pulses))
        exact = nearest(Fraction(digits, 10**decimals) * mm * pulses_per_mm)
        assert bool(fits) == (exact <= 1 << 28)
        assert not fits or pulses.value == exact


@pytest.mark.parametrize("inch", [0, 1])
def test_speeds_are_exact(scale, rng, inch):
    library, _, _ = scale
    mm = Fraction(254, 10) if inch else 1
    for digits, decimals in numbers(rng, 2000):
        speed = ctypes.c_uint32()
        fits = library.gk_speed_of(ctypes.c_uint64(digits), decimals, inch, ctypes.byref(speed))
        exact = nearest(Fraction(digits, 10**decimals) * mm * 1000)
        assert bool(fits) == (exact < 1 << 31)
        assert not fits or speed.value == exact


def test_rates_are_within_a_unit(scale, rng):
    library, clock_hz, pulses_per_mm = scale
    for speed in (1, 999, 60_000, 3_000_000, (1 << 32) - 1, *(rng.randrange(1 << 32)
                                                             for _ in range(500))):
        exact = Fraction(speed * pulses_per_mm << 32, 60_000 * clock_hz)
        rate = library.gk_rate(ctypes.c_uint32(speed))
        assert rate == FASTEST if exact >= FASTEST else abs(rate - exact) <= 1
        back = library.gk_speed_of_rate(rate) & 0xFFFFFFFF
        assert abs(back - Fraction(rate * 60_000 * clock_hz, pulses_per_mm << 32)) <= 1


def test_measured_speed(scale, rng):
    library, clock_hz, pulses_per_mm = scale
    assert library.gk_speed_of_count(5, 0) == 0
    for _ in range(500):
        clocks = rng.randrange(1, 1 << 32)
        pulses = rng.randrange(max(1, clocks // 4))
        exact = Fraction(pulses * 60_000 * clock_hz, clocks * pulses_per_mm)
        got = library.gk_speed_of_count(pulses, ctypes.c_uint32(clocks)) & 0xFFFFFFFF
        assert abs(got - exact) <= 1 + exact / (1 << 16) + Fraction(60_000 * clock_hz,
                                                                   pulses_per_mm << 32)


def test_acceleration_and_braking(scale, rng):
    library, clock_hz, pulses_per_mm = scale
    for _ in range(300):
        mm_per_s2 = rng.randint(1, 20_000)
        exact = Fraction(mm_per_s2 * pulses_per_mm << 36, clock_hz**2)
        acceleration = library.gk_acceleration(mm_per_s2)
        assert acceleration == 1 if exact < 1 else abs(acceleration - exact) <= 1 + exact / 1000
        start, rate = rng.randrange(1, 1 << 30), rng.randrange(1, 1 << 30)
        distance = library.gk_braking(rate, start, acceleration) & 0xFFFFFFFF
        needed = Fraction(8 * (rate**2 - start**2), acceleration << 32)
        assert distance == 0 if rate <= start else needed <= distance <= needed + 2


def test_root_is_the_nearest(scale, rng):
    library, _, _ = scale
    library.gk_root.restype = ctypes.c_uint32
    edges = [0, 1, 2, 3, 4, (1 << 60) - 1, 1 << 60, 3 << 58]
    around = [k * k + k + step for k in (1, 7, 1 << 20, (1 << 30) - 1) for step in (-1, 0, 1, 2)]
    for square in edges + around + [rng.randrange(1 << 60) for _ in range(3000)]:
        root = isqrt(square)
        nearest_root = root + (square > root * root + root)
        assert library.gk_root(ctypes.c_uint64(square)) == nearest_root


def test_lead_is_a_share_of_the_lag(scale, rng):
    library, clock_hz, _ = scale
    for _ in range(200):
        percent, per_s = rng.randint(0, 100), rng.choice((1, 50, 400, rng.randint(1, 400)))
        exact = Fraction(percent * clock_hz, 100 * per_s)
        found = library.gk_lead(percent, per_s)
        assert found == min(int(exact + Fraction(1, 2)), (1 << 27) - 1)
