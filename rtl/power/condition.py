# SPDX-License-Identifier: Apache-2.0
"""The machining condition in force."""

from collections.abc import Mapping

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.power.condition_switch import ConditionSwitch
from rtl.power.settling import Settling

__all__ = ["WORDS", "Condition"]

# The words of a condition, by the registers in which they are staged: block, then name.
WORDS = (
    "power_level", "power_on_time", "power_wait_time", "power_off_time", "power_off_extra",
    "power_supply_voltage", "power_supply_negative",
    "gap_reference_open", "gap_reference_arc", "gap_reference_short",
    "gap_delay_least", "gap_criteria_current", "gap_criteria_delay", "gap_criteria_noise",
    "gap_criteria_relaxation",
    "servo_presets_dame", "servo_presets_open", "servo_presets_ok", "servo_step",
    "servo_counting_mode", "servo_counting_window", "servo_counting_weight",
    "feed_no_load", "feed_reference_voltage", "feed_reference_drop", "feed_share",
)
SHORT_LEVEL = 122  # after reset: 12 V of 100, so that contact and stuck gates are seen at once


class Condition(wiring.Component):
    """Registers of the condition in force: all take the staged words in the same clock.

    ``rtl.power.condition_switch`` decides when: by order or at a depth, and always between two
    pulses. So no pulse mixes two conditions, and each pause belongs to its pulse. After reset all
    words are 0 (no current) except the short level.

    ``latched`` and ``settled`` say whether the power supply and the comparators follow the words
    in force. The words do not wait for that: if another condition comes meanwhile, the newest
    one is taken, and the wait begins anew for what it changes. So a condition that was never
    whole outside gets no pulse, and its successor is not late.

    Parameters
    ----------
    registers : mapping of str to wiring.Signature
        Register blocks, as their owner on the bus has them: those of ``WORDS``, and ``condition``.
    latch, settle : int
        See ``rtl.power.settling``.

    Members
    -------
    registers : In(Signature of the block ``condition``)
        Orders, depths and status; see ``softcore/regmap.py``.
    staged : In(the words)
        The staged words, each by its name.
    words : Out(the words)
        The words in force.
    between, position : In, count, at, switched : Out
        See ``rtl.power.condition_switch``.
    latched, settled : Out(1)
        See ``rtl.power.settling``.
    """

    @staticmethod
    def in_force(registers: Mapping[str, wiring.Signature]) -> wiring.Signature:
        """Signature of the words, each as wide as the register in which it is staged."""
        members = {}
        for name in WORDS:
            block, _, register = name.partition("_")
            init = SHORT_LEVEL if name == "gap_reference_short" else 0
            members[name] = Out(registers[block].members[register].shape, init=init)
        return wiring.Signature(members)

    def __init__(self, *, registers: Mapping[str, wiring.Signature], latch: int = 1,
                 settle: int = 1):
        self.switch = ConditionSwitch()
        self.settling = Settling(latch=latch, settle=settle)
        words, switch = self.in_force(registers), self.switch.signature.members
        super().__init__({
            "registers": In(registers["condition"]), "staged": In(words), "words": Out(words),
            **{name: switch[name] for name in ("between", "position", "count", "at", "switched")},
            "latched": Out(1), "settled": Out(1),
        })

    def stage(self, registers):
        """Assignments that take the staged words from the register blocks."""
        return [getattr(self.staged, name).eq(
                    getattr(getattr(registers, name.partition("_")[0]), name.partition("_")[2]))
                for name in WORDS]

    def elaborate(self, platform):
        m = Module()
        m.submodules.switch = switch = self.switch
        m.submodules.settling = settling = self.settling
        registers, words = self.registers, self.words
        m.d.comb += [
            switch.between.eq(self.between), switch.position.eq(self.position),
            self.count.eq(switch.count), self.at.eq(switch.at), self.switched.eq(switch.switched),
            switch.commit.eq(registers.order_strobe & registers.order_commit),
            switch.disarm.eq(registers.order_strobe & registers.order_disarm),
            switch.restart.eq(registers.order_strobe & registers.order_restart),
            switch.depth.eq(registers.depth), switch.arm.eq(registers.depth_strobe),
            registers.status_armed.eq(switch.armed), registers.status_pending.eq(switch.pending),
            registers.status_count.eq(switch.count),
            settling.supply.eq(Cat(words.power_supply_voltage, words.power_supply_negative)),
            settling.reference.eq(Cat(words.gap_reference_open, words.gap_reference_arc,
                                      words.gap_reference_short)),
            settling.longer.eq(registers.settle),
            self.latched.eq(settling.latched), self.settled.eq(settling.settled),
            registers.status_settled.eq(settling.latched & settling.settled),
        ]
        with m.If(switch.take):
            m.d.sync += [getattr(self.words, name).eq(getattr(self.staged, name))
                         for name in WORDS]
        return m
