# SPDX-License-Identifier: Apache-2.0
"""Reference model of the serial line: bytes to levels, and levels to bytes."""

FRAMING = "framing"


def levels(data, divisor):
    """Return the level of the line in each clock while ``data`` is sent without gaps."""
    return [bit for byte in data for bit in (0, *(byte >> i & 1 for i in range(8)), 1)
            for _ in range(divisor)]


def waveform(data, bit, *, phase=0.0, idle=0):
    """Return the levels that clocks see of a sender whose bits last ``bit`` clocks.

    ``bit`` need not be whole; the first edge lies ``phase`` clocks before the clock that sees it,
    and ``idle`` clocks of idle line precede it.
    """
    bits = levels(data, 1)
    end = int(len(bits) * bit)
    return [1] * idle + [bits[min(int((clock + phase) / bit), len(bits) - 1)]
                         for clock in range(end)]


def receive(line, divisor):
    """Return ``(clock, byte or FRAMING)`` for every stop bit of a line; the clock of its middle."""
    found = []
    clock = 0
    while clock < len(line):
        middle = clock + divisor // 2
        if line[clock]:
            clock += 1
            continue
        if middle + 9 * divisor >= len(line):
            break
        if line[middle]:
            clock = middle + 1
            continue
        bits = [line[middle + n * divisor] for n in range(1, 10)]
        clock = middle + 9 * divisor
        if bits[8]:
            found.append((clock, sum(bit << n for n, bit in enumerate(bits[:8]))))
        else:
            found.append((clock, FRAMING))
            clock += 1
            while clock < len(line) and not line[clock]:
                clock += 1
        clock += 1
    return found
