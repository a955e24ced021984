# SPDX-License-Identifier: Apache-2.0
"""The command ``gapkeeper scope``, and the option of ``gapkeeper run`` for the same."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

__all__ = ["RunScope", "record_gap"]

out = Console(highlight=False)

WORDS = "now, short, arc, retraction, open, ok, shorted, rise=V, fall=V"
RunScope = Annotated[str | None, typer.Option(
    metavar="TRIGGER", show_default=False,
    help="Record the gap around the first such moment with the controller's oscilloscope, into "
         f"scope.csv and the waveform scope.fst: {WORDS}.")]


def record_gap(
    port: Annotated[str, typer.Option(
        metavar="URL", help="The controller's port: /dev/ttyUSB0, socket://HOST:PORT. Without it, "
                            "a simulated one on this computer.")] = "socket://127.0.0.1:3333",
    trigger: Annotated[str, typer.Option(
        metavar="TRIGGER", help=f"What to wait for: {WORDS}.")] = "now",
    before: Annotated[int, typer.Option(
        min=0, max=99, metavar="%", help="Share of the record before the trigger.")] = 50,
    auto: Annotated[float | None, typer.Option(
        min=0.0, metavar="SECONDS", show_default="wait",
        help="Trigger by itself after so long without the trigger.")] = None,
    targets: Annotated[list[Path] | None, typer.Option(
        "-o", "--output", metavar="FILE", dir_okay=False, show_default="gap.csv",
        help="File for the record: .csv, or .fst for a waveform. May be given several times.",
    )] = None,
    baud: Annotated[int, typer.Option(
        min=1, metavar="N", help="Bits a second of a serial line.")] = 1_000_000,
) -> None:
    """Look at the gap: record voltage, comparators, gates and pulse classes around a trigger.

    The controller at the port goes on with what it does: it is not reset, and its discharge is not
    touched. While another program has the port, as `run` or `panel`, use `run --scope` or the
    panel's tab. Ctrl-C disarms.
    """
    from host.scope.record_at import record_at
    record_at(port, trigger, before=before, auto_s=auto, targets=targets or [Path("gap.csv")],
              baud=baud, console=out)
