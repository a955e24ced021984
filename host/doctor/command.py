# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper doctor``: the examination at a port, told on the terminal and written down."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from constraints.boards import BOARDS
from host.doctor.doctor import Doctor
from host.errors import DONE, FAULT, UsageError, UserError
from host.link.port import Port
from host.machines import machine as machines

__all__ = ["examine"]


def examine(url: str, board: str, *, baud: int, report: Path, console: Console,
            ask: Callable[[str], bool], machine: str | None = None) -> int:
    """Examine the controller at ``url``, write the report, return the exit status.

    With ``machine``, the settings of that machine's file are entered first.

    Raises
    ------
    UsageError
        If there is no such board or machine.
    UserError
        If nobody answers there, it is not Gapkeeper, or the report cannot be written.
    """
    chosen = {one.name: one for one in BOARDS}
    if board not in chosen:
        raise UsageError(f'there is no board "{board}"; there are: {", ".join(sorted(chosen))}.')

    known = None if machine is None else machines.load(machine)

    def say(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    port = Port(url, baud)
    try:
        doctor = Doctor(port, chosen[board], ask=ask, say=say, machine=known)
        try:
            doctor.examine()
        finally:
            try:
                report.parent.mkdir(parents=True, exist_ok=True)
                report.write_text(doctor.report(), encoding="utf-8")
            except OSError as error:
                raise UserError(f"{report} cannot be written: {error.strerror}.") from error
    finally:
        port.close()
    wrong = sum(one.ok is False for one in doctor.findings)
    say(f"{wrong or 'nothing'} wrong; the report is {report}")
    return FAULT if wrong else DONE
