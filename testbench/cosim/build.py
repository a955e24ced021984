# SPDX-License-Identifier: Apache-2.0
"""Build the cocotb simulation: ``bench.sv``, the emitted Verilog and the plant, as one program.

cocotb's own runner makes every signal public, which costs two thirds of the speed, and needs make
and perl. Here the tools are called directly and only the probes are public. The result is kept
under ``build/native/``, as the native library is.
"""

from importlib.metadata import version
from pathlib import Path

import cocotb_tools.config

from testbench import tools
from testbench.native import build, compiling, probes, verilated
from testbench.native.compiling import BUILD
from testbench.native.signals import RECORDED

__all__ = ["TOP", "program"]

HERE = Path(__file__).parent
TOP = "bench"

WORD = 64   # probes in a word of ``bench_watched``
VERILATE = ["--timing", "--vpi", "--top-module", TOP]
RUNTIME = [*verilated.RUNTIME, "verilated_timing.cpp", "verilated_vpi.cpp", "verilated_dpi.cpp"]
OPTIONS = verilated.includes(timing=True)


def _readings() -> str:
    """SystemVerilog that passes every watched probe of the controller to C++, by its number."""
    lines = []
    for index, probe in enumerate(probes.PROBES):
        if index % WORD == 0:
            lines.append(f"watched = bench_watched({index // WORD});")
        if probe.scope:
            value = ".".join(["controller", *probe.path[1:]])
            lines.append(f"if (watched[{index % WORD}]) "
                         f"bench_probe({index}, 64'(unsigned'({value})));")
    return "\n".join(lines) + "\n"


def program(clock_hz: int, options: build.Options = build.USUAL,
            progress: build.Progress = lambda _: None) -> Path:
    """Path of the program for a controller with ``options``; builds it if there is none.

    Raises
    ------
    testbench.native.compiling.BuildError
        If a tool fails.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    files = [*build.verilog(clock_hz, progress, options), HERE / "bench.sv"]
    compiler = tools.compiler()
    libraries = Path(cocotb_tools.config.libs_dir)
    machine = build.station(progress)

    def make(folder):
        progress("translating the Verilog to C++ for cocotb (Verilator)")
        configuration = folder / "public.vlt"
        configuration.write_text(probes.public(writable=True))
        (folder / "probes.svh").write_text(_readings())
        (folder / "waves.inc").write_text(probes.places(RECORDED))
        compiling.verilate([*VERILATE, f"-I{folder}", configuration, *files], folder)
        progress(f"compiling the cocotb simulation ({compiler.name}): a minute, once")
        main = Path(cocotb_tools.config.share_dir) / "lib" / "verilator" / "verilator.cpp"
        own = compiling.objects([main, HERE / "dpi.cpp"], folder,
                                [*OPTIONS, f"-I{folder}", f"-I{build.PLANT}", f"-I{build.HERE}"])
        parts = [*verilated.model(folder, OPTIONS), *verilated.runtime(RUNTIME),
                 *machine, *own]
        # Python finds the station's functions in the program itself.
        compiling.link(parts, [f"-L{libraries}", "-lcocotbvpi_verilator",
                               f"-Wl,-rpath,{libraries}", "-rdynamic"], folder / TOP)

    key = compiling.digest(VERILATE, verilated.KEY,
                           machine[0].parent.name, probes.public(writable=True), _readings(),
                           probes.places(RECORDED), compiler.command, compiler.version,
                           version("cocotb"),
                           sources=[*files, *build.sources(), build.HERE / "verilated.py",
                                    HERE / "dpi.cpp"])
    return compiling.kept(BUILD / f"cosim-{key}", make) / TOP
