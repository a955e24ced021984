# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper touch``: a touching cycle on the controller at a port, shown on the terminal."""

from rich.console import Console

from host.errors import UsageError
from host.link.link import Link
from host.link.port import Port
from host.machines import machine as machines
from host.run.controller import Controller
from host.touch.cycles import AXES, Cycle, Found, Probe, boss, corner, drive, edge, hole, zero_line

__all__ = ["SHAPES", "cycle_of", "touch", "ways_of"]

SHAPES = ("edge", "corner", "hole", "boss")


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


def cycle_of(shape: str, probe: Probe, *, toward: str = "", size: float = 0.0, lift: float = 0.0,
             along: float = 2.0) -> Cycle:
    """The cycle for a shape.

    Raises
    ------
    UsageError
        If something that it needs is missing or wrong.
    """
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
                     'Y, such as X+Y+.' if shape in SHAPES else
                     f'there is no "{shape}" to touch; there are: {", ".join(SHAPES)}.')


def touch(url: str, cycle: Cycle, probe: Probe, *, baud: int, machine: str, known: float | None,
          system: int | None, console: Console) -> Found:
    """Carry out a cycle on the controller at ``url``, and print what it has found.

    With ``known``, the true diameter of a hole or boss in mm, the contact offset is printed too.
    With ``system``, 1 (G54) to 6, the zero of that work offset is set.

    Raises
    ------
    UserError
        If the controller cannot be reached, refuses a line, or is in alarm.
    """
    def say(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    chosen = machines.load(machine)
    port = Port(url, baud)
    try:
        controller = Controller(port, chosen, clock_hz=chosen.clock_hz, say=say)
        controller.identify(reset=False)
        link = Link(controller, _quiet)
        link.await_greeting()
        link.command("$X")
        found = drive(link, cycle, tell=say)
        for axis, place in found.places.items():
            say(f"{axis} {place:.4f} mm in the machine frame")
        if found.size is not None:
            say(f"diameter {found.size:.4f} mm")
        if known is not None:
            say(f"contact offset {found.offset(known, probe):.4f} mm: give it as --offset")
        if system is not None:
            line = zero_line(found, system)
            link.command(line)
            say(f"zero of G{53 + system} set: {line}")
    finally:
        port.close()
    return found


def _quiet(line: str) -> None:
    """Ignore a line that is no answer."""

