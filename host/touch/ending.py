# SPDX-License-Identifier: Apache-2.0
"""What ends a touching cycle before its end: the machine is held, and an alarm is named."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from host import alarms
from host.errors import ALARM, UserError
from host.link.link import HOLD, RESET, Link, LinkError, held_by
from host.run.events import EventError, Scale, is_event, parse
from host.touch.cycles import TouchError

__all__ = ["AlarmError", "Alarms", "ending"]

REST_S = 3.0        # longest wait for rest
TOLD_S = 0.5        # and from an alarm to its number and sentence
POLL_S = 0.05


class AlarmError(TouchError):
    """The machine is in alarm; the text names it and says what to do."""

    status = ALARM


class Alarms:
    """Lines of a controller, of which the newest alarm is kept; ``scale`` is that of its events.

    ``code`` is the alarm's number, None without one, and ``text`` its sentence.
    """

    def __init__(self, scale: Scale) -> None:
        self._scale = scale
        self.code: int | None = None
        self.text = ""

    def hear(self, line: str) -> None:
        """Take a line."""
        if held := held_by(line):
            self.code, self.text = held
        elif line.startswith("ALARM:") and line[6:].isdecimal():
            code = int(line[6:])
            self.text = self.text if self.code == code else alarms.sentence(code)
            self.code = code
        elif is_event(line):
            try:
                event = parse(line, self._scale)
            except EventError:
                return      # damaged on its way: the number comes in a line of its own
            if event["event"] == "alarm":
                self.code, self.text = event["code"], event["text"]

    @property
    def told(self) -> str:
        """The alarm, and what to do about it; empty without one."""
        if self.code is None:
            return ""
        return f"alarm {self.code}: {self.text} {alarms.remedy(self.code)}".rstrip()


@contextmanager
def ending(link: Link, heard: Alarms, say: Callable[[str], None]) -> Iterator[None]:
    """Whatever ends the block early, Ctrl-C included, holds the machine; ``say`` tells so.

    What is left of a motion is given up, by a reset at rest: the position stays. ``heard`` must get
    the lines of the link.

    Raises
    ------
    AlarmError
        In place of a failure of the link, if an alarm is the reason.
    """
    try:
        yield
    except BaseException as error:
        try:
            state = _hold(link, say)
            if state == "Alarm" and isinstance(error, UserError):
                _await_alarm(link, heard)
        except UserError:
            say("The machine could not be held, as the link is lost: it goes to the end of the "
                "line that it has, and no further.")
        if isinstance(error, LinkError) and heard.told:
            raise AlarmError(heard.told) from error
        raise


def _hold(link: Link, say: Callable[[str], None]) -> str:
    """Hold the machine, wait for rest, and give up what is left; return the state before that."""
    link.press(HOLD)
    end = link.pipe.time_s() + REST_S
    while True:
        told = link.status()
        state = told["state"]
        if state == "Alarm" or (state in ("Idle", "Hold") and told.get("substate") != "1"):
            break
        if link.pipe.time_s() > end:
            say(f"The machine has not come to rest within {REST_S:g} s of a hold: stop it by its "
                "emergency stop.")
            return state
        link.poll(POLL_S)
    if state == "Hold":
        link.press(RESET)
        link.await_greeting()
        say("The machine is held and stands; what was left of the cycle is given up.")
    return state


def _await_alarm(link: Link, heard: Alarms) -> None:
    """Wait for number and sentence of an alarm: they come after the state."""
    end = link.pipe.time_s() + TOLD_S
    while heard.code is None and link.pipe.time_s() < end:
        link.poll(POLL_S)
