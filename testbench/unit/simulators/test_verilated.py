# SPDX-License-Identifier: Apache-2.0
"""Verilog as Verilator gets it: initial values in loops are those of the lines before."""

import re

import pytest

from testbench.native.verilated import in_loops


def words(text):
    """Initial values of memories in Verilog, by their names; loops are run."""
    found = {}
    for line in text.splitlines():
        if loop := re.fullmatch(r" *for \(int i = 0; i < (\d+); i = i \+ 1\) (\S+)\[i\] = (\S+);",
                                line):
            found.setdefault(loop[2], {}).update(dict.fromkeys(range(int(loop[1])), loop[3]))
        elif one := re.fullmatch(r" *(\S+)\[(\d+)\] = (\S+);", line):
            found.setdefault(one[1], {})[int(one[2])] = one[3]
    return found


def lines(memory, values):
    return "".join(f"    {memory}[{index}] = {value};\n" for index, value in values)


@pytest.mark.parametrize(("memories", "loops"), [
    ([("ram", [(0, "32'd0"), (1, "32'd0"), (2, "32'd0")])], 1),
    ([("\\odd.name ", [(0, "1'h1"), (1, "1'h1")])], 0),       # a name that is not one word
    ([("ram", [(0, "8'h00"), (1, "8'h00"), (2, "8'h05"), (3, "8'h00")])], 1),
    ([("ram", [(0, "8'h05"), (1, "8'h00"), (2, "8'h00")])], 0),
    ([("ram", [(0, "8'h00"), (2, "8'h00")])], 0),             # a word that is not defined
    ([("a", [(0, "8'h00"), (1, "8'h00")]), ("b", [(0, "8'h00"), (1, "8'h00")])], 2),
])
def test_values_are_the_same_in_a_loop(memories, loops):
    text = "  initial begin\n" + "  end\n  initial begin\n".join(
        lines(*memory) for memory in memories) + "  end\n"
    shorter = in_loops(text)
    assert shorter.count("for (") == loops
    assert words(shorter) == words(text)
    assert (loops == 0) == (shorter == text)
