# SPDX-License-Identifier: Apache-2.0
"""The page of the boards' pins, and a drawing of each board, from the boards' wires."""

from collections.abc import Iterable

from constraints.board import Board
from constraints.pads import CHAIN, FIXED, PADS, POWER, Pad
from constraints.wires import GROUND_OHM, KINDS, LOW_MAX_V, Wire, unloaded_high, unloaded_v

__all__ = ["alike", "board_drawing", "drawn", "pins_page"]

PAD = {pad.name: pad for pad in (*PADS, CHAIN, *FIXED)}
TRIED = ("No machine has been wired by this page yet, and no bitstream has been on a board: the "
         "tables are checked against the pin lists and by a test, not on hardware.")


def _labels(board: Board) -> dict[str, str]:
    return {pin: f"{header.name} {header.labels.get(pin, pin)}"
            for header in board.headers for row in header.rows for pin in row}


def _taken(board: Board) -> dict[str, tuple[Wire, int]]:
    """Pins of the headers whose site has a wire on the board itself; the wire and its bit."""
    at = {site: pin for pin, site in board.sites.items()}
    return {at[site]: (wire, bit) for wire in board.wires if not wire.header
            for bit, site in enumerate(board.sites_of(wire)) if site in at}


def _name(wire: Wire, bit: int) -> str:
    return f"{wire.pad}{f'[{bit}]' if PAD[wire.pad].width > 1 else ''}"


def _places(wire: Wire, board: Board) -> str:
    labels = _labels(board)
    return ", ".join(f"{labels[pin]} ({site})" if wire.header else site
                     for pin, site in zip(wire.pins.split(), board.sites_of(wire), strict=True))


def _notes(board: Board) -> list[str]:
    """Paragraphs of what a board's table does not say."""
    labels, taken, found = _labels(board), _taken(board), []
    if board.analogue:
        found.append(board.analogue)
    wires = {wire.pad: wire for wire in board.wires}
    if CHAIN.name in wires:
        first = wires["drive_enable"].pins.split()[0]
        found.append(
            "**The shift registers behind `chain` come up at random: their output enable must be "
            f"wired to {labels[first]}, `drive_enable[0]`.** Of a register such as the 74HC595 it "
            "is active low: put an inverter between them. The three pins of `drive_enable` always "
            "have the same level; take the first. While it is low, as without a bitstream and "
            "whenever the outputs are safe, the registers drive nothing: give each of their "
            "outputs a resistor to its inactive level. Keep the resistor to ground on "
            "`drive_enable`. Untried.")
    if taken:
        names = ", ".join(f"{labels[pin]} (`{_name(*taken[pin])}`)" for pin in taken)
        found.append(f"**Leave these pins of the headers free:** {names}. The board itself uses "
                     "their sites.")
    return [line for text in found for line in (text, "")]


def _unloaded(wire: Wire) -> str:
    if PAD[wire.pad].direction == "i":
        return "not read"
    level = unloaded_high(wire)
    held = {"ground": f"{GROUND_OHM / 1000:.1f} kΩ to ground", "supply": "resistor to 3.3 V",
            "board": "by the board", "": "by nothing"}[wire.hold]
    if level is None:
        return f"not known (held {held})"
    said = f"{'high' if level else 'low'} ({held}), " + (
        "inactive" if level is wire.low else "idle" if wire.pad == "tx" else "active")
    return said + (f"; acts only with `{wire.behind}`" if wire.behind else "")


def _electrics(wire: Wire) -> str:
    drive = "" if wire.drive_ma is None else f", {wire.drive_ma} mA{' slow' * wire.slow}"
    pull = "" if wire.pull == "NONE" else f", pull {wire.pull.lower()}"
    return f"{wire.standard}{pull}{drive}"


def _row(wire: Wire, pad: Pad, board: Board) -> str:
    way = "in" if pad.direction == "i" else "out ⚡" if wire.pad in POWER else "out"
    return (f"| `{wire.pad}` | {way} | {_places(wire, board)} "
            f"| {'yes' if wire.low else ''} | {_electrics(wire)} | {pad.doc} "
            f"{wire.reason[0].upper()}{wire.reason[1:]}. | {_unloaded(wire)} | {wire.broken} |")


def alike(boards: Iterable[Board]) -> list[list[Board]]:
    """Boards in groups of the same pins."""
    groups: dict[str, list[Board]] = {}
    for board in boards:
        groups.setdefault(board.pin_list.name, []).append(board)
    return list(groups.values())


def drawn(board: Board) -> str:
    """Name of a board's drawing; boards with the same pins share it."""
    return f"pins-{board.pin_list.stem}.svg"


def pins_page(boards: Iterable[Board], pads: Iterable[Pad] = (*PADS, CHAIN, *FIXED)) -> str:
    """Reference of the pins and wires, in Markdown; boards with the same pin list share a table."""
    boards, pads = tuple(boards), tuple(pads)
    worst = max(unloaded_v(wire)[1] for board in boards for wire in board.wires
                if wire.hold == "ground")
    lines = [
        "# Pins and wires", "",
        "Each signal of the machine, and its pins on the board, first bit first: the header's pin "
        "as it is printed there and in brackets the site of the device, or the site alone. "
        "*Active low*: the pad inverts. ⚡ marks an output of power: one that puts power on the "
        f"machine or moves it while it is active. {TRIED}", "",
        f"**Every output of power needs its resistor of {GROUND_OHM / 1000:.1f} kΩ to ground.** "
        "Without a bitstream the device lets its pins go, and a weak resistor inside it may pull "
        f"the wire up. With the resistor the wire then has at most {worst:.2f} V, and below "
        f"{LOW_MAX_V} V is low. The strength of the inner pull is from memory of the data sheet "
        "(`constraints/wires.py`). A test holds that no output of power can be active without a "
        "bitstream if these resistors are there.",
        "", "## What every wire must withstand", "",
        "The pins take 3.3 V and no more; they are not 5 V tolerant. Every wire to the machine "
        "comes through an isolator, which must withstand this:", "",
        "| kind | what it must withstand | wires |", "| --- | --- | --- |"]
    wires = [wire for board in boards for wire in board.wires]
    for key, kind in KINDS.items():
        names = dict.fromkeys(f"`{wire.pad}`" for wire in wires if wire.kind == key)
        if names:
            lines.append(f"| {kind.title} | {kind.withstand} | {', '.join(names)} |")
    for same in alike(boards):
        lines += ["", "## " + ", ".join(f"{board.title} (`{board.name}`)" for board in same), "",
                  f"![The headers from above]({drawn(same[0])})", "", *_notes(same[0]),
                  "| signal | direction | pins | active low | electrics | meaning | without a "
                  "bitstream | with a broken wire |", f"|{' --- |' * 8}",
                  *(_row(wire, pad, same[0]) for pad in pads
                    for wire in same[0].wires if wire.pad == pad.name)]
    return "\n".join(lines) + "\n"


ROW, WIDE, HALF, TOP = 18, 440, 220, 72
COLOURS = {"power": "#f4b6b0", "output": "#cfe3f7", "input": "#d6efd3", "guard": "#ffe3a8",
           "": "#f0f0f0", "supply": "#d9d9d9"}
LEGEND = (("power", "output of power"), ("output", "other output"),
          ("guard", "input: a broken wire is a fault"), ("input", "other input"),
          ("", "unused"), ("supply", "supply or ground"))


def _kind(wire: Wire) -> str:
    if wire.pad in POWER:
        return "power"
    if PAD[wire.pad].direction == "o":
        return "output"
    return "guard" if wire.low else "input"


def _cell(x: int, y: int, colour: str, label: str, said: str, *, left: bool) -> list[str]:
    text = f"{said} · {label}" if left else f"{label} · {said}"
    at, anchor = (x + HALF - 14, "end") if left else (x + 14, "start")
    return [f'<rect x="{x}" y="{y}" width="{HALF - 4}" height="{ROW - 2}" fill="{colour}" '
            'stroke="#888" stroke-width="0.5"/>',
            f'<text x="{at}" y="{y + 12}" text-anchor="{anchor}">{text.strip(" ·")}</text>']


def board_drawing(same: list[Board]) -> str:
    """SVG of the headers of boards with the same pins, from above: print, site and signal."""
    board = same[0]
    title = ", ".join(one.title for one in same)
    used = {pin: (wire, bit) for wire in board.wires if wire.header
            for bit, pin in enumerate(wire.pins.split())} | _taken(board)
    drawn_as = {pin: (_kind(wire), _name(wire, bit)) for pin, (wire, bit) in used.items()}
    drawn_as |= {pin: ("input", name) for pin, name in board.analogue_pins.items()}
    across = min(3, len(board.headers))
    stacks = [board.headers[at:at + across] for at in range(0, len(board.headers), across)]
    height = TOP + sum(max(len(header.rows) for header in stack) * ROW + 46 for stack in stacks)
    width = across * (WIDE + 20) + 20
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
             f'viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11">',
             f'<rect width="{width}" height="{height}" fill="white"/>',
             f'<text x="20" y="22" font-size="15" font-weight="bold">{title}: headers from '
             'above (print, site, signal)</text>']
    for index, (key, said) in enumerate(LEGEND):
        x = 20 + index * ((width - 40) // len(LEGEND))
        lines += [f'<rect x="{x}" y="34" width="12" height="12" fill="{COLOURS[key]}" '
                  'stroke="#888"/>',
                  f'<text x="{x + 16}" y="44" font-size="9">{said}</text>']
    top = TOP
    for stack in stacks:
        for column, header in enumerate(stack):
            x = 20 + column * (WIDE + 20)
            lines.append(f'<text x="{x + HALF - 2}" y="{top}" text-anchor="middle" '
                         f'font-size="13" font-weight="bold">{header.name}</text>')
            for row, pins in enumerate(header.rows):
                for side, pin in enumerate(pins):
                    site = board.sites.get(pin, "")
                    key, name = drawn_as.get(pin, ("" if site else "supply", ""))
                    label = " ".join(filter(None, (header.labels.get(pin, pin), site)))
                    lines += _cell(x + side * HALF, top + 8 + row * ROW, COLOURS[key], label,
                                   name, left=not side)
        top += max(len(header.rows) for header in stack) * ROW + 46
    return "\n".join([*lines, "</svg>"]) + "\n"
