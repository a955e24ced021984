# SPDX-License-Identifier: Apache-2.0
"""Reference model of the register file: what a sequence of whole accesses reads and strobes."""

from dataclasses import dataclass, field


@dataclass
class RegisterFile:
    """``blocks`` is the register table. Values of fields are kept by (block, register, field)."""

    blocks: tuple
    values: dict = field(default_factory=dict)

    def __post_init__(self):
        self.registers = {block.base + register.offset: (block, register)
                          for block in self.blocks for register in block.registers}
        for block, register in self.registers.values():
            for each in register.fields:
                self.values[block.name, register.name, each.name] = each.init

    def set_bit(self, *names):
        """The gateware sets a ``rw1c`` bit."""
        self.values[names] = 1

    def write(self, address, word) -> list[str]:
        """Write a word; return the strobes that follow, as ``block_register``."""
        if address not in self.registers:
            return []
        block, register = self.registers[address]
        for each, part in self._parts(register, word):
            if each.access in ("rw", "w"):
                self.values[block.name, register.name, each.name] = part
            elif each.access == "rw1c" and part:
                self.values[block.name, register.name, each.name] = 0
        return [f"{block.name}_{register.name}"] if register.pulse == "write" else []

    def read(self, address, inputs) -> int:
        """Read a word; ``inputs`` has the gateware's values of ``r`` fields."""
        if address not in self.registers:
            return 0
        block, register = self.registers[address]
        word = at = 0
        for each in register.fields:
            key = block.name, register.name, each.name
            if each.access == "r":
                value = inputs.get(key, 0)
            else:
                value = 0 if each.access == "w" else self.values[key]
            word |= (value & ((1 << each.bits) - 1)) << at
            at += each.bits
        return word

    @staticmethod
    def _parts(register, word):
        at = 0
        for each in register.fields:
            yield each, (word >> at) & ((1 << each.bits) - 1)
            at += each.bits
