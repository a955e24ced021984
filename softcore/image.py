# SPDX-License-Identifier: Apache-2.0
"""The firmware, compiled: an image for the soft core, and a library of it for this computer.

Both are compiled from the same sources, but the library has the room ``pc`` instead of the
registers. Results are kept under ``build/firmware/``, in a folder named by a digest of all inputs.
"""

import contextlib
import hashlib
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from softcore import texts

__all__ = ["OBJECTS", "FirmwareError", "address_runtime", "among", "host_library", "host_objects",
           "image_digest", "path_units", "target_image"]

SOURCES = Path(__file__).parent / "firmware"
BUILD = Path(__file__).parents[1] / "build" / "firmware"
OBJECTS = BUILD / "objects"     # of images and libraries

PACKING = Path(texts.__file__).read_bytes()     # how sentences are stored; the pairs are a header

# Rooms and files of one build that the other leaves out.
TARGET_ONLY = ("hal", "app/main.c")
HOST_ONLY = ("pc",)

# Warnings are errors. Products and sums are not contracted into one operation, so that floats have
# the same bits everywhere.
COMMON = ["-std=gnu11", "-Wall", "-Wextra", "-Wshadow", "-Werror", "-ffp-contract=off"]
# Whole-program optimisation and linker relaxation save an eighth of the code. Saving registers by
# calls (-msave-restore, `hal/save.S`) saves 2.7 KB more. All sources must be compiled with it, or
# none: functions are not put into others that were compiled otherwise. The target has no use for
# the sanitizer that zig turns on by default.
TARGET = ["-target", "riscv32-freestanding-none", "-mcpu=generic_rv32+m+c+zicsr", "-Os", "-flto",
          "-mrelax", "-msave-restore", "-ffreestanding", "-fno-sanitize=all",
          "-g"]  # keeps the symbols, by which tests find addresses
# Size is the rule (zig takes -Oz for -Os, so the compiler itself is told).
SMALL = ["-Xclang", "-Oz"]
# The few sources compiled for speed, as every block and every line pass through them. All but
# app/execute.c took a block of 10 um from 20 060 clocks to 17 860, for 6 KB; app/execute.c alone
# takes 230 of 8230 instructions off, for 1 KB. At most are 18 200 (`cosim/test_retrace.py`): if
# there are more, `python -m testbench.cosim.code_order` may find a better order of the functions.
# The linker puts small functions into those compiled for speed, however cold they are: those that
# are marked `noinline` for that took 2 KB.
FAST = frozenset({"app/execute.c", "app/main_loop.c", "app/program.c", "base/text.c",
                  "base/units.c", "hal/hal_regs.c", "interp/wire_offset.c",
                  "link/link.c", "link/output.c",
                  # Else the longest step of an arc takes 12 290 clocks: `wander` allows 8500.
                  "path/arc.c", "path/arc_border.c"})
SANITIZE = {
    "": [],
    "undefined": ["-fsanitize=undefined", "-fno-sanitize-recover=all"],
    "coverage": ["-fsanitize=undefined", "-fno-sanitize-recover=all",
                 "-fsanitize-coverage=trace-pc"],
    "address": ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"],
}


RING = "path/history.c"     # alone depends on the size of the memory
# Bytes for the firmware without the history of the path, including its stack and some room to grow;
# and bytes of a unit of that history (a line is one unit, an arc two).
BESIDE_PATH = 180_224
PATH_UNIT = 16


def image_digest(words: Sequence[int]) -> int:
    """Digest of the words of an image, 32 bits, with the same function as ``image_watch.c``."""
    total = 0
    for word in words:
        total = (total ^ word) * 0x9E3779B1 & 0xFFFFFFFF
        total ^= total >> 15
    return total


def _with_digest(image: bytes) -> bytes:
    """Write the digest of all other words into the last word, which the linker script leaves 0."""
    words = struct.unpack(f"<{len(image) // 4}I", image)
    if words[-1]:
        raise FirmwareError("the last word of the image is not the one for its digest")
    return image[:-4] + struct.pack("<I", image_digest(words[:-1]))


class FirmwareError(RuntimeError):
    """The firmware does not compile; the text has the compiler's messages."""


def _zig(tool: str) -> list[str]:
    return [sys.executable, "-m", "ziglang", tool]


def _host_compiler() -> list[str]:
    """The machine's C compiler if it has one, else zig's."""
    for name in ("cc", "gcc", "clang"):
        found = shutil.which(name)
        if found:
            return [found]
    return _zig("cc")


def _version(command: list[str]) -> str:
    said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    return said.stdout


def address_runtime() -> Path | None:
    """Runtime library of the host compiler's address sanitizer, if it has one as a file."""
    compiler = _host_compiler()
    if "clang" in _version(compiler):
        return None
    said = subprocess.run([*compiler, "-print-file-name=libasan.so"], capture_output=True,
                          text=True, check=True)
    path = Path(said.stdout.strip())
    return path if path.is_absolute() and path.exists() else None


def among(path: Path, places: tuple[str, ...]) -> bool:
    """Whether a source of the firmware, relative to its folder, is one of some files and rooms."""
    return any(path.is_relative_to(place) for place in places)


def _sources(leave_out: tuple[str, ...]) -> list[Path]:
    # By name: moving a file to another room does not change the image.
    return sorted((path for path in SOURCES.rglob("*")
                   if path.suffix in {".c", ".S"}
                   and not among(path.relative_to(SOURCES), leave_out)),
                  key=lambda path: path.name)


def _compiled_sources() -> Path:
    """The folder that is compiled: a copy of the sources in which sentences are packed.

    It is made once for each state of the sources. The compiler's messages name the originals.
    """
    folder = BUILD / "sources" / _digest([])
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as place:
            made = Path(shutil.copytree(SOURCES, Path(place) / "made"))
            for path in texts.sources(SOURCES):
                own = path.relative_to(SOURCES)
                text = texts.stored(path.read_text(encoding="utf-8"))
                (made / own).write_text(f'#line 1 "{path}"\n{text}', encoding="utf-8")
            with contextlib.suppress(OSError):     # another process was quicker
                made.rename(folder)
    return folder


def _digest(command: Sequence[str | Path]) -> str:
    total = hashlib.sha256(PACKING + repr(command).encode())
    for path in sorted(path for path in SOURCES.rglob("*") if path.is_file()):
        total.update(str(path.relative_to(SOURCES)).encode() + b"\0" + path.read_bytes())
    return total.hexdigest()[:16]


def _run(command: Sequence[str | Path]) -> None:
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          check=False)
    if done.returncode:
        raise FirmwareError(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")


def _cached(name: str, command: Sequence[str | Path], build: Callable[[Path], None]) -> Path:
    """Path of ``name`` in the folder of its digest; ``build(folder)`` makes it if it is missing.

    It is built in another folder and then moved, so that two processes may build at the same time.
    Other files of the build are moved before it.
    """
    folder = BUILD / _digest(command)
    result = folder / name
    if not result.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as place:
            build(Path(place))
            for made in sorted(Path(place).iterdir(), key=lambda path: path.name == name):
                made.replace(folder / made.name)
    return result


def _objects(sources: Sequence[Path], command: list[str],
             own: Callable[[Path], list[str]] = lambda _: []) -> list[Path]:
    """Object file of each source, compiled by a command and with the options of its ``own``.

    They are kept by what they are made of, all headers included: after a change of one source, or
    for another memory, the others are not compiled again.
    """
    compiled = _compiled_sources()
    base = hashlib.sha256(PACKING + repr((command, _version(command))).encode())
    for path in sorted(SOURCES.rglob("*.h")):
        base.update(str(path.relative_to(SOURCES)).encode() + b"\0" + path.read_bytes())
    OBJECTS.mkdir(parents=True, exist_ok=True)

    def one(source: Path) -> Path:
        total = base.copy()
        total.update(repr(own(source)).encode() + source.read_bytes())
        kept = OBJECTS / f"{source.stem}-{total.hexdigest()[:16]}.o"
        if not kept.exists():
            with tempfile.TemporaryDirectory(dir=OBJECTS) as place:
                made = Path(place) / kept.name
                packed = (compiled / source.relative_to(SOURCES)
                          if source.is_relative_to(SOURCES) else source)
                _run([*command, *own(source), "-c", f"-I{compiled}", packed, "-o", made])
                made.replace(kept)
        return kept

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(one, sources))


def host_objects(sources: Sequence[Path], sanitize: str = "") -> list[Path]:
    """Object file of each source, compiled for this computer as in the library.

    Raises
    ------
    FirmwareError
        If one does not compile.
    """
    return _objects(sources, _host_command(sanitize))


def _host_command(sanitize: str) -> list[str]:
    """Compiler of this computer with the options of the library, to compile and to link."""
    compiler = _host_compiler()
    options = SANITIZE[sanitize]
    if sanitize in ("undefined", "coverage"):
        # Trapping needs no runtime library, which the Python process would not have.
        options = [*options, "-fsanitize-trap=all" if "clang" in _version(compiler)
                   else "-fsanitize-undefined-trap-on-error"]
    # -g1 has the lines that a sanitizer tells; -g takes up to a third more time.
    return [*compiler, "-fPIC", "-O1", "-g1", *COMMON, *options]


def path_units(memory_size: int) -> int:
    """Units of the path's history that fit into a memory, a power of two.

    Raises
    ------
    FirmwareError
        If the memory is too small.
    """
    room = (memory_size - BESIDE_PATH) // PATH_UNIT
    if room < 256:
        raise FirmwareError(f"a memory of {memory_size} bytes does not fit the firmware and a path")
    return 1 << room.bit_length() - 1


def target_image(memory_size: int = 311_296,
                 progress: Callable[[str], None] = lambda _: None) -> Path:
    """Image of the soft core's memory from address 0, little-endian, without variables (``.bss``).

    Its last word is the digest with which the firmware checks itself.

    Parameters
    ----------
    memory_size : int
        Bytes of the block RAM that holds code, data and stack.
    progress : callable
        Gets one sentence if the firmware has to be compiled.

    Raises
    ------
    FirmwareError
        If it does not compile, or does not fit.
    """
    compiler = [*_zig("cc"), *TARGET, *COMMON]
    sources = _sources(HOST_ONLY)
    ring = f"-DPATH_RING={path_units(memory_size)}u"

    def own(source: Path) -> list[str]:
        place = str(source.relative_to(SOURCES))
        return [*([] if place in FAST else SMALL), *([ring] if place == RING else [])]

    # zig's linker front end does not know --defsym.
    script = f"__ram_size = {memory_size};\n" + (SOURCES / "hal" / "link.ld").read_text()

    def build(folder: Path) -> None:
        progress("compiling the firmware")
        made = _objects(sources, compiler, own)
        (folder / "link.ld").write_text(script)
        _run([*compiler, *made, "-Wl,--gc-sections", f"-Wl,-T,{folder / 'link.ld'}",
              "-o", folder / "firmware.elf"])
        _run([*_zig("objcopy"), "-O", "binary", folder / "firmware.elf", folder / "firmware.bin"])
        image = folder / "firmware.bin"
        if not image.stat().st_size:
            raise FirmwareError("objcopy has written an empty image")
        image.write_bytes(_with_digest(image.read_bytes()))

    return _cached("firmware.bin", [*compiler, *sources, *map(repr, map(own, sources)), script],
                   build)


def host_library(sanitize: str = "") -> Path:
    """Shared library of all firmware above ``hal.h``, with a model of the machine below it.

    Parameters
    ----------
    sanitize : str
        ``""``; ``"undefined"``: undefined behaviour ends the process; ``"coverage"``: the same, and
        ``gk_coverage`` counts; ``"address"``: the address sanitizer too, whose runtime
        (``address_runtime``) must have been loaded before.

    Raises
    ------
    FirmwareError
        If it does not compile.
    """
    command = [*_host_command(sanitize), "-shared"]
    sources = _sources(TARGET_ONLY)

    def build(folder: Path) -> None:
        _run([*command, *host_objects(sources, sanitize), "-o", folder / "firmware.so"])

    return _cached("firmware.so", [*command, _version(command), *(path.name for path in sources)],
                   build)
