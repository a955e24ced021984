# SPDX-License-Identifier: Apache-2.0
"""Running compilers, and keeping their results by the digest of the inputs."""

import fcntl
import gc
import hashlib
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from testbench import tools

__all__ = ["BUILD", "BuildError", "digest", "kept", "link", "objects", "run", "uncollected",
           "verilate"]

BUILD = Path(__file__).parents[2] / "build" / "native"

# The Verilog is generated: its widths were decided, and reviewed, in Amaranth. Without look-up
# tables and without a graph of the dataflow, Verilator takes 13 CPU seconds for the controller in
# place of 35; its C++ compiles as fast, and simulates no slower.
VERILATE = ["--cc", "-O3", "-fno-table", "-fno-dfg", "--x-assign", "fast", "--x-initial", "fast",
            "--noassert", "-Wno-fatal", "-Wno-lint", "-Wno-style", "--prefix", "Vtop"]
# Nobody reads the generated C++: no warnings.
COMPILE = ["-O2", "-fPIC", "-w"]
# zig turns sanitizers on by default.
ZIG = ["-fno-sanitize=all"]


class BuildError(RuntimeError):
    """A tool of the build has failed; the text has its output."""


def run(command: Iterable, **options) -> None:
    """Run a tool.

    Raises
    ------
    BuildError
        If it fails.
    """
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise BuildError(f"{' '.join(words)}\n{done.stdout}{done.stderr}")


def digest(*words, sources: Iterable[Path] = ()) -> str:
    """Short digest of anything with a ``repr``, and of the names and contents of files."""
    total = hashlib.sha256(repr(words).encode())
    for path in sources:
        total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()[:16]


@contextmanager
def uncollected() -> Iterator[None]:
    """Search for no garbage.

    An elaboration makes hundreds of thousands of objects that live to its end: to look for garbage
    among them again and again takes a third of its time.
    """
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


def kept(folder: Path, build: Callable[[Path], None]) -> Path:
    """``folder``; ``build(place)`` makes its contents if it does not exist.

    It is made under another name and then moved, so that it never exists in part. If another
    process is making it, this one waits.
    """
    if folder.exists():
        return folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            with tempfile.TemporaryDirectory(dir=folder.parent) as place:
                made = Path(place) / "made"
                made.mkdir()
                build(made)
                made.replace(folder)
    return folder


def verilate(options: Sequence, folder: Path) -> None:
    """Translate Verilog to C++ in ``folder``, with the packaged Verilator."""
    root = tools.verilator_root()
    run([root / "bin" / "verilator_bin", *VERILATE, "-Mdir", folder, *options],
        env=tools.environment())


def objects(sources: Iterable[Path], folder: Path, options: Sequence,
            compiler: tools.Compiler | None = None) -> list[Path]:
    """Object files of C++ ``sources``, made in ``folder`` by two compilers at a time."""
    chosen = compiler or tools.compiler()
    command = [*chosen.command, *COMPILE, *options, *(ZIG if chosen.zig else [])]

    def one(source):
        target = folder / f"{source.stem}.o"
        # Code that runs once needs no optimisation, which would take the compiler longest.
        quick = ["-O0"] if "Slow" in source.stem else []
        run([*command, *quick, "-c", source, "-o", target], cwd=folder)
        return target

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, sources))


def link(parts: Iterable[Path], options: Sequence, target: Path) -> None:
    """Link object files with the C++ compiler's defaults."""
    run([*tools.compiler().command, *parts, *options, "-o", target, "-lpthread"])
