# SPDX-License-Identifier: Apache-2.0
"""References of the gap's comparators, as bit streams."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["References"]


class References(wiring.Component):
    """Bit streams with a programmed share of ones, for an RC filter in front of a comparator.

    In every 1024 clocks a stream is high in ``level`` of them, as evenly spread as it can be (a
    first-order sigma-delta modulator). Full scale, 1024, is not reached.

    Parameters
    ----------
    streams : int
        How many.

    Members
    -------
    level : In(10) x streams
        Ones in 1024 clocks.
    stream : Out(streams)
        The bits; they come from registers.
    """

    BITS = 10

    def __init__(self, *, streams=3):
        self.streams = streams
        super().__init__({"level": In(self.BITS).array(streams), "stream": Out(streams)})

    def elaborate(self, platform):
        m = Module()
        for index in range(self.streams):
            remainder = Signal(self.BITS, name=f"remainder_{index}")
            m.d.sync += Cat(remainder, self.stream[index]).eq(remainder + self.level[index])
        return m
