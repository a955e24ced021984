# SPDX-License-Identifier: Apache-2.0
"""The emitted Verilog of a design, built with Verilator and cocotb's main program as one library.

A signal that nothing drives is a port, for benches to set. The library is kept under
``build/native/`` by the digest of the netlist, so a design is built again only if it has changed.
"""

from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import cocotb_tools.config
from amaranth.back import rtlil, verilog
from amaranth.hdl import ClockDomain, Fragment, Signal
from amaranth.hdl._ast import SignalDict
from amaranth.hdl._ir import Design, Instance, IOBufferInstance
from amaranth.hdl._mem import MemoryData, MemoryInstance

from testbench import tools
from testbench.native import compiling, verilated

__all__ = ["PERIOD_NS", "TOP", "Emitted", "Place", "emit", "library"]

TOP = "top"
PERIOD_NS = 10   # of the clock
OPTIONS = verilated.includes()
# Verilator's own function would abort.
STOPPING = ["-DVL_USER_STOP"]
RUNTIME = [*verilated.RUNTIME, "verilated_vpi.cpp"]
WAVES = ["-UVM_TRACE", "-DVM_TRACE=1", "-UVM_TRACE_VCD", "-DVM_TRACE_VCD=1"]
# Failed assertions end the run.
VERILATE = ["--vpi", "--assert", "--top-module", TOP]
# A block's C++ is one unit: reading the headers takes longest.
MODEL = ["-O1"]
# Before the files that Verilator calls slow: they run once, and are a third of a block's C++.
# Without optimisation of them a block of the motion takes 3.4 CPU seconds to compile, else 5.8.
UNOPTIMISED = '#pragma GCC optimize ("O0")\n'

# Instead of Verilator's own: the engine looks at the number.
STOP = """extern "C" { int stopped = 0; }
void vl_stop(const char* file, int line, const char*) {
    ++stopped;
    VL_PRINTF("%s:%d: assertion failed\\n", file, line);
}
"""
# What a unit includes before its own: parsing it is most of the compiler's work.
HEADERS = ("verilated.h", "verilated_vpi.h", "memory", "string")


@dataclass(frozen=True)
class Place:
    """Where a signal is: the names below the top module that lead to it.

    ``input`` is set if nothing in the design drives it, ``settable`` if a bench may set it.
    """

    path: tuple[str, ...]
    input: bool
    settable: bool


@dataclass
class Emitted:
    """A design as a netlist, with the places of its signals and the names of its memories."""

    design: Design
    text: str
    places: SignalDict = field(default_factory=SignalDict)
    memories: dict[MemoryData, tuple[str, ...]] = field(default_factory=dict)

    @property
    def domain(self) -> ClockDomain:
        """The one clock domain of the design."""
        return self.design.lookup_domain("sync", None)


def _drivers(design: Design) -> SignalDict:
    """For every driven signal, where its driver is: names, and whether that is a register."""
    found = SignalDict()
    for fragment, info in design.fragments.items():
        def add(signals, register, info=info):
            for signal in signals:
                if signal in info.signal_names:
                    found[signal] = ((*info.name[1:], info.signal_names[signal]), register)

        if isinstance(fragment, MemoryInstance):
            for port in fragment._read_ports:
                add(port._data._lhs_signals(), False)
        elif isinstance(fragment, Instance):
            for value, kind in fragment.ports.values():
                if kind == "o":
                    add(value._lhs_signals(), False)
        elif isinstance(fragment, IOBufferInstance):
            if fragment.i is not None:
                add(fragment.i._lhs_signals(), False)
        else:
            for domain, statements in fragment.statements.items():
                for statement in statements:
                    add(statement._lhs_signals(), domain != "comb")
    return found


def emit(fragment: Fragment) -> Emitted:
    """Netlist of an elaborated design, with a port for every signal that nothing drives."""
    tools.use_packaged()
    used = fragment.prepare()
    driven = _drivers(used)
    ports = [(None, signal, None) for signal in used.signal_lca
             if signal not in driven and signal.name and len(signal)]
    while True:
        design = fragment.prepare(ports=ports, hierarchy=(TOP,), propagate_domains=False)
        text, names = rtlil.convert_fragment(design, name=TOP, emit_src=False)
        # A part that only passes signals on leaves no module: so they are ports, too.
        lost = [(None, signal, None) for signal in used.signal_lca
                if signal not in names and signal.name and len(signal)]
        if not lost:
            break
        ports += lost
    emitted = Emitted(design, text)
    driven = _drivers(design)
    inputs = SignalDict((signal, name) for name, signal, _ in design.ports
                        if isinstance(signal, Signal))
    for signal, (_, *path) in names.items():
        if signal.name.startswith("$"):
            continue    # Verilog may have it under any name
        if signal in driven:
            place, register = driven[signal]
            emitted.places[signal] = Place(place if register else tuple(path), False, register)
        else:
            emitted.places[signal] = Place((inputs[signal],), True, True)
    for found, info in design.fragments.items():
        if isinstance(found, MemoryInstance):
            emitted.memories[found._data] = info.name[1:]
    return emitted


def _headers(options: list[str]) -> list[str]:
    """Options for a unit that take the headers precompiled, which halves its time; g++ only."""
    compiler = tools.compiler()
    if not compiler.gcc:
        return []

    def build(folder):
        source = folder / "headers.h"
        source.write_text("".join(f"#include <{name}>\n" for name in HEADERS))
        compiling.run([*compiler.command, *compiling.COMPILE, *options, *MODEL, "-x", "c++-header",
                       source, "-o", folder / "headers.h.gch"])

    key = compiling.digest(HEADERS, options, MODEL, verilated.KEY, compiler.command,
                           compiler.version)
    return ["-include", str(compiling.kept(compiling.BUILD / f"headers-{key}", build)
                            / "headers.h")]


def _unit(files: list[Path]) -> str:
    """C++ of a block as one unit: what runs once comes last, and is not optimised."""
    often, once = ("".join(f'#include "{path}"\n' for path in files
                           if ("Slow" in path.stem) == slow) for slow in (False, True))
    return often + STOP + UNOPTIMISED + once


def _public(emitted: Emitted) -> str:
    """Verilator's configuration: every signal with a name can be read, and what is settable set.

    Verilator may do with the others as it likes: a tenth less CPU time for the tests of a block.
    """
    lines = ["`verilator_config"]
    for path, settable in [*((place.path, place.settable) for place in emitted.places.values()),
                           *((path, True) for path in emitted.memories.values())]:
        lines.append(f'public_flat_{"rw" if settable else "rd"} '
                     f'-module "{".".join((TOP, *path[:-1]))}" -var "{path[-1]}"')
    return "\n".join(sorted(set(lines))) + "\n"


def _build(text: str, public: str, folder: Path, *, waves: bool) -> None:
    """Make ``top.so`` of a netlist as RTLIL, with Verilator's configuration."""
    source = folder / "top.v"
    source.write_text(verilated.in_loops(verilog._convert_rtlil_text(text)))
    configuration = folder / "public.vlt"
    configuration.write_text(public)
    options = OPTIONS + (WAVES if waves else [])
    runtime = RUNTIME + (["verilated_vcd_c.cpp"] if waves else [])
    compiling.verilate([*VERILATE, *(["--trace-vcd"] if waves else []), configuration, source],
                       folder)
    main = Path(cocotb_tools.config.share_dir) / "lib" / "verilator" / "verilator.cpp"
    unit = folder / "unit.cpp"
    unit.write_text(_unit([*sorted(folder.glob("Vtop*.cpp")), main]))
    own = compiling.objects([unit], folder, [*options, *_headers(options), f"-I{folder}", *MODEL])
    libraries = Path(cocotb_tools.config.libs_dir)
    compiling.link([*own, *verilated.runtime(runtime, WAVES if waves else (), first=STOPPING)],
                   ["-shared", f"-L{libraries}", "-lcocotbvpi_verilator",
                    f"-Wl,-rpath,{libraries}"], folder / "top.so")
    for path in [*folder.glob("*.o"), *folder.glob("Vtop*")]:
        path.unlink()


def library(emitted: Emitted, *, waves: bool = False) -> Path:
    """Path of the library of a netlist; builds it if there is none.

    Raises
    ------
    testbench.native.compiling.BuildError
        If a tool fails.
    """
    compiler = tools.compiler()
    public = _public(emitted)
    key = compiling.digest(emitted.text, public, waves, VERILATE, OPTIONS, STOPPING, STOP, MODEL,
                           UNOPTIMISED, RUNTIME, HEADERS, WAVES, verilated.KEY,
                           compiler.command, compiler.version, version("amaranth"),
                           version("cocotb"), sources=[Path(verilated.__file__)])

    def build(folder):
        _build(emitted.text, public, folder, waves=waves)

    return compiling.kept(compiling.BUILD / f"block-{key}", build) / "top.so"
