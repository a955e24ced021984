# SPDX-License-Identifier: Apache-2.0
"""The whole controller with its pads: for a board's ports, or for simulation."""

import argparse
import hashlib
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

from amaranth import *
from amaranth.back import rtlil, verilog
from amaranth.lib import io, wiring

from constraints.board import Journal
from rtl.members import SERIAL, pins
from rtl.pads import INPUTS, OUTPUTS, Pads
from softcore.cpu import VexRiscv
from softcore.flash import SECTOR
from softcore.sleep import GATE
from softcore.soc import Soc

__all__ = ["NO_GATEWARE", "Top", "digest", "is_kept", "simulated", "simulation_netlist",
           "simulation_verilog"]

ROOT = Path(__file__).parents[1]
# Sources beside the gateware's that have no part in it: a change of theirs needs no new layout.
NO_GATEWARE = frozenset(f"softcore/{name}.py" for name in (
    "generate", "image", "render", "tables/conditions", "tables/grbl", "tables/pairs",
    "tables/references", "tables/settings", "texts"))
SIMULATED_DIVISOR = 8  # clocks per bit of the serial link
SIMULATED_JOURNAL = Journal(0xE0_0000, 16 * SECTOR, 80 * SECTOR)  # as on the ULX3S


def is_kept(length: int) -> bool:
    """Whether a copy of the simulated flash memory's region may have so many bytes.

    It has the journal, and then whole sectors of the firmware slots, up to the last one in use.
    """
    region = SIMULATED_JOURNAL
    return region.size <= length <= region.whole and length % SECTOR == 0


def digest() -> str:
    """Digest of every gateware source, in hexadecimal; pins and board have no part in it.

    The processor's Verilog is from a package, and is a source as well.
    """
    total = hashlib.sha256(VexRiscv.verilog().encode())
    for top in ("rtl", "softcore"):
        for path in sorted((ROOT / top).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            if name not in NO_GATEWARE:
                total.update(name.encode() + b"\\0" + path.read_bytes())
    return total.hexdigest()


class Top(Elaboratable):
    """Pads and controller, joined, in a clock domain that makes its own reset.

    Boards have no dependable reset pin. ``sync`` is in reset after configuration and while
    ``locked`` is low, and then for ``RESET_CLOCKS`` more clocks; on ECP5 only the processor is in
    reset for these further clocks.

    An ECP5 has a dedicated net (GSR) that sets every register to its initial value. There it is
    used in place of a reset signal, which would be by far the largest net of ordinary wires.

    Parameters
    ----------
    soc : Soc
        The controller.
    ports : object
        The ports that ``rtl.pads.Pads`` asks for.
    clock : Signal
        Clock of ``sync``.
    locked : Value
        The clock is good.
    """

    RESET_CLOCKS = 15

    def __init__(self, soc: Soc, ports, clock, locked=1):
        self.soc = soc
        self.ports = ports
        self.clock = clock
        self.locked = locked

    def elaborate(self, platform):
        m = Module()
        if getattr(platform, "device", "").startswith("LFE5"):
            self._global_reset(m)
        else:
            self._wired_reset(m)

        m.submodules.soc = soc = self.soc
        m.submodules.pads = pads = Pads(self.ports)
        for name, port in pins().items():
            inner, outer = getattr(soc, name), getattr(pads, name)
            m.d.comb += inner.eq(outer) if port.flow is wiring.In else outer.eq(inner)
        for name in SERIAL:
            inner, outer = getattr(soc, name), getattr(pads, name)
            m.d.comb += inner.eq(outer) if name in INPUTS else outer.eq(inner)
        return m

    def _wired_reset(self, m):
        m.domains.sync = sync = ClockDomain()
        m.domains.power_on = power_on = ClockDomain(reset_less=True, local=True)
        clocks = Signal(range(self.RESET_CLOCKS + 1))
        m.d.comb += [sync.clk.eq(self.clock), power_on.clk.eq(self.clock)]
        m.d.power_on += sync.rst.eq(clocks != self.RESET_CLOCKS)
        with m.If(~Value.cast(self.locked)):
            m.d.power_on += clocks.eq(0)
        with m.Elif(clocks != self.RESET_CLOCKS):
            m.d.power_on += clocks.eq(clocks + 1)

    def _global_reset(self, m):
        m.domains.sync = sync = ClockDomain(reset_less=True)
        # Two registers that GSR does not affect synchronise its end to the clock.
        good = [self.locked, Signal(name="good_0"), Signal(name="good_1")]
        for index, (level, held) in enumerate(pairwise(good)):
            m.submodules[f"good_{index}"] = Instance(
                "FD1S3AX", p_GSR="DISABLED", i_CK=self.clock, i_D=level, o_Q=held)
        m.submodules.reset = Instance("SGSR", i_CLK=self.clock, i_GSR=good[-1])
        # The processor's registers have no initial values, so it needs a reset signal.
        clocks = Signal(range(self.RESET_CLOCKS + 1))
        m.d.comb += [sync.clk.eq(self.clock), self.soc.hold.eq(clocks != self.RESET_CLOCKS)]
        with m.If(clocks != self.RESET_CLOCKS):
            m.d.sync += clocks.eq(clocks + 1)


def simulated(clock_hz: int, **options) -> tuple[Top, dict]:
    """Controller for the simulator; its ports have the names of ``rtl.members.pins``.

    The memory is empty: the simulator loads firmware when it starts.
    """
    ports = SimpleNamespace(
        **{name: io.SimulationPort("i", width, name=name) for name, (width, _) in INPUTS.items()},
        **{name: io.SimulationPort("o", width, name=name) for name, (width, _) in OUTPUTS.items()})
    outside = {name: (getattr(ports, name).i, None) for name in INPUTS}
    outside |= {name: (getattr(ports, name).o, None) for name in OUTPUTS}
    soc = Soc(clock_hz=clock_hz, link_divisor=SIMULATED_DIVISOR, journal=SIMULATED_JOURNAL,
              **options)
    clock, good = Signal(name="clk"), Signal(name="power_good")
    outside |= {"clk": (clock, None), "power_good": (good, None)}
    return Top(soc, ports, clock, good), outside


def simulation_verilog(clock_hz: int, **options) -> list[str]:
    """Verilog of module ``gapkeeper`` and of the modules that it instantiates, one text per file.

    Its ports: ``clk``, ``rx``, ``tx`` and the pins; and ``power_good``, low for a brown-out. It
    resets itself.
    """
    top, outside = simulated(clock_hz, **options)
    text = verilog.convert(top, name="gapkeeper", ports=outside, emit_src=False)
    return [text, VexRiscv.verilog(), GATE]


def simulation_netlist(clock_hz: int, **options) -> list[str]:
    """Like ``simulation_verilog``, for Yosys: RTLIL, the processor, and the gate's ports only."""
    top, outside = simulated(clock_hz, **options)
    text = rtlil.convert(top, name="gapkeeper", ports=outside, emit_src=False)
    ports = GATE.splitlines()[0]
    return [text, VexRiscv.verilog(), f"{ports}\nendmodule\n"]


def main():
    """Write the simulated controller's Verilog into a folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--clock", type=int, default=2_000_000, help="Hz")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    names = "gapkeeper.v", "VexRiscv.v", "gate.v"
    for name, text in zip(names, simulation_verilog(arguments.clock), strict=True):
        (arguments.folder / name).write_text(text)


if __name__ == "__main__":
    main()
