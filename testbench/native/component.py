# SPDX-License-Identifier: Apache-2.0
"""One component as compiled code, for tests that need millions of its clocks."""

import ctypes
from importlib.metadata import version
from pathlib import Path

from amaranth.back import verilog
from amaranth.lib import wiring

from testbench import tools
from testbench.native import compiling
from testbench.native.build import RUNTIME, STANDARD, includes

__all__ = ["component_library"]


def component_library(component: wiring.Component, driver: Path) -> ctypes.CDLL:
    """Library of the C++ file ``driver`` with ``component`` as its class ``Vtop``.

    It is built once for what both contain, in some ten seconds.

    Raises
    ------
    testbench.native.compiling.BuildError
        If a tool fails.
    """
    tools.use_packaged()
    text = verilog.convert(component, name="top", emit_src=False)

    def build(folder):
        source = folder / "top.v"
        source.write_text(text)
        compiling.verilate(["--top-module", "top", source], folder)
        runtime = [tools.verilator_root() / "include" / name for name in RUNTIME]
        parts = compiling.objects([*sorted(folder.glob("Vtop*.cpp")), *runtime, driver], folder,
                                  [*STANDARD, *includes(folder)])
        compiling.link(parts, ["-shared"], folder / "component.so")

    key = compiling.digest(text, compiling.VERILATE, compiling.COMPILE, tools.compiler().command,
                           tools.compiler().version, version("verilator"), sources=[driver])
    folder = compiling.kept(compiling.BUILD / f"{driver.stem}-{key}", build)
    return ctypes.CDLL(str(folder / "component.so"))
