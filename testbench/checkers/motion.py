# SPDX-License-Identifier: Apache-2.0
"""``rtl.motion.motion`` for benches, with checks that hold in every clock."""

from amaranth import *
from amaranth.hdl import Assert
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.motion import Motion as Joined
from rtl.motion.retraction_members import DATA
from softcore.csr import interfaces
from softcore.regmap import BLOCKS

__all__ = ["Motion"]

REGISTERS = interfaces(BLOCKS)
# Members that lead to registers of a block, and those of the gap, the interlock and the operator.
OF_RETRACTION = (*DATA, "commit_strobe")
OF_PATH = {"ahead": "ahead", "behind": "behind", "back_limit": "back_limit",
           "select": "slot_select", "select_strobe": "slot_select_strobe", "data": "slot_data",
           "data_strobe": "slot_data_strobe", "load": "origin_strobe", "load_slot": "origin"}
OF_RAMP = ("start_rate", "acceleration", "back_start_rate", "back_acceleration")
OF_GAP = ("shorted", "completed", "discharging", "servo", "up", "down", "step", "wait", "contact")
OF_OTHERS = ("hold", "safe", "in_position", "cycle", "backpressure")
FAST = "fast_ahead", "fast_behind", "fast_ahead_rate", "fast_behind_rate"
FREE = {"commit_valid": "commit", "run": "control_run"}


class Motion(wiring.Component):
    """``rtl.motion.motion`` with a plain signal for each member, for benches to set.

    It asserts in every clock, for any inputs: a commanded pulse is stored, on its way or in the
    position; pulses Ps are 4 clocks apart; the direction changes at rest only; and no forward pulse
    Ps follows ``shorted``, ``wait`` or ``contact``.

    The blocks are attributes too, for benches to look at.

    Parameters
    ----------
    axes : int
        Number of axes.

    Members
    -------
    load : In(1), load_slot : In(6)
        As ``path_origin`` of the registers: it acts at rest only.
    fast_ahead, fast_behind : In(signed(32)), fast_ahead_rate, fast_behind_rate : In(26)
        Next places at which the machine must be slow; written in every clock.
    start_rate, acceleration, back_start_rate, back_acceleration : In(30), lead : In(27)
        The registers of the ramp.
    axis : Out(signed(32)) x axes
        Sum of the axis pulses Pi.
    contact : In(1)
        High for one clock, and not while going back, as ``rtl.gap.contact`` would have it here.
    The others are the members of ``Retraction`` and of ``SegmentWindow`` with the same names.
    """

    def __init__(self, *, axes=1):
        self.axes = axes
        self.joined = joined = Joined(registers=REGISTERS, axes=axes)
        self.feed, self.ramp, self.path = joined.feed, joined.ramp, joined.path
        self.distributor, self.retraction = joined.distributor, joined.retraction
        self.conservation = joined.conservation
        within = self.retraction.signature.members, self.path.signature.members
        names = (*OF_RETRACTION, *OF_PATH, *OF_GAP, *OF_OTHERS, *FREE, "retract", "release",
                 *FAST)
        super().__init__({name: In(next(members[name].shape for members in within
                                        if name in members)) for name in names} | {
            **{name: In(30) for name in OF_RAMP}, "lead": In(27),
            "axis": Out(signed(32)).array(axes),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.joined = joined = self.joined
        registers = joined.registers
        m.d.comb += [
            *(getattr(registers.retraction, name).eq(getattr(self, name))
              for name in OF_RETRACTION),
            *(getattr(registers.retraction, theirs).eq(getattr(self, name))
              for name, theirs in FREE.items()),
            registers.retraction.command_retract.eq(self.retract),
            registers.retraction.command_release.eq(self.release),
            registers.retraction.command_strobe.eq(1),
            *(getattr(registers.path, theirs).eq(getattr(self, name))
              for name, theirs in OF_PATH.items()),
            *(getattr(registers.path, name).eq(getattr(self, name)) for name in FAST),
            registers.path.fast_slot.eq(registers.path.slot),
            registers.path.fast_slot_strobe.eq(1),
            *(getattr(registers.ramp, name).eq(getattr(self, name))
              for name in (*OF_RAMP, "lead")),
            *(getattr(joined.gap, name).eq(getattr(self, name)) for name in OF_GAP),
            joined.gap.feed.eq(joined.gap.rate),
            *(getattr(joined, name).eq(getattr(self, name)) for name in OF_OTHERS),
        ]
        for index in range(self.axes):
            with m.If(joined.pi[index]):
                m.d.sync += self.axis[index].eq(
                    Mux(joined.pi_reverse[index], self.axis[index] - 1, self.axis[index] + 1))

        self._check(m)
        return m

    def _check(self, m):
        """Assert the rules that always hold."""
        feed, ramp, path, retraction = self.feed, self.ramp, self.path, self.retraction

        under_way = Signal(signed(32))
        m.d.comb += under_way.eq(Mux(retraction.reverse, path.position - feed.command,
                                     feed.command - path.position))
        since = Signal(range(4), init=3)
        reverse = Signal()
        rest = Signal(init=1)
        shorted = Signal()
        m.d.sync += [
            reverse.eq(retraction.reverse),
            rest.eq(ramp.rest),
            shorted.eq((self.shorted | self.wait | self.contact) & ~retraction.reverse
                       & (ramp.rate == self.start_rate)),
        ]
        with m.If(feed.ps):
            m.d.sync += since.eq(0)
        with m.Elif(since != 3):
            m.d.sync += since.eq(since + 1)
        with m.If(~self.safe):
            m.d.sync += [
                Assert(under_way == ramp.stored + feed.ps + ramp.pp, "a pulse lost or invented"),
                Assert(~feed.ps | (since == 3), "pulses Ps less than 4 clocks apart"),
                Assert((reverse == retraction.reverse) | rest, "reversed in motion"),
                Assert(~(shorted & feed.ps), "a pulse Ps follows the short"),
            ]
        m.d.sync += [
            Assert(~self.conservation.damaged, "a guard sees a pulse lost or made"),
            Assert(~(path.damaged_word | path.damaged_segment | path.damaged_place),
                   "a guard sees damage in the window"),
        ]
