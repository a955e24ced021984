# SPDX-License-Identifier: Apache-2.0
"""The processor: VexRiscv from its data package, behind two simple buses."""

from importlib.util import find_spec
from pathlib import Path

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["BusSignature", "VexRiscv"]

# What the package leaves open (``'bx``), and what we make of it. Simulated, open bits are 0;
# synthesis takes what costs least.
DECIDED = (
    # A compressed instruction that no case expands becomes 0, which is illegal.
    ("IBusCachedPlugin_decompressor_decompressed = 32'b" + 32 * "x" + ";",
     "IBusCachedPlugin_decompressor_decompressed = 32'b" + 32 * "0" + ";"),
    # Of mret and sret, both legal, only mret has a place to jump to. sret becomes illegal.
    ("(decode_INSTRUCTION & 32'hdfffffff) == 32'h10200073",
     "(decode_INSTRUCTION & 32'hffffffff) == 32'h30200073"),
)


class BusSignature(wiring.Signature):
    """Initiator's side of Wishbone B4 with 32-bit words. ``ack`` ends each access.

    ``more`` (cycle type 010): the access of the next word follows at once.
    """

    def __init__(self):
        super().__init__({
            "adr": Out(30), "dat_w": Out(32), "dat_r": In(32), "sel": Out(4), "we": Out(1),
            "stb": Out(1), "more": Out(1), "ack": In(1),
        })


class VexRiscv(wiring.Component):
    """VexRiscv, RV32IMAC with caches of 4 KiB, starting at address 0.

    The firmware uses its compressed instructions, which make the image a fifth smaller.

    The data cache writes through. It does not cache addresses with the top bit set.

    Ref: SpinalHDL/VexRiscv, as packaged in ``pythondata-cpu-vexriscv`` (MIT licence).

    Members
    -------
    ibus, dbus : Out(BusSignature)
        Instructions and data.
    interrupt : In(2)
        External interrupts 0 and 1, level.
    """

    ibus: Out(BusSignature())
    dbus: Out(BusSignature())
    interrupt: In(2)

    @staticmethod
    def verilog() -> str:
        """Text of the core's Verilog, in which nothing that an instruction does is left open.

        The package leaves it open for some that do not exist. Simulated, they are trapped or jump
        to address 0. On a board the core would obey what nobody has written. Here they are illegal.

        Not mended: some that do not exist are taken for others, the same on a board as in
        simulation: 0x0000 for ``addi s0, sp, 0``, ``lwu`` for a load, and ``slli``, ``srli`` and
        ``srai`` by more than 31 for shifts.

        Raises
        ------
        ValueError
            If the package has other text there.
        """
        package = find_spec("pythondata_cpu_vexriscv").submodule_search_locations[0]
        text = (Path(package) / "verilog" / "VexRiscv_IMAC.v").read_text()
        for package_has, gapkeeper_has in DECIDED:
            if text.count(package_has) != 1:
                raise ValueError(f"the processor's package has no longer: {package_has}")
            text = text.replace(package_has, gapkeeper_has)
        return text

    def elaborate(self, platform):
        m = Module()

        ports = {}
        for name, bus in (("iBus", self.ibus), ("dBus", self.dbus)):
            cycle = Signal(name=f"{name}_cyc")
            strobe = Signal(name=f"{name}_stb")
            kind = Signal(3, name=f"{name}_cti")
            m.d.comb += [bus.stb.eq(cycle & strobe), bus.more.eq(kind == 0b010)]
            ports |= {
                f"o_{name}Wishbone_CYC": cycle, f"o_{name}Wishbone_STB": strobe,
                f"i_{name}Wishbone_ACK": bus.ack, f"o_{name}Wishbone_WE": bus.we,
                f"o_{name}Wishbone_ADR": bus.adr, f"i_{name}Wishbone_DAT_MISO": bus.dat_r,
                f"o_{name}Wishbone_DAT_MOSI": bus.dat_w, f"o_{name}Wishbone_SEL": bus.sel,
                f"i_{name}Wishbone_ERR": 0,
                f"o_{name}Wishbone_CTI": kind,
                f"o_{name}Wishbone_BTE": Signal(2, name=f"{name}_bte"),
            }
        m.submodules.core = Instance(
            "VexRiscv", i_clk=ClockSignal(), i_reset=ResetSignal(),
            i_externalResetVector=C(0, 32), i_timerInterrupt=0, i_softwareInterrupt=0,
            i_externalInterruptArray=Cat(self.interrupt, C(0, 30)), **ports)
        if platform is not None and hasattr(platform, "add_file"):
            platform.add_file("VexRiscv.v", self.verilog())

        return m
