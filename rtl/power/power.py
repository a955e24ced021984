# SPDX-License-Identifier: Apache-2.0
"""The gates of both sources: limits, pulse generator and read-back, joined."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.power.limiter import Limiter
from rtl.power.pulse_generator import PulseGenerator
from rtl.power.readback import ReadBack

__all__ = ["Power"]

# Members that are those of the pulse generator, or pass the limiter before it.
TIMES = {"on_time": 20, "wait_time": 20, "off_time": 20, "off_extra": 20, "sense_on": 16,
         "sense_off": 16, "level": 6}
SIGNS = ("cut", "abnormal", "ignited", "current", "short")


class Power(wiring.Component):
    """Decides which source is on and when, within limits that no register can exceed.

    With ``machining`` there are main pulses or, while ``sensing`` is high, sensing pulses instead.
    Without it the discharge is off: there are sensing pulses while ``look`` is high, else none.

    No pulse begins in the clock after one with ``latched`` low. While ``settled`` is low there are
    no main pulses, but sensing pulses instead, as they would be with ``sensing``: so the guards
    against a short stay awake until the comparators have their levels.

    With ``safe`` or ``quiet`` there is no pulse at all. Each of these takes the gates low in the
    same clock. So does every change of ``machining``, for at least that clock; then an off-time
    passes.

    ``forget`` says that the classes of the last pulses are out of date: the discharge is off and
    there is no look, or ``machining`` has changed in this clock.

    No pulse exceeds the limits, and none begins before the gap has died away since the last one
    (``rtl.power.readback``). If the gap keeps current, or a voltage above the short level,
    ``stuck`` rises at most ``limit`` + 1 clocks after the pulse under way, or after the one that
    begins in the next clock.

    Proof: ``testbench/formal/test_power.py``.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    level_max, on_max, off_min : int
        See ``rtl.power.limiter``.
    **times
        Times of the ``rtl.power.readback`` that differ from the default.

    Members
    -------
    machining : In(1)
        The discharge is wanted.
    sensing : In(1)
        The discharge is reduced to sensing pulses.
    look : In(1)
        Sensing pulses are wanted while the discharge is off.
    latched, settled : In(1)
        The power supply, and the comparators, follow the condition in force
        (``rtl.power.settling``).
    safe, quiet : In(1)
        No pulses at all: outputs are safe, or the machine has halted.
    level, on_time, wait_time, off_time, off_extra, sense_on, sense_off : In
        See ``rtl.power.pulse_generator``.
    cut, abnormal, ignited : In(1)
        See ``rtl.power.pulse_generator``.
    current, short : In(1)
        Comparators of the gap.
    reference : In(10)
        The short level in force.
    on, sense : Out(1)
        Gates of the sources.
    level_out : Out(6), between : Out(1)
        See ``rtl.power.pulse_generator``.
    forget : Out(1)
        Samples of pulses before this clock no longer count.
    stuck : Out(1)
        The gap stays live with both gates off.
    limit_level : Out(6), limit_off : Out(20)
        The limits.

    Raises
    ------
    ValueError
        If a limit or a time is out of its range.
    """

    def __init__(self, *, clock_hz, level_max, on_max, off_min, **times):
        self.limiter = Limiter(level_max=level_max, on_max=on_max, off_min=off_min)
        self.readback = ReadBack(clock_hz=clock_hz, **times)
        super().__init__({
            "machining": In(1), "sensing": In(1), "look": In(1), "safe": In(1), "quiet": In(1),
            "latched": In(1), "settled": In(1), **{name: In(bits) for name, bits in TIMES.items()},
            **{name: In(1) for name in SIGNS}, "reference": In(10),
            "on": Out(1), "sense": Out(1), "level_out": Out(6), "between": Out(1),
            "forget": Out(1), "stuck": Out(1), "limit_level": Out(6), "limit_off": Out(20),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.limiter = limiter = self.limiter
        m.submodules.pulses = pulses = PulseGenerator()
        m.submodules.readback = readback = self.readback

        before = Signal()   # machining, a clock ago
        changed = Signal()
        m.d.sync += before.eq(self.machining)
        m.d.comb += [
            changed.eq(self.machining != before),
            self.forget.eq(changed | ~(self.machining | self.look)),

            limiter.level.eq(self.level), limiter.on_time.eq(self.on_time),
            limiter.wait_time.eq(self.wait_time), limiter.off_time.eq(self.off_time),
            self.limit_level.eq(limiter.limit_level), self.limit_off.eq(limiter.limit_off),

            pulses.enable.eq((self.machining | self.look) & ~changed & ~self.safe & ~self.quiet),
            pulses.sensing.eq(self.sensing | ~self.machining | ~self.settled),
            pulses.level.eq(limiter.allowed_level), pulses.on_time.eq(limiter.allowed_on),
            pulses.wait_time.eq(limiter.allowed_wait),
            pulses.off_time.eq(limiter.allowed_off),
            pulses.off_extra.eq(self.off_extra), pulses.sense_on.eq(self.sense_on),
            pulses.sense_off.eq(self.sense_off), pulses.cut.eq(self.cut),
            pulses.abnormal.eq(self.abnormal), pulses.ignited.eq(self.ignited),
            pulses.live.eq(readback.live | ~self.latched),
            self.on.eq(pulses.on), self.sense.eq(pulses.sense),
            self.level_out.eq(pulses.level_out), self.between.eq(pulses.between),

            readback.on.eq(pulses.on), readback.sense.eq(pulses.sense),
            readback.current.eq(self.current), readback.short.eq(self.short),
            readback.level.eq(self.reference), self.stuck.eq(readback.stuck),
        ]
        return m
