# SPDX-License-Identifier: Apache-2.0
"""Accelerator/decelerator: linear ramps of the path-pulse rate."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Ramp"]


class Ramp(wiring.Component):
    """Accelerator/decelerator, 104 of the first patent, on the rate of path pulses.

    Every pulse ``ps`` is stored and leaves as one pulse ``pp``, so at every clock the pulses in are
    the pulses out plus ``stored``. Pulses leave at least ``2**32 / rate`` clocks apart.

    ``rate`` rests at ``start_rate``; there a stored pulse leaves 2 clocks after its ``ps``, so
    that at or below the start/stop speed the block is a delay of 2 clocks. Above it ``rate``
    changes every 4 clocks by a step, a quarter of ``acceleration``: up while pulses are stored and
    ``target`` is at least a step away, down while ``brake`` is high or ``target`` is below. Within
    a step of the target pulses leave at ``target`` itself. While it slows down and nothing is
    stored, the ramp asks for pulses with ``pull``: what is in motion cannot stop without them. It
    asks as soon as the last one has left, so that the next is there when its time comes.

    ``distance`` is what slowing down from ``rate`` to ``start_rate`` takes, in whole pulses,
    rounded down, plus at most one step of the ramp. It is the sum of the steps taken upwards, so
    that the way down is as long as the way up, to the pulse.

    What is decided in a clock, from what is stored and asked for in it, acts from the next one on;
    ``rate`` changes at the end of every fourth clock, counted from reset: so slowing down begins 2
    to 5 clocks after the first of ``brake``. If nothing is stored any more and none can come
    (``room``), ``rate`` falls back to ``start_rate`` at once.

    ``start_rate`` and ``acceleration`` may change only at rest.

    Members
    -------
    start_rate : In(30)
        Start/stop speed, 2**-32 pulse/clock; 1 to 2**30 - 1.
    acceleration : In(30)
        Slope of the ramp, 2**-32 pulse/clock per 16 clocks; at least 1.
    target : In(30)
        Commanded rate, 2**-32 pulse/clock.
    brake : In(1)
        Slow down to ``start_rate``.
    ps : In(1)
        A path pulse comes in.
    room : In(1)
        Pulses asked for can come.
    drop : In(1)
        Forget what is stored and be at rest: outputs are safe and nothing moves.
    pp : Out(1)
        A path pulse goes out, high for one clock.
    pull : Out(1)
        A pulse is needed now.
    stored : Out(24)
        Pulses in, less pulses out.
    rate : Out(32)
        Speed of the ramp, 2**-32 pulse/clock, rounded down.
    distance : Out(24)
        Braking distance, pulses.
    steady : Out(1)
        Pulses leave as they come, or at ``target``: it is within a step, or below ``start_rate``.
        One clock old.
    rest : Out(1)
        Nothing stored, nothing coming in or going out, and at ``start_rate``.
    """

    STEPS = 4      # in the 16 clocks of ``acceleration``
    FRACTION = 20  # bits of ``distance`` below the pulse

    start_rate: In(30)
    acceleration: In(30)
    target: In(30)
    brake: In(1)
    ps: In(1)
    room: In(1)
    drop: In(1)
    pp: Out(1)
    pull: Out(1)
    stored: Out(24)
    rate: Out(32)
    distance: Out(24)
    steady: Out(1)
    rest: Out(1)

    def elaborate(self, platform):
        m = Module()

        # In quarters of the unit of rates, in which a step is ``acceleration``.
        above = Signal(34)  # rate less start_rate: 0 at rest, whatever start_rate is set to
        quarters = Signal(34)
        lead = Signal(signed(36))
        m.d.comb += [
            quarters.eq(above + (self.start_rate << 2)),
            self.rate.eq(quarters >> 2),
            lead.eq((self.target << 2) - quarters),
        ]
        ramping = Signal()
        m.d.comb += ramping.eq(above != 0)

        slowing = Signal()
        rising = Signal()
        m.d.sync += [
            slowing.eq(ramping & (self.brake | (lead < 0))),
            rising.eq(~self.brake & (lead >= self.acceleration) & (self.stored != 0)),
            self.steady.eq((lead < self.acceleration) & ~(ramping & (self.brake | (lead < 0)))),
        ]

        # A step of the ramp covers quarters / 2**32 pulses: a quarter of the unit, but 4 clocks.
        shift = 32 - self.FRACTION
        braking = Signal(24 + self.FRACTION)
        m.d.comb += self.distance.eq(braking >> self.FRACTION)
        up = Signal(34)
        m.d.comb += up.eq(quarters + self.acceleration)
        clocks = Signal(range(16 // self.STEPS))
        m.d.sync += clocks.eq(clocks + 1)
        with m.If(clocks == 0):
            with m.If(slowing & ramping):
                m.d.sync += above.eq(above - self.acceleration)
                m.d.sync += braking.eq(braking - (quarters >> shift))
            with m.Elif(rising):
                m.d.sync += above.eq(above + self.acceleration)
                m.d.sync += braking.eq(braking + (up >> shift))

        # Room for one pulse builds up at the speed of the ramp and waits, full, for the pulse.
        room = Signal(33)
        full = room[32]
        leave = Signal()
        m.d.comb += leave.eq(full & (self.stored != 0))
        speed = Signal(32)
        m.d.comb += speed.eq(Mux(~slowing & (lead >= 0) & (lead < self.acceleration),
                                 self.target, self.rate))
        with m.If(leave | ~full):
            m.d.sync += room.eq(room[:32] + speed)
        m.d.sync += self.pp.eq(leave)
        m.d.sync += self.stored.eq(self.stored + self.ps - leave)
        m.d.comb += self.pull.eq(slowing & ramping & (self.stored == 0) & ~self.ps)
        m.d.comb += self.rest.eq(~ramping & (self.stored == 0) & ~self.ps & ~self.pp)

        # At the bound nothing moves any more, so there is no speed left to bring down.
        with m.If(slowing & (self.stored == 0) & ~self.ps & ~self.room):
            m.d.sync += [above.eq(0), braking.eq(0)]
        with m.If(self.drop):
            m.d.sync += [above.eq(0), braking.eq(0), self.stored.eq(0), self.pp.eq(0),
                         slowing.eq(0), rising.eq(0)]

        return m
