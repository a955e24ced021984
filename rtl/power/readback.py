# SPDX-License-Identifier: Apache-2.0
"""Read-back of the gates: whether the gap is dead while both sources are off."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.debounce import Debounce

__all__ = ["ReadBack"]


class ReadBack(wiring.Component):
    """What the gap has while neither source is on: after a pulse it must die away.

    The gap shows life in a clock with a gate on, with current, or with a voltage above the short
    level. ``live`` is high in the clock after that, and falls after ``dead`` clocks in a row
    without; it is low out of reset. Gates count, as the comparators lag them. No pulse may begin
    while ``live`` is high: a gap whose voltage falls slowly then has a longer pause, and one whose
    voltage does not fall gives itself away.

    ``stuck`` is high in the clock after ``limit`` clocks in a row with ``live`` high and both gates
    off: a gate, or its transistor, does not let go, or a comparator's wire is broken. It is so
    whatever else holds the outputs safe.

    The short level comes from a filtered stream. So the voltage does not count in the ``settle``
    clocks after reset, nor in as many after a clock whose ``level`` is another than in the clock
    before (0 before reset). Current always does.

    Bounds: a gap that dies away exponentially from V is dead in time if its time constant is below
    ``limit`` / ln(V / short level): 155 us from 300 V, 260 us from 80 V. Not seen: a gate of the
    sensing source that is stuck while the gap is short, if its current is below the threshold; once
    the gap opens its voltage is seen.

    Proof: ``testbench/formal/test_power.py``.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    dead_ns, limit_us, settle_us : int
        Times, rounded up to clocks, at least 1. ``limit_us`` is half of what a stuck gate may last,
        ``settle_us`` ten time constants of the filter.

    Members
    -------
    on, sense : In(1)
        Gates of the main and of the sensing source, as the pulse generator makes them.
    current : In(1)
        Gap current above its threshold.
    short : In(1)
        Gap voltage below the short level.
    level : In(10)
        The short level in force.
    live : Out(1)
        The gap shows life, or did just now.
    stuck : Out(1)
        It does so although both sources are off.

    Raises
    ------
    ValueError
        If a time is below 0.
    """

    def __init__(self, *, clock_hz, dead_ns=1000, limit_us=500, settle_us=2000):
        if min(dead_ns, limit_us, settle_us) < 0:
            raise ValueError("times of the read-back must not be below 0, but are "
                             f"{dead_ns!r}, {limit_us!r} and {settle_us!r}")
        self.dead = max(1, -(-clock_hz * dead_ns // 10**9))
        self.limit = max(1, -(-clock_hz * limit_us // 10**6))
        self.settle = max(1, -(-clock_hz * settle_us // 10**6))
        super().__init__({
            "on": In(1), "sense": In(1), "current": In(1), "short": In(1), "level": In(10),
            "live": Out(1), "stuck": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        before = Signal(10)
        known = Signal(range(self.settle + 1))  # clocks of this level
        trusted = Signal()
        m.d.sync += before.eq(self.level)
        m.d.comb += trusted.eq(known == self.settle)
        with m.If(self.level != before):
            m.d.sync += known.eq(0)
        with m.Elif(~trusted):
            m.d.sync += known.eq(known + 1)

        gate = Signal()
        m.submodules.life = life = Debounce(rise=1, fall=self.dead)
        m.d.comb += [
            gate.eq(self.on | self.sense),
            life.raw.eq(gate | self.current | (trusted & ~self.short)),
            self.live.eq(life.steady),
        ]

        silent = Signal(range(self.limit + 1))  # clocks live with both gates off
        m.d.comb += self.stuck.eq(silent == self.limit)
        with m.If(gate | ~self.live):
            m.d.sync += silent.eq(0)
        with m.Elif(~self.stuck):
            m.d.sync += silent.eq(silent + 1)

        return m
