# SPDX-License-Identifier: Apache-2.0
"""The processor: what it does with an instruction of no known kind is decided."""

import re
import struct

import pytest

from host.machines import machine as machines
from softcore import cpu
from softcore.cpu import VexRiscv
from softcore.top import simulation_netlist
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
ILLEGAL = bytes([2])            # cause of the trap
TRAP = 0x60                     # address of the trap's program
BASE = 0x800002B7               # lui t0, 0x80000
SEND = 0x1062A223               # sw t1, 0x104(t0): the transmitter
STAY = 0x0000006F               # j .


def put(value: int) -> int:
    """Word of ``li t1, value``."""
    return value << 20 | 0x313


def answer(tmp_path, word: int) -> bytes:
    """Byte that a program sends behind the word: its trap's cause, or "o" if the word is obeyed."""
    program = [BASE, put(TRAP), 0x30531073,             # csrw mtvec, t1
               word, put(ord("o")), SEND, STAY]
    trap = [0x34202373, SEND, STAY]                     # csrr t1, mcause
    words = [*program, *[STAY] * (TRAP // 4 - len(program)), *trap]
    image = tmp_path / "program.bin"
    image.write_bytes(struct.pack(f"<{len(words)}I", *words))
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1, trace=False,
                    image=image) as session:
        return session.receive(1_000)


@pytest.mark.parametrize("word", [
    0x10200073,                 # sret: the package has no place to jump to
    0x00200073,                 # uret
    0xE000E000,                 # c.fsw, floating point
    0x60006000,                 # c.flw
    0xFFFFFFFF, 0x00000053])    # nothing; fadd.s
def test_an_instruction_that_the_processor_has_not_is_trapped(tmp_path, word):
    assert answer(tmp_path, word) == ILLEGAL


@pytest.mark.parametrize("word", [0x00000013, 0x00010001, 0x02628333])  # nop, twice c.nop, mul
def test_an_instruction_that_it_has_is_obeyed(tmp_path, word):
    assert answer(tmp_path, word) == b"o"


def test_no_case_of_the_expansion_of_compressed_instructions_is_open():
    """On a board, too. `cosim/test_synthesised.py` holds every pin of the cells to that."""
    text = VexRiscv.verilog()
    expanded = re.findall(r"IBusCachedPlugin_decompressor_decompressed = (.*);", text)
    assert expanded.count(f"32'b{32 * '0'}") == 1
    assert len(expanded) > 15
    assert not any(re.search(r"'[bh][0-9a-f]*x", value) for value in expanded)


def test_it_is_what_simulation_and_synthesis_read():
    assert VexRiscv.verilog() in simulation_netlist(2_000_000)


@pytest.mark.parametrize("number", range(len(cpu.DECIDED)))
def test_a_package_with_other_text_is_refused(monkeypatch, number):
    has, becomes = cpu.DECIDED[number]
    monkeypatch.setattr(cpu, "DECIDED", ((has + " ", becomes),))
    with pytest.raises(ValueError, match="has no longer") as refused:
        VexRiscv.verilog()
    assert has[:40] in str(refused.value)
