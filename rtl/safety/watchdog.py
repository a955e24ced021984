# SPDX-License-Identifier: Apache-2.0
"""Watchdog that the firmware must call, in two stages."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["FIRST_KEY", "SECOND_KEY", "Watchdog"]

FIRST_KEY = 0xA5   # written where the main loop starts
SECOND_KEY = 0x5A  # written where it ends
LONGEST_US = 5000  # a gap that nobody watches burns for no longer


class Watchdog(wiring.Component):
    """Says when the firmware has stopped calling.

    A complete call is the first key and then the second, with no other key written in between; a
    second key without the first counts for nothing, so a stray writer or an interrupt alone cannot
    keep the watchdog quiet. ``expired`` is high from reset until the first complete call. After a
    complete call in clock ``k`` it is low from clock ``k + 1``, and high again from clock
    ``k + period`` unless another call is completed before that clock. It is not latched here: a
    complete call ends it (``rtl.safety.interlock`` latches).

    While it is expired, the second key must come less than ``period`` clocks after the first. A
    first key written before it expires is forgotten when it does.

    Proof: ``testbench/formal/test_watchdog.py``.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    period_us : int
        Longest time between complete calls, at most 5000 us and at least 2 clocks. ``period`` is
        the same in clocks, rounded down.

    Members
    -------
    pet : In(1)
        A key is written.
    key : In(8)
        The key. Read while ``pet`` is high.
    expired : Out(1)
        Nobody has called in time.
    limit : Out(32)
        ``period``, for software to read.

    Raises
    ------
    ValueError
        If the period is too long or too short.
    """

    def __init__(self, *, clock_hz, period_us=LONGEST_US):
        period = clock_hz * period_us // 1_000_000
        if period_us > LONGEST_US:
            raise ValueError(f"watchdog period must be at most {LONGEST_US} us, not {period_us!r}")
        if period < 2:
            raise ValueError(f"watchdog period must be at least 2 clocks, not {period!r}")
        self.clock_hz = clock_hz
        self.period_us = period_us
        self.period = period
        super().__init__({
            "pet": In(1), "key": In(8), "expired": Out(1, init=1), "limit": Out(32),
        })

    def elaborate(self, platform):
        m = Module()

        # Clocks since the last complete call, or while expired since the first key. It runs while
        # anything is waited for, so no disturbance can put it where it would never end.
        age = Signal(range(self.period))
        begun = Signal()  # the first key was written last
        first = Signal()
        complete = Signal()
        m.d.comb += [
            self.limit.eq(self.period),
            first.eq(self.pet & (self.key == FIRST_KEY)),
            complete.eq(self.pet & (self.key == SECOND_KEY) & begun),
        ]

        with m.If(self.pet):
            m.d.sync += begun.eq(first)
        with m.If(complete):
            m.d.sync += [self.expired.eq(0), age.eq(1)]
        with m.Elif(self.expired & first):
            m.d.sync += age.eq(1)
        with m.Elif(age >= self.period - 1):
            m.d.sync += [self.expired.eq(1), begun.eq(0), age.eq(0)]
        with m.Elif(begun | ~self.expired):
            m.d.sync += age.eq(age + 1)

        return m
