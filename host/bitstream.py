# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper build``: the bitstreams of boards, and the resources that they use."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from rich.console import Console
from rich.table import Table

from host.errors import UsageError, UserError
from host.places import ROOT

__all__ = ["TOGETHER", "build_board", "build_boards"]

TOGETHER = 2   # boards at a time; each takes one core and 1 GB of memory
COMMAND = [sys.executable, "-m", "host.cli", "build"]   # builds one


def _require_boards(names: Sequence[str]) -> None:
    from softcore.build import BOARDS
    for name in names:
        if name not in BOARDS:
            known = ", ".join(sorted(BOARDS))
            raise UsageError(f'there is no board "{name}"; there are: {known}.')


def build_boards(names: Sequence[str], console: Console) -> None:
    """Build the bitstreams of several boards, ``TOGETHER`` at a time, each in its own process.

    What they print comes line by line with the board's name in front, and at the end of each board
    the CPU time that it took. A board that fails does not stop the others.

    Raises
    ------
    UsageError
        If there is no such board; then none is built.
    UserError
        If a board fails.
    """
    names = list(dict.fromkeys(names))
    _require_boards(names)
    if len(names) == 1:
        build_board(names[0], console)
        return

    def one(name: str) -> bool:
        def say(text: str) -> None:
            console.print(f"{name}: {text}", markup=False, soft_wrap=True)

        with subprocess.Popen([*COMMAND, name], cwd=ROOT,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              errors="replace") as process:
            assert process.stdout
            for line in process.stdout:
                say(line.rstrip())
            # With the time of its tools, which it has waited for.
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        say(f"took {(used.ru_utime + used.ru_stime) / 60:.1f} minutes of CPU time")
        return not process.returncode

    with ThreadPoolExecutor(TOGETHER) as pool:
        built = list(pool.map(one, names))
    failed = [name for name, good in zip(names, built, strict=True) if not good]
    if failed:
        raise UserError(f"{len(failed)} of {len(names)} boards failed: {', '.join(failed)}; what "
                        "each said is above.")


def build_board(name: str, console: Console) -> None:
    """Build a board's bitstream and print its resources, clocks and digests.

    Raises
    ------
    UsageError
        If there is no such board.
    UserError
        If a tool fails, or the layout misses the clock.
    """
    from softcore.build import BOARDS, BUILD, MANIFEST, BuildError, build
    from softcore.image import FirmwareError
    _require_boards([name])
    board = BOARDS[name]
    try:
        with console.status("") as status:
            def say(text: str) -> None:
                status.update(text)
                if not console.is_terminal:
                    console.print(text)
            made = build(board, say)
    except BuildError as error:
        raise UserError(str(error)) from error
    except FirmwareError as error:
        raise UserError("the firmware does not compile; `make test` shows why.") from error
    table = Table(title=board.title, show_header=False)
    table.add_row("bitstream", str(BUILD / made.path))
    firmware = json.loads((BUILD / name / MANIFEST).read_text(encoding="utf-8"))["firmware_sha256"]
    table.add_row("firmware", firmware[:16])
    table.add_row("layout", f"{made.digest}, " + ("kept from an earlier build" if made.kept else
                                                  f"made in {made.seconds:.0f} s"))
    table.add_row("look-up tables", f"{made.luts}, those in carry pairs and small RAMs with them")
    table.add_row("flip-flops", str(made.cells.ff))
    table.add_row("block RAMs", f"{made.cells.bram} of 18 Kbit")
    table.add_row("multipliers", str(made.cells.dsp))
    for clock, (reached, wanted) in made.fmax_mhz.items():
        table.add_row(f"clock {clock}", f"{reached:.1f} MHz reached, {wanted:g} MHz wanted")
    console.print(table)
