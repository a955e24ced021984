# SPDX-License-Identifier: Apache-2.0
"""One component as compiled code, for tests that need millions of its clocks."""

import ctypes
from pathlib import Path

from amaranth.back import verilog
from amaranth.lib import wiring

from testbench import tools
from testbench.native import compiling, verilated

__all__ = ["component_library"]

HERE = Path(__file__).parent


def component_library(component: wiring.Component, driver: Path, *headers: Path) -> ctypes.CDLL:
    """Library of the C++ file ``driver`` with ``component`` as its class ``Vtop``.

    ``headers`` are what the driver includes besides. It is built once for the contents of all, in
    about ten seconds.

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
        options = verilated.includes()
        own = compiling.objects([driver], folder, [*options, f"-I{folder}", f"-I{HERE}",
                                                 *(f"-I{header.parent}" for header in headers)])
        compiling.link([*verilated.model(folder, options), *verilated.runtime(), *own],
                       ["-shared"], folder / "component.so")

    key = compiling.digest(text, verilated.KEY, tools.compiler().command,
                           tools.compiler().version,
                           sources=[driver, *headers, HERE / "verilated.py"])
    folder = compiling.kept(compiling.BUILD / f"{driver.stem}-{key}", build)
    return ctypes.CDLL(str(folder / "component.so"))
