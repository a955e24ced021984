# SPDX-License-Identifier: Apache-2.0
"""Planted breaks: code that stops the machine is broken on purpose, and a test must fail.

A break changes one place of one source file in a copy of the checkout and runs the tests that must
see it. It is *seen* if one of them fails on an assertion, and *survives* if all pass. Anything else
is an *error* of the table and never counts as seen: a text that does not occur, a source that no
longer compiles or elaborates, a test that does not exist or cannot begin, a process that dies, a
time-out.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from softcore.image import HOST_ONLY, OBJECTS, TARGET_ONLY, among
from testbench.breaks.witness import SAW

__all__ = ["IN_VERILOG", "ROOT", "Break", "Equivalent", "Verdict", "applied", "breaks_of",
           "run_whole", "try_break"]

ROOT = Path(__file__).parents[2]
SCRATCH = ROOT / "build" / "breaks"
FIRMWARE = "softcore/firmware/"
DEADLINE_S = 900
PASSED, FAILED, NOTHING = 0, 1, 5  # exit statuses of pytest
BUILT = f"*-{'[0-9a-f]' * 16}"
# A break is first looked for with the share of cases and the simulator of `make check`, which takes
# some seconds for most; one that is not seen so, with every test and every case.
PASSES = (("-m", "not soak", "--sim", "amaranth"), ("-m", "", "--all-cases"))
# Only tests that run the emitted Verilog under cocotb.
IN_VERILOG = (("-m", "cocotb"),)
# Build results and foreign files: a copy makes its own, so nothing broken gets into a cache.
LEFT_OUT = shutil.ignore_patterns("build", ".venv", ".git", "__pycache__", ".*_cache", "*.egg-info")


class Verdict(Enum):
    """Result of a break."""

    SEEN = "seen"
    SURVIVED = "survived"
    ERROR = "error"


@dataclass(frozen=True)
class Break:
    """One change that a test must see.

    Members
    -------
    file : str
        Path from the checkout's root.
    old, new : str
        Text that occurs there exactly once, and its replacement.
    tests : tuple of str
        Files or tests for pytest to run; at least one of them must fail.
    promise : str
        The property that the break removes, in a few words.
    """

    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    promise: str

    def __str__(self):
        return f"{self.file}: {self.promise}"


@dataclass(frozen=True)
class Equivalent:
    """A change without any visible effect, and the reason why. Its tests must pass."""

    what: Break
    argument: str

    def __str__(self):
        return str(self.what)


def breaks_of(file: str, tests: str, *rows: tuple[str, ...]) -> tuple[Break, ...]:
    """Breaks of one file: rows of old, new, promise, and tests if they differ from ``tests``.

    Tests are paths from the testbench's folder, separated by blanks.
    """
    return tuple(Break(file, old, new,
                       tuple(f"testbench/{test}" for test in (others or (tests,))[0].split()),
                       promise)
                 for old, new, promise, *others in rows)


def applied(one: Break) -> str:
    """Text of the broken file.

    Raises
    ------
    ValueError
        If the text to change does not occur exactly once.
    SyntaxError
        If the change makes invalid Python.
    """
    text = (ROOT / one.file).read_text(encoding="utf-8")
    if text.count(one.old) != 1 or one.old == one.new:
        raise ValueError(f"{one}: the text to change occurs {text.count(one.old)} times, not once")
    broken = text.replace(one.old, one.new)
    if one.file.endswith(".py"):
        compile(broken, one.file, "exec")
    return broken


def _copied(folder: Path) -> None:
    """Copy the checkout, and link what is built already into the copy.

    Each build's folder is named by the digest of its sources, and so is each object file of the
    firmware. So a broken source makes a new one in the copy, and only sound ones are shared. To
    build them anew takes longer than most tests.
    """
    shutil.copytree(ROOT, folder, symlinks=True, ignore=LEFT_OUT)
    kept = folder / "build" / "native"
    kept.mkdir(parents=True)
    for made in (ROOT / "build" / "native").glob(BUILT):
        if made.is_dir():
            (kept / made.name).symlink_to(made)
    objects = folder / OBJECTS.relative_to(ROOT)
    objects.mkdir(parents=True)
    for made in OBJECTS.glob("*.o"):
        (objects / made.name).symlink_to(made)


def _run(command, folder):
    """Run Python in a copy; return its exit status (None after the deadline) and its output."""
    # The settings of the outer pytest must not reach the pytest in the copy.
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    try:
        done = subprocess.run([sys.executable, *command], cwd=folder, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              timeout=DEADLINE_S, check=False,
                              env=kept | {"PYTHONDONTWRITEBYTECODE": "1"})
    except subprocess.TimeoutExpired:
        return None, f"no verdict within {DEADLINE_S} s"
    return done.returncode, done.stdout


def _builds(file, folder):
    """Compile the firmware if the file belongs to it; return success and output."""
    if not file.startswith(FIRMWARE):
        return True, ""
    source = Path(file).relative_to(FIRMWARE)
    if among(source, HOST_ONLY):
        raise ValueError(f"{file} is no part of the machine")
    made = "target_image()" if among(source, TARGET_ONLY) else "host_library('undefined')"
    status, said = _run(["-c", f"from softcore.image import *; {made}"], folder)
    return status == 0, said


def _pytest(tests, folder, options):
    """Run tests in a copy; return exit status, reasons of the failures, and pytest's output."""
    witness = folder / "witness.txt"
    witness.write_text("", encoding="utf-8")
    status, said = _run(["-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *options,
                         "-p", "testbench.breaks.witness", "--witness", str(witness), *tests],
                        folder)
    return status, witness.read_text(encoding="utf-8").splitlines(), said


def try_break(one: Break, passes: Sequence[tuple[str, ...]] = PASSES) -> tuple[Verdict, str]:
    """Plant a break in a copy and run its tests there; return the verdict and the output.

    ``passes`` are options of pytest: the tests run with each of them until one fails.
    """
    SCRATCH.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=SCRATCH) as place:
        folder = Path(place) / "checkout"
        _copied(folder)
        (folder / one.file).write_text(applied(one), encoding="utf-8")
        built, said = _builds(one.file, folder)
        if not built:
            return Verdict.ERROR, said
        for options in passes:
            status, reasons, said = _pytest(one.tests, folder, options)
            said = "\n".join([*reasons, said])
            if status == FAILED and reasons and all(reason == SAW for reason in reasons):
                return Verdict.SEEN, said
            # The first pass has nothing to run where all tests are in the soak.
            if status not in (PASSED, NOTHING):
                return Verdict.ERROR, said
    return (Verdict.SURVIVED if status == PASSED else Verdict.ERROR), said


def run_whole(tests: Sequence[str]) -> tuple[bool, str]:
    """Run tests in a copy with nothing broken, in both passes; whether all pass, and the output."""
    SCRATCH.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=SCRATCH) as place:
        folder = Path(place) / "checkout"
        _copied(folder)
        for options in PASSES:
            status, _, said = _pytest(tests, folder, options)
            if status not in (PASSED, NOTHING):
                return False, said
    return status == PASSED, said
