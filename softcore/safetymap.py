# SPDX-License-Identifier: Apache-2.0
"""Registers of interlock, watchdog and inputs: a part of ``softcore.regmap``. Plain data."""

from softcore.registers import AXES, Block, Field, registers, value
from softcore.tables.causes import CAUSES

__all__ = ["SAFETY"]

_CAUSE_BITS = "By bit: " + "; ".join(
    f"{bit} `{cause.name}`, {cause.sentence}" for bit, cause in enumerate(CAUSES)) + "."

SAFETY = Block(name="safety", base=0x800, doc="Interlock and watchdog; see ``rtl.safety``.",
               registers=registers(
    ("live", "Causes present now. " + _CAUSE_BITS,
     value(len(CAUSES), "One bit per cause.", access="r")),
    ("latched", "Causes since the interlock was cleared, by the same bits.",
     value(len(CAUSES), "One bit per cause.", access="r")),
    ("status", "State of the interlock.", (
        Field(name="safe", bits=1, access="r", doc="Outputs are in their safe state."),
        Field(name="first", bits=5, access="r", doc="Number of the first cause latched."),
        Field(name="simultaneous", bits=len(CAUSES), access="r",
              doc="Causes that came in the same clock as the first."),
        Field(name="blamed", bits=len(AXES), access="r",
              doc="Axes that raised the first cause, bit 0 X; 0 if it is not one of axes."))),
    ("pet", "Watchdog call: ``0xA5`` at the start of a step of the main loop, ``0x5A`` at its end, "
     "``0xC3`` from the handler of interrupt 1.",
     value(8, "The key.", access="w"), "write"),
    ("clear", "Operator's acknowledgement ``0x5A``: clears causes that are no longer present.",
     value(8, "The key.", access="w"), "write"),
    ("stop", "Trip the interlock (cause ``firmware``).",
     value(1, "Any value.", access="w"), "write"),
    ("fluid", "Fluid supervision.", (
        Field(name="required", bits=1, init=1, doc="Low fluid trips while discharging.",
              guarded=True),)),
    ("period", "Longest time between two watchdog calls.",
     value(32, "Clocks, a build parameter.", access="r", unit="clock")),
    ("arming", "Permission to discharge; see ``rtl.safety.arming``.", (
        Field(name="contactor", bits=1, access="r", doc="The main contactor's coil is on."),
        Field(name="armed", bits=1, access="r", doc="Its contacts are closed: the discharge is "
              "allowed."),
        Field(name="pressed", bits=1, access="r", doc="The button's level, not debounced."))),
    ("disarm", "Open the main contactor until the button is pressed again.",
     value(1, "Any value.", access="w"), "write"),
    ("leave", "Operator's order ``0x5A`` to leave the pressed limit switches. Only while safe. "
     "They then do not trip until they are released, another cause comes, or a pulse would go "
     "further onto one of them. Meanwhile there is no discharge, and motion is slow.",
     value(8, "The key.", access="w"), "write"),
    ("limits", "Limit switches, debounced.", (
        Field(name="low", bits=len(AXES), access="r", doc="Lower one, bit 0 X."),
        Field(name="high", bits=len(AXES), access="r", doc="Upper one."),
        Field(name="leaving", bits=1, access="r", doc="The machine is leaving them."))),
    ("damage", "Damage that cause ``guard`` has found since the interlock was cleared.", (
        Field(name="axes", bits=len(AXES), access="r",
              doc="Command, position and Er of an axis disagree, or the state of its backlash "
                  "and pitch has a wrong parity, bit 0 X."),
        Field(name="word", bits=1, access="r", doc="A word of the path window has a wrong parity."),
        Field(name="segment", bits=1, access="r",
              doc="A word of the present segment has a wrong parity."),
        Field(name="place", bits=1, access="r",
              doc="Path coordinate, front or place in the segment differ from their doubles."),
        Field(name="pulses", bits=1, access="r",
              doc="A path pulse was lost, or came without a reason."),
        Field(name="settings", bits=len(AXES), access="r",
              doc="A soft limit, a bound of the following error, the gain, the output's mode, "
                  "gear, backlash or pitch error of an axis differs from what the firmware wrote, "
                  "bit 0 X."),
        Field(name="fluid", bits=1, access="r",
              doc="The choice whether low fluid trips differs from what the firmware wrote."),
        Field(name="rate", bits=1, access="r", doc="The rate of the ramp has a wrong parity."),
        Field(name="latch", bits=1, access="r", doc="The interlock's latches differ."),
     )),
    ("watch", "State of the watchdog; see ``rtl.safety.watchdog``.", (
        Field(name="asked", bits=1, access="r", doc="It waits for ``0xC3``. Interrupt 1."),
        Field(name="open", bits=1, access="r", doc="``0x5A`` would not be too early."))),
    ("inputs", "Levels of the machine's inputs, not debounced; 1: active. For whoever checks the "
     "wires.", tuple(Field(name=name, bits=bits, access="r", doc=doc) for name, bits, doc in (
         ("estop", 1, "Emergency stop."),
         ("drive_fault", len(AXES), "Faults of the drives, bit 0 X."),
         ("limit_low", len(AXES), "Lower limit switches."),
         ("limit_high", len(AXES), "Upper limit switches."),
         ("fluid_low", 1, "The fluid is below its level."),
         ("fin", 1, "The machine side has done the auxiliary function."),
         ("arm", 1, "The button."),
         ("enc_a", len(AXES), "Phases A of the coders."),
         ("enc_b", len(AXES), "Phases B."),
         ("gap_high", 1, "The gap voltage is above the open level."),
         ("gap_arc", 1, "It is below the arc level."),
         ("gap_short", 1, "It is below the short level."),
         ("gap_current", 1, "Current flows."),
         ("gap_noise", 1, "The discharge has high frequencies."),
         ("adc_data", 1, "Data of the converter."),
         ("enc_index", len(AXES), "Indices of the coders.")))),
))
