# SPDX-License-Identifier: Apache-2.0
"""The firmware on this computer at the end of a bad cable, as a pipe for ``host.link``."""

import ctypes
import random
from collections import Counter

from softcore import linkmap
from softcore.image import host_library

__all__ = ["HARMS", "Cable"]

HARMS = ("bent", "dropped", "doubled", "unstopped")
REALTIME = [realtime.byte for realtime in linkmap.REALTIME]
BUFFER = 4096


class Cable:
    """Firmware and model machine; every pass of the main loop counts 1000 clocks.

    One byte in ``every`` to the controller is damaged: one or more bits are inverted, it is lost,
    comes twice or has no stop bit. A byte with inverted bits becomes a real-time byte more often
    than by chance. ``hits`` counts damaged bytes by kind, ``became`` those with inverted bits by
    the byte received, ``sent`` all bytes.
    """

    CLOCK_HZ = 2_000_000
    PASS_S = 1000 / CLOCK_HZ
    QUEUE = 256

    def __init__(self, rng: random.Random, every: float):
        self.library = ctypes.CDLL(str(host_library()))
        self.library.gk_boot(self.CLOCK_HZ, 10_000, 2)
        self.library.gk_queue(self.QUEUE)
        self.library.gk_speed(1 << 30)
        self.rng, self.every = rng, every
        self.sent = self.passes = 0
        self.hits, self.became = Counter(), Counter()
        self._buffer = ctypes.create_string_buffer(BUFFER)
        self._next = self._gap()

    def _gap(self):
        """Number of bytes up to the next damaged one."""
        return int(self.rng.expovariate(1 / self.every)) if self.every else 1 << 60

    def write(self, data: bytes) -> None:
        """Send bytes, some of them damaged."""
        begin = 0
        while self._next < len(data) - begin:
            at = begin + self._next
            self._give(data[begin:at])
            self._harm(data[at])
            begin = at + 1
            self._next = self._gap()
        self._next -= len(data) - begin
        self._give(data[begin:])
        self.sent += len(data)

    def _give(self, data):
        self.library.gk_send(data, len(data))

    def _harm(self, byte):
        harm = self.rng.choice(HARMS)
        self.hits[harm] += 1
        if harm == "bent":
            came = self.rng.choice((*[byte ^ 1 << self.rng.randrange(8)] * 3,
                                    byte ^ self.rng.randrange(1, 256),
                                    self.rng.choice(REALTIME)))
            self.became[came] += 1
            self._give(bytes([came]))
        elif harm == "doubled":
            self._give(bytes([byte, byte]))
        elif harm == "unstopped":
            self.library.gk_send_broken()

    def read(self, timeout_s: float) -> bytes:
        """Run until the firmware sends something."""
        for _ in range(max(1, round(timeout_s / self.PASS_S))):
            self.library.gk_pass(1)
            self.passes += 1
            if count := self.library.gk_receive(self._buffer, BUFFER):
                return self._buffer.raw[:count]
        return b""

    def time_s(self) -> float:
        """Time of the firmware's clock, about."""
        return self.passes * self.PASS_S

    @property
    def axes(self) -> tuple[int, ...]:
        """Commanded positions, pulses."""
        return tuple(self.library.gk_axis(axis) for axis in range(3))
