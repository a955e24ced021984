# SPDX-License-Identifier: Apache-2.0
"""Speed of the simulation beside another version's: ``make bench BESIDE=folder``.

Both versions run the same tapes in turn, each in a process of its own, from its own folder, and
with its own gateware and firmware. What counts is the CPU time inside the native library; building
it, the start of Python and reports do not. The computer's own speed may change by half from run to
run: so each pair of runs is told, and the fastest time of every 20 000 clocks.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from host.errors import UsageError, UserError

__all__ = ["Rows", "fastest", "measure", "speed"]

ROOT = Path(__file__).parents[1]
TAPES = ("sink_shallow_deep", "wire_slot", "sink_jump")
PAIRS = 3
BIN = 20_000    # clocks
Rows = list[tuple[int, int, float]]     # of each call: the clock, clocks run, CPU seconds

# Runs in either version, from its folder: it must use nothing that an old one has not.
RUNNER = """
import contextlib, io, json, sys, time
from host import cli
from testbench.native.simulation import Simulation

rows = []

def timed(method):
    def run(self, clocks):
        before, began = self.cycle, time.thread_time()
        result = method(self, clocks)
        rows.append((before, self.cycle - before, time.thread_time() - began))
        return result
    return run

Simulation.run, Simulation.receive = timed(Simulation.run), timed(Simulation.receive)
sys.argv[0] = "gapkeeper"
ended = 0
with contextlib.redirect_stdout(io.StringIO()):
    try:
        cli.app()
    except SystemExit as end:
        ended = end.code
if ended not in (0, None):
    sys.exit(ended)
print(json.dumps(rows))
"""


def measure(folder: Path, tape: str, seconds: float | None = None) -> Rows:
    """Run a tape, or so many of its machine's seconds, in the version in ``folder``.

    Raises
    ------
    host.errors.UsageError
        If the folder has no Gapkeeper, or not this tape, or the run fails.
    """
    folder = folder.resolve()
    text = folder / "tapes" / f"{tape}.nc"
    if not text.exists():
        raise UsageError(f"{folder} is no folder of Gapkeeper: there is no {text}.")
    with tempfile.TemporaryDirectory() as out:
        until = [] if seconds is None else ["--until", str(seconds)]
        done = subprocess.run(
            [sys.executable, "-c", RUNNER, "run", str(text), "--out", out, *until], cwd=folder,
            env=os.environ | {"PYTHONPATH": str(folder)}, capture_output=True,
            text=True, check=False)
    if done.returncode:
        raise UsageError(f"the version in {folder} did not run {tape}:\n{done.stderr.strip()}")
    return [tuple(row) for row in json.loads(done.stdout)]


def speed(rows: Rows) -> float:
    """Million clocks in a CPU second."""
    return sum(row[1] for row in rows) / sum(row[2] for row in rows) / 1e6


def fastest(runs: Sequence[Rows]) -> float:
    """The same of several equal runs, by the fastest time of every 20 000 clocks."""
    clocks: list[dict[int, int]] = []
    seconds: list[dict[int, float]] = []
    for rows in runs:
        clocks.append(defaultdict(int))
        seconds.append(defaultdict(float))
        for at, count, took in rows:
            clocks[-1][at // BIN] += count
            seconds[-1][at // BIN] += took
    same = [at for at in clocks[0] if len({one.get(at) for one in clocks}) == 1]
    return (sum(clocks[0][at] for at in same) /
            sum(min(one[at] for one in seconds) for at in same) / 1e6)


def main() -> None:
    """Print how many clocks this version simulates in a CPU second, and another one."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path, help="another version, as git worktree adds one")
    parser.add_argument("--tapes", nargs="+", default=TAPES, metavar="TAPE")
    parser.add_argument("--pairs", type=int, default=PAIRS, metavar="N")
    parser.add_argument("--until", type=float, metavar="SECONDS",
                        help="of the machine's time; else whole tapes")
    asked = parser.parse_args()
    if asked.pairs < 1:
        parser.error("argument --pairs: at least one pair is needed")
    folders = asked.folder, ROOT
    print("| tape | | the other | this | times |\n| --- | --- | --- | --- | --- |", flush=True)
    try:
        for tape in asked.tapes:
            for folder in folders:      # builds what is not there
                measure(folder, tape, 0.01)
            runs: tuple[list[Rows], list[Rows]] = [], []
            for pair in range(1, asked.pairs + 1):
                for folder, kept in zip(folders, runs, strict=True):
                    kept.append(measure(folder, tape, asked.until))
                _row(tape, f"pair {pair}", *(speed(kept[-1]) for kept in runs))
            _row(tape, f"fastest of {asked.pairs}", *map(fastest, runs))
    except UserError as error:
        sys.exit(str(error))


def _row(tape, what, other, this):
    print(f"| `{tape}` | {what} | {other:.2f} million | {this:.2f} million | {this / other:.1f} |",
          flush=True)


if __name__ == "__main__":
    main()
