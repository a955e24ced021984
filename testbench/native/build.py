# SPDX-License-Identifier: Apache-2.0
"""Build the native simulation: emitted Verilog and the plant's C++ into one shared library.

Verilator's binary and the C++ compiler are called directly, so that neither make nor perl is
needed. Everything is kept under ``build/native/`` by the digest of what goes into it, in three
steps: the Verilog by the gateware's sources; the compiled model, which takes a minute, by the
Verilog; the library by the model and the bench's C++. Firmware is none of that: it is loaded when a
simulation starts.
"""

import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

from softcore import top
from testbench import tools
from testbench.native import compiling, probes, state
from testbench.native.compiling import BUILD

__all__ = ["HERE", "PLANT", "STATION", "includes", "library", "plant_library", "verilog"]

HERE = Path(__file__).parent
PLANT = HERE.parent / "plant"
STATION = [*(PLANT / f"{name}.cpp"
             for name in ("plant", "gap", "sinker", "wire_gap", "wire", "workpiece")),
           HERE / "station.cpp"]
# Options of the controller by the kind of its machine.
KINDS = {"sinker": {}, "wire": {"jump_axis": 15}}

STANDARD = ["-std=gnu++17"]
# Calls inside the model need no detour for another library's sake: a tenth faster.
INSIDE = ["-fvisibility=hidden", "-fno-semantic-interposition"]
VERILATE = ["--flatten", "--top-module", "gapkeeper"]
RUNTIME = ["verilated.cpp", "verilated_threads.cpp"]

Progress = Callable[[str], None]


def sources() -> list[Path]:
    """Every file that a change of the bench's C++ can be in."""
    return sorted(path for folder in (HERE, PLANT) for path in folder.iterdir()
                  if path.suffix in {".cpp", ".hpp"})


def includes(model: Path, *, timing: bool = False) -> list[str]:
    """Options to compile what Verilator made in ``model``, and the bench."""
    include = tools.verilator_root() / "include"
    off = ("COVERAGE", "SC", "TRACE", "TRACE_FST", "TRACE_VCD", "TRACE_SAIF")
    return ["-DVERILATOR=1", *(f"-DVM_{what}=0" for what in off), f"-DVM_TIMING={int(timing)}",
            *(f"-I{path}" for path in (model, include, include / "vltstd", PLANT, HERE))]


def verilog(clock_hz: int, progress: Progress, kind: str = "sinker") -> list[Path]:
    """Files of the emitted Verilog, of the controller for a kind of machine."""
    def build(folder):
        progress("writing the controller as Verilog")
        tools.use_packaged()
        for index, text in enumerate(top.simulation_verilog(clock_hz, **KINDS[kind])):
            (folder / f"controller_{index}.v").write_text(text)

    key = compiling.digest(top.digest(), clock_hz, version("amaranth"), *KINDS[kind].items())
    return sorted(compiling.kept(BUILD / f"verilog-{key}", build).glob("*.v"))


def _model(files, clock_hz, progress):
    """Folder with the Verilated model: its headers and its object files."""
    compiler = tools.compiler()
    runtime = [tools.verilator_root() / "include" / name for name in RUNTIME]

    def build(folder):
        progress("translating the Verilog to C++ (Verilator)")
        configuration = folder / "public.vlt"
        configuration.write_text(probes.public(writable=False))
        compiling.verilate([*VERILATE, configuration, *files], folder)
        made = [*sorted(folder.glob("Vtop*.cpp")), *runtime]
        progress(f"compiling the simulated machine ({compiler.name}): a minute or two, once")
        options = [*STANDARD, *INSIDE, *includes(folder)]
        if not compiler.gcc:
            compiling.objects(made, folder, options)
            return
        # GCC lays the code out so that it runs a quarter faster, if it has seen it run.
        parts = compiling.objects(made, folder, [*options, "-fprofile-generate"])
        with tempfile.TemporaryDirectory(dir=BUILD) as place:
            rehearsal = Path(place) / "rehearsal.so"
            _link_bench(folder, parts, Path(place), rehearsal, ["-fprofile-generate"])
            compiling.run([sys.executable, "-m", "testbench.native.rehearse", rehearsal, clock_hz],
                          cwd=HERE.parents[1])
        progress("compiling it again, for speed")
        compiling.objects(made, folder, [*options, "-fprofile-use", "-fprofile-partial-training"])

    key = compiling.digest(VERILATE, INSIDE, compiling.VERILATE, compiling.COMPILE,
                           probes.public(writable=False), compiler.command,
                           compiler.version, version("verilator"),
                           sources=[*files, HERE / "rehearse.py"])
    return compiling.kept(BUILD / f"model-{key}", build)


def _link_bench(model, parts, place, target, options=()):
    """Compile the bench's C++ and link it with the objects of a model."""
    (place / "probes.inc").write_text(probes.header())
    (place / "state.inc").write_text(state.header(model))
    own = compiling.objects([*STATION, HERE / "native.cpp"], place,
                            [*STANDARD, f"-I{place}", *includes(model)])
    compiling.link([*parts, *own], ["-shared", *options], target)


def library(clock_hz: int, progress: Progress = lambda _: None, kind: str = "sinker") -> Path:
    """Path of the library for a controller at ``clock_hz``; builds it if there is none.

    ``kind`` is that of its machine, of ``KINDS``.

    Raises
    ------
    testbench.native.compiling.BuildError
        If a tool fails.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    model = _model(verilog(clock_hz, progress, kind), clock_hz, progress)

    def build(folder):
        progress("compiling the bench")
        _link_bench(model, sorted(model.glob("*.o")), folder, folder / "gapkeeper.so")

    key = compiling.digest(model.name, probes.header(), state.header(model), sources=sources())
    return compiling.kept(BUILD / f"library-{key}", build) / "gapkeeper.so"


def plant_library() -> Path:
    """Path of a library of the plant alone, for tests of its physics."""
    def build(folder):
        own = compiling.objects([*STATION, HERE / "alone.cpp"], folder,
                                [*STANDARD, f"-I{PLANT}", f"-I{HERE}"])
        compiling.link(own, ["-shared"], folder / "plant.so")

    key = compiling.digest(compiling.COMPILE, tools.compiler().command, tools.compiler().version,
                           sources=sources())
    return compiling.kept(BUILD / f"plant-{key}", build) / "plant.so"
