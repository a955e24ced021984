# SPDX-License-Identifier: Apache-2.0
"""A touching cycle on the panel: its next line, what it has found, and the zero that it sets."""

from host.errors import UsageError
from host.link.link import fields_of
from host.touch.command import check_known, cycle_of
from host.touch.cycles import Found, Place, Probe, TouchError, place_of
from host.touch.zero import stands, zero_lines

__all__ = ["Touching"]

FRESH = 2   # reports after the last answer: the first may have been begun before it


class Touching:
    """One cycle, line by line; the session sends each line when the one before is answered.

    ``known`` is the true diameter of a hole or boss, for the contact offset; ``system`` the work
    offset whose zero is set, 1 to 6. Other words are those of ``host.touch.command.cycle_of``.

    Raises
    ------
    UsageError
        If a word is missing or wrong.
    """

    def __init__(self, shape: str, probe: Probe, *, toward: str = "", size: float = 0.0,
                 lift: float = 0.0, known: float | None = None, system: int | None = None) -> None:
        check_known(shape, known)
        self.probe, self.known, self.system = probe, known, system
        self.offset: float | None = None    # calibrated by this cycle
        self.found: Found | None = None
        self._cycle = cycle_of(shape, probe, toward=toward, size=size, lift=lift)
        self._next: str | None = next(self._cycle)
        self._told: Place | None = None
        self._reports = 0                           # since the end of the cycle
        self._at: dict[str, float] | None = None    # where the axes rest after it
        self._state = ""

    def hear(self, line: str) -> None:
        """Take a line of the controller."""
        self._told = place_of(line) or self._told
        if self.found is not None and line.startswith("<") and line.endswith(">"):
            fields = fields_of(line)
            self._reports += 1
            self._state = fields["state"]
            if self._reports >= FRESH and self._state == "Idle":
                self._at = stands(fields) or self._at

    def line(self) -> str | None:
        """The next line to send, after the answer to the last one; None if there is none now.

        Raises
        ------
        TouchError
            If the cycle cannot go on, or an alarm came before the axes rest.
        """
        if self.found is not None:
            if not self.over and self._state == "Alarm":
                raise TouchError("the zero is not set: an alarm came before the axes were at rest.")
            return None
        line, self._next = self._next, None
        if line is not None:
            return line
        told, self._told = self._told, None
        try:
            return self._cycle.send(told)
        except StopIteration as end:
            self.found = end.value
            return None

    @property
    def over(self) -> bool:
        """Whether all has been found, and the place is known that a zero needs."""
        return self.found is not None and (self.system is None or self._at is not None)

    def ending(self) -> tuple[str, list[str]]:
        """What was found, as a sentence; and the lines that set the zero, if one is wanted.

        Raises
        ------
        UsageError
            If the cycle is not ``over``.
        """
        if self.found is None or not self.over:
            raise UsageError("the cycle has not ended.")
        places = ", ".join(f"{axis} {place:.4f}" for axis, place in self.found.places.items())
        said = f"{self.found.what} found: {places} mm in the machine frame"
        if self.found.size is not None:
            said += f"; diameter {self.found.size:.4f} mm"
        if self.known is not None:
            self.offset = round(self.found.offset(self.known, self.probe), 4)
            said += f"; contact offset {self.offset:.4f} mm"
        if self.system is None or self._at is None:
            return said + ".", []
        return said + ".", zero_lines(self.found, self.system, self._at)
