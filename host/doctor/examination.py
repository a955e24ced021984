# SPDX-License-Identifier: Apache-2.0
"""The talk with a controller under examination, and what is found."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from constraints.board import Board
from host.doctor.complaints import Place
from host.doctor.levels import Build, Inputs
from host.link.link import ANSWER_TIMEOUT_S, Link, RefusedError
from host.link.port import Port

__all__ = ["CLEAR_MM", "Examination", "Finding", "stopped"]

Told = TypeVar("Told")
CLEAR_MM = 0.002    # an axis that came so far had an open gap before it touched
QUIET_S = 0.1       # after an answer: what else there is to say


@dataclass
class Finding:
    """The outcome of a check: ``ok`` is None if it was left out."""

    check: str
    ok: bool | None
    said: str
    places: list[Place] = field(default_factory=list)

    def __str__(self) -> str:
        mark = {True: "ok", False: "WRONG", None: "left out"}[self.ok]
        where = "; look at " + ", ".join(map(str, self.places)) if self.places else ""
        return f"{mark:8} {self.check}: {self.said}{where}"


def stopped(said: list[str]) -> bool:
    """Whether the controller raised an alarm or refused a line."""
    return any("ALARM:" in text or text.startswith("refused:") for text in said)


class Examination:
    """Asks, listens, and keeps all that was said and found.

    Parameters
    ----------
    port : Port
        The line to the controller. The caller closes it.
    board : Board
        The board, by which wires have pins.
    ask : callable
        Asks a person a question; true is yes.
    say : callable
        Gets each finding as it is made, and what a person has to do.
    """

    def __init__(self, port: Port, board: Board, *, ask: Callable[[str], bool],
                 say: Callable[[str], None]) -> None:
        self.port, self.board, self.ask, self.say = port, board, ask, say
        self.findings: list[Finding] = []
        self.said: list[str] = []
        self.answered_s = 0.0   # when the last line was answered, by this computer's clock
        self.link = Link(port, self.said.append)

    def find(self, check: str, ok: bool | None, said: str,
             places: list[Place] | None = None) -> None:
        """Keep a finding, and tell it."""
        self.findings.append(Finding(check, ok, said, places or []))
        self.say(str(self.findings[-1]))

    def command(self, line: str, *, refused: bool = False,
                within_s: float = ANSWER_TIMEOUT_S) -> list[str]:
        """Send a line; return what was said until its answer, and a refusal as ``refused: …``.

        Raises
        ------
        RefusedError
            If the controller refuses it, and ``refused`` is false.
        """
        before = len(self.said)
        try:
            self.link.command(line, within_s)
            self.answered_s = time.monotonic()
        except RefusedError as error:
            if not refused:
                raise
            self.said.append(f"refused: {error}")
        self.listen(QUIET_S)
        return self.said[before:]

    def listen(self, seconds: float) -> list[str]:
        """What is said in this time."""
        before, end = len(self.said), self.port.time_s() + seconds
        while self.port.time_s() < end:
            self.link.poll(0.05)
        return self.said[before:]

    def since(self, before: int) -> list[str]:
        """Lines received after the first ``before`` ones, without the status reports."""
        return [text for text in self.said[before:] if not text.startswith("<")]

    def await_state(self, *states: str, within_s: float) -> None:
        """Wait until the controller is in one of these states, for so long at most."""
        end = self.port.time_s() + within_s
        while self.link.status()["state"] not in states and self.port.time_s() < end:
            self.link.poll(0.02)

    def places(self) -> list[float]:
        """Positions of the axes, mm."""
        return [float(one) for one in self.link.status()["MPos"].split(",")]

    def build(self) -> Build | None:
        """Gateware and clock; None from firmware that does not know ``$INPUTS``."""
        return self._told(Build.of)

    def inputs(self) -> Inputs | None:
        """What the inputs are at; None from firmware that does not know ``$INPUTS``."""
        return self._told(Inputs.of)

    def _told(self, of: Callable[[str], Told | None]) -> Told | None:
        """What ``$INPUTS`` tells; asked twice, as a line to the host may be damaged."""
        for _ in range(2):
            for text in self.command("$INPUTS", refused=True):
                if (told := of(text)) is not None:
                    return told
        return None
