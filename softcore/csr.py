# SPDX-License-Identifier: Apache-2.0
"""Gateware registers built from ``softcore.regmap``."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from softcore.registers import Block, Field, Register

__all__ = ["RegisterFile", "interfaces", "member"]


def member(register: Register, field: Field) -> str:
    """Name of the member for a field, in the interface of its block."""
    return register.name if len(register.fields) == 1 else f"{register.name}_{field.name}"


def _shape(field):
    return signed(field.bits) if field.signed else unsigned(field.bits)


def _place(block, register):
    """Address of a register, in words."""
    return (block.base + register.offset) // 4


def _initial(register):
    """Word of a register after reset."""
    word = at = 0
    for field in register.fields:
        word |= (field.init & (1 << field.bits) - 1) << at
        at += field.bits
    return word


def interfaces(blocks: tuple[Block, ...]) -> dict[str, wiring.Signature]:
    """Members of the registers of each block, by the block's name.

    Directions are those of the register bank. Each field has a member, named by ``member``: an
    output for ``rw`` and ``w`` fields, an input for ``r`` fields; for ``rw1c`` an input that sets
    the bit (setting wins over clearing). A guarded field also has an output ``<member>_damaged``:
    an odd number of its bits differ from what was written. A register with a ``pulse`` has
    ``<register>_strobe``. For writes it is high in the clock after the access, together with the
    new values; for reads in the clock in which the value is read.
    """
    found = {}
    for block in blocks:
        members = {}
        for register in block.registers:
            for field in register.fields:
                shape = _shape(field)
                members[member(register, field)] = (
                    Out(shape, init=field.init) if field.access in ("rw", "w") else In(shape))
                if field.guarded:
                    members[f"{member(register, field)}_damaged"] = Out(1)
            if register.pulse:
                members[f"{register.name}_strobe"] = Out(1)
        found[block.name] = wiring.Signature(members)
    return found


class RegisterFile(wiring.Component):
    """All registers of a table on one 32-bit bus.

    An access takes 2 clocks: ``ack`` follows ``stb`` by one, with ``dat_r``. Only whole words are
    written. An address without a register reads as 0 and ignores writes.

    A register of ``rw`` fields alone is read from a memory that keeps what was written. So the
    value itself, which lies where it is used, needs no wire back. The memory is not reset: until
    its first write after reset a register is read as its initial value.

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
    fields : Out(Signature of the blocks)
        Members of the registers, see ``interfaces``.
    """

    def __init__(self, blocks: tuple[Block, ...]):
        self.blocks = blocks
        super().__init__({
            "adr": In(10), "we": In(1), "stb": In(1), "dat_w": In(32), "dat_r": Out(32),
            "ack": Out(1),
            "fields": Out(wiring.Signature({name: Out(signature)
                                            for name, signature in interfaces(blocks).items()})),
        })

    def elaborate(self, platform):
        m = Module()

        taken = Signal()
        m.d.comb += taken.eq(self.stb & ~self.ack)
        m.d.sync += self.ack.eq(taken)
        read = Signal(32)       # of all registers that are not in the memory
        kept = Signal()         # the access is of one that is
        m.d.sync += [read.eq(0), kept.eq(0)]
        m.submodules.shadow = shadow = memory.Memory(shape=32, depth=1 << len(self.adr), init=[])
        write, back = shadow.write_port(), shadow.read_port()
        m.d.comb += [
            write.addr.eq(self.adr), write.en.eq(taken & self.we),
            back.addr.eq(self.adr), back.en.eq(taken & ~self.we),
            self.dat_r.eq(read | (back.data & kept.replicate(32))),
        ]
        registers = [(block, register) for block in self.blocks for register in block.registers]

        strobes = {}
        for block, register in registers:
            if register.pulse:
                strobe = getattr(self._of(block), f"{register.name}_strobe")
                strobes[block.name, register.name] = strobe
                if register.pulse == "write":
                    m.d.sync += strobe.eq(0)
        latches = {}
        for block, register in registers:
            for field in register.fields:
                if field.access == "rw1c":
                    name = member(register, field)
                    latches[block.name, name] = Signal(name=f"{block.name}_{name}_latched")

        parities = self._parities(m, registers)

        # The access is the outer condition, so that the simulator skips all registers in a clock
        # without an access. What is written has a condition for each register: in one switch,
        # the emitted Verilog would repeat an empty case per register for each signal.
        with m.If(taken):
            words, written = {}, {}
            for block, register in registers:
                name = block.name, register.name
                with m.If(self.adr == _place(block, register)):
                    words[name] = self._access(m, block, register, latches, parities)
                    if register.pulse == "read":
                        m.d.comb += strobes[name].eq(~self.we)
                    elif register.pulse == "write":
                        m.d.sync += strobes[name].eq(self.we)
                    if all(field.access == "rw" for field in register.fields):
                        written[name] = Signal(name=f"{block.name}_{register.name}_written")
                        with m.If(self.we):
                            m.d.sync += written[name].eq(1)
            with m.Switch(self.adr):
                for block, register in registers:
                    name = block.name, register.name
                    with m.Case(_place(block, register)):
                        if name in written:
                            m.d.comb += write.data.eq(self.dat_w[:len(words[name])])
                            with m.If(written[name]):
                                m.d.sync += kept.eq(1)
                            with m.Else():
                                m.d.sync += read.eq(_initial(register))
                        else:
                            m.d.sync += read.eq(words[name])
        for (block, name), latch in latches.items():
            with m.If(getattr(getattr(self.fields, block), name)):
                m.d.sync += latch.eq(1)

        return m

    def _of(self, block):
        """Interface of a block."""
        return getattr(self.fields, block.name)

    def _parities(self, m, registers):
        """Parity of the value written into each guarded field, by its block and member.

        The parity makes the number of ones odd. With even parity, synthesis would merge the parity
        of a single bit with the bit itself.
        """
        found = {}
        for block, register in registers:
            for field in register.fields:
                if not field.guarded:
                    continue
                name = member(register, field)
                own = self._of(block)
                parity = Signal(init=~field.init.bit_count() & 1,
                                name=f"{block.name}_{name}_parity")
                found[block.name, name] = parity
                m.d.comb += getattr(own, f"{name}_damaged").eq(
                    ~(getattr(own, name).as_unsigned().xor() ^ parity))
        return found

    def _access(self, m, block, register, latches, parities):
        """Write the fields of one register; return its word."""
        read = []
        at = 0
        for field in register.fields:
            name = member(register, field)
            word = self.dat_w[at:at + field.bits]
            value = getattr(self._of(block), name)
            if field.access == "rw1c":
                value = latches[block.name, name]
                with m.If(self.we & word.any()):
                    m.d.sync += value.eq(0)
            elif field.access in ("rw", "w"):
                with m.If(self.we):
                    m.d.sync += value.eq(word)
                    if field.guarded:
                        m.d.sync += parities[block.name, name].eq(~word.xor())
            read.append(C(0, field.bits) if field.access == "w" else value)
            at += field.bits
        return Cat(*read)
