# SPDX-License-Identifier: Apache-2.0
"""Reference model of the gateware's notice: what it says, and when each sentence begins."""


def sentence(place):
    """Bytes that tell of a memory that reads wrong at ``place``."""
    return f"\r\nALARM:155 memory parity at 0x{place:08X}\r\n".encode()


SILENT = b"\r\nALARM:155 watchdog: the processor does not answer\r\n"


def beginnings(held, period, count):
    """Clocks in which the first bytes of ``count`` sentences are offered, ``held`` the first."""
    return [held + number * period for number in range(count)]
