# SPDX-License-Identifier: Apache-2.0
"""Walking along the path from the panel: where the machine is, and where the next step leads."""

from collections.abc import Callable

from host.panel.heard import Heard

__all__ = ["STEPS_MM", "Walking"]

STEPS_MM = (1.0, 0.1)
DIGITS = 4


class Walking:
    """The steps of one page, which may follow each other faster than the controller reports.

    Distances are in mm before the front, along the path. ``pending`` says of a line whether it is
    still on its way: status reports do not tell of it yet, and it has not been refused.
    """

    def __init__(self, pending: Callable[[str], bool]) -> None:
        self._pending = pending
        self._ordered: float | None = None      # place, until the reports tell of it

    @staticmethod
    def offered(heard: Heard) -> bool:
        """Whether the machine stands on hold, or walks."""
        return heard.state == "Hold:0" or (heard.state == "Hold:1" and _told(heard)[0] > 0)

    @staticmethod
    def motion(heard: Heard) -> str:
        """What the machine does in a walk; empty without one."""
        if _told(heard)[0] <= 0:
            return ""
        return "stands on a walk" if heard.state == "Hold:0" else "walks along the path"

    @staticmethod
    def distance(heard: Heard) -> float:
        """How far the machine is before the front."""
        return _told(heard)[1]

    def place(self, heard: Heard, step: float) -> float | None:
        """Where a step leads, back if it is above 0; None if it would reach the front.

        It leads on from where the machine stands, or from where it is going.
        """
        goal, distance = _told(heard)
        begin = distance if heard.state == "Hold:0" else goal
        if self._ordered is not None and not self._pending(_line(self._ordered)):
            self._ordered = None
        begin = begin if self._ordered is None else self._ordered
        place = round(begin + step, DIGITS)
        return place if place > 0 else None

    def order(self, place: float) -> str:
        """Note that the machine is sent to a place, and return the line that does it."""
        self._ordered = place
        return _line(place)


def _line(place: float) -> str:
    return f"$WALK={place:.{DIGITS}f}"


def _told(heard: Heard) -> tuple[float, float]:
    """Distance ordered, 0 without a walk; and that of the machine."""
    numbers = heard.numbers("Wk")
    return (numbers[0], numbers[1]) if len(numbers) == 2 else (0.0, 0.0)
