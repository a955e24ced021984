# SPDX-License-Identifier: Apache-2.0
"""Debouncer for contacts and floats."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Debounce"]


class Debounce(wiring.Component):
    """Follows a level once it has lasted.

    ``steady`` rises in the clock after ``raw`` was high for ``rise`` clocks in a row, and falls in
    the clock after it was low for ``fall`` clocks in a row. It is low out of reset.

    Parameters
    ----------
    rise, fall : int
        Times for which a level must last, in clocks, at least 1.

    Members
    -------
    raw : In(1)
        Synchronised input.
    steady : Out(1)
        Its debounced level.

    Raises
    ------
    ValueError
        If a time is less than 1.
    """

    def __init__(self, *, rise, fall):
        if rise < 1 or fall < 1:
            raise ValueError(f"debounce times must be at least 1 clock, not {rise!r} and {fall!r}")
        self.rise = rise
        self.fall = fall
        super().__init__({"raw": In(1), "steady": Out(1)})

    def elaborate(self, platform):
        m = Module()

        count = Signal(range(max(self.rise, self.fall)))  # clocks in a row in which raw differs
        with m.If(self.raw == self.steady):
            m.d.sync += count.eq(0)
        with m.Elif(count == Mux(self.steady, self.fall - 1, self.rise - 1)):
            m.d.sync += [self.steady.eq(self.raw), count.eq(0)]
        with m.Else():
            m.d.sync += count.eq(count + 1)

        return m
