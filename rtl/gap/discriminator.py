# SPDX-License-Identifier: Apache-2.0
"""Pulse discriminator: tells what each pulse was, from the gap's comparators."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Discriminator", "PulseClass"]


class PulseClass(enum.Enum, shape=2):
    """What a pulse was."""

    OPEN = 0   # no current flowed
    OK = 1     # a good discharge
    DAME = 2   # an arc: the voltage was below the arc level
    SHORT = 3  # the voltage was below the short level


class Discriminator(wiring.Component):
    """One sample for each pulse, by simple thresholds at its end.

    A pulse is a run of clocks with ``on`` high (a main pulse), or with ``sense`` high and ``on``
    low (a sensing pulse). Its first ``blanking`` clocks are not looked at; that covers the way to
    the power supply and back as well, since the comparators lag the gates. A pulse that is not
    longer than ``blanking`` gives no sample. Any other gives one in the clock after its last clock:
    ``sample`` is high, and ``kind`` is

    * ``SHORT`` if ``short`` was high in the last clock of the pulse; else
    * ``OPEN`` for a sensing pulse, and for a main pulse without ``current`` in any clock; else
    * ``DAME`` if ``arc`` was high in the last clock; else ``OK``.

    ``shorted_now`` follows ``short`` in the same clock while a pulse is on and past its blanking.
    The counters and ``last`` follow main pulses only, one clock after the sample; counters wrap.

    Ref: the class scheme (open, normal, arc, short by voltage and current): doi
    10.1177/0954405414543488; arcs burn below 15 to 20 V, shorts below 10 to 15 V.

    Members
    -------
    on, sense : In(1)
        Gates of the main and of the sensing source, as ``rtl.power.pulse_generator`` makes them.
    arc, short : In(1)
        Gap voltage below the arc level, and below the short level.
    current : In(1)
        Gap current above its threshold.
    blanking : In(16)
        In clocks, from the first clock of the gate.
    sample : Out(1)
        A pulse was classified: high for one clock.
    kind : Out(PulseClass)
        What it was. Valid with ``sample``.
    sample_sensing : Out(1)
        It was a sensing pulse. Valid with ``sample``.
    sample_shorted : Out(1)
        ``kind`` is ``SHORT``. Valid with ``sample``.
    shorted_now : Out(1)
        The pulse is shorted in this clock.
    last : Out(PulseClass)
        Class of the last main pulse.
    open_count, ok_count, dame_count, short_count : Out(32)
        Main pulses of each class since reset.
    """

    on: In(1)
    sense: In(1)
    arc: In(1)
    short: In(1)
    current: In(1)
    blanking: In(16)
    sample: Out(1)
    kind: Out(PulseClass)
    sample_sensing: Out(1)
    sample_shorted: Out(1)
    shorted_now: Out(1)
    last: Out(PulseClass)
    open_count: Out(32)
    ok_count: Out(32)
    dame_count: Out(32)
    short_count: Out(32)

    def elaborate(self, platform):
        m = Module()

        gates = Signal(2)   # main, sensing: never both
        before = Signal(2)
        m.d.comb += gates.eq(Cat(self.on, self.sense & ~self.on))
        m.d.sync += before.eq(gates)

        age = Signal(16)      # clocks of the pulse up to the last, saturated
        elapsed = Signal(16)  # clocks of the pulse before this one
        past = Signal()       # the comparators count
        m.d.comb += [
            elapsed.eq(Mux(gates == before, age, 0)),
            past.eq((gates != 0) & (elapsed >= self.blanking)),
            self.shorted_now.eq(past & self.short),
        ]
        m.d.sync += age.eq(Mux(elapsed.all(), elapsed, elapsed + 1))

        # What the last clock said.
        valid = Signal()
        short = Signal()
        arc = Signal()
        current = Signal()  # so far in the pulse
        m.d.sync += [
            valid.eq(past),
            short.eq(self.short),
            arc.eq(self.arc),
            current.eq(past & (self.current | (current & (gates == before)))),
        ]

        main = before[0]
        m.d.comb += [
            self.sample.eq(valid & (gates != before)),
            self.sample_sensing.eq(~main),
            self.sample_shorted.eq(short),
        ]
        with m.If(short):
            m.d.comb += self.kind.eq(PulseClass.SHORT)
        with m.Elif(~main | ~current):
            m.d.comb += self.kind.eq(PulseClass.OPEN)
        with m.Elif(arc):
            m.d.comb += self.kind.eq(PulseClass.DAME)
        with m.Else():
            m.d.comb += self.kind.eq(PulseClass.OK)

        with m.If(self.sample & main):
            m.d.sync += self.last.eq(self.kind)
            with m.Switch(self.kind):
                for kind, count in ((PulseClass.OPEN, self.open_count),
                                    (PulseClass.OK, self.ok_count),
                                    (PulseClass.DAME, self.dame_count),
                                    (PulseClass.SHORT, self.short_count)):
                    with m.Case(kind):
                        m.d.sync += count.eq(count + 1)

        return m
