# SPDX-License-Identifier: Apache-2.0
"""The lock of a controller: no command moves a locked machine that nobody has told it to unlock."""

from host.errors import ALARM, UserError
from host.link.link import Link, RefusedError
from softcore.tables.faults import named

__all__ = ["LockedError", "require_unlocked"]

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
