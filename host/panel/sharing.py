# SPDX-License-Identifier: Apache-2.0
"""Who holds the controls: one page at a time; every other page watches.

A page is named by a text that is its own. It must be heard of every ``SILENT_S`` at least. A page
that has not been heard of for longer has lost its connection, and lets go of the controls.
"""

import time
from collections.abc import Callable

__all__ = ["LEASE_S", "SILENT_S", "Jog", "Sharing"]

SILENT_S = 3.0      # a page says that it is there once a second
LEASE_S = 0.35      # a page with a finger on a jog button says so ten times a second


class Sharing:
    """The controls, and the page that holds them.

    ``clock`` gives the computer's time in seconds. The class has no lock: its caller has one.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._heard: dict[str, float] = {}
        self._holder: str | None = None

    def seen(self, page: str) -> None:
        """Note that a page is there."""
        self._heard[page] = self._clock()

    def gone(self, page: str) -> None:
        """Note that a page has gone; it lets go of the controls."""
        self._heard.pop(page, None)
        self.let_go(page)

    def take(self, page: str) -> bool:
        """Give the controls to a page; return whether it has them. Nobody is robbed of them."""
        self.seen(page)
        if self.holder is None:
            self._holder = page
        return self._holder == page

    def let_go(self, page: str) -> None:
        """Take the controls from a page, if it has them."""
        if self._holder == page:
            self._holder = None

    @property
    def holder(self) -> str | None:
        """The page that holds the controls, or None."""
        self._forget()
        return self._holder

    @property
    def pages(self) -> int:
        """Number of pages that are there."""
        self._forget()
        return len(self._heard)

    def _forget(self) -> None:
        now = self._clock()
        for page in [page for page, heard in self._heard.items() if now - heard > SILENT_S]:
            self.gone(page)


class Jog:
    """An axis that moves while a finger is on a button, in short segments.

    The button must be renewed every ``LEASE_S`` at least, or the jog ends. Segments take
    ``SEGMENT_S``, and no more than ``AHEAD_S`` of motion is ordered ahead: so the machine stops by
    itself 0.2 s after the last order, whatever has become of the computer or the cable.

    Parameters
    ----------
    axis : str
        X, Y or Z.
    way : int
        1 or -1.
    feed : float
        mm/min.
    clock : callable
        The computer's time in seconds, for the finger.
    machine_s : callable
        The machine's time, for the motion: a simulated machine may be slower.
    """

    SEGMENT_S = 0.1
    AHEAD_S = 0.1

    def __init__(self, axis: str, way: int, feed: float, *, clock: Callable[[], float],
                 machine_s: Callable[[], float]) -> None:
        self.axis, self.way, self.feed = axis, way, feed
        self._clock, self._machine_s = clock, machine_s
        self._until = 0.0    # machine's time at which the motion ordered so far is over
        self._left = 0.0     # part of a pulse that the segments so far have left over, mm
        self._end = clock() + LEASE_S

    def renew(self, axis: str, way: int, feed: float) -> bool:
        """The finger is still on a button; return whether it is that of this jog, and in time."""
        same = (axis, way, feed) == (self.axis, self.way, self.feed) and not self.over
        if same:
            self._end = self._clock() + LEASE_S
        return same

    @property
    def over(self) -> bool:
        """Whether the button has been let go, or nobody has renewed it in time."""
        return self._clock() > self._end

    def segment(self) -> str | None:
        """The line to send now, or None if enough motion has been ordered."""
        now = self._machine_s()
        if self.over or self._until - now > self.AHEAD_S:
            return None
        self._until = max(now, self._until) + self.SEGMENT_S
        whole = self._left + self.feed / 60 * self.SEGMENT_S
        length = round(whole, 4)    # a pulse of a usual machine is 0.1 um
        self._left = whole - length
        return f"$J=G91 G21 {self.axis}{self.way * length:.4f} F{self.feed:g}"
