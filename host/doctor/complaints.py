# SPDX-License-Identifier: Apache-2.0
"""From what a controller says of its inputs to the wires and pins that may be wrong."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from constraints.board import Board
from constraints.pads import PADS

__all__ = ["OPEN", "PLACES", "Place", "place", "suspects", "touched"]

AXES = "XYZ"
WIDTH = {pad.name: pad.width for pad in PADS}


@dataclass(frozen=True)
class Place:
    """A wire and its pin: ``wire`` is the pad with its bit, ``pin`` where it is on the board."""

    wire: str
    pin: str

    def __str__(self) -> str:
        return f"{self.wire} at {self.pin}"


def place(board: Board, pad: str, bit: int = 0) -> Place:
    """Wire and pin of a pad's bit on a board."""
    wire = next(wire for wire in board.wires if wire.pad == pad)
    pins = wire.pins.split()
    pin, site = pins[bit], board.sites_of(wire)[bit]
    name = f"{pad}[{bit}]" if len(pins) > 1 else pad
    for header in board.headers:
        if any(pin in row for row in header.rows):
            return Place(name, f"{header.name} {header.labels.get(pin, pin)} (site {site})")
    return Place(name, f"site {site}, on the board")


# What an open guard means: its input is active when its wire is broken.
OPEN = {
    "estop": "open: the emergency stop is pressed, or its wire is broken",
    "drive_fault": "open: the drive reports a fault or is off, or its wire is broken",
    "limit_low": "open: the axis stands on its lower limit switch, or the wire is broken",
    "limit_high": "open: the axis stands on its upper limit switch, or the wire is broken",
    "fluid_low": "open: too little fluid, or its wire is broken",
}
CONTACT = r"touche[sd]|contact with"
# What the controller says, the pads of whose axes it speaks, and what that level means. A pad with
# a bit is that one wire, whatever axes are named.
PLACES: tuple[tuple[str, tuple[str, ...], str], ...] = (
    (r"emergency stop", ("estop",), OPEN["estop"]),
    (r"the wire has a break or its drive", ("drive_fault[2]",),
     "open: the wire has a break, its drive reports a fault or is off, or the input's wire is "
     "broken"),
    (r"a drive reports a fault", ("drive_fault",), OPEN["drive_fault"]),
    (r"lower limit switch", ("limit_low",), OPEN["limit_low"]),
    (r"upper limit switch", ("limit_high",), OPEN["limit_high"]),
    (r"On the limit switch of", ("limit_low", "limit_high"),
     "open: both ends of an axis at once; a common wire is broken, or the switches have no supply"),
    (r"the fluid is below", ("fluid_low",), OPEN["fluid_low"]),
    (r"coder of axis \w: phase A is silent", ("enc_a",), "phase A never changes: its wire is "
     "broken or stuck"),
    (r"coder of axis \w: phase B is silent", ("enc_b",), "phase B never changes: its wire is "
     "broken or stuck"),
    (r"coder of axis \w: both phases are silent", ("enc_a", "enc_b"), "neither phase changes: the "
     "coder's plug is off, or the drive does not move (enable, command)"),
    (r"coder of axis \w: it counts (against|another)", ("enc_a", "enc_b", "dac_negative"),
     "it counts the wrong way: the phases are exchanged, or the command's sign is broken, or the "
     "settings of the drives are not entered (they come first: --machine)"),
    (r"coder of axis \w|an encoder made an illegal transition", ("enc_a", "enc_b"),
     "it does not show the motion: look at both phases and their ground"),
    (r"current or voltage with both sources off",
     ("gap_current", "gap_short", "gap_on", "gap_sense"),
     "current or voltage with both gates off: a comparator's wire is broken (current) or stuck "
     "(short), or a gate is on: its wire is stuck, or its transistor is broken"),
    (CONTACT, ("gap_short", "gap_sense"), "the gap reads as a short: it is, or "
     "the comparator's wire is broken, or the sensing source has no voltage"),
)


def _axes(text: str) -> list[int]:
    """Axes that a sentence names; none means all."""
    found = re.search(r"\bax[ie]s ([XYZ](?:(?:, | and )[XYZ])*)", text)
    return [AXES.index(name) for name in re.findall("[XYZ]", found[1])] if found else []


def _split(pad: str) -> tuple[str, tuple[int, ...]]:
    """A pad's name, and its bit if it has one."""
    name, _, bit = pad.rstrip("]").partition("[")
    return name, (int(bit),) if bit else ()


def touched(text: str) -> bool:
    """Whether the controller says that electrode and work touch."""
    return re.search(CONTACT, text) is not None


def suspects(board: Board, said: Iterable[str]) -> list[tuple[str, list[Place]]]:
    """Meaning, and the wires that may be wrong, of each sentence that tells of an input."""
    found: list[tuple[str, list[Place]]] = []
    for text in said:
        for pattern, pads, meaning in PLACES:
            if not re.search(pattern, text):
                continue
            bits = _axes(text)
            places = [place(board, pad, bit) for pad, fixed in map(_split, pads)
                      for bit in ((bits or range(WIDTH[pad])) if WIDTH[pad] > 1 and not fixed else
                                  fixed or (0,))]
            if (meaning, places) not in found:
                found.append((meaning, places))
            break
    return found
