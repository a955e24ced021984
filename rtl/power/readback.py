# SPDX-License-Identifier: Apache-2.0
"""Read-back of the gates: whether the gap dies away while both sources are off."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.debounce import Debounce

__all__ = ["ReadBack"]


class ReadBack(wiring.Component):
    """Checks that current and voltage of the gap die away while neither source is on.

    A clock is live if a gate is on, current flows, or the voltage is above the short level. In the
    clock after a live one ``live`` is high; it falls after ``dead`` clocks in a row that are not
    live. It is low out of reset. A gate alone makes a clock live because the comparators lag the
    gates. No pulse may begin while ``live`` is high. So a voltage that falls slowly prolongs the
    pause, and one that does not fall is found.

    ``stuck`` is high in the clock after ``limit`` clocks in a row with ``live`` high and both gates
    off: a gate, or its transistor, does not switch off, or a comparator's wire is broken. ``safe``
    outputs do not hide it.

    The short level comes from a filtered stream. So the voltage does not count in the ``settle``
    clocks after reset, nor in as many after a change of ``level`` (0 before reset). Current always
    counts.

    Bounds: a gap that dies away exponentially from V is dead in time if its time constant is below
    ``limit`` / ln(V / short level): 155 us from 300 V, 260 us from 80 V. Not detected: a stuck gate
    of the sensing source while the gap is short, if its current is below the threshold. Once the
    gap opens, its voltage shows it.

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
        The gap has current or voltage, or had just now.
    stuck : Out(1)
        It still has although both sources are off.

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
        known = Signal(range(self.settle + 1))  # clocks since the level changed
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
