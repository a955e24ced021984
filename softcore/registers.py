# SPDX-License-Identifier: Apache-2.0
"""Blocks, registers and fields of the register map. Plain data: imports nothing from Amaranth."""

from dataclasses import dataclass
from typing import Literal

__all__ = ["AXES", "Access", "Block", "Field", "Register", "registers", "value"]

AXES = "xyz"

# rw: software owns the value. r: the gateware owns it. w: a command; the value is there for the
# one clock in which the register's strobe is high. rw1c: set by the gateware, cleared by writing 1.
Access = Literal["r", "rw", "w", "rw1c"]


@dataclass(frozen=True, kw_only=True)
class Field:
    """A range of bits. ``unit`` is the physical size of one count; ``""`` for a flag or a code.

    ``guarded``, for ``rw``: the register bank keeps the parity of the written value, and reports
    when the value no longer has this parity.
    """

    name: str
    bits: int
    doc: str
    access: Access = "rw"
    signed: bool = False
    init: int = 0
    unit: str = ""
    guarded: bool = False


@dataclass(frozen=True, kw_only=True)
class Register:
    """A 32-bit word at a byte ``offset`` into its block; fields fill it from bit 0 upwards.

    ``pulse`` gives the gateware a strobe for every access: ``"write"`` in the clock after a write,
    ``"read"`` in the clock in which the value is read.
    """

    name: str
    offset: int
    doc: str
    fields: tuple[Field, ...]
    pulse: Literal["", "read", "write"] = ""


@dataclass(frozen=True, kw_only=True)
class Block:
    """The registers of one peripheral, at a byte address ``base`` of the register space."""

    name: str
    base: int
    doc: str
    registers: tuple[Register, ...]


Row = (tuple[str, str, tuple[Field, ...]]
       | tuple[str, str, tuple[Field, ...], Literal["read", "write"]])


def value(bits: int, doc: str, *, access: Access = "rw", signed: bool = False, init: int = 0,
          unit: str = "", guarded: bool = False) -> tuple[Field, ...]:
    """Fields of a register that holds one value."""
    return (Field(name="value", bits=bits, doc=doc, access=access, signed=signed, init=init,
                  unit=unit, guarded=guarded),)


def registers(*rows: Row) -> tuple[Register, ...]:
    """Number the rows ``(name, doc, fields[, pulse])`` from offset 0 on."""
    return tuple(Register(name=row[0], offset=4 * index, doc=row[1], fields=row[2],
                          pulse=row[3] if len(row) == 4 else "")
                 for index, row in enumerate(rows))
