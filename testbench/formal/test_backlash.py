# SPDX-License-Identifier: Apache-2.0
"""Proof on ``rtl.motion.backlash``: drive and axis part by backlash and pitch, and by nothing else.

While no bit turns over by itself, it never calls itself damaged.
"""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.motion.backlash import Backlash
from testbench.formal.prover import prove

SUM = 20    # bits of the sums, which wrap
LOWEST, HIGHEST = -4096, 8191 + 4095    # goals
INPUTS = ("size", "pitch", "tick", "pi", "pi_reverse", "moved", "moved_reverse", "safe", "clear")


class BacklashContract(wiring.Component):
    """Sum of ``moved`` = sum of ``fp`` - ``taken_up``, from ``clear`` to ``clear``."""

    size: In(13)
    pitch: In(signed(13))
    tick: In(1)
    pi: In(1)
    pi_reverse: In(1)
    moved: In(1)
    moved_reverse: In(1)
    safe: In(1)
    clear: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = Backlash()
        for name in INPUTS:
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        m.d.comb += Assume(~ResetSignal("sync"))

        # The size changes only with ``clear``, also from the reset on.
        size, begun = Signal(13), Signal()
        m.d.sync += [size.eq(self.size), begun.eq(1)]
        m.d.comb += Assume(self.clear | (begun & (self.size == size)))

        moved = Mux(self.moved, Mux(self.moved_reverse, -1, 1), 0)
        fp = Mux(dut.fp, Mux(dut.fp_reverse, -1, 1), 0)
        drive, axis = Signal(signed(SUM)), Signal(signed(SUM))
        was_safe = Signal()
        # The goal at the tick for which a pulse is due; the pitch may have changed since.
        goal, aim = Signal(signed(16)), Signal(signed(16))
        m.d.comb += goal.eq(Mux(dut.down, self.size, 0) + self.pitch)
        with m.If(self.tick & (self.moved | ~dut.due) & (dut.taken_up != goal)):
            m.d.sync += aim.eq(goal)
        m.d.sync += [
            drive.eq(Mux(self.clear, 0, drive + moved)), axis.eq(Mux(self.clear, 0, axis + fp)),
            was_safe.eq(self.safe),
        ]
        with m.If(begun):
            difference = Signal(signed(SUM))
            m.d.comb += [
                difference.eq(axis - drive),
                Assert(difference == dut.taken_up),
                Assert((aim >= LOWEST) & (aim <= HIGHEST)),
                Assert((dut.taken_up >= LOWEST) & (dut.taken_up <= HIGHEST)),
                # A pulse of the drive passes in its clock, and no other comes with it.
                Assert(~self.moved | (dut.fp & (dut.fp_reverse == self.moved_reverse))),
                Assert(~(was_safe & ~self.moved) | ~dut.fp),
                # What is due leads to the goal.
                Assert(~dut.due | ((dut.taken_up != aim) & (dut.grow == (aim > dut.taken_up)))),
                Assert(dut.done == (dut.taken_up == goal)),
                Assert(Cat(dut.taken_up, dut.down, dut.grow, dut.due, dut.parity).xor()),
                Assert(~dut.damaged),
            ]
        m.d.comb += [Cover(dut.taken_up == 2), Cover(dut.taken_up == -2),
                     Cover(begun & dut.due & self.moved),
                     Cover(begun & dut.down & dut.done & (dut.taken_up == 1) & (self.size == 2))]
        return m


def test_drive_and_axis_part_by_what_is_taken_up(workdir):
    prove(BacklashContract(), workdir, depth=3)


def test_the_contract_is_reachable(workdir):
    prove(BacklashContract(), workdir, depth=14, mode="cover")
