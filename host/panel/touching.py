# SPDX-License-Identifier: Apache-2.0
"""A touching cycle on the panel: its next line, and what it has found."""

from host.errors import UsageError
from host.touch.command import cycle_of
from host.touch.cycles import Place, Probe, place_of, zero_line

__all__ = ["Touching"]


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
        if known is not None and shape not in ("hole", "boss"):
            raise UsageError("the contact offset is calibrated by a hole or a boss.")
        self.probe, self.known, self.system = probe, known, system
        self.offset: float | None = None    # calibrated by this cycle
        self._cycle = cycle_of(shape, probe, toward=toward, size=size, lift=lift)
        self._next: str | None = next(self._cycle)  # refuses what is wrong before anything moves
        self._told: Place | None = None

    def hear(self, line: str) -> None:
        """Take a line of the controller."""
        self._told = place_of(line) or self._told

    def line(self) -> str | None:
        """The next line to send, after the answer to the last one; None at the end.

        Raises
        ------
        TouchError
            If the cycle cannot go on.
        """
        line, self._next = self._next, None
        if line is not None:
            return line
        told, self._told = self._told, None
        try:
            return self._cycle.send(told)
        except StopIteration as end:
            self.found = end.value
            return None

    def ending(self) -> tuple[str, str | None]:
        """What was found, as a sentence; and the line that sets the zero, if one is wanted."""
        places = ", ".join(f"{axis} {place:.4f}" for axis, place in self.found.places.items())
        said = f"{self.found.what} found: {places} mm in the machine frame"
        if self.found.size is not None:
            said += f"; diameter {self.found.size:.4f} mm"
        if self.known is not None:
            self.offset = round(self.found.offset(self.known, self.probe), 4)
            said += f"; contact offset {self.offset:.4f} mm"
        return said + ".", None if self.system is None else zero_line(self.found, self.system)
