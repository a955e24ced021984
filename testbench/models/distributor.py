# SPDX-License-Identifier: Apache-2.0
"""Reference model of the line distributor, in exact integers."""


def steps(pulses: int, length: int, travel: int) -> int:
    """Steps of an axis with ``travel`` after so many of a segment's ``length`` path pulses.

    The nearest integer to ``pulses * travel / length``, halves away from zero.
    """
    size = (2 * pulses * abs(travel) + length) // (2 * length)
    return size if travel >= 0 else -size
