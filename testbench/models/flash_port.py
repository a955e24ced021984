# SPDX-License-Identifier: Apache-2.0
"""Reference model of the port to the flash memory, from its contract."""

SERIAL_HZ = 12_500_000


def exchange(send: int, *, clock_hz: int, latency: int) -> tuple[list[tuple[int, int | None]],
                                                                 list[int]]:
    """Levels of (clock, command) in every clock in which the port is busy, and when bits are taken.

    Clock 0 is the one after ``start``. ``command`` is None where it does not matter. The second
    list has, for each bit, the clock whose ``data`` is the bit.
    """
    half = 1
    while clock_hz > 2 * half * SERIAL_HZ:
        half += 1
    levels, taken = [], []
    for bit in range(7, -1, -1):
        for clock in (0, 1):
            if clock:
                taken.append(len(levels) + latency)
            levels += [(clock, send >> bit & 1)] * half
    while len(levels) <= taken[-1]:
        levels.append((0, None))
    return levels, taken
