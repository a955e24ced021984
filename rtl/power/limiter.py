# SPDX-License-Identifier: Apache-2.0
"""Limits of the power supply that no register can exceed."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Limiter"]


class Limiter(wiring.Component):
    """Orders to the power supply, clamped to the limits of this build.

    ``allowed_level = min(level, level_max)``, ``allowed_on = min(on_time, on_max)``,
    ``allowed_off = max(off_time, off_min)``, in the same clock. ``allowed_wait = min(wait_time,
    on_max - allowed_on)``: so waiting and on-time together are not above ``on_max`` either, and an
    ignition that is not seen, or seen late, makes no longer pulse. The limits are constants of the
    netlist: software reads them (``limit_level``, ``limit_off``) and cannot change them. With
    ``rtl.power.pulse_generator`` they bound every main pulse; proof:
    ``testbench/formal/test_power.py``.

    Parameters
    ----------
    level_max : int
        Highest current level, 0 to 63, in steps of the power supply.
    on_max : int
        Longest main pulse, 1 to 2**20 - 1, in clocks.
    off_min : int
        Shortest off-time, 1 to 2**20 - 1, in clocks.

    Members
    -------
    level : In(6), on_time : In(20), wait_time : In(20), off_time : In(20)
        The values wanted.
    allowed_level : Out(6), allowed_on : Out(20), allowed_wait : Out(20), allowed_off : Out(20)
        The same, clamped.
    limit_level : Out(6), limit_off : Out(20)
        ``level_max`` and ``off_min``.

    Raises
    ------
    ValueError
        If a limit is out of its range.
    """

    def __init__(self, *, level_max, on_max, off_min):
        if not 0 <= level_max < 1 << 6:
            raise ValueError(f"level_max must be 0 to 63, not {level_max!r}")
        if not 1 <= on_max < 1 << 20:
            raise ValueError(f"on_max must be 1 to 1048575 clocks, not {on_max!r}")
        if not 1 <= off_min < 1 << 20:
            raise ValueError(f"off_min must be 1 to 1048575 clocks, not {off_min!r}")
        self.level_max = level_max
        self.on_max = on_max
        self.off_min = off_min
        super().__init__({
            "level": In(6), "on_time": In(20), "wait_time": In(20), "off_time": In(20),
            "allowed_level": Out(6), "allowed_on": Out(20), "allowed_wait": Out(20),
            "allowed_off": Out(20),
            "limit_level": Out(6), "limit_off": Out(20),
        })

    def elaborate(self, platform):
        m = Module()
        level_max, on_max, off_min = C(self.level_max, 6), C(self.on_max, 20), C(self.off_min, 20)
        longest = Signal(20)  # wait that the on-time leaves
        m.d.comb += [
            longest.eq(on_max - self.allowed_on),
            self.allowed_wait.eq(Mux(self.wait_time > longest, longest, self.wait_time)),
            self.allowed_level.eq(Mux(self.level > level_max, level_max, self.level)),
            self.allowed_on.eq(Mux(self.on_time > on_max, on_max, self.on_time)),
            self.allowed_off.eq(Mux(self.off_time < off_min, off_min, self.off_time)),
            self.limit_level.eq(level_max),
            self.limit_off.eq(off_min),
        ]
        return m
