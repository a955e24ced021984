# SPDX-License-Identifier: Apache-2.0
"""Compensation of an axis's backlash and of its screw's pitch, beside its error counter."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["BACKLASH_BITS", "PITCH_BITS", "TAKEN_BITS", "Backlash"]

BACKLASH_BITS, PITCH_BITS = 13, 13
TAKEN_BITS = 15     # of a backlash and a pitch together, with sign


class Backlash(wiring.Component):
    """Lets the drive stand further down than the axis, by what backlash and screw ask for.

    ``taken_up`` is how far the drive is further down. Its goal is ``pitch``, by which the screw
    takes the axis too far up at its place, and ``size`` more after a command pulse down. It goes to
    the goal by one pulse a ``tick``. For each pulse that it grows the axis's error counter gets a
    feedback pulse up, and for each that it shrinks one down. The drive then makes up for this pulse
    as for any other. So for the sum of the pulses ``moved`` of the drive and that of the feedback
    pulses ``fp`` that the error counter gets

        sum of moved = sum of fp - taken_up

    in every clock, and the sum of ``fp`` is the place of the axis, on either side of the backlash
    and at every error of the screw. At the goal ``taken_up`` depends on the direction and on
    ``pitch`` alone: a way and its way back lead the drive to the same pulse. A pulse of ``moved``
    is passed on in its clock; one of the compensation waits for a clock without. If the goal
    changes meanwhile it is made all the same, and taken back at the next tick.

    After ``clear`` the drive counts as having come up, along a true screw: ``taken_up`` is 0, and
    no pulse is made before the next tick. A pulse of the compensation in that clock still reaches
    the error counter.

    A bit of its state that turns over would move the drive by up to the whole range of ``size``,
    and the sum would not show it. So the state has a parity.

    Proof: ``testbench/formal/test_backlash.py``.

    Members
    -------
    size : In(13)
        The backlash, in pulses. It changes with ``clear`` only.
    pitch : In(signed(13))
        How far the screw takes the axis too far up, in pulses. It may change in any clock.
    tick : In(1)
        One pulse may be made.
    pi, pi_reverse : In(1)
        Command pulse, and its direction: down.
    moved, moved_reverse : In(1)
        Pulse of the drive, from its coder or as a step, and its direction.
    safe : In(1)
        No pulse of the compensation from the next clock on.
    clear : In(1)
        Begin anew.
    fp, fp_reverse : Out(1)
        Feedback pulse for the error counter.
    done : Out(1)
        ``taken_up`` is where it is to be.
    taken_up : Out(signed(15))
        The drive is so far further down, in pulses.
    damaged : Out(1)
        The parity of the state was wrong in the clock before; it stays wrong until ``clear``.
    """

    size: In(BACKLASH_BITS)
    pitch: In(signed(PITCH_BITS))
    tick: In(1)
    pi: In(1)
    pi_reverse: In(1)
    moved: In(1)
    moved_reverse: In(1)
    safe: In(1)
    clear: In(1)
    fp: Out(1)
    fp_reverse: Out(1)
    done: Out(1)
    taken_up: Out(signed(TAKEN_BITS))
    damaged: Out(1)

    def __init__(self):
        # For proofs: a pulse is to be made, in the next clock without one of the drive; it makes
        # ``taken_up`` greater; the direction of the last command pulse; and the parity, which makes
        # the number of ones odd.
        self.due = Signal()
        self.grow = Signal()
        self.down = Signal()
        self.parity = Signal(init=1)
        super().__init__()

    def elaborate(self, platform):
        m = Module()

        due, grow, down, taken_up = self.due, self.grow, self.down, self.taken_up
        state = Cat(taken_up, down, grow, due)
        due_next, grow_next, down_next = Signal(), Signal(), Signal()
        taken_up_next = Signal(TAKEN_BITS)
        state_next = Cat(taken_up_next, down_next, grow_next, due_next)
        to_go = Signal(signed(TAKEN_BITS + 1))
        m.d.comb += [
            to_go.eq(Mux(down, self.size, 0) + (self.pitch - taken_up)),
            self.done.eq(to_go == 0),
            self.fp.eq(self.moved | due),
            self.fp_reverse.eq(Mux(self.moved, self.moved_reverse, ~grow)),
            state_next.eq(state),
        ]
        m.d.sync += [
            state.eq(state_next),
            # Not made anew from the state: what is damaged stays so.
            self.parity.eq(self.parity ^ state.xor() ^ state_next.xor()),
            self.damaged.eq(~(state.xor() ^ self.parity)),
        ]
        with m.If(due & ~self.moved):
            m.d.comb += [due_next.eq(0), taken_up_next.eq(taken_up + Cat(
                1, (~grow).replicate(TAKEN_BITS - 1)).as_signed())]  # +-1
        with m.Elif(self.tick & ~self.done):
            m.d.comb += [due_next.eq(1), grow_next.eq(~to_go[-1])]
        with m.If(self.safe):
            m.d.comb += due_next.eq(0)
        with m.If(self.pi):
            m.d.comb += down_next.eq(self.pi_reverse)
        with m.If(self.clear):
            m.d.comb += state_next.eq(0)
            m.d.sync += self.parity.eq(1)

        return m
