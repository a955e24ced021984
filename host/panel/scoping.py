# SPDX-License-Identifier: Apache-2.0
"""The gap oscilloscope of a session: what is armed, and the last record. It waits for nothing."""

from host.errors import UserError
from host.scope.acquire import Acquisition, Trigger
from host.scope.record import Record

__all__ = ["Scoping"]

AGAIN_S = 0.5       # from a record to the next arming, while it runs
STOP = "$SCOPE=STOP"


class Scoping:
    """One oscilloscope, shared by all pages.

    ``record`` is the last record, or None; ``number`` counts records. ``failed`` says why the last
    attempt has given none. Lines go out one at a time: after ``line`` has given one, ``answered``
    or ``forget`` comes before the next.
    """

    def __init__(self) -> None:
        self.record: Record | None = None
        self.number = 0
        self.forget()

    def forget(self) -> None:
        """Forget what belonged to the last connection; the record stays."""
        self.failed = ""
        self.runs = False
        self._wanted: Acquisition | None = None
        self._trigger: Trigger | None = None    # to be armed anew
        self._from_s = 0.0                      # from this time on
        self._stops = False
        self._under_way = ""

    @property
    def state(self) -> str:
        """State of the oscilloscope, as a word."""
        if self._wanted is not None:
            return "reading" if self._wanted.state == "full" else self._wanted.state
        return "armed" if self._trigger is not None else "idle"

    def lost(self) -> None:
        """The line under way will not be answered: begin its record anew."""
        self._under_way = ""
        if self._wanted is not None:
            self._wanted, self._trigger = None, self._wanted.trigger

    def arm(self, trigger: Trigger, *, again: bool) -> None:
        """Arm; ``again`` after each record too."""
        self.failed, self.runs = "", again
        self._trigger, self._from_s = trigger, 0.0
        self._wanted, self._stops = None, False

    def stop(self) -> None:
        """Disarm, and keep the last record."""
        self.runs, self._trigger, self._wanted = False, None, None
        self._stops = True

    def force(self) -> None:
        """Trigger now."""
        if self._wanted is not None:
            self._wanted.force()

    def line(self, now_s: float) -> str | None:
        """The next line to be sent, if it is time for one."""
        if self._under_way:
            return None
        if self._stops:
            self._stops = False
            self._under_way = STOP
            return STOP
        if self._wanted is None and self._trigger is not None and now_s >= self._from_s:
            self._wanted, self._trigger = Acquisition(self._trigger), None
        line = None if self._wanted is None else self._wanted.line(now_s)
        self._under_way = line or ""
        return line

    def hear(self, line: str) -> bool:
        """Take a line of the controller; return whether it belongs to the oscilloscope."""
        return line.startswith("[SCOPE") and (self._wanted is None or self._wanted.hear(line))

    def answered(self, answer: str, message: str, now_s: float) -> None:
        """Take the answer to the last line."""
        line, self._under_way = self._under_way, ""
        wanted = self._wanted
        if line == STOP or wanted is None or not wanted.waits_for(line):
            return      # of what has been given up meanwhile
        try:
            wanted.answered(answer, message)
        except UserError as error:
            self.forget()
            self.failed = str(error)
            return
        if wanted.record is not None:
            self.record, self._wanted = wanted.record, None
            self.number += 1
            if self.runs:
                self._trigger, self._from_s = wanted.trigger, now_s + AGAIN_S
