# SPDX-License-Identifier: Apache-2.0
"""The firmware in layouts by the real tools: as if it had been there from the start.

A memory with a register chain around it, so that it needs four pins only, is laid out with the
placeholder and with a firmware, for the smallest ECP5. Everything else of the two is equal.

Yosys numbers what it makes, and takes fewer numbers where block RAMs have equal contents. Such a
netlist has other names and may be placed otherwise; its cells are compared, not its layout.
"""

import json
import random
import re
from collections import Counter

import pytest
from amaranth import *
from amaranth.back import rtlil

from softcore.contents import placeholder, with_firmware
from softcore.memory import BlockRam
from softcore.tools import run_tool

DEVICE = ["--25k", "--package", "CABGA381", "--speed", "6"]
# In banks of 8192, 4096, 2048 and 1024 words, whose rows have 2, 4, 9 and 18 bits; the parity's 1.
SIZE, ROWS = 60 * 1024, {1, 2, 4, 9, 18}


class Chained(Elaboratable):
    """A memory whose inputs come from a chain of registers, and whose outputs go to one pin."""

    def __init__(self, ram):
        self.ram = ram
        self.enters, self.leaves = Signal(), Signal()

    def elaborate(self, platform):
        m = Module()
        m.submodules.ram = ram = self.ram
        inputs = Cat(*((bus.adr, bus.stb, bus.more) for bus in (ram.ibus, ram.dbus)),
                     ram.dbus.dat_w, ram.dbus.sel, ram.dbus.we)
        chain = Signal(len(inputs))
        m.d.comb += inputs.eq(chain)
        m.d.sync += [
            chain.eq(Cat(self.enters, chain)),
            self.leaves.eq(Cat(ram.ibus.dat_r, ram.ibus.ack, ram.dbus.dat_r, ram.dbus.ack,
                               ram.damaged, ram.place).xor()),
        ]
        return m


def synthesised(folder, image):
    """Synthesise a memory that holds an image; its cells, with parameters but without contents."""
    folder.mkdir(parents=True, exist_ok=True)
    design = Chained(BlockRam(size=SIZE, banks=True, image=image))
    (folder / "top.il").write_text(rtlil.convert(design, ports=[design.enters, design.leaves],
                                                 emit_src=False))
    (folder / "top.ys").write_text("read_rtlil top.il\nsynth_ecp5 -nowidelut -top top "
                                   "-json top.json\n")
    run_tool(["yosys", "-q", "top.ys"], folder)
    cells = json.loads((folder / "top.json").read_text())["modules"]["top"]["cells"].values()
    return Counter((cell["type"], *sorted((name, value) for name, value in
                                          cell["parameters"].items()
                                          if not name.startswith("INIT")))
                   for cell in cells)


def laid_out(folder):
    """Text of the layout of what was synthesised in a folder."""
    run_tool(["nextpnr-ecp5", "-q", *DEVICE, "--json", "top.json", "--textcfg", "top.config",
              "--lpf-allow-unconstrained", "--seed", "1", "--timing-allow-fail"], folder)
    return (folder / "top.config").read_text()


def half():
    """Half a memory of code; some columns of it have zeros only, or ones only."""
    random_ = random.Random(3)
    words = [random_.getrandbits(32) & 0x0FFF_FFF3 | 0x0100_0000 for _ in range(SIZE // 8)]
    return b"".join(word.to_bytes(4, "little") for word in words)


@pytest.mark.soak
def test_a_layout_is_equal_to_one_that_had_the_firmware_from_the_start(workdir):
    """Byte by byte. Constant columns and zeros change no cell, and none is left out."""
    image = random.Random(2).randbytes(SIZE - 100)
    cells, with_image, with_half = (synthesised(workdir / name, content) for name, content in
                                    (("noise", placeholder(SIZE)), ("image", image),
                                     ("half", half())))
    assert cells == with_image == with_half
    layout = laid_out(workdir / "noise")
    assert set(map(int, re.findall(r"DP16KD\.DATA_WIDTH_A (\d+)$", layout, re.M))) == ROWS
    filled = with_firmware(layout, image, size=SIZE, banks=True)
    assert filled != layout
    assert filled == laid_out(workdir / "image")
