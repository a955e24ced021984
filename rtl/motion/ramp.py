# SPDX-License-Identifier: Apache-2.0
"""Accelerator/decelerator: linear ramps of the path-pulse rate."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.arithmetic import sum_or_difference

__all__ = ["Ramp"]


class Ramp(wiring.Component):
    """Accelerator/decelerator, 104 of the first patent, on the rate of path pulses.

    Every pulse ``ps`` is stored and leaves as one pulse ``pp``, so at every clock the pulses in are
    the pulses out plus ``stored``. Pulses leave at least ``2**32 / rate`` clocks apart.

    At rest ``rate`` is ``start_rate``. At this rate a stored pulse leaves 2 clocks after its
    ``ps``, so that at or below the start/stop speed the block is a delay of 2 clocks. Above it
    ``rate`` changes every 4 clocks by a step, a quarter of ``acceleration``: up while pulses are
    stored and ``target`` is at least a step above, down while ``brake`` is high or ``target`` is
    below. Within a step of the target, pulses leave at ``target`` itself. While the ramp slows down
    and nothing is stored, it asks for pulses with ``pull``: without them a machine in motion could
    not slow down. It asks as soon as the last pulse has left, so that the next is there in time.

    While ``ready`` is low no pulse leaves; a pulse that is due waits, and leaves 1 clock after
    ``ready`` rises. The next one keeps its usual distance to it. The delay is made up only when
    pulses come further apart than they may leave. ``rate`` changes meanwhile as if no pulse waited.

    ``distance`` is the braking distance from ``rate`` to ``start_rate`` in whole pulses, rounded
    down, plus at most one step of the ramp. It is the sum of the steps taken upwards, so that the
    way down is exactly as long as the way up.

    ``rate`` changes every 4 clocks, counted from reset and anew from each fall to ``start_rate``,
    by ``brake``, ``target`` and the number of stored pulses in the clock before the change. So
    slowing down begins 2 to 5 clocks after ``brake`` rises. ``target`` is read in that clock only,
    for the 4 clocks that follow. If no pulse is stored and none can come (``room``), ``rate`` falls
    back to ``start_rate`` at once; that fall takes the place of a change. The last step down ends
    at ``start_rate``, wherever it began: so a bit of the rate that has turned over does not keep
    the ramp from coming to rest.

    ``start_rate`` and ``acceleration`` may change only at rest; they are in force 8 clocks later.

    A bit of the rate that turns over is found in any clock, in motion and at rest: the rate has a
    parity. ``damaged`` is high in the clock after the one that has the bit, and as long as it has.

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
    ready : In(1)
        The path can take a pulse in the next clock.
    drop : In(1)
        Forget the stored pulses and be at rest: outputs are safe and nothing moves.
    pp : Out(1)
        A path pulse goes out, high for one clock.
    pull : Out(1)
        A pulse is needed now.
    stored : Out(24)
        Pulses in, less pulses out.
    rate : Out(32)
        Speed of the ramp, 2**-32 pulse/clock, rounded down; below 2**30.
    speed : Out(30)
        Rate at which stored pulses leave: ``rate``, or ``target`` within a step of it.
    distance : Out(24)
        Braking distance, pulses.
    fast : Out(1)
        The rate is above ``start_rate``.
    steady : Out(1)
        Pulses leave as they come, or at ``target``: it is within a step, or below ``start_rate``.
        One clock late, and for the ``target`` that was read last.
    rest : Out(1)
        Nothing stored, nothing coming in or going out, and at ``start_rate``.
    damaged : Out(1)
        One clock ago, an odd number of bits of the rate differed from those written.

    Attributes
    ----------
    quarters : Signal(32)
        The rate in quarters of its unit, in which a step is exact: for tests to invert a bit.
    """

    STEPS = 4      # in the 16 clocks of ``acceleration``
    FRACTION = 20  # bits of ``distance`` below the pulse

    start_rate: In(30)
    acceleration: In(30)
    target: In(30)
    brake: In(1)
    ps: In(1)
    room: In(1)
    ready: In(1)
    drop: In(1)
    pp: Out(1)
    pull: Out(1)
    stored: Out(24)
    rate: Out(32)
    speed: Out(30)
    distance: Out(24)
    fast: Out(1)
    steady: Out(1)
    rest: Out(1)
    damaged: Out(1)

    def __init__(self):
        super().__init__()
        self.quarters = Signal(32)

    def elaborate(self, platform):
        m = Module()

        # The rate changes in the first of 4 clocks only. So there is time for registers behind it:
        # ``upper`` and ``lowest`` follow in the second clock, and the target is compared with the
        # rate in the fourth.
        clocks = Signal(range(16 // self.STEPS))
        m.d.sync += clocks.eq(clocks + 1)

        # The rate in quarters of its unit: so a step is ``acceleration``.
        quarters = self.quarters
        upper = Signal(33)    # a step further up
        lower = Signal(signed(34))  # ... and down
        ramping = Signal()    # above the start/stop speed
        lowest = Signal()     # the rate is at most one step above the start/stop speed
        climbed = Signal(32)  # rate less start_rate
        above = Signal(32)    # ... but 0 at rest, when start_rate may change; for waveforms
        m.d.comb += [
            self.rate.eq(quarters >> 2),
            lower.eq(quarters - self.acceleration),
            climbed.eq(quarters - (self.start_rate << 2)),
            above.eq(Mux(ramping, climbed, 0)),
            self.fast.eq(ramping),
        ]
        m.d.sync += [
            upper.eq(quarters + self.acceleration),
            lowest.eq(lower <= (self.start_rate << 2)),
        ]

        below = Signal()          # the target lies below the rate
        apart = Signal(init=1)    # ... at least a step above, or it is unknown
        aim = Signal(30)          # the target that was read last
        with m.If(clocks == 3):
            m.d.sync += [
                below.eq((self.target << 2) < quarters),
                apart.eq((self.target << 2) >= upper),
                aim.eq(self.target),
            ]

        some = Signal()           # stored != 0
        braked = Signal()         # brake, a clock ago
        waiting = Signal()        # some, a clock ago
        slowing = Signal()
        m.d.sync += [
            braked.eq(self.brake),
            waiting.eq(some),
            self.steady.eq(~apart & ~(ramping & (self.brake | below))),
        ]
        m.d.comb += slowing.eq(ramping & (braked | below))

        # A step of the ramp covers quarters / 2**32 pulses: the quarters and its 4 clocks cancel.
        shift = 32 - self.FRACTION
        braking = Signal(24 + self.FRACTION)
        m.d.comb += self.distance.eq(braking >> self.FRACTION)
        span = Signal.like(braking)
        after = Signal.like(braking)
        m.d.comb += span.eq(Mux(slowing, quarters, upper) >> shift)
        m.d.comb += after.eq(sum_or_difference(braking, span, slowing))
        # The parity is made of the next value of the rate, not of the register.
        changes = Signal()
        changed = Signal(32)
        ones = Signal()
        m.d.comb += changed.eq(self.start_rate << 2)
        with m.If(changes):
            m.d.sync += [quarters.eq(changed), ones.eq(changed.xor())]
        m.d.sync += self.damaged.eq(quarters.xor() != ones)

        with m.If(~ramping):
            m.d.comb += changes.eq(1)
        with m.If(clocks == 0):
            with m.If(slowing):
                m.d.comb += [changes.eq(1), changed.eq(lower)]
                m.d.sync += [
                    braking.eq(after),
                    ramping.eq(~lowest),
                    apart.eq(1),
                ]
            with m.Elif(apart & ~braked & waiting):
                m.d.comb += [changes.eq(1), changed.eq(upper)]
                m.d.sync += [
                    braking.eq(after),
                    ramping.eq(1),
                ]

        # The phase until the next pulse may leave grows at the ramp's speed; it waits when full.
        room = Signal(33)
        full = room[32]
        leave = Signal()
        m.d.comb += leave.eq(full & some & self.ready)
        m.d.comb += self.speed.eq(Mux(apart | below | slowing, self.rate, aim))
        with m.If(leave | ~full):
            m.d.sync += room.eq(room[:32] + self.speed)
        m.d.sync += self.pp.eq(leave)
        with m.If(self.ps != leave):
            m.d.sync += self.stored.eq(self.stored + Mux(leave, -1, 1))
        m.d.sync += some.eq(self.ps | self.stored[1:].any() | (self.stored[0] & ~leave))
        m.d.comb += self.pull.eq(slowing & ~some & ~self.ps)
        m.d.comb += self.rest.eq(~ramping & ~some & ~self.ps & ~self.pp)

        # At the bound nothing moves any more, so the rate may fall at once.
        fall = Signal()
        m.d.comb += fall.eq(self.drop | (slowing & ~some & ~self.ps & ~self.room))
        with m.If(fall):
            m.d.comb += [changes.eq(1), changed.eq(self.start_rate << 2)]
            m.d.sync += [clocks.eq(1), braking.eq(0), ramping.eq(0), apart.eq(1)]
        with m.If(self.drop):
            m.d.sync += [self.stored.eq(0), some.eq(0), self.pp.eq(0)]

        return m
