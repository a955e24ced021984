# SPDX-License-Identifier: Apache-2.0
"""Walking along the path from the panel: where the machine is, and where the next step leads."""

import time
from collections.abc import Callable

from host.panel.heard import Heard

__all__ = ["STEPS_MM", "Walking"]

STEPS_MM = (1.0, 0.1)
DIGITS = 4
TOLD_S = 0.5        # after an order, until a status report tells of it; or it was refused


class Walking:
    """The steps of one page, which may follow each other faster than the controller reports.

    Distances are in mm before the front, along the path. ``clock`` gives the time in seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._ordered: tuple[float, float] | None = None    # place, and until when it is waited for

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
        if self._ordered is not None:
            ordered, until = self._ordered
            if goal == ordered or self._clock() > until:
                self._ordered = None
            else:
                begin = ordered
        place = round(begin + step, DIGITS)
        return place if place > 0 else None

    def order(self, place: float) -> str:
        """Note that the machine is sent to a place, and return the line that does it."""
        self._ordered = place, self._clock() + TOLD_S
        return f"$WALK={place:.{DIGITS}f}"


def _told(heard: Heard) -> tuple[float, float]:
    """Distance ordered, 0 without a walk; and that of the machine."""
    numbers = heard.numbers("Wk")
    return (numbers[0], numbers[1]) if len(numbers) == 2 else (0.0, 0.0)
