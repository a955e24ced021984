# SPDX-License-Identifier: Apache-2.0
"""Damaged tapes by the thousand, under the sanitizers.

Each run is a process of its own: a violation ends it.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from softcore.image import address_runtime
from testbench.fuzz import LINES, under_address_sanitizer

ROOT = Path(__file__).parents[3]


def fuzzed(done):
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr[-3000:]}"
    assert "cases" in done.stdout
    return int(done.stdout.split()[0])


def run(*arguments):
    return subprocess.run([sys.executable, "-m", "testbench.fuzz", *arguments], cwd=ROOT,
                          capture_output=True, text=True, check=False)


def test_damaged_tapes_under_the_undefined_behaviour_sanitizer(request, cases):
    seed, count = str(request.config.getoption("--seed")), cases(1500)
    assert fuzzed(run("--sanitize", "undefined", "--cases", str(count), "--seed", seed)) == count


@pytest.mark.soak
def test_grown_tapes_find_new_ways_through_the_code(request, cases):
    seed, count = str(request.config.getoption("--seed")), cases(1500)
    done = run("--sanitize", "coverage", "--cases", str(count), "--seed", seed)
    assert fuzzed(done) == count
    assert int(done.stdout.split()[2]) > 20, "nothing was kept: the coverage does not count"


@pytest.mark.skipif(address_runtime() is None, reason="the compiler has no address sanitizer")
def test_damaged_tapes_under_the_address_sanitizer(request, cases):
    seed, count = str(request.config.getoption("--seed")), cases(750)
    assert fuzzed(under_address_sanitizer(["--cases", str(count), "--seed", seed])) == count


def test_every_word_of_the_operator_is_sent():
    """The first column of the pages' table has them all."""
    page = (ROOT / "docs" / "reference" / "link.md").read_text(encoding="utf-8")
    told = {word for row in re.findall(r"^\| (`\$.*?) \| ", page, re.MULTILINE)
            for word in re.findall(r"`(\$[A-Z$#]+(?:=[A-Z$#*]+)?)", row)}
    assert {"$FROM", "$J", "$H", "$RST=*", "$SCOPE=STOP", "$FIRMWARE=B"} <= told
    assert {word for word in told if not any(line.startswith(word) for line in LINES)} == set()


def test_a_planted_violation_ends_the_process():
    """The check of the checks: an overflow that C forbids does not pass."""
    done = subprocess.run(
        [sys.executable, "-c", "from testbench.firmware import library\n"
         "import ctypes\n"
         "library().gk_overflow(ctypes.c_int32(2**31 - 1))"],
        cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode < 0, "the process should have been ended by a signal"


@pytest.mark.soak
@pytest.mark.parametrize("sanitize", ["coverage", "address"])
def test_soak(request, sanitize):
    seconds = ["--seconds", "600", "--seed", str(request.config.getoption("--seed"))]
    fuzzed(under_address_sanitizer(seconds) if sanitize == "address"
           else run("--sanitize", sanitize, *seconds))
