# SPDX-License-Identifier: Apache-2.0
"""Numbered states that gateware, firmware and host name: one table for all.

``python -m softcore.generate`` makes the gateware's (``rtl/states.py``) and the firmware's
(``hal/states.h``) of it; the host reads it. Plain data: imports nothing from Amaranth.
"""

from dataclasses import dataclass

__all__ = ["CHECKS", "MOTION", "PULSES", "State"]


@dataclass(frozen=True)
class State:
    """A state: its number, its name, and what it means; ``text`` is the firmware's of it."""

    number: int
    name: str
    doc: str
    text: str = ""


def _states(*rows: tuple[str, ...]) -> tuple[State, ...]:
    """States ``(name, doc)`` or ``(name, doc, text)``, numbered from 0 on."""
    return tuple(State(number, *row) for number, row in enumerate(rows))


# What the motion is doing.
MOTION = _states(
    ("front", "machining at the front of the path"),
    ("stopping", "a retraction was ordered: coming to rest"),
    ("retracting", "going back"),
    ("at_limit", "as far back as allowed, still short"),
    ("high", "re-advance at VH (H of the tape), to the changeover position"),
    ("low", "re-advance at VL (E of the tape), to the start point"),
    ("halted", "stopped by an alarm"))

# The check of a coder's supervision that failed first, with the words of the alarm.
CHECKS = _states(
    ("none", "", "it is sound"),
    ("model", "the axis does not move as the model of its drive",
     "the axis does not follow its drive's command"),
    ("silent", "no edge of either phase", "both phases are silent"),
    ("phase_a", "B alone has edges", "phase A is silent"),
    ("phase_b", "A alone has edges", "phase B is silent"),
    ("against", "against the command", "it counts against the command"),
    ("share", "much less, or much more, than the drive was commanded",
     "it counts much less, or much more, than was commanded"),
    ("rate", "faster than any drive", "it counts faster than any drive goes"))

# The pulse that got its class in the clock of the oscilloscope's entry.
PULSES = _states(
    ("none", ""), ("open", ""), ("ok", ""), ("dame", ""), ("short", ""),
    ("sensed_open", "a sensing pulse"), ("sensed_short", "a sensing pulse"))
