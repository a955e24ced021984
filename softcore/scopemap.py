# SPDX-License-Identifier: Apache-2.0
"""Registers of the gap oscilloscope: a part of ``softcore.regmap``. Plain data."""

from softcore.registers import Block, Field, registers, value

__all__ = ["SCOPE"]

SCOPE = Block(name="scope", base=0xB80, doc="The gap oscilloscope; see ``rtl.gap.scope``. The "
              "trigger and ``after`` may change only while it does not run.", registers=registers(
    ("order", "Orders to it.", (
        Field(name="arm", bits=1, access="w", doc="Empty the ring and record."),
        Field(name="stop", bits=1, access="w", doc="Stop at once."),
        Field(name="force", bits=1, access="w", doc="Trigger now.")), "write"),
    ("trigger", "What is waited for.", (
        Field(name="source", bits=3, doc="0 nothing, 1 Ss rises, 2 a retraction starts, 3 a pulse "
              "gets one of the classes, 4 the voltage rises to the level, 5 it falls below it."),
        Field(name="classes", bits=6, doc="By bit: 0 open, 1 ok, 2 dame, 3 short, 4 a sensing "
              "pulse that was not shorted, 5 one that was."),
        Field(name="level", bits=12, doc="Level.", unit="1/4096 full scale"))),
    ("after", "Entries that follow the trigger's, less than ``depth``.", value(16, "Entries.")),
    ("status", "State of it.", (
        Field(name="recording", bits=2, access="r",
              doc="0 idle, 1 armed, 2 triggered, 3 full."),
        Field(name="count", bits=16, access="r", doc="Entries in the ring."))),
    ("depth", "Size of the ring; 0: this build has no oscilloscope.",
     value(16, "Entries.", access="r")),
    ("time", "Clock count in the clock after the trigger's.",
     value(32, "Lower half of the clock count.", access="r", unit="clock")),
    ("place", "Choose an entry to be read, 0 for the oldest.",
     value(16, "Its number.", access="w"), "write"),
    ("entry", "The chosen entry.", (
        Field(name="stamp", bits=9, access="r", unit="clock",
              doc="Time since the entry before; 0 for the first."),
        Field(name="voltage", bits=12, access="r", unit="1/4096 full scale",
              doc="Last sample of the gap voltage."),
        Field(name="sampled", bits=1, access="r", doc="It is new."),
        *(Field(name=name, bits=1, access="r", doc=doc) for name, doc in (
            ("high", "The voltage is above the open level."),
            ("arc", "It is below the arc level."), ("short", "It is below the short level."),
            ("current", "Current flows."), ("noise", "The discharge has high frequencies."),
            ("on", "Gate of the discharge."), ("sense", "Gate of the sensing source."))),
        Field(name="pulse", bits=3, access="r", doc="Pulse that got its class: 0 none, 1 open, "
              "2 ok, 3 dame, 4 short; a sensing pulse: 5 not shorted, 6 shorted."))),
    ("entry_rest", "The rest of the chosen entry. Reading it chooses the next entry.", (
        Field(name="shorted", bits=1, access="r", doc="The signal Ss."),
        Field(name="state", bits=3, access="r", doc="State of the retraction; see "
              "``path.status``.")), "read"),
))
