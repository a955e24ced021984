# SPDX-License-Identifier: Apache-2.0
"""A controller at a port as a run sees it: what it tells of itself, and nothing of its machine.

A simulated machine knows the true gap, what has been removed, every millisecond of the path. A
controller has its status report: the axes by their coders, their error counters, the state of a
retraction, the classes of its discharge pulses. It is asked for one ten times a second.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from host.errors import UsageError
from host.link.link import RESET, STATUS, LinkError, fields_of
from host.link.port import Port, PortError
from host.machines.machine import Machine
from host.run.workpiece import Columns

__all__ = ["SAMPLE_S", "UNKNOWN", "Controller"]

SAMPLE_S = 0.1          # between two status reports
ANSWER_S = 1.0          # for the first of them, asked for
ASKED = 3               # times
ARM_S = 60.0            # for a person to press the button
TREMBLE_PULSES = 2      # of an axis at rest
CLASSES = ("open", "ok", "dame", "short")   # as the report has them
# What of a run only a simulated machine tells, by its name in summary or trace.
UNKNOWN = ["pressed_mm", "removed_mm3", "gap_um", "gap_v", "debris", "path", "feed"]


class Controller:
    """A controller at an open port, as a pipe of bytes for a link, with what its reports tell.

    Parameters
    ----------
    port : Port
        The line to it. It stays the caller's to close.
    machine : Machine
        What the controller moves.
    clock_hz : int
        The controller's clock, by which its events count time.
    say : callable
        Told, in one sentence, what a person has to do.
    """

    cycle = None    # a controller tells its clock with events only

    def __init__(self, port: Port, machine: Machine, *, clock_hz: int,
                 say: Callable[[str], None]) -> None:
        self.port, self.machine, self.clock_hz, self.say = port, machine, clock_hz, say
        self._began_s = port.time_s()
        self._rows: list[tuple[float, ...]] = []    # time, places, errors, state, shorts, classes
        self._armed = False

    # ---- a pipe of bytes

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        self.port.write(data)

    def read(self, timeout_s: float) -> bytes:
        """Return what has come; wait for something, at most ``timeout_s``."""
        return self.port.read(timeout_s)

    def time_s(self) -> float:
        """Seconds since the connection, by the computer's clock."""
        return self.port.time_s() - self._began_s

    # ---- who it is

    def identify(self, *, reset: bool) -> None:
        """See that it is one of ours and free, and reset it: its greeting is then to come.

        Nothing but ``?`` is sent before that is certain. ``reset`` takes it even from a program.

        Raises
        ------
        PortError
            If nobody answers, or something else does, or it has another client.
        LinkError
            If it is at work.
        """
        try:
            fields, said = self._first_report()
        except PortError as error:
            raise PortError(f"{self.port.url} closes the connection at once: it may have another "
                            "client.") from error
        if fields is None:
            if said:
                raise PortError(f"the other end of {self.port.url} is not Gapkeeper: asked for "
                                f"its status, it says {said[:60]!r}.")
            raise PortError(f"nobody answers at {self.port.url}: the controller is off, the cable "
                            "is off, or the baud rate is another.")
        if not {"MPos", "Er", "Gap"} <= fields.keys():
            raise PortError(f"the other end of {self.port.url} is not Gapkeeper: its status "
                            "report has no Gapkeeper fields.")
        if fields["state"] in ("Run", "Hold") and not reset:
            raise LinkError(f"the controller at {self.port.url} is at work ({fields['state']}): "
                            "wait until it ends, or end it with --reset.")
        self.write(RESET)

    def _first_report(self) -> tuple[dict[str, str] | None, str]:
        said = ""
        for _ in range(ASKED):
            self.write(STATUS)
            end = self.time_s() + ANSWER_S
            while self.time_s() < end:
                said += self.read(end - self.time_s()).decode("ascii", "replace")
                for line in said.splitlines():
                    if line.startswith("<") and line.endswith(">"):
                        return fields_of(line), said
        return None, said.strip()

    # ---- what its reports tell

    def report(self, line: str) -> None:
        """Take a status report that has come."""
        fields = fields_of(line)
        try:
            places = [float(place) * self.machine.pulses_per_mm
                      for place in fields["MPos"].split(",")]
            numbers = [int(number) for name in ("Er", "Rt", "Gap")
                       for number in fields[name].split(",")]
        except (KeyError, ValueError):
            return  # bent on its way: the next one comes soon
        if len(places) + len(numbers) == 12:
            self._rows.append((self.time_s(), *places, *numbers))
            self._armed = "Armed" in fields

    def press_arm(self, poll: Callable[[], object]) -> None:
        """Have a person press the button ``arm``; ``poll`` asks for a report and takes it.

        Raises
        ------
        UsageError
            If nobody does within ``ARM_S``.
        """
        poll()
        if self._armed:
            return
        self.say('press the button "arm" at the machine')
        end = self.time_s() + ARM_S
        while not self._armed:
            if self.time_s() > end:
                raise UsageError(f'nobody has pressed the button "arm" within {ARM_S:.0f} s; '
                                 "nothing was moved. A tape that discharges nothing runs with "
                                 "--no-arm.")
            poll()

    def positions(self) -> dict[str, int]:
        """Encoder positions by axis, in pulses, as reported last."""
        return self._axes(1)

    def errors(self) -> dict[str, int]:
        """Error counters by axis, in pulses, as reported last."""
        return self._axes(4)

    def _axes(self, first: int) -> dict[str, int]:
        row = self._rows[-1] if self._rows else (0.0,) * 13
        return {axis: round(row[first + index]) for index, axis in enumerate("xyz")}

    def discharges(self) -> dict[str, int]:
        """Discharge pulses by class since the first report."""
        if not self._rows:
            return dict.fromkeys(CLASSES, 0)
        return {name: int(self._rows[-1][9 + index] - self._rows[0][9 + index]) % 2**32
                for index, name in enumerate(CLASSES)}

    def front(self) -> int:
        """How far an axis was from where it was first, in pulses; not counting its trembling."""
        places = np.array([row[1:4] for row in self._rows]).reshape(-1, 3)
        far = int(np.abs(places - places[:1]).max(initial=0))
        return far if far > TREMBLE_PULSES else 0

    def trace(self, controllers_s: Callable[[Any], Any]) -> Columns:
        """Reports as columns, a row for every ``SAMPLE_S``; see the simulated machine's.

        ``controllers_s`` turns seconds since the connection into those of the controller's clock.
        There are ``t``, ``x y z``, ``error_x/y/z``, ``state``, ``shorted`` and the classes of the
        pulses. Between two reports a place is taken to change evenly.
        """
        rows = np.array(self._rows) if self._rows else np.zeros((1, 13))
        then = controllers_s(rows[:, 0])
        t = np.arange(then[0], then[-1] + SAMPLE_S / 2, SAMPLE_S)
        last = np.searchsorted(then, t, side="right") - 1
        columns = {"t": t}
        columns |= {axis: np.interp(t, then, rows[:, 1 + index])
                    for index, axis in enumerate("xyz")}
        columns |= {f"error_{axis}": rows[last, 4 + index] for index, axis in enumerate("xyz")}
        columns |= {"state": rows[last, 7], "shorted": rows[last, 8]}
        for index, name in enumerate(CLASSES):
            so_far = np.interp(t, then, rows[:, 9 + index] - rows[0, 9 + index])
            columns[name] = np.diff(so_far, prepend=so_far[:1])
        return columns
