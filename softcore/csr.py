# SPDX-License-Identifier: Apache-2.0
"""Gateware registers built from ``softcore.regmap``."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from softcore.registers import Block, Field, Register

__all__ = ["RegisterFile", "member"]


def member(block: Block, register: Register, field: Field) -> str:
    """Name of the machine's member behind a field."""
    stem = f"{block.name}_{register.name}"
    return stem if len(register.fields) == 1 else f"{stem}_{field.name}"


def _shape(field):
    return signed(field.bits) if field.signed else unsigned(field.bits)


class RegisterFile(wiring.Component):
    """All registers of a table on one 32-bit bus.

    An access takes 2 clocks: ``ack`` follows ``stb`` by one, with ``dat_r``. Only whole words are
    written. An address without a register reads as 0 and ignores writes.

    Members beside the bus, per field, named by ``member``: an output for ``rw`` and ``w`` fields,
    an input for ``r`` fields; for ``rw1c`` an input that sets the bit (setting wins over clearing).
    A register with a ``pulse`` has ``<block>_<register>_strobe``: for writes it is high in the
    clock after the access is taken, together with the new values; for reads in the clock in which
    the value is taken.

    Parameters
    ----------
    blocks : tuple of Block
        The table.

    Members
    -------
    adr : In(10)
        Word address.
    we, stb : In(1)
        Write, and access.
    dat_w : In(32), dat_r : Out(32)
        Data.
    ack : Out(1)
        The access is done.
    """

    def __init__(self, blocks: tuple[Block, ...]):
        self.blocks = blocks
        members = {"adr": In(10), "we": In(1), "stb": In(1), "dat_w": In(32), "dat_r": Out(32),
                   "ack": Out(1)}
        for block in blocks:
            for register in block.registers:
                for field in register.fields:
                    shape = signed(field.bits) if field.signed else unsigned(field.bits)
                    members[member(block, register, field)] = (
                        Out(shape, init=field.init) if field.access in ("rw", "w") else In(shape))
                if register.pulse:
                    members[f"{block.name}_{register.name}_strobe"] = Out(1)
        super().__init__(members)

    def elaborate(self, platform):
        m = Module()

        taken = Signal()
        m.d.comb += taken.eq(self.stb & ~self.ack)
        m.d.sync += self.ack.eq(taken)
        m.d.sync += self.dat_r.eq(0)
        registers = [(block, register) for block in self.blocks for register in block.registers]

        strobes = {}
        for block, register in registers:
            if register.pulse:
                strobe = getattr(self, f"{block.name}_{register.name}_strobe")
                strobes[block.name, register.name] = strobe
                if register.pulse == "write":
                    m.d.sync += strobe.eq(0)
        latches = {}
        for block, register in registers:
            for field in register.fields:
                if field.access == "rw1c":
                    name = member(block, register, field)
                    latches[name] = Signal(name=f"{name}_latched")

        # The access is the outer condition, for the simulator's sake: it then skips every register
        # in every clock without one.
        with m.If(taken), m.Switch(self.adr):
            for block, register in registers:
                with m.Case((block.base + register.offset) // 4):
                    self._access(m, block, register, latches)
                    strobe = strobes.get((block.name, register.name))
                    if register.pulse == "read":
                        m.d.comb += strobe.eq(~self.we)
                    elif register.pulse == "write":
                        m.d.sync += strobe.eq(self.we)
        for name, latch in latches.items():
            with m.If(getattr(self, name)):
                m.d.sync += latch.eq(1)

        return m

    def _access(self, m, block, register, latches):
        """Write the fields of one register, and read them."""
        read = []
        at = 0
        for field in register.fields:
            name = member(block, register, field)
            word = self.dat_w[at:at + field.bits]
            value = getattr(self, name)
            if field.access == "rw1c":
                value = latches[name]
                with m.If(self.we & word.any()):
                    m.d.sync += value.eq(0)
            elif field.access in ("rw", "w"):
                with m.If(self.we):
                    m.d.sync += value.eq(word)
            read.append(C(0, field.bits) if field.access == "w" else value)
            at += field.bits
        m.d.sync += self.dat_r.eq(Cat(*read))
