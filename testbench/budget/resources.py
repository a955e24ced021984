# SPDX-License-Identifier: Apache-2.0
"""Cost of the gateware on an ECP5: cells and clock of every block and of the whole.

Each block is cut out of the whole controller, with its parameters on a board, and synthesised
alone. Its clock is that of a layout without pads (``--out-of-context``), so only paths inside the
block count. The clock of the whole is the one that a board must reach; it comes from that board's
bitstream. All layouts have one seed; others change a clock by some per cent.
"""

import hashlib
import json
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace

from amaranth.back import rtlil

from softcore.build import BOARDS, SMALL_MEMORIES, STAT, SYNTHESIS, Cells, build, run_tool
from softcore.cpu import VexRiscv
from softcore.top import simulated

CORE = r"cell \VexRiscv"     # of a block that has the processor in it
BUILD = Path(__file__).parents[2] / "build" / "budget"
BOARD = BOARDS["ulx3s"]
DEVICE = ["--45k", "--package", "CABGA381", "--speed", "6"]
# All axes are equal, and the last one is measured. Pads belong to the boards.
LEFT_OUT = {"axis_x", "axis_y", "limits_x", "limits_y", "pads", "gate"}
# What joins blocks is measured by them.
JOINING = {"controller", "motion", "drives", "gap"}
PLACE = re.compile(r"gapkeeper\.soc\.(?:controller\.)?(?:(?:motion|drives|gap)\.)?"
                   r"(\w+)(?:\$\d+)?")


@dataclass(frozen=True)
class Resources:
    """Cells, and the frequency that the layout reaches: None where no path lies within."""

    cells: Cells
    fmax_mhz: float | None


def netlist() -> str:
    """The controller as on a board but without the pads, as RTLIL with its hierarchy.

    Its memory and its oscilloscope are the smallest board's, so that every block fits ``DEVICE``.
    """
    smallest = min(BOARDS.values(), key=lambda board: board.memory_size)
    top, outside = simulated(BOARD.clock_hz, memory_size=smallest.memory_size,
                             memory_banks=smallest.memory_banks,
                             scope_depth=smallest.scope_depth)
    return rtlil.convert(top, name="gapkeeper", ports=outside, emit_src=False,
                         platform=SimpleNamespace(device="LFE5U"))


def blocks(text: str) -> dict[str, str]:
    """Netlists of the blocks by name: the controller's, and those of the processor around it.

    Each has its module, named ``block``, and the modules below.
    """
    modules = {found[1]: found[0] for found in
               re.finditer(r"(?:^attribute .*\n)*^module \\(\S+)\n(?:.*\n)*?^end\n", text, re.M)}

    def below(name):
        yield name
        for cell in sorted(set(re.findall(r"^  cell \\(\S+)", modules[name], re.M))):
            if cell in modules:
                yield from below(cell)

    found = {}
    for module in modules:
        place = PLACE.fullmatch(module)
        if place and place[1] not in LEFT_OUT | JOINING:
            cut = "".join(modules[name] for name in dict.fromkeys(below(module)))
            # Numbers that Amaranth appends depend on the rest of the design.
            found[place[1]] = cut.replace(f"module \\{module}\n", "module \\block\n")
    return found


def _kept(what, text, measure):
    """Result of ``measure(folder)``, kept by content under ``build/budget``."""
    BUILD.mkdir(parents=True, exist_ok=True)
    core = VexRiscv.verilog() if CORE in text else ""
    key = f"{what}{DEVICE}{SYNTHESIS}{SMALL_MEMORIES}{core}{text}"
    name = hashlib.sha256(key.encode()).hexdigest()[:20]
    kept = BUILD / f"{name}.json"
    if not kept.exists():
        with tempfile.TemporaryDirectory(dir=BUILD) as folder:
            found = json.dumps(measure(Path(folder)))
            made = Path(folder) / "result"
            made.write_text(found)
            made.replace(kept)
    return json.loads(kept.read_text())


def _synthesise(text, folder):
    core = memories = ""
    if CORE in text:
        core, memories = "read_verilog core.v\n", f"{SMALL_MEMORIES}\n"
        (folder / "core.v").write_text(VexRiscv.verilog())
    (folder / "block.il").write_text(text)
    (folder / "block.ys").write_text(
        f"{core}read_rtlil block.il\n{memories}synth_ecp5 {SYNTHESIS} -top block "
        f"-json block.json\n{STAT}\n")
    run_tool(["yosys", "-q", "block.ys"], folder)
    return asdict(Cells.counted((folder / "stat.json").read_text()))


def cells(text: str) -> Cells:
    """Cells of one netlist of ``blocks``."""
    return Cells(**_kept("cells", text, lambda folder: _synthesise(text, folder)))


def layout(text: str) -> float | None:
    """Frequency in MHz of one netlist of ``blocks``, laid out alone."""
    def measure(folder):
        _synthesise(text, folder)
        run_tool(["nextpnr-ecp5", "-q", *DEVICE, "--json", "block.json", "--out-of-context",
                  "--freq", str(BOARD.clock_hz / 1e6), "--timing-allow-fail", "--seed", "1",
                  "--report", "report.json"], folder)
        clocks = json.loads((folder / "report.json").read_text())["fmax"].values()
        return min((clock["achieved"] for clock in clocks), default=None)
    return _kept("layout", text, measure)


def measure_all(progress: Callable[[str], None] = lambda text: None,
                ) -> Iterator[tuple[str, Resources]]:
    """Yield every block and its cost, the whole last, as on ``BOARD``.

    ``progress`` gets a sentence before each. Results for the same sources are used again.
    """
    for name, text in blocks(netlist()).items():
        progress(f"Laying out {name}.")
        yield name, Resources(cells(text), layout(text))
    made = build(BOARD, progress)
    yield "whole", Resources(made.cells, min(fmax for fmax, _ in made.fmax_mhz.values()))
