# SPDX-License-Identifier: Apache-2.0
"""The machining condition in force."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.power.condition_switch import ConditionSwitch

__all__ = ["WORDS", "Condition"]

# What makes up a condition, and its bits, by the registers in which it is staged.
WORDS = {
    "power_level": 6, "power_on_time": 20, "power_off_time": 20, "power_off_extra": 20,
    "power_supply_voltage": 4, "power_supply_negative": 1,
    "gap_reference_open": 10, "gap_reference_arc": 10, "gap_reference_short": 10,
    "servo_presets_dame": 8, "servo_presets_open": 8, "servo_presets_ok": 8, "servo_step": 16,
    "law_no_load": 16, "law_reference_voltage": 16, "law_reference_drop": 16,
}
SHORT_LEVEL = 122  # after reset: 12 V of 100, by which contact and stuck gates are told at once


class Condition(wiring.Component):
    """Registers of the condition in force, which take over together what is staged.

    When they do is told by ``rtl.power.condition_switch``, whose orders and reports these are: by
    order or at a depth, and always between two pulses, so that no pulse has something of two
    conditions and each pause is that of its pulse. After reset all words are 0, without current,
    but for the short level.

    Members
    -------
    staged_* : In
        Words of ``WORDS``, each by its name.
    * : Out
        The same in force.

    The others: ``rtl.power.condition_switch.ConditionSwitch``, all but ``take``.
    """

    def __init__(self):
        self.switch = ConditionSwitch()
        members = {name: member for name, member in self.switch.signature.members.items()
                   if name != "take"}
        for name, bits in WORDS.items():
            init = SHORT_LEVEL if name == "gap_reference_short" else 0
            members |= {f"staged_{name}": In(bits), name: Out(bits, init=init)}
        super().__init__(members)

    def follow(self, machine):
        """Connections with the registers of a machine: what is staged, orders and status."""
        strobe = machine.condition_order_strobe
        return [
            *(getattr(self, f"staged_{name}").eq(getattr(machine, name)) for name in WORDS),
            *(getattr(self, name).eq(strobe & getattr(machine, f"condition_order_{name}"))
              for name in ("commit", "disarm", "restart")),
            self.depth.eq(machine.condition_depth), self.arm.eq(machine.condition_depth_strobe),
            *(getattr(machine, f"condition_status_{name}").eq(getattr(self, name))
              for name in ("armed", "pending", "count")),
        ]

    def elaborate(self, platform):
        m = Module()
        m.submodules.switch = switch = self.switch
        for name, member in switch.signature.members.items():
            if name == "take":
                continue
            outer, inner = getattr(self, name), getattr(switch, name)
            m.d.comb += inner.eq(outer) if member.flow is In else outer.eq(inner)
        with m.If(switch.take):
            m.d.sync += [getattr(self, name).eq(getattr(self, f"staged_{name}")) for name in WORDS]
        return m
