# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper build``: the bitstream of a board, and the resources that it uses."""

import json

from rich.console import Console
from rich.table import Table

from host.errors import UsageError, UserError


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
    if name not in BOARDS:
        known = ", ".join(sorted(BOARDS))
        raise UsageError(f'there is no board "{name}"; there are: {known}.')
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
