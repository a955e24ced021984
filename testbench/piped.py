# SPDX-License-Identifier: Apache-2.0
"""The firmware on this computer at the other end of the host's link.

The machine below it is a model that follows the path at once.
"""

import ctypes

from softcore.image import host_library

__all__ = ["CLOCK_HZ", "PULSES_PER_MM", "Firmware", "Machinery"]

CLOCK_HZ, PULSES_PER_MM, Z = 2_000_000, 10_000, 2
PASS_S = 1000 / CLOCK_HZ


class Firmware:
    """The firmware as a pipe; every pass of its main loop counts 1000 clocks."""

    clock_hz = CLOCK_HZ

    def __init__(self, pulses_per_pass=200):
        self.library = ctypes.CDLL(str(host_library()))
        self.library.gk_boot(CLOCK_HZ, PULSES_PER_MM, Z)
        self.library.gk_speed(pulses_per_pass)
        self.passes = 0

    @property
    def cycle(self):
        return self.passes * 1000

    def press_arm(self):
        self.library.gk_arm()

    def write(self, data):
        self.library.gk_send(data, len(data))

    def read(self, timeout_s):
        buffer = ctypes.create_string_buffer(4096)
        for _ in range(max(1, round(timeout_s / PASS_S))):
            self.library.gk_pass(1)
            self.passes += 1
            count = self.library.gk_receive(buffer, len(buffer))
            if count:
                return buffer.raw[:count]
        return b""

    def time_s(self):
        return self.passes * PASS_S

    def positions(self):
        return {axis: self.library.gk_axis(n) for n, axis in enumerate("xyz")}

    def front(self):
        return self.library.gk_position()

    def errors(self):
        return dict.fromkeys("xyz", 0)

    def discharges(self):
        return dict.fromkeys(("open", "ok", "dame", "short"), 0)


class Machinery(Firmware):
    """The firmware on this computer, as the machine behind a line."""

    byte_s = 1e-5

    def button_arm(self, down):
        if down:
            self.press_arm()

    def armed(self):
        return False
