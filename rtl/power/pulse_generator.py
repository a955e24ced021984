# SPDX-License-Identifier: Apache-2.0
"""Discharge pulse generator: main pulses for machining, sensing pulses for retraction."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["PulseGenerator"]


class PulseGenerator(wiring.Component):
    """Gates of the two sources of the power supply, by programmed on- and off-times.

    There are two modes, main and sensing. A sensing pulse lasts exactly its on-time. So does a main
    pulse with ``wait_time`` 0. With another ``wait_time`` the on-time of a main pulse counts from
    its ignition: from the first clock of the pulse with ``ignited`` high it goes on for exactly the
    on-time, that clock included. Without any such clock it ends after the wait. So it is never
    longer than ``wait_time + on_time - 1``, whatever ``ignited`` does. The pause
    after it is never shorter than the off-time of its mode, and exactly as long while ``enable`` is
    high and ``live`` low. ``sensing`` in the clock before a pulse decides its mode, so the gates
    are never both high and change only over an off-time.

    No pulse begins in the clock after one with ``live`` high, as the gap has not died away since
    the last pulse; the off-time is prolonged.

    A main pulse ends early one clock after ``cut`` and ``abnormal`` were both high, and one clock
    after ``sensing`` rose: so the discharge is reduced at once, not at the end of a long pulse. A
    sensing pulse is never cut. If ``abnormal`` was high in the last clock of a main pulse, cut or
    not, the off-time after it is longer by ``off_extra``.

    ``enable`` low takes both gates low in the same clock (it passes one gate, no register) and
    begins an off-time anew: the first pulse comes one off-time after ``enable`` rose. The first
    pulse after reset comes after an off-time, too.

    A time of 0 counts as 1, but for ``wait_time``. A time is read in the clock before it begins.
    ``level`` and the times of a main pulse are held for the whole pulse: they are read in the clock
    before it.

    Members
    -------
    enable : In(1)
        Pulses are allowed and wanted.
    sensing : In(1)
        Sensing pulses are wanted, not main pulses.
    on_time, off_time : In(20)
        Main pulses, in clocks.
    wait_time : In(20)
        Longest wait of a main pulse for its ignition, in clocks; 0: the on-time counts from the
        gate.
    ignited : In(1)
        The main pulse burns now. It has no effect on a sensing pulse or without ``wait_time``.
    off_extra : In(20)
        More off-time after an abnormal main pulse, in clocks. Read in the clock before it begins.
    sense_on, sense_off : In(16)
        Sensing pulses, in clocks.
    level : In(6)
        Current of main pulses, in steps of the power supply.
    live : In(1)
        The gap still has voltage or current.
    cut : In(1)
        Abnormal main pulses are cut off.
    abnormal : In(1)
        The pulse is shorted or an arc now.
    on : Out(1)
        Gate of the main source.
    sense : Out(1)
        Gate of the current-limited sensing source.
    level_out : Out(6)
        Current of the main source; 0 while ``on`` is low.
    between : Out(1)
        No pulse is under way, and none begins in the next clock. Inputs that change from this
        clock to the next do not mix in one pulse. Every off-time of 2 clocks or more has such a
        clock.
    """

    enable: In(1)
    sensing: In(1)
    on_time: In(20)
    off_time: In(20)
    wait_time: In(20)
    ignited: In(1)
    off_extra: In(20)
    sense_on: In(16)
    sense_off: In(16)
    level: In(6)
    live: In(1)
    cut: In(1)
    abnormal: In(1)
    on: Out(1)
    sense: Out(1)
    level_out: Out(6)
    between: Out(1)

    def elaborate(self, platform):
        m = Module()

        ready = Signal()       # low in the first clock after reset only, to begin an off-time
        pulse = Signal()       # the on-time is running, else the off-time
        probe = Signal()       # the last pulse was a sensing pulse
        level = Signal(6)
        remaining = Signal(21)  # clocks left of the present time, this one included; 0 counts as 1
        waiting = Signal()     # the main pulse has not ignited before this clock
        burning = Signal(20)   # the on-time that will then begin
        left = Signal(21)      # as remaining, once it is known whether the pulse ignites now
        lights = Signal()
        m.d.comb += [
            self.on.eq(self.enable & pulse & ~probe),
            self.sense.eq(self.enable & pulse & probe),
            self.level_out.eq(Mux(self.on, level, 0)),
        ]

        off = Signal(21)
        ends = Signal()
        # Both sums are there before ``enable``, which is late: only the choice waits for it.
        plain = Mux(probe, self.sense_off, self.off_time)
        m.d.comb += off.eq(Mux(self.on & self.abnormal, plain + self.off_extra, plain))
        m.d.comb += [
            lights.eq(pulse & waiting & self.ignited),
            left.eq(Mux(lights, burning, remaining)),
        ]
        m.d.comb += ends.eq((left <= 1)
                            | (~probe & ((self.cut & self.abnormal) | self.sensing)))

        m.d.comb += self.between.eq(~pulse & (~self.enable | ~ready | (remaining > 1) | self.live))

        # Read in every clock of an off-time: so they do not wait for ``enable``, which is late.
        with m.If(~pulse):
            m.d.sync += [level.eq(self.level), burning.eq(self.on_time)]

        m.d.sync += ready.eq(1)
        with m.If(~self.enable | ~ready | (pulse & ends)):
            m.d.sync += [pulse.eq(0), waiting.eq(0), remaining.eq(off)]
        with m.Elif(left > 1):
            m.d.sync += [remaining.eq(left - 1), waiting.eq(waiting & ~lights)]
        with m.Elif(~self.live):
            m.d.sync += [
                pulse.eq(1),
                probe.eq(self.sensing),
                waiting.eq(~self.sensing & (self.wait_time != 0)),
                remaining.eq(Mux(self.sensing, self.sense_on,
                                 Mux(self.wait_time != 0, self.wait_time, self.on_time))),
            ]

        return m
