# SPDX-License-Identifier: Apache-2.0
"""Compile what Verilator makes: a model as two units, its runtime once for all models.

Verilator spreads a model over some thirty files, each of which reads the same headers for 1.6
seconds. At -O1 the controller takes 15 CPU seconds as two units, and 63 file by file.

The runtime is the same for all models: each of its files is compiled once, in one way. The
coroutines of a model's own clocks need C++20.
"""

import re
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from testbench import tools
from testbench.native import compiling

__all__ = ["KEY", "RUNTIME", "in_loops", "includes", "model", "runtime"]

STANDARD = ["-std=gnu++20"]
RUNTIME = ["verilated.cpp", "verilated_threads.cpp"]
# Of a model and the runtime: -O2 takes half as long again to twice as long to compile, and the
# clocks a second are the same.
MODEL = ["-O1"]
# Initial values of a memory, all the same, as Yosys writes them.
ALIKE = re.compile(r"^( *)(\S+)\[0\] = (\S+);\n(?: *\2\[(\d+)\] = \3;\n)+", re.MULTILINE)
# What a build with Verilator depends on, besides its sources.
KEY = (compiling.VERILATE, compiling.COMPILE, MODEL, version("verilator"))


def in_loops(text: str) -> str:
    """Verilog in which a memory whose words begin with the same value gets it in a loop.

    Yosys writes a line per word; those of the processor's memory took Verilator half of its time.
    """
    def loop(found):
        space, memory, value, last = found.groups()
        words = int(last) + 1
        if found[0].count("\n") != words:
            return found[0]
        return f"{space}for (int i = 0; i < {words}; i = i + 1) {memory}[i] = {value};\n"

    return ALIKE.sub(loop, text)


def includes(*, timing: bool = False) -> list[str]:
    """Options to compile Verilator's runtime, and all that includes a model."""
    include = tools.verilator_root() / "include"
    off = ("COVERAGE", "SC", "TRACE", "TRACE_FST", "TRACE_VCD", "TRACE_SAIF")
    return [*STANDARD, "-DVERILATOR=1", *(f"-DVM_{what}=0" for what in off),
            f"-DVM_TIMING={int(timing)}", f"-I{include}", f"-I{include / 'vltstd'}"]


def runtime(names: Sequence[str] = RUNTIME, options: Sequence[str] = (), *,
            first: Sequence[str] = ()) -> list[Path]:
    """Object files of the runtime's C++ files ``names``.

    ``options`` are further ones of all the files, ``first`` of ``verilated.cpp`` alone.
    """
    def compiled(name):
        source = tools.verilator_root() / "include" / name
        chosen = [*includes(timing=True), *MODEL, *options, *(first if name == RUNTIME[0] else ())]
        key = compiling.digest(KEY, name, chosen, tools.compiler().command,
                               tools.compiler().version)
        folder = compiling.kept(compiling.BUILD / f"runtime-{key}",
                                lambda folder: compiling.objects([source], folder, chosen))
        return folder / f"{source.stem}.o"

    return [compiled(name) for name in names]


def model(folder: Path, options: Sequence[str]) -> list[Path]:
    """Object files of the model that Verilator wrote to ``folder``, made there."""
    files = sorted(folder.glob("Vtop*.cpp"))
    units = []
    # What compiling.objects calls slow runs once, and is not optimised.
    for name, slow in (("Model", False), ("ModelSlow", True)):
        unit = folder / f"{name}.cpp"
        unit.write_text("".join(f'#include "{file.name}"\n' for file in files
                                if ("Slow" in file.stem) == slow))
        units.append(unit)
    return compiling.objects(units, folder, [*options, f"-I{folder}", *MODEL])
