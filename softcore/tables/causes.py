# SPDX-License-Identifier: Apache-2.0
"""Why the interlock trips: the only place where its causes are written down.

A cause's number is its place in the table: its bit in every register. ``python -m
softcore.generate`` makes the firmware's sentences (``base/cause_texts.h``) and part of the page
``docs/reference/alarms.md`` of it; the register map reads it. Plain data: imports nothing from
Amaranth.
"""

from dataclasses import dataclass

__all__ = ["CAUSES", "Cause", "numbers"]


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A cause: ``sentence`` as in the alarm, and ``remedy`` for the person at the machine.

    For coders and soft limits the firmware knows more and makes its own sentence; the one here is
    only for the page.
    """

    name: str
    sentence: str
    remedy: str


def _cause(name: str, sentence: str, remedy: str) -> Cause:
    return Cause(name=name, sentence=sentence, remedy=remedy)


DRIVE = "Look at the drive, its supply and its cable."
CODER = "Look at the coder, its cable and its plug. The position is lost."

CAUSES: tuple[Cause, ...] = (
    _cause("power_on", "nobody has cleared the interlock since power-on", "Send `$X`."),
    _cause("estop", "emergency stop", "See why it was pressed, and release it."),
    _cause("drive_fault", "a drive reports a fault", f"{DRIVE} On a wire machine the third drive "
           "is that of the wire: it may be broken."),
    _cause("limit_low", "an axis is on its lower limit switch",
           "Send `$X`, and move slowly away from the switch."),
    _cause("limit_high", "an axis is on its upper limit switch",
           "Send `$X`, and move slowly away from the switch."),
    _cause("fluid_low", "the fluid is below its level", "Fill the tank; look for a leak."),
    _cause("watchdog", "the firmware stopped calling the watchdog",
           "Send `$X`. If it happens again, do not use the controller, and report it."),
    _cause("error_saturated", "a deviation counter reached its limit",
           "The axis did not follow: check that it can move, and look at its drive."),
    _cause("encoder", "an encoder made an illegal transition", CODER),
    _cause("following_stopped", "position deviation at rest above its limit",
           f"Something pushes the axis, or its drive does not hold it. {DRIVE}"),
    _cause("following_moving", "position deviation in motion above its limit",
           f"The axis did not follow: check that it can move. {DRIVE}"),
    _cause("firmware", "the firmware has tripped it", "Read the messages before this one."),
    _cause("coder", "a coder does not show the motion of its axis", CODER),
    _cause("travel", "a command beyond a soft limit",
           "Check zero and program; move the axis back."),
    _cause("contact", "the electrode touched the work with the discharge off",
           "Send `$X`, and move away from the work. Check electrode and work for damage."),
    _cause("gate", "the gap had current or voltage with both sources off",
           "Switch the power supply off. One of its transistors, or its cable, may be broken."),
    _cause("memory", "the processor's memory read wrong",
           "Switch the controller off and on. If it happens again, do not use the controller."),
    _cause("guard", "a guarded register of the gateware is damaged",
           "Send `$X`, and find the reference again. If it happens again, do not use the "
           "controller."),
)


def numbers() -> dict[str, int]:
    """Number of each cause, by its name."""
    return {cause.name: number for number, cause in enumerate(CAUSES)}
