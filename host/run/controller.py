# SPDX-License-Identifier: Apache-2.0
"""A controller at a port, as a run sees it: by its status reports.

A simulated machine knows the true gap, the material removed, every millisecond of the path. A real
controller only reports its status: the axes by their coders, their error counters, the state of a
retraction, the classes of its discharge pulses. The host asks for a report ten times a second.
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
ANSWER_S = 1.0          # wait for the first report, each time it is asked for,
ASKED = 3               # so many times
ARM_S = 60.0            # for a person to press the button
TREMBLE_PULSES = 2      # motion of an axis at rest
CLASSES = ("open", "ok", "dame", "short")   # in the report's order
# Values that only a simulated machine has, by their names in summary or trace.
UNKNOWN = ["pressed_mm", "removed_mm3", "clear_of_shorts",
           "gap_um", "gap_v", "debris", "path", "feed"]


class Controller:
    """A controller at an open port: a pipe of bytes for a link, and the values of its reports.

    Parameters
    ----------
    port : Port
        The line to it. The caller closes it.
    machine : Machine
        The machine that the controller moves.
    clock_hz : int
        The controller's clock, by which its events count time.
    say : callable
        Called with one sentence when a person has to do something.
    """

    cycle = None    # a controller gives its clock with events only

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
        """Return the bytes that have come; wait at most ``timeout_s`` for one."""
        return self.port.read(timeout_s)

    def time_s(self) -> float:
        """Seconds since the connection, by the computer's clock."""
        return self.port.time_s() - self._began_s

    # ---- who it is

    def identify(self, *, reset: bool) -> None:
        """Check that it is a Gapkeeper controller and idle, and reset it; its greeting follows.

        Only ``?`` is sent before that is certain. With ``reset`` even a busy controller is reset.

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
            raise PortError(f"nobody answers at {self.port.url}: the controller is off, a cable "
                            "is unplugged, or the baud rate is wrong.")
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
            return  # damaged on its way: the next report comes soon
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
        """Greatest distance of an axis from its first place, in pulses, less its trembling."""
        places = np.array([row[1:4] for row in self._rows]).reshape(-1, 3)
        far = int(np.abs(places - places[:1]).max(initial=0))
        return far if far > TREMBLE_PULSES else 0

    def trace(self, controllers_s: Callable[[Any], Any]) -> Columns:
        """Reports as columns, a row for every ``SAMPLE_S``, in the form of a simulated trace.

        ``controllers_s`` converts seconds since the connection into those of the controller's
        clock. There are ``t``, ``x y z``, ``error_x/y/z``, ``state``, ``shorted`` and the classes
        of the pulses. Places between two reports are interpolated.
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
