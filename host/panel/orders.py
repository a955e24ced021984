# SPDX-License-Identifier: Apache-2.0
"""What a page may order, and when: the sentence that refuses an order that cannot be now."""

from dataclasses import dataclass
from typing import Any

from host.errors import UserError
from host.link.framing import check_line
from host.panel.heard import Heard
from host.panel.job import Job

__all__ = ["BEGIN", "MEASURING", "ORDERS", "TOUCHING", "Moment", "why_not"]

LINES = 20          # that may wait to be sent
ORDERS = ("hold", "resume", "retract", "stop", "line", "jog", "jog_end", "choose", "run", "arm",
          "touch", "tune", "connect", "scope", "scope_stop", "scope_force")
BEGIN = ("run", "touch", "tune")    # orders that go on by themselves
MEASURING, TOUCHING = "The drives are being measured", "Touching is under way"
# A retraction needs the data of a tape: without it there is an alarm.
_DISTURB = (*BEGIN, "line", "jog", "retract")   # orders that would disturb what goes on by itself


@dataclass(frozen=True)
class Moment:
    """What decides on an order: ``heard`` of the controller, and how the panel stands.

    ``running`` says whether a tape runs, ``begins`` whether an order of ``BEGIN`` is about to be
    carried out, ``busy`` is ``MEASURING``, ``TOUCHING`` or empty, ``waiting`` the number of lines
    that wait.
    """

    heard: Heard
    job: Job | None
    running: bool
    simulated: bool
    busy: str
    begins: bool
    waiting: int


def why_not(name: str, words: tuple[Any, ...], moment: Moment) -> str:
    """Why an order with its words cannot be given now, in a sentence; empty if it can."""
    heard = moment.heard
    state = heard.fields.get("state", "")
    told = heard.state or "not known"
    if name in BEGIN and moment.begins:
        return "Something else is about to begin."
    if moment.busy and name in _DISTURB:
        return f"{moment.busy}: Stop ends it."
    if name == "line":
        try:
            check_line(words[0])
        except UserError as error:
            return f"{str(error)[:1].upper()}{str(error)[1:]}"
        if moment.waiting >= LINES:
            return f"{LINES} lines wait already."
    elif name == "choose" and moment.running:
        return "A tape is running."
    elif name == "run":
        if moment.job is None:
            return "No tape is chosen."
        if moment.running or state != "Idle":
            return f"A tape starts from Idle; the state is {told}."
        if "Armed" not in heard.fields and not heard.dry:
            return ('The discharge is not armed: press the button "arm"'
                    f"{' below' if moment.simulated else ' at the machine'}.")
    elif name in ("touch", "tune") and (moment.running or state != "Idle"):
        return (f"{'Touching' if name == 'touch' else 'Measuring'} starts from Idle; the state is "
                f"{told}.")
    elif name == "jog" and (moment.running or state not in ("Idle", "Jog", "Run")):
        return f"A jog starts from Idle; the state is {told}."
    return ""
