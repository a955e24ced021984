# SPDX-License-Identifier: Apache-2.0
"""Watchdog: firmware must call it in two steps, neither too late nor too soon."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["FIRST_KEY", "LONGEST_US", "SECOND_KEY", "THIRD_KEY", "Watchdog"]

FIRST_KEY = 0xA5   # written where the main loop starts
SECOND_KEY = 0x5A  # written where it ends
THIRD_KEY = 0xC3   # written by the handler of the interrupt that asks for it
LONGEST_US = 5000  # longest time for which a gap may burn unwatched


class Watchdog(wiring.Component):
    """Says when the firmware has stopped calling, calls too soon, or takes no interrupts.

    A complete call is the first key and then the second; of the keys, only the third may come
    between. A second key without the first does nothing, so a stray write or an interrupt alone
    cannot keep the watchdog quiet. A complete call in clock ``k`` makes the main loop *in time*
    from clock ``k + 1`` to before clock ``k + period``. A second complete call before clock ``k +
    earliest``, while the main loop is in time, is too soon: it is out of time from the next clock
    on. The main loop is out of time after reset, too; the next complete call always ends this.

    The interrupt: ``asked`` is high until the third key is written, and again from ``ask`` clocks
    after it. The interrupts are in time from the clock after a third key that was asked for until
    ``period`` clocks after it. They are out of time after reset. A third key that was not asked
    for does nothing.

    ``expired`` is high while either is out of time. It is not latched here: calls end it
    (``rtl.safety.interlock`` latches). ``silent`` is high when ``expired`` has lasted for
    ``period`` clocks, but never before it has been low once: a starting processor has no deadline.

    While the main loop is out of time, the second key must come less than ``period`` clocks after
    the first; later, the first key is forgotten.

    Proof: ``testbench/formal/test_watchdog.py``.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    period_us : int
        Longest time between complete calls, at most 5000 us and at least 4 clocks. ``period`` is
        the same in clocks, rounded down; ``earliest`` a quarter of it, and ``ask`` half, rounded
        down. Firmware's longest step, or part of one between two calls, must fit into the
        three quarters between.

    Members
    -------
    pet : In(1)
        A key is written.
    key : In(8)
        The key. Read while ``pet`` is high.
    expired : Out(1)
        Nobody has called in time.
    late : Out(1)
        The main loop is out of time.
    silent : Out(1)
        Expired for so long that firmware has surely stopped.
    asked : Out(1)
        The interrupt: the third key is asked for.
    open : Out(1)
        A complete call is not too soon.
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
        if period < 4:
            raise ValueError(f"watchdog period must be at least 4 clocks, not {period!r}")
        self.period = period
        self.earliest = period // 4
        self.ask = period // 2
        super().__init__({
            "pet": In(1), "key": In(8), "expired": Out(1), "late": Out(1, init=1), "silent": Out(1),
            "asked": Out(1), "open": Out(1), "limit": Out(32),
        })

    def elaborate(self, platform):
        m = Module()

        # Clocks since the last complete call or, while the main loop is late, since the first key.
        # It runs whenever something is awaited, so no disturbance can make it stop for ever.
        age = Signal(range(self.period))
        late = self.late
        begun = Signal()  # the first key was written last
        first = Signal()
        complete = Signal()
        third = self.pet & (self.key == THIRD_KEY)
        m.d.comb += [
            self.limit.eq(self.period),
            first.eq(self.pet & (self.key == FIRST_KEY)),
            complete.eq(self.pet & (self.key == SECOND_KEY) & begun),
            self.open.eq(late | (age >= self.earliest)),
        ]

        with m.If(self.pet & ~third):
            m.d.sync += begun.eq(first)
        with m.If(complete & self.open):
            m.d.sync += [late.eq(0), age.eq(1)]
        with m.Elif(late & first):
            m.d.sync += age.eq(1)
        with m.Elif(complete | (age >= self.period - 1)):
            m.d.sync += [late.eq(1), begun.eq(0), age.eq(0)]
        with m.Elif(begun | ~late):
            m.d.sync += age.eq(age + 1)

        unanswered = Signal(range(self.period + 1), init=self.period)  # clocks since the third key
        mute = unanswered >= self.period
        m.d.comb += self.asked.eq(unanswered >= self.ask)
        with m.If(third & self.asked):
            m.d.sync += unanswered.eq(1)
        with m.Elif(~mute):
            m.d.sync += unanswered.eq(unanswered + 1)

        # Clocks until ``silent``; they count only once ``expired`` has been low.
        left = Signal(range(self.period + 1))
        counts = Signal()
        m.d.comb += [self.expired.eq(late | mute), self.silent.eq(counts & (left == 0))]
        with m.If(~self.expired):
            m.d.sync += [left.eq(self.period), counts.eq(1)]
        with m.Elif(left != 0):
            m.d.sync += left.eq(left - 1)

        return m
