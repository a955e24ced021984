# SPDX-License-Identifier: Apache-2.0
"""Registers of the port to the flash memory: a part of ``softcore.regmap``. Plain data."""

from softcore.registers import Block, Field, registers, value

__all__ = ["FLASH"]

FLASH = Block(name="flash", base=0x080, doc="Serial flash memory of journal and firmware; see "
              "``softcore.flash``.", registers=registers(
    ("send", "Exchange a byte with the memory. Does nothing while ``busy``.",
     value(8, "The byte to the memory.", access="w"), "write"),
    ("select", "Select the memory, around the bytes of a command.", value(1, "1: selected.")),
    ("status", "State of the exchange.", (
        Field(name="received", bits=8, access="r", doc="The byte from the memory."),
        Field(name="busy", bits=1, access="r", doc="An exchange is under way."))),
    ("region", "The journal's region of the memory, and two firmware slots behind it: "
     "nothing else is ever written.", (
        Field(name="first", bits=16, access="r", doc="Its first sector.", unit="4 KiB"),
        Field(name="sectors", bits=8, access="r", doc="Its length; 0 for no journal.",
              unit="4 KiB"),
        Field(name="slot", bits=8, access="r", doc="Length of each slot; 0 for none.",
              unit="4 KiB"))),
))
