# SPDX-License-Identifier: Apache-2.0
"""How a command takes a controller at a port, and leaves it to whoever comes next.

No command moves a locked machine that nobody has told it to unlock. At its end a reset at rest lets
others send lines without numbers again, such as ``$X`` from a terminal.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress

from host.errors import ALARM, UserError
from host.link.link import RESET, Link, RefusedError
from softcore.tables.faults import named

__all__ = ["LockedError", "leave", "require_unlocked", "taken"]

RESTS_S = 1.0       # longest wait for rest
LOOK_S = 0.1        # between two looks at the place

LOCKED = named("locked").error


class LockedError(UserError):
    """The machine is locked."""

    status = ALARM


def require_unlocked(link: Link, *, unlock: bool) -> None:
    """Refuse a locked machine, or unlock it first if ``unlock`` is wanted. Sets G21.

    Raises
    ------
    LockedError
        If the machine is locked.
    LinkError
        If the controller refuses a line for another reason, or does not answer.
    """
    if unlock:
        link.command("$X")
    try:
        link.command("G21")     # any block would do: a locked machine refuses all
    except RefusedError as error:
        if error.code != LOCKED:
            raise
        raise LockedError(
            "the machine is locked, as after power-on, an alarm, or a reset in motion. Look at the "
            "machine and remove the cause; then unlock it with $X. The option --unlock does that "
            "first.") from error


def leave(link: Link) -> None:
    """Reset the controller if its axes rest; a moving one, or a lost link, is left as it is."""
    with suppress(UserError):
        end, place = link.pipe.time_s() + RESTS_S, ""
        while link.pipe.time_s() < end:
            told = link.status()
            if told["state"] in ("Idle", "Alarm") and told.get("MPos") == place:
                link.press(RESET)
                link.await_greeting()
                return
            place = told.get("MPos", "")
            link.poll(LOOK_S)


@contextmanager
def taken(link: Link, *, unlock: bool) -> Iterator[None]:
    """Take a controller as ``require_unlocked`` does, which raises; at the end ``leave`` it."""
    try:
        require_unlocked(link, unlock=unlock)
        yield
    finally:
        leave(link)
