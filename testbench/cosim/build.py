# SPDX-License-Identifier: Apache-2.0
"""Build the cocotb simulation: ``bench.sv``, the emitted Verilog and the plant, as one program.

cocotb's own runner would make everything public, which costs two thirds of the speed, and needs
make and perl; here the tools are called directly and only the probes are public. Kept under
``build/native/`` as the native library is.
"""

from importlib.metadata import version
from pathlib import Path

import cocotb_tools.config

from testbench import tools
from testbench.native import build, compiling, probes
from testbench.native.compiling import BUILD

__all__ = ["TOP", "program"]

HERE = Path(__file__).parent
TOP = "bench"

# Coroutines, which the clock in SystemVerilog needs.
STANDARD = ["-std=c++20"]
VERILATE = ["--timing", "--vpi", "--top-module", TOP]
RUNTIME = ["verilated.cpp", "verilated_threads.cpp", "verilated_timing.cpp", "verilated_vpi.cpp",
           "verilated_dpi.cpp"]


def _readings() -> str:
    """SystemVerilog that hands every probe of the controller to C++, by its number."""
    return "".join(
        f"bench_probe({index}, 64'(unsigned'({'.'.join(['controller', *probe.path[1:]])})));\n"
        for index, probe in enumerate(probes.PROBES) if probe.scope)


def program(clock_hz: int, progress: build.Progress = lambda _: None) -> Path:
    """Path of the program for a controller at ``clock_hz``; builds it if there is none.

    Raises
    ------
    testbench.native.compiling.BuildError
        If a tool fails.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    files = [*build.verilog(clock_hz, progress), HERE / "bench.sv"]
    compiler = tools.compiler()
    libraries = Path(cocotb_tools.config.libs_dir)

    def make(folder):
        progress("translating the Verilog to C++ for cocotb (Verilator)")
        configuration = folder / "public.vlt"
        configuration.write_text(probes.public(writable=True))
        (folder / "probes.svh").write_text(_readings())
        compiling.verilate([*VERILATE, f"-I{folder}", configuration, *files], folder)
        progress(f"compiling the cocotb simulation ({compiler.name}): a minute, once")
        sources = [
            *sorted(folder.glob("Vtop*.cpp")),
            *(tools.verilator_root() / "include" / name for name in RUNTIME),
            Path(cocotb_tools.config.share_dir) / "lib" / "verilator" / "verilator.cpp",
            *build.STATION, HERE / "dpi.cpp"]
        parts = compiling.objects(sources, folder,
                                  [*STANDARD, *build.includes(folder, timing=True)])
        # Python finds the station's functions in the program itself.
        compiling.link(parts, [f"-L{libraries}", "-lcocotbvpi_verilator",
                               f"-Wl,-rpath,{libraries}", "-rdynamic"], folder / TOP)

    key = compiling.digest(VERILATE, compiling.VERILATE, compiling.COMPILE,
                           probes.public(writable=True), _readings(),
                           compiler.command, compiler.version, version("verilator"),
                           version("cocotb"),
                           sources=[*files, *build.sources(), HERE / "dpi.cpp"])
    return compiling.kept(BUILD / f"cosim-{key}", make) / TOP
