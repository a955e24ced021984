# SPDX-License-Identifier: Apache-2.0
"""The lines that pages enter by hand: whose they are, what waits, and what moves by them.

A line waits until the one before it has been answered. It belongs to its page, and so does what it
has set in motion, until the axes rest. If the page lets go of the controls, nobody looks at either
any more. A line of the panel itself belongs to no page.
"""

from collections import deque

from host import alarms
from softcore.tables.faults import named

__all__ = ["ByHand"]

FRESH = 2           # reports after an answer: the first may have been begun before it
ALARM_S = 0.5       # longest time from the refusal of a line to the alarm that has ended it
Alarm = tuple[int, str] | None      # number and sentence
_LOCKED = named("locked").error


class ByHand:
    """Lines in the order in which they are sent.

    ``jogs`` is the page whose jog, sent as a line, may be under way; empty without one.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[str, str]] = deque()     # page and line
        self.jogs = ""
        self._moves = ""        # the page that has set something else in motion
        self._last = ""         # the line that was sent last, until a report tells what it did
        self._open = False      # it is not answered yet
        self._reports = 0       # since that answer
        # Refusals until their alarm is known: until when, of what, the sentence, the alarm before.
        self._ended: deque[tuple[float, str, str, Alarm]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, line: str, page: str = "") -> None:
        """Let a line wait; without a page it is the panel's own."""
        self._waiting.append((page, line))

    def clear(self) -> None:
        """Forget all that waits and all that moves, as after a stop."""
        self._waiting.clear()
        self.jogs = self._moves = self._last = ""
        self._open = False

    def overtaken(self) -> list[str]:
        """Forget the lines of pages that wait: an alarm has come. Return them."""
        lines = [line for page, line in self._waiting if page]
        self._waiting = deque(one for one in self._waiting if not one[0])
        return lines

    def take(self) -> str:
        """Return the next line, to be sent now. One must wait."""
        page, line = self._waiting.popleft()
        self._last, self._open, self._reports = line, True, 0
        if page and line.startswith("$J="):
            self.jogs = page
        elif page and (line.startswith("$H") or not line.startswith("$")):
            self._moves = page
        return line

    def pending(self, line: str) -> bool:
        """Whether a line is still on its way: no status report tells yet what it did.

        A line that was refused is on its way no more.
        """
        return line == self._last or any(line == one for _, one in self._waiting)

    def moves(self, page: str) -> None:
        """Note that a page has set the machine in motion, by a line or by going on after a hold."""
        self._moves, self._reports = page, 0

    def answered(self) -> None:
        """Note that the line that was sent last has been answered, by ok or by a refusal."""
        self._open, self._reports = False, 0

    def report(self, state: str) -> None:
        """Take the state of a status report: at rest nothing is in motion by hand any more."""
        self._reports += 1
        if self._reports >= FRESH and not self._open:
            self._last = ""
            if state in ("Idle", "Alarm"):
                self._moves = ""

    def left(self, holder: str | None) -> tuple[list[str], bool]:
        """Forget what belongs to pages other than the one that holds the controls.

        Return their lines that were not sent, and whether something moves by one that was.
        """
        lines = [line for page, line in self._waiting if page not in ("", holder)]
        if lines:
            self._waiting = deque(one for one in self._waiting if one[0] in ("", holder))
        moves = self._moves not in ("", holder)
        if moves:
            self._moves = ""
        return lines, moves

    def refused(self, what: str, answer: str, said: str, before: Alarm, now: float) -> None:
        """Note that ``what`` was refused by an answer such as ``error:9``; ``said`` says why.

        ``before`` is the alarm that was in force when its line was sent. If an alarm has ended the
        line, the controller tells the alarm only after the answer.
        """
        self._last = ""
        code = answer.removeprefix("error:")
        known = alarms.refusal(int(code)) if code.isdecimal() else answer
        waits = before is None and code.isdecimal() and int(code) == _LOCKED
        refused = f"{what} is refused: {said or known}"
        self._ended.append((now + ALARM_S * waits, what, refused, before))

    def refusal(self, alarm: Alarm, now: float) -> str:
        """Sentence on the oldest refusal, once; empty while the alarm behind it may still come.

        ``alarm`` is the one that is in force.
        """
        if not self._ended:
            return ""
        until, what, refused, before = self._ended[0]
        came = alarm is not None and alarm != before
        if not came and now < until:
            return ""
        self._ended.popleft()
        return f"{what} was ended by alarm {alarm[0]}: {alarm[1]}" if came and alarm else refused
