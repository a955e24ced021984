# SPDX-License-Identifier: Apache-2.0
"""Planted breaks: what stops the machine, broken on purpose, has to make a test fail.

A break changes one place of one source file in a copy of the checkout and runs the tests that must
see it. It is *seen* if one of them fails because what it looked at was wrong, and *survives* if all
pass. Anything else is an *error* of the table and never counts as seen: a text that is not there, a
source that no longer compiles or elaborates, a test that is not there or cannot begin, a process
that dies, a deadline.
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

from softcore.image import HOST_ONLY, TARGET_ONLY, among
from testbench.breaks.witness import SAW

__all__ = ["ROOT", "Break", "Equivalent", "Verdict", "applied", "breaks_of", "run_whole",
           "try_break"]

ROOT = Path(__file__).parents[2]
SCRATCH = ROOT / "build" / "breaks"
FIRMWARE = "softcore/firmware/"
DEADLINE_S = 900
PASSED, FAILED = 0, 1  # exit statuses of pytest
# What is made or is not ours: a copy makes its own, so nothing broken gets into a cache.
LEFT_OUT = shutil.ignore_patterns("build", ".venv", ".git", "__pycache__", ".*_cache", "*.egg-info")


class Verdict(Enum):
    """What became of a break."""

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
        Text that occurs there exactly once, and what takes its place.
    tests : tuple of str
        What pytest is to run: files, or tests by their node; at least one of them must fail.
    promise : str
        What the break takes away, in a few words.
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
    """A change after which nothing can be told apart from before, and why. Its tests must pass."""

    what: Break
    argument: str

    def __str__(self):
        return str(self.what)


def breaks_of(file: str, tests: str, *rows: tuple[str, ...]) -> tuple[Break, ...]:
    """Breaks of one file: rows of old, new, promise, and tests where others than usual see it.

    Tests are told as from the testbench's folder, with blanks between.
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
        If what is to be changed does not stand there exactly once.
    SyntaxError
        If it is Python, and is none after the change.
    """
    text = (ROOT / one.file).read_text(encoding="utf-8")
    if text.count(one.old) != 1 or one.old == one.new:
        raise ValueError(f"{one}: the text to change occurs {text.count(one.old)} times, not once")
    broken = text.replace(one.old, one.new)
    if one.file.endswith(".py"):
        compile(broken, one.file, "exec")
    return broken


def _run(command, folder):
    """Run Python in a copy; its exit status, or none after the deadline, and what it said."""
    # A test that runs this has settings of its own pytest, which are not for the one in the copy.
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
    """Compile the firmware if the file belongs to it; whether it did, and what was said."""
    if not file.startswith(FIRMWARE):
        return True, ""
    source = Path(file).relative_to(FIRMWARE)
    if among(source, HOST_ONLY):
        raise ValueError(f"{file} is no part of the machine")
    made = "target_image()" if among(source, TARGET_ONLY) else "host_library('undefined')"
    status, said = _run(["-c", f"from softcore.image import *; {made}"], folder)
    return status == 0, said


def _pytest(tests, folder):
    """Run tests in a copy: exit status, reasons of the failures, and what pytest said."""
    witness = folder / "witness.txt"
    witness.touch()
    status, said = _run(["-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "",
                         "-p", "testbench.breaks.witness", "--witness", str(witness), *tests],
                        folder)
    return status, witness.read_text(encoding="utf-8").splitlines(), said


def try_break(one: Break) -> tuple[Verdict, str]:
    """Plant a break in a copy, run its tests there; return the verdict and what was said."""
    SCRATCH.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=SCRATCH) as place:
        folder = Path(place) / "checkout"
        shutil.copytree(ROOT, folder, symlinks=True, ignore=LEFT_OUT)
        (folder / one.file).write_text(applied(one), encoding="utf-8")
        built, said = _builds(one.file, folder)
        if not built:
            return Verdict.ERROR, said
        status, reasons, said = _pytest(one.tests, folder)
    if status == PASSED:
        return Verdict.SURVIVED, said
    seen = status == FAILED and reasons and all(reason == SAW for reason in reasons)
    return (Verdict.SEEN if seen else Verdict.ERROR), "\n".join([*reasons, said])


def run_whole(tests: Sequence[str]) -> tuple[bool, str]:
    """Run tests in a copy with nothing broken: whether all pass, and what pytest said."""
    SCRATCH.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=SCRATCH) as place:
        folder = Path(place) / "checkout"
        shutil.copytree(ROOT, folder, symlinks=True, ignore=LEFT_OUT)
        status, _, said = _pytest(tests, folder)
    return status == PASSED, said
