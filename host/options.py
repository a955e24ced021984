# SPDX-License-Identifier: Apache-2.0
"""Options that several commands of the command line share."""

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from host.machines.machine import built_in

__all__ = ["BAUD", "LIVE_PORT", "MACHINE_NAMES", "Baud", "ControllerPort", "FlashFile",
           "MachineOfTape", "Unlock", "WithTcp"]

MACHINE_NAMES = ", ".join(built_in())

MachineOfTape = Annotated[str | None, typer.Option(
    "--machine", metavar="NAME|FILE", show_default="the one that the tape names, or else sinker",
    help=f"A built-in machine ({MACHINE_NAMES}), or a TOML file of one. A tape names its "
         "machine in a comment before its first block: (MACHINE WIRE). With --port, a tape that "
         "names another than the sinker needs this option.")]

FlashFile = Annotated[Path | None, typer.Option(
    "--flash", metavar="FILE", dir_okay=False, show_default="none: a fresh memory",
    help="Keep what the simulated controller's flash memory holds (settings, offsets, conditions, "
         "fluid classes) in this file, from one power-on to the next. A missing file is made.")]

LIVE_PORT = "socket://127.0.0.1:3333"   # of ``gapkeeper simulate``
ControllerPort = Annotated[str, typer.Option(
    "--port", metavar="URL", help="The controller's port: /dev/ttyUSB0, socket://HOST:PORT. "
                                  "Without it, a simulated one on this computer.")]

BAUD = 1_000_000
Baud = Annotated[int, typer.Option(
    "--baud", min=1, metavar="N", help="Bits a second of a serial line.")]

Unlock = Annotated[bool, typer.Option(
    "--unlock", help="Unlock a locked machine first ($X). Look at it before: its lock has a cause. "
                     "Without this option a locked machine is refused.")]


class WithTcp(TyperCommand):
    """A command whose ``--tcp`` may stand without an address."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Give a bare ``--tcp`` the address that it stands for."""
        given: list[str] = []
        for index, word in enumerate(args):
            given.append(word)
            if word == "--tcp" and (index + 1 == len(args) or args[index + 1].startswith("-")):
                given.append("")
        return super().parse_args(ctx, given)
