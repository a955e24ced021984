# SPDX-License-Identifier: Apache-2.0
"""Addresses of the firmware's functions and variables in the processor's memory, by name."""

import re
import struct
from operator import itemgetter
from pathlib import Path

from softcore.image import target_image

__all__ = ["firmware_symbols"]

HEADER = struct.Struct("<16sHHIIIIIHHHHHH")
SECTION = struct.Struct("<IIIIIIIIII")
SYMBOL = struct.Struct("<IIIBBH")
SYMBOL_TABLE = 2


def firmware_symbols(path: Path | None = None) -> dict[str, tuple[int, int]]:
    """Address and size in bytes of every function and variable.

    If several have the same name (the linker numbers them), the largest counts.

    Parameters
    ----------
    path : Path or None
        An ELF file of 32 bits, little-endian; by default that of the firmware.

    Ref: Tool Interface Standard, Executable and Linking Format 1.2.
    """
    path = path or target_image().with_name("firmware.elf")
    data = path.read_bytes()
    header = HEADER.unpack_from(data)
    start, size, count = header[6], header[11], header[12]
    sections = [SECTION.unpack_from(data, start + size * number) for number in range(count)]
    found = {}
    for _, kind, _, _, offset, length, link, *_ in sections:
        if kind != SYMBOL_TABLE:
            continue
        names = sections[link][4]
        for at in range(offset, offset + length, SYMBOL.size):
            name, value, extent, *_ = SYMBOL.unpack_from(data, at)
            begin = names + name
            named = re.sub(r"\.\d+$", "", data[begin:data.index(b"\0", begin)].decode())
            found[named] = max(found.get(named, (0, -1)), (value, extent), key=itemgetter(1))
    return found
