# SPDX-License-Identifier: Apache-2.0
"""Compact events: short event lines of the controller, expanded to full ones.

With short blocks the link's speed would bound the speed of a contour. So the controller sends event
``block`` in fewer characters if clock, line and place are near those of the event before::

    [Bcccclxxyyzztext]

This has the low bits of each number: clock (24 bits), line (6) and place (12 for each axis), 6 bits
a character from ``0`` on, the highest first. The full number is the one nearest to that of the
event before. At least every 32nd line is a full one; see ``softcore/firmware/link/output.h``.
"""

import re

from softcore.tables.events import named

_FULL = re.compile(r"\[E:\w+,(\d+),(\d+),(-?\d+),(-?\d+),(-?\d+)[],]")
_BLOCK = named("block").word
_SHORT = re.compile(r"\[B([0-o]{4})([0-o])([0-o]{2})([0-o]{2})([0-o]{2})(.*)\]", re.DOTALL)


def _nearest(last: int, low: str) -> int:
    """The number nearest to ``last`` with these low bits."""
    bits = 6 * len(low)
    value = sum((ord(digit) - ord("0")) << 6 * place for place, digit in enumerate(reversed(low)))
    half = 1 << bits - 1
    return last + (value - last + half) % (1 << bits) - half


class Expander:
    """Expands the compact events in a stream of lines; call it with each line in order."""

    def __init__(self) -> None:
        self._last: list[int] | None = None  # cycle, line, x, y, z of the event before

    def __call__(self, line: str) -> str:
        """The line in full. Any line but a compact event that follows an event is unchanged."""
        if full := _FULL.match(line):
            self._last = [int(number) for number in full.groups()]
        elif self._last and (short := _SHORT.fullmatch(line)):
            *numbers, text = short.groups()
            self._last = [_nearest(*pair) for pair in zip(self._last, numbers, strict=True)]
            return f"[E:{_BLOCK},{','.join(map(str, self._last))},{text}]"
        return line
