# SPDX-License-Identifier: Apache-2.0
"""The way by which a drive is behind its velocity command: a model of first order."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["SHARE_BITS", "SHARE_INIT", "DriveLag"]

SHARE_BITS = 13
SHARE_INIT = 512    # a lag of 128 ticks


class DriveLag(wiring.Component):
    """A drive of first order that is commanded a speed stays behind by ``lag``.

    In every tick the way gains the speed commanded, and loses ``share * 2**-16`` of itself, rounded
    down: so the drive's lag is ``2**16 / share`` ticks. ``tell`` comes ``SHARE_BITS + 2`` clocks
    after ``tick`` at the earliest, and ticks ``SHARE_BITS + 3`` clocks apart.

    Exact model: ``testbench/models/drive_lag.py``.

    Members
    -------
    tick : In(1)
        A tick; ``share`` is read.
    share : In(13)
        Part of the way that is made up in a tick, 2**-16. Never 0, and a lag of 256 ticks at most
        keeps the way in its range.
    tell : In(1)
        ``told`` is the speed commanded in this tick.
    told : In(signed(22))
        2**-12 pulse/tick.
    lag : Out(signed(19))
        The way, in whole pulses: rounded down, and one more below 0. Changes 2 clocks after
        ``tell``.
    """

    FRACTION = 12
    WAY = 31        # bits of the way, with its sign

    tick: In(1)
    share: In(SHARE_BITS)
    tell: In(1)
    told: In(signed(22))
    lag: Out(signed(WAY - FRACTION))

    def elaborate(self, platform):
        m = Module()
        way = Signal(signed(self.WAY))
        factor = Signal(SHARE_BITS)
        product = Signal(signed(self.WAY + SHARE_BITS))
        step = Signal(range(SHARE_BITS + 2), init=SHARE_BITS + 1)

        whole = Signal()    # the way has lost and gained
        m.d.sync += whole.eq(self.tell)
        with m.If(whole):
            # The same in both directions: a lag of -1 at the slowest speeds would hold an axis that
            # is a pulse above its command there.
            m.d.sync += self.lag.eq((way >> self.FRACTION) + way[-1])
        with m.If(self.tick):
            m.d.sync += [factor.eq(self.share), product.eq(0), step.eq(0)]
        with m.Elif(step < SHARE_BITS):     # for every bit of the share, from the top one on
            m.d.sync += [factor.eq(factor << 1), step.eq(step + 1),
                         product.eq((product << 1) + Mux(factor[-1], way, 0))]
        with m.Elif(step == SHARE_BITS):
            m.d.sync += [way.eq(way - (product >> 16)), step.eq(step + 1)]
        with m.Elif(self.tell):
            m.d.sync += way.eq(way + self.told)
        return m
