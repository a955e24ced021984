# SPDX-License-Identifier: Apache-2.0
"""The zero of a work offset at the surface, corner or middle that a cycle has found.

``G10 L20`` says which coordinates the present place has in a work offset. The controller reckons
with an offset of G92, which ``G10 L2`` does not. So the place where the axes stand must be known:
it is told by a status report at rest.
"""

from collections.abc import Mapping

from host.errors import UsageError
from host.link.link import Link
from host.touch.cycles import AXES, Found, TouchError
from softcore.tables.settings import PULSES_PER_MM

__all__ = ["await_rest", "set_zero", "stands", "zero_lines"]

SYSTEMS = 6     # work offsets, G54 to G59
POLL_S = 0.05
_MOVES = ("Run", "Hold")    # states after which the axes come to rest


def stands(fields: Mapping[str, str]) -> dict[str, float] | None:
    """Where the path stands by a status report, in mm of the machine frame by axis.

    That is the place by the coders and the following error. None if the report is damaged.
    """
    try:
        places = [float(place) for place in fields["MPos"].split(",")]
        errors = [int(error) / PULSES_PER_MM for error in fields["Er"].split(",")]
        return {axis: place + error
                for axis, place, error in zip(AXES, places, errors, strict=True)}
    except (KeyError, ValueError):
        return None


def zero_lines(found: Found, system: int, at: Mapping[str, float]) -> list[str]:
    """Lines that put the zero of a work offset, 1 (G54) to 6, at what was found.

    ``at`` is where the axes stand, as ``stands`` has it.

    Raises
    ------
    UsageError
        If there is no such work offset.
    """
    if not 1 <= system <= SYSTEMS:
        raise UsageError(f"a work offset is 1 (G54) to {SYSTEMS} (G59), not {system}.")
    words = " ".join(f"{axis}{round(at[axis] - place, 4) + 0.0:.4f}"
                     for axis, place in found.places.items())
    return ["G21", f"G10 L20 P{system} {words}"]


def await_rest(link: Link) -> dict[str, float]:
    """Wait until the axes rest, a hold included; return where they stand, as ``stands``.

    Raises
    ------
    TouchError
        If they do not come to rest as after a motion, but by an alarm.
    LinkError
        If the controller does not answer.
    """
    while True:
        told = link.status()
        at = stands(told)
        if told["state"] == "Idle" and at is not None:
            return at
        if told["state"] not in ("Idle", *_MOVES):
            raise TouchError("the axes have not come to rest as after a motion: the state of the "
                             f"controller is {told['state']}, not Idle.")
        link.poll(POLL_S)


def set_zero(link: Link, found: Found, system: int) -> list[str]:
    """Put the zero of a work offset at what was found; return the lines that did it.

    Raises
    ------
    UsageError, TouchError, LinkError
        As ``zero_lines``, ``await_rest``, and if a line is refused.
    """
    lines = zero_lines(found, system, await_rest(link))
    for line in lines:
        link.command(line)
    return lines
