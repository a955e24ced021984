# SPDX-License-Identifier: Apache-2.0
"""Everything that Verilator keeps of the controller from clock to clock, by name, bit by bit.

The table gives C++ that turns any bit over. Not all of it is registers: what is worked out anew
from others settles back, and the bench says so.
"""

import re
from pathlib import Path

__all__ = ["header", "members"]

# A member of the model's class: its type, its highest bit, its name.
MEMBER = re.compile(
    r"^ +(?:CData|SData|IData|QData|VlWide<\d+>)/\*(\d+):0\*/ (gapkeeper__DOT__\w+);$", re.M)
DOT, HEX = "__DOT__", re.compile("__0([0-9A-F]{2})")


def members(model: Path) -> list[tuple[str, int]]:
    """Name in C++ and bits of each, of the model in a folder; no arrays, which are memories."""
    text = (model / "Vtop___024root.h").read_text()
    return [(name, int(high) + 1) for high, name in MEMBER.findall(text)]


def plain(name: str) -> str:
    """A member's name as the Verilog has it."""
    dotted = name.removeprefix("gapkeeper" + DOT).replace(DOT, ".")
    return HEX.sub(lambda match: chr(int(match[1], 16)), dotted)


def header(model: Path) -> str:
    """C++ with the table of them: name, place in the model's class, bits."""
    rows = [f'    {{"{plain(name)}", offsetof(Vtop___024root, {name}), {bits}}},'
            for name, bits in members(model)]
    return "\n".join(["struct Member {", "    const char* name;", "    size_t offset;",
                      "    uint32_t bits;", "};", "static const Member STATE[] = {", *rows, "};",
                      ""])
