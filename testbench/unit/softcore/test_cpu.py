# SPDX-License-Identifier: Apache-2.0
"""The processor's Verilog: what it does with an instruction of no known kind is decided."""

import re

import pytest

from softcore import cpu
from softcore.cpu import VexRiscv
from softcore.top import simulation_netlist


def test_a_compressed_instruction_of_no_known_kind_becomes_zero_which_is_illegal():
    """On a board, too. `cosim/test_synthesised.py` holds every pin of the cells to that."""
    text = VexRiscv.verilog()
    expanded = re.findall(r"IBusCachedPlugin_decompressor_decompressed = (.*);", text)
    assert expanded.count(f"32'b{32 * '0'}") == 1
    assert len(expanded) > 15
    assert not any(re.search(r"'[bh][0-9a-f]*x", value) for value in expanded)


def test_it_is_what_simulation_and_synthesis_read():
    assert VexRiscv.verilog() in simulation_netlist(2_000_000)


def test_a_package_with_other_text_is_refused(monkeypatch):
    monkeypatch.setattr(cpu, "OPEN", cpu.OPEN + " ")
    with pytest.raises(ValueError, match="another decompressor"):
        VexRiscv.verilog()
