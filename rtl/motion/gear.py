# SPDX-License-Identifier: Apache-2.0
"""Electronic gear of a step/direction output: n steps for m pulses of an axis."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.step_dir import StepDir

__all__ = ["GEAR_BITS", "Gear"]

GEAR_BITS = 16


class Gear(wiring.Component):
    """Takes the pulses that a signed counter outside holds, and sends the steps that they make.

    With ``n = steps``, ``m = steps + surplus`` and P the sum of all pulses taken since ``clear``,
    the sum S of the steps sent since then is

        S = floor((P n + floor(m / 2)) / m)

    in every clock: P n/m rounded to the nearest, half a step upwards. So S depends on P alone. A
    way and its way back give the same steps, and no error adds up.

    ``pending`` and ``negative`` say whether the counter holds pulses and which way. Each ``fp``
    must bring it one nearer to zero in the next clock. A pulse that makes a step is taken with the
    first clock of that step; any other one, a clock after it is seen. So a pulse is taken in at
    most every second clock, and pulses without a step also in the times of a step before. With
    n = m every pulse is a step. Times, and ``safe``, are those of ``StepDir``; while ``safe`` no
    pulse is taken.

    ``clear`` begins to count anew, with the ``steps`` and ``surplus`` of that clock; they change
    only then. No pulse is taken in that clock.

    Proof: ``testbench/formal/test_gear.py``.

    Members
    -------
    pending : In(1)
        There are pulses to take.
    negative : In(1)
        They go down. Read while ``pending`` is high.
    steps : In(16)
        n, at least 1.
    surplus : In(16)
        m - n, so that n is at most m. The sum m is at most 2**16.
    clear : In(1)
        Begin to count.
    width, space, setup : In(8)
        Times of a step, in clocks; see ``StepDir``.
    safe : In(1)
        No steps.
    step, dir : Out(1)
        To the drive; ``dir`` is high for down.
    fp : Out(1)
        A pulse is taken, for one clock.
    fp_reverse : Out(1)
        It goes down.
    """

    pending: In(1)
    negative: In(1)
    steps: In(GEAR_BITS, init=1)
    surplus: In(GEAR_BITS)
    clear: In(1)
    width: In(8)
    space: In(8)
    setup: In(8)
    safe: In(1)
    step: Out(1)
    dir: Out(1)
    fp: Out(1)
    fp_reverse: Out(1)

    def __init__(self):
        # For proofs: P n + floor(m/2) - S m, from 0 to m - 1. Reset belongs to n = m = 1.
        self.phase = Signal(GEAR_BITS)
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        m.submodules.step_dir = step_dir = StepDir()

        phase = self.phase
        # The two ways to go on by a pulse: by n less m one way, by n the other. Of either pair one
        # result leaves the range; the borrow tells which.
        low, high = Signal(GEAR_BITS + 1), Signal(GEAR_BITS)
        borrow, makes, waits = Signal(), Signal(), Signal()
        silent = Signal()       # a pulse without a step is taken
        down = Signal()
        m.d.comb += [
            low.eq(phase - Mux(self.negative, self.steps, self.surplus)),
            high.eq(phase + Mux(self.negative, self.surplus, self.steps)),
            borrow.eq(low[-1]),
            makes.eq(borrow == self.negative),
            # In the clock of a pulse the counter does not know of it yet.
            waits.eq(self.pending & ~self.fp & ~self.clear),

            step_dir.pending.eq(waits & makes),
            step_dir.negative.eq(self.negative),
            step_dir.width.eq(self.width),
            step_dir.space.eq(self.space),
            step_dir.setup.eq(self.setup),
            step_dir.safe.eq(self.safe),
            self.step.eq(step_dir.step),
            self.dir.eq(step_dir.dir),
            self.fp.eq(silent | step_dir.taken),
            self.fp_reverse.eq(down),
        ]
        take = Signal()
        m.d.comb += take.eq(waits & ~makes & ~self.safe)
        m.d.sync += silent.eq(take)
        with m.If(take | step_dir.takes):
            m.d.sync += [phase.eq(Mux(borrow, high, low)), down.eq(self.negative)]
        with m.If(self.clear):
            m.d.sync += phase.eq((self.steps + self.surplus) >> 1)

        return m
