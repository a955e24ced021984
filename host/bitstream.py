# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper build``: the bitstream of a board, and what it needs of the device."""

from rich.console import Console

from host.errors import UsageError, UserError
from softcore.build import BOARDS, BUILD, BuildError, build
from softcore.image import FirmwareError


def build_board(name: str, console: Console) -> None:
    """Build for the board of this name, telling each step and at last the figures."""
    if name not in BOARDS:
        raise UsageError(f"there is no board {name}; there are {', '.join(sorted(BOARDS))}.")
    try:
        with console.status("") as status:
            def say(text):
                console.print(text)
                status.update(text)
            made = build(BOARDS[name], say)
    except (BuildError, FirmwareError) as error:
        raise UserError(str(error)) from error
    console.print(f"{BUILD / made.path}, digest {made.digest}, made in {made.seconds:.0f} s")
    console.print(f"{made.luts} LUTs, {made.flip_flops} flip-flops, {made.block_rams} block RAMs, "
                  f"{made.multipliers} multipliers")
    for clock, (reached, wanted) in made.fmax_mhz.items():
        console.print(f"clock {clock}: {reached:.1f} MHz, of {wanted:.1f} MHz that it needs")
