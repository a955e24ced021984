# SPDX-License-Identifier: Apache-2.0
"""The controller of the native simulation beside Verilator's, in every pin and every clock."""

import ctypes
from pathlib import Path

from rtl.pads import INPUTS, OUTPUTS
from softcore.image import target_image
from softcore.memory import parities, words_of
from testbench import tools
from testbench.native import build, compiling, probes, verilated
from testbench.native.simulation import Simulation
from testbench.native.station import declare

__all__ = ["difference", "pair_library"]

VERILATE = ["--flatten", "--top-module", probes.TOP]
OPTIONS = verilated.includes()
_POINTER, _UNSIGNED = ctypes.c_void_p, ctypes.c_uint64
_FUNCTIONS = {
    "pair_create": (_POINTER, []),
    "pair_free": (None, [_POINTER]),
    "pair_load": (None, [_POINTER, ctypes.POINTER(ctypes.c_uint32), ctypes.c_char_p, _UNSIGNED]),
    "pair_run": (ctypes.c_int, [_POINTER, _POINTER, _UNSIGNED, _UNSIGNED]),
    "pair_clock": (_UNSIGNED, [_POINTER]),
    "pair_name": (ctypes.c_char_p, [_POINTER]),
}


def _names(driven: Path) -> str:
    """Lists of pins and probes, for the preprocessor.

    A class that is synthesised has no probes; if it is the whole controller, its memory has the
    firmware already.
    """
    members = (driven / "controller.hpp").read_text()
    ahead = " ".join(f"X({name})" for name in OUTPUTS if name != "tx")
    inputs = " ".join(f"X({name})" for name in (*INPUTS, "power_good"))
    seen = " ".join(f"X({probe.name}, {probes.plain(probe.path)}, {(1 << probe.bits) - 1:#x}ull)"
                    for probe in probes.PROBES
                    if probe.scope and f" probe_{probe.name}(" in members)
    return "\n".join([
        f"#define PINS(X) {ahead}", f"#define INPUTS(X) {inputs}", f"#define PROBES(X) {seen}",
        f"#define MEMORY(root) ((root)->{probes.plain(probes.MEMORY)})",
        f"#define PARITY(root) ((root)->{probes.plain(probes.PARITY)})",
        *([] if " memory()" in members else ["#define LOADED"]), ""])


def _verilated(clock_hz, options):
    """Folder with Verilator's C++ of the controller, compiled."""
    files = build.verilog(clock_hz, lambda _: None, options)

    def make(folder):
        configuration = folder / "public.vlt"
        configuration.write_text(probes.public(writable=False))
        compiling.verilate([*VERILATE, configuration, *files], folder)
        verilated.model(folder, OPTIONS)

    key = compiling.digest(VERILATE, verilated.KEY, probes.public(writable=False),
                           tools.compiler().command, tools.compiler().version,
                           sources=[*files, build.HERE / "verilated.py"])
    return compiling.kept(compiling.BUILD / f"verilated-{key}", make)


def pair_library(clock_hz: int, options: build.Options = build.USUAL,
                 model: Path | None = None) -> Path:
    """Path of a library with both; ``model`` is a folder with another ``controller.hpp``.

    Raises
    ------
    testbench.native.compiling.BuildError
        If a tool fails.
    """
    plain = _verilated(clock_hz, options)
    driven = model or build.model(clock_hz, lambda _: None, options)

    def make(folder):
        (folder / "pair.inc").write_text(_names(driven))
        own = compiling.objects(
            [build.HERE / "pair.cpp"], folder,
            [*OPTIONS, f"-I{folder}", f"-I{driven}", f"-I{plain}", f"-I{build.PLANT}",
             f"-I{build.HERE}"])
        compiling.link([*sorted(plain.glob("*.o")), *verilated.runtime(),
                        *sorted(driven.glob("*.o")), *own], ["-shared"], folder / "pair.so")

    key = compiling.digest(plain.name, driven.name, _names(driven), sources=build.sources())
    return compiling.kept((model or compiling.BUILD) / f"pair-{key}", make) / "pair.so"


def difference(native: Simulation, library: Path) -> tuple[int, str] | None:
    """Clock and name of the first pin or probe that differs, on the inputs that ``native`` kept.

    ``keep_inputs`` of ``native`` must have been called before its first clock, and nothing must
    have changed it from outside except over pins.

    Raises
    ------
    ValueError
        If it kept no inputs, or has not run: then two idle controllers would be compared.
    """
    kept, count = native.kept_inputs()
    if not count or not native.cycle:
        raise ValueError("the simulation has kept no inputs: there is nothing to compare")
    code = ctypes.CDLL(str(library))
    declare(code, _FUNCTIONS)
    pair = code.pair_create()
    image = target_image().read_bytes()
    words = words_of(image)
    code.pair_load(pair, (ctypes.c_uint32 * len(words))(*words), bytes(parities(image)),
                   len(words))
    same = code.pair_run(pair, kept, count, native.cycle)
    found = None if same else (code.pair_clock(pair), code.pair_name(pair).decode())
    code.pair_free(pair)
    return found
