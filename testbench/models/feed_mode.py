# SPDX-License-Identifier: Apache-2.0
"""Reference model of the feed modes: exact integers, for inputs that stand still."""

CONSTANT, ZERO, OFFSET, REMOVAL = range(4)
ONE = 1 << 12           # of the gain's unit, and of the ratio
HIGHEST = (1 << 30) - 1


def speed(*, gain, mean, reference, known) -> int:
    """Steps a clock under ``ZERO`` in 2**-32, forward above 0."""
    deviation = mean - reference if known else 0
    size = min(gain * abs(deviation) // ONE, HIGHEST)
    return size if deviation >= 0 else -size


def feed(mode, *, rate, highest, gain, mean, reference, known, ratio) -> int:
    """Feed at the front in 2**-32 pulse/clock."""
    if mode == OFFSET:
        wanted = rate + speed(gain=gain, mean=mean, reference=reference, known=known)
    elif mode == REMOVAL:
        wanted = rate * ratio // ONE
    else:
        return rate
    return max(0, min(wanted, highest))
