# SPDX-License-Identifier: Apache-2.0
"""The page of a board's pins, from its resources and the machine's pads."""

import re
from collections.abc import Iterable
from typing import Any

from constraints.board import CHAIN, PADS, Board, Pad

__all__ = ["pins_page"]


def _sites(board: Board) -> dict[tuple[str, int], str]:
    """Site of every pin, by the pad's name and bit, from the board's pin list."""
    found = re.findall(r'^LOCATE COMP "(\w+)_0__io(?:\[(\d+)\])?" SITE "(\w+)";',
                       board.pin_list.read_text(), re.M)
    return {(name, int(bit or 0)): site for name, bit, site in found}


def _row(pad: Pad, board: Board, resources: dict[tuple[str, int], Any]) -> str:
    io = resources[pad.name, 0].ios[0]      # Amaranth has no types
    sites = _sites(board)
    places = [f"{name.removeprefix('gpio_0:')} ({sites[pad.name, bit]})" if ":" in name else name
              for bit, name in enumerate(io.names)]
    low = "yes" if io.invert else ""
    return (f"| `{pad.name}` | {'in' if pad.direction == 'i' else 'out'} | {', '.join(places)} "
            f"| {low} | {pad.doc} |")


def pins_page(boards: Iterable[Board], pads: Iterable[Pad] = (*PADS, CHAIN)) -> str:
    """Reference of the pins, in Markdown; boards with the same pin list share a table."""
    lines = [
        "# Pins", "",
        "Each signal of the machine, and its pins on the board, first bit first: the header's pin "
        "and in brackets the site of the device, or the site alone. *Active low*: the pad inverts. "
        "An input at a header is pulled down: where its wire breaks, an active low one reads as "
        "true, and what guards the machine stops it. What each wire must be like stands at the "
        "head of the board's file in `constraints/`."]
    pads = tuple(pads)
    alike: dict[str, list[Board]] = {}
    for board in boards:
        alike.setdefault(board.pin_list.name, []).append(board)
    for same in alike.values():
        resources = same[0].platform().resources
        lines += ["", "## " + ", ".join(f"{board.title} (`{board.name}`)" for board in same), "",
                  "| signal | direction | pins | active low | meaning |", f"|{' --- |' * 5}",
                  *(_row(pad, same[0], resources) for pad in pads
                    if (pad.name, 0) in resources)]
    return "\n".join(lines) + "\n"
