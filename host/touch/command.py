# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper touch``: a touching cycle on the controller at a port, shown on the terminal."""

from rich.console import Console

from host.errors import UsageError
from host.link.link import Link
from host.link.lock import taken
from host.link.port import Port
from host.machines import machine as machines
from host.run.controller import Controller
from host.run.events import Scale
from host.touch.cycles import AXES, Cycle, Found, Probe, boss, corner, drive, edge, hole
from host.touch.ending import Alarms, ending
from host.touch.zero import await_rest, set_zero

__all__ = ["SHAPES", "check_known", "cycle_of", "touch", "ways_of"]

SHAPES = ("edge", "corner", "hole", "boss")
LONGEST_MM = 1000


def ways_of(toward: str) -> dict[str, int]:
    """Directions by axis: ``"X+"`` or ``"X+Y-"``.

    Raises
    ------
    UsageError
        If the text is no such list of directions, or an axis is named twice.
    """
    text = toward.upper()
    pairs = [text[start:start + 2] for start in range(0, len(text), 2)]
    ways = {pair[0]: 1 if pair[1:] == "+" else -1 for pair in pairs}
    if not pairs or any(len(pair) != 2 or pair[0] not in AXES or pair[1] not in "+-"
                        for pair in pairs):
        raise UsageError(f'"{toward}" is no direction; write an axis and a sign, such as X+.')
    if len(ways) != len(pairs):
        raise UsageError(f'"{toward}" names an axis twice.')
    return ways


def check_known(shape: str, known: float | None) -> None:
    """Refuse the true diameter ``known``, mm, of what has none, or one that is no length.

    Raises
    ------
    UsageError
        Says which it is.
    """
    if known is None:
        return
    if shape not in ("hole", "boss"):
        raise UsageError("the contact offset is calibrated by a hole or a boss.")
    if not 0 < known <= LONGEST_MM:
        raise UsageError(f"the true diameter must be above 0 and at most {LONGEST_MM} mm, not "
                         f"{known:g}.")


def cycle_of(shape: str, probe: Probe, *, toward: str = "", size: float = 0.0, lift: float = 0.0,
             along: float = 2.0) -> Cycle:
    """The cycle for a shape.

    Raises
    ------
    UsageError
        If something that it needs is missing or wrong.
    """
    if shape not in SHAPES:
        raise UsageError(f'there is no "{shape}" to touch; there are: {", ".join(SHAPES)}.')
    for name, number in (("size", size), ("lift", lift), ("way along a side", along)):
        if not 0 <= number <= LONGEST_MM:
            raise UsageError(f"the {name} must be 0 to {LONGEST_MM} mm, not {number:g}.")
    if shape == "hole":
        return hole(probe)
    if shape == "boss":
        return boss(probe, size, lift=lift)
    ways = ways_of(toward)
    if shape == "edge" and len(ways) == 1:
        ((axis, way),) = ways.items()
        return edge(probe, axis, way)
    if shape == "corner" and set(ways) == {"X", "Y"}:
        return corner(probe, ways["X"], ways["Y"], along=along)
    raise UsageError('an edge needs one direction, such as X+; a corner needs one of X and one of '
                     'Y, such as X+Y+.')


def touch(url: str, cycle: Cycle, probe: Probe, *, baud: int, machine: str, known: float | None,
          system: int | None, unlock: bool, console: Console) -> Found:
    """Carry out a cycle on the controller at ``url``, and print what it has found.

    With ``known``, the true diameter of a hole or boss in mm, the contact offset is printed too.
    With ``system``, 1 (G54) to 6, the zero of that work offset is set. A locked machine is
    unlocked if ``unlock`` is wanted. Whatever ends the cycle early holds the machine.

    Raises
    ------
    UserError
        If the controller cannot be reached, is locked, refuses a line, or is in alarm.
    """
    def say(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    chosen = machines.load(machine)
    port = Port(url, baud)
    try:
        controller = Controller(port, chosen, clock_hz=chosen.clock_hz, say=say)
        controller.identify(reset=False)
        heard = Alarms(Scale(chosen.clock_hz, chosen.pulses_per_mm))
        link = Link(controller, heard.hear)
        link.await_greeting()
        with taken(link, unlock=unlock), ending(link, heard, say):
            found = drive(link, cycle, tell=say)
            await_rest(link)
            for axis, place in found.places.items():
                say(f"{axis} {place:.4f} mm in the machine frame")
            if found.size is not None:
                say(f"diameter {found.size:.4f} mm")
            if known is not None:
                say(f"contact offset {found.offset(known, probe):.4f} mm: give it as --offset")
            if system is not None:
                say(f"zero of G{53 + system} set: {set_zero(link, found, system)[-1]}")
    finally:
        port.close()
    return found
