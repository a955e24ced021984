# SPDX-License-Identifier: Apache-2.0
"""The commands ``gapkeeper tape``."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from host.errors import UsageError, UserError
from host.options import MACHINE_NAMES
from host.words import counted

__all__ = ["tape_app"]

tape_app = typer.Typer(
    help="Punch, read and check tapes: text (.nc) to punched rows (.ptp) and back.",
    no_args_is_help=True, rich_markup_mode="markdown")
out = Console(highlight=False)


class TapeCode(StrEnum):
    """Codes a tape may be punched in."""

    ISO = "iso"
    EIA = "eia"


@tape_app.command("encode")
def tape_encode(
    source: Annotated[Path, typer.Argument(metavar="IN", exists=True, dir_okay=False,
                                           show_default=False, help="Part program as text.")],
    target: Annotated[Path, typer.Option("-o", "--output", metavar="OUT", dir_okay=False,
                                         show_default=False, help="File for the punched rows.")],
    code: Annotated[TapeCode, typer.Option(
        help="ISO 840 (even parity) or EIA RS-244 (odd parity).")] = TapeCode.ISO,
) -> None:
    """Punch a part program.

    One byte a row, track 1 in the lowest bit. Leader and trailer, and the % at start and end, are
    added if the text lacks them. Small letters are punched as capitals: the codes have no others.
    """
    from host.tape.codes import CODES
    from host.tape.tape import encode, text_of
    _differ(target, source)
    tape = encode(text_of(source, source.read_bytes()), CODES[code.value])
    _write(target, tape.rows)
    _say(f"{target}: {len(tape.rows)} rows in {tape.code.title}, "
         f"{len(tape.rows) * 2.54 / 1000:.2f} m of tape")


@tape_app.command("decode")
def tape_decode(
    source: Annotated[Path, typer.Argument(metavar="IN", exists=True, dir_okay=False,
                                           show_default=False, help="Punched rows.")],
    target: Annotated[Path | None, typer.Option(
        "-o", "--output", metavar="OUT", dir_okay=False, show_default="the terminal",
        help="File for the text.")] = None,
) -> None:
    """Read a punched tape as text.

    The first end of block tells the code. Every row is checked up to the end word (M02 or M30); the
    first fault ends the reading, and the message names its block and character.
    """
    from host.tape.tape import decode
    if target is not None:
        _differ(target, source)
    text, code = decode(source.read_bytes())
    if target is None:
        sys.stdout.write(text)
    else:
        _write(target, text.encode())
        _say(f"{target}: {counted(text.count(chr(10)), 'line')}, from {code.title}")


@tape_app.command("check")
def tape_check(
    source: Annotated[Path, typer.Argument(
        metavar="IN", exists=True, dir_okay=False, show_default=False,
        help="Part program as text (.nc) or as punched rows (.ptp).")],
    mdi: Annotated[list[str] | None, typer.Option(
        metavar='"G36 …"', show_default=False,
        help="A line that `run` would be given by hand before the tape starts, such as retraction "
             "data for what the tape leaves out, or a setting (`$455=750`). May be given several "
             "times.",
    )] = None,
    machine: Annotated[str | None, typer.Option(
        metavar="NAME|FILE", show_default="the one that the tape names, or else none",
        help="Judge clock, settings and travel of this machine too, from where it stands at the "
             f"start: {MACHINE_NAMES}, or a TOML file.")] = None,
) -> None:
    """Check a tape with the controller's own reader.

    The firmware's tape reader and block parser, compiled for this computer, read the whole tape.
    The message on the first fault names block and character, and the line of a text; exit status
    4. For a tape without fault, notes say which words other controls would read differently.
    """
    from host.machines import machine as machines
    from host.tape.check import check
    from host.tape.machine import machine_named
    from host.tape.notes import notes
    from host.tape.tape import load
    tape = load(source)
    if machine is None and machine_named(tape) in machines.built_in():
        machine = machine_named(tape)
    chosen = None if machine is None else machines.load(machine)
    blocks = check(tape, mdi or [], chosen)
    judged = f"for the machine {chosen.name}" if chosen else "travel not judged (--machine)"
    _say(f"{source}: {counted(blocks, 'block')}, no fault found; {judged}")
    for note in notes(tape):
        _say(f"  {note}")


def _say(line: str) -> None:
    out.print(line, markup=False, soft_wrap=True)  # no markup in names, no breaks in lines


def _differ(target: Path, source: Path) -> None:
    """Refuse to write into the file that is read, whatever its two names are."""
    if target.exists() and target.samefile(source):
        raise UsageError(f"{target} is the file that is read, and would be lost.")


def _write(path: Path, data: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}.") from error
