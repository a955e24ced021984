# SPDX-License-Identifier: Apache-2.0
"""The command ``gapkeeper tune``."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from host.options import BAUD, LIVE_PORT, Baud, ControllerPort, Unlock

__all__ = ["tune_drives"]

out = Console(highlight=False)


def tune_drives(
    axes: Annotated[str, typer.Argument(
        metavar="[AXES]", help="Axes to move, each with the way that is free: X+Y+Z+.")] = "X+Y+Z+",
    port: ControllerPort = LIVE_PORT,
    travel: Annotated[float, typer.Option(
        metavar="MM", help="How far each axis goes, and back.")] = 3.0,
    picture: Annotated[Path, typer.Option(
        "--out", metavar="FILE", dir_okay=False,
        help="Picture of measured and predicted steps, SVG.")] = Path("build/tune.svg"),
    machine: Annotated[str, typer.Option(
        metavar="NAME|FILE", help="As of `run`.")] = "sinker",
    baud: Baud = BAUD,
    unlock: Unlock = False,
) -> None:
    """Measure the drives by small motions, and propose the settings of the position loop.

    The discharge must be off, the machine unlocked, and the position known. Each axis goes to and
    fro, also slowly and without a stop. Its drive's gain, offset, friction, lags, dead time and
    acceleration are told, and settings for them; $540 and $421 are changed meanwhile.
    """
    from host.tune.command import tune as tune_at
    tune_at(port, axes, travel_mm=travel, baud=baud, machine=machine, picture=picture,
            unlock=unlock, console=out)
