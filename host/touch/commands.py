# SPDX-License-Identifier: Apache-2.0
"""The command ``gapkeeper touch``."""

from typing import Annotated

import typer
from rich.console import Console

from host.options import BAUD, LIVE_PORT, Baud, ControllerPort, Unlock

__all__ = ["touch_work"]

out = Console(highlight=False)


def touch_work(
    shape: Annotated[str, typer.Argument(
        metavar="SHAPE", show_default=False,
        help="What to find: edge, corner, hole (its middle), boss (its middle).")],
    toward: Annotated[str, typer.Argument(
        metavar="[DIRECTION]", show_default=False,
        help="Of an edge or corner: the way to its sides, such as X+, Z- or X+Y-.")] = "",
    port: ControllerPort = LIVE_PORT,
    radius: Annotated[float, typer.Option(
        metavar="MM", help="Radius of the wire or of a round electrode.")] = 0.0,
    offset: Annotated[float, typer.Option(
        metavar="MM", help="Contact offset: how far before the surface the gap conducts.")] = 0.0,
    reach: Annotated[float, typer.Option(
        metavar="MM", help="Longest way to a surface; of a hole, more than its diameter.")] = 5.0,
    size: Annotated[float, typer.Option(
        metavar="MM", help="Of a boss: roughly its diameter.")] = 0.0,
    lift: Annotated[float, typer.Option(
        metavar="MM", help="Of a boss: how far Z goes down beside it, from a start over its "
                           "middle. 0: go round it, from a start beside it at least X.")] = 0.0,
    along: Annotated[float, typer.Option(
        metavar="MM", help="Of a corner: the start is at most so far from it.")] = 2.0,
    known: Annotated[float | None, typer.Option(
        metavar="MM", show_default=False,
        help="True diameter of a hole or boss: tell the contact offset.")] = None,
    zero: Annotated[int | None, typer.Option(
        min=1, max=6, metavar="N", show_default=False,
        help="Set the zero of a work offset there: 1 is G54, 6 is G59.")] = None,
    machine: Annotated[str, typer.Option(
        metavar="NAME|FILE", help="As of `run`.")] = "sinker",
    baud: Baud = BAUD,
    unlock: Unlock = False,
) -> None:
    """Find an edge, a corner, or the middle of a hole or boss by touching it.

    The discharge must be off, the machine unlocked, and the position known. Each side is touched
    quickly, and again slowly. Contact where none is expected ends it with alarm 152. Places are
    told in the machine frame. Ctrl-C and whatever else ends it early hold the machine.
    """
    from host.touch.command import check_known, cycle_of
    from host.touch.command import touch as touch_at
    from host.touch.cycles import Probe
    probe = Probe(radius=radius, offset=offset, reach=reach)
    cycle = cycle_of(shape, probe, toward=toward, size=size, lift=lift, along=along)
    check_known(shape, known)
    touch_at(port, cycle, probe, baud=baud, machine=machine, known=known, system=zero,
             unlock=unlock, console=out)
