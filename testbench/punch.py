# SPDX-License-Identifier: Apache-2.0
"""Punch the derived tapes: ``python -m testbench.punch``.

It punches the part programs in ``tapes/`` in ISO and in EIA code and, in ``tapes/broken/``, one
tape for every kind of fault. The files are committed, so that they can be given to a machine; a
test compares them with this script.
"""

from dataclasses import dataclass
from pathlib import Path

from host.tape.codes import EIA, ISO, Code
from host.tape.tape import FEED_ROWS, encode

TAPES = Path(__file__).parents[1] / "tapes"

# Block 1 is the start; the motion of block 7 is 10 um on the machine `sinker`.
BASE = """%
N10 G21 G90 G94
N20 C130
N30 G36 R300 L0.5 H600 E60 Q0.1
N40 M08
N50 M03
N60 G01 Z0.09 F6
N70 M05
N80 M02
%
"""

# A step of 0.3 mm between two inside corners; a wire with its offset needs 0.2 mm at each.
STEP = """N20 C130
N21 G10 D1 R0.2
N22 G41 D1 G01 X1 F6
N23 X3
N24 Y0.3
N25 X1
N26 G40 X0
"""


@dataclass(frozen=True)
class Broken:
    """A broken tape: its rows, and where a reader must find the fault.

    ``character`` is 0 if the fault is not a single character. ``moves`` says that blocks before the
    fault move the machine.
    """

    rows: bytes
    block: int
    character: int
    words: str
    moves: bool = False


def _text(old: str, new: str, code: Code = ISO) -> bytes:
    assert BASE.count(old) == 1
    return encode(BASE.replace(old, new), code).rows


def _row(block: int, character: int, change, code: Code = ISO) -> bytes:
    """Base tape with one row replaced by the rows ``change(row)``."""
    rows = encode(BASE, code).rows
    index = FEED_ROWS
    for _ in range(block - 1):
        index = rows.index(code.end_of_block, index) + 1
    index += character - 1
    return rows[:index] + bytes(change(rows[index])) + rows[index + 1:]


def _other_code(block: int) -> bytes:
    """An ISO tape that goes on in EIA code from a block on."""
    cut = encode(BASE).rows
    for _ in range(block - 1):
        index = cut.index(ISO.end_of_block)
        cut = cut[index + 1:]
    head = encode(BASE).rows[:-len(cut)]
    tail = "".join(line + "\n" for line in BASE.splitlines()[block - 1:])
    return head + encode(tail, EIA).rows[FEED_ROWS + 2:]


def broken() -> dict[str, Broken]:
    """Every broken tape, by file name."""
    whole = encode(BASE).rows
    end = whole.index(bytes([ISO.punch["M"], ISO.punch["0"], ISO.punch["2"]]))
    return {
        "parity_flip.ptp": Broken(
            _row(4, 6, lambda row: [row ^ 0x10]), 4, 6, "parity"),
        "parity_flip.eia.ptp": Broken(
            _row(4, 6, lambda row: [row ^ 0x10], EIA), 4, 6, "parity"),
        "parity_in_comment.ptp": Broken(
            _text("M08", "M08 (OIL ON)").replace(b"\xcf", b"\xce", 1), 5, 10, "parity"),
        "no_character.ptp": Broken(
            _row(7, 5, lambda row: [0x81]), 7, 5, "character"),
        "blank_in_data.eia.ptp": Broken(
            _row(3, 5, lambda row: [0x00, row], EIA), 3, 5, "blank"),
        "other_code.ptp": Broken(_other_code(6), 6, 1, "parity"),
        "truncated.ptp": Broken(whole[:end - 7], 8, 6, "M02", moves=True),
        "missing_end.ptp": Broken(_text("N80 M02\n", ""), 9, 1, "M02", moves=True),
        "missing_start.ptp": Broken(
            whole[:FEED_ROWS] + whole[FEED_ROWS + 2:], 1, 0, "start"),
        "damaged_start.ptp": Broken(
            _row(1, 1, lambda row: [row ^ 0x01]), 1, 0, "start"),
        "over_long_block.ptp": Broken(
            _text("N40 M08", f"N40 M08 ({'LONG ' * 60})"), 5, 257, "256"),
        "number_overflow.ptp": Broken(_text("Z0.09", "Z-1234567890123"), 7, 23, "digits"),
        "number_malformed.ptp": Broken(_text("Z0.09", "Z0.0.9"), 7, 13, "second decimal point"),
        "lone_return.ptp": Broken(_text("M08", "M99"), 5, 5, "M99"),
        "unknown_word.ptp": Broken(_text("M08", "B90"), 5, 5, "B"),
        "unknown_code.ptp": Broken(_text("G90", "G77"), 2, 9, "G77"),
        "word_twice.ptp": Broken(_text("Z0.09", "Z0.09 Z0.03"), 7, 15, "Z"),
        "open_comment.ptp": Broken(_text("M08", "M08 (OIL ON"), 5, 9, "comment"),
        "limit_below_changeover.ptp": Broken(_text("Q0.1", "Q0.6"), 4, 28, "Q"),
        "zero_speed.ptp": Broken(_text("R300", "R0"), 4, 9, "R"),
        "incomplete_data.ptp": Broken(_text(" E60", ""), 4, 0, "E"),
        "arc_radii_differ.ptp": Broken(
            _text("G01 Z0.09", "G02 X1 I0.6"), 7, 12, "0.6000 mm at its start, 0.4000 mm"),
        "arc_without_centre.ptp": Broken(_text("G01 Z0.09", "G03 X1 Y1"), 7, 9, "centre"),
        "arc_chord_too_long.ptp": Broken(_text("G01 Z0.09", "G02 X1 R0.45"), 7, 12, "diameter"),
        "impossible_corner.ptp": Broken(
            _text("N20 C130\n", STEP), 7, 0, "0.2000 mm leaves nothing",
            moves=True),
        "fault_after_motion.ptp": Broken(
            _text("N80 M02", "N80 X1 B2\nN90 M02"), 9, 8, "B", moves=True),
    }


def derived() -> dict[Path, bytes]:
    """Every derived tape, by its path."""
    files = {}
    for program in sorted(TAPES.glob("*.nc")):
        text = program.read_text()
        files[program.with_suffix(".ptp")] = encode(text, ISO).rows
        files[program.with_suffix(".eia.ptp")] = encode(text, EIA).rows
    return files | {TAPES / "broken" / name: tape.rows for name, tape in broken().items()}


def main() -> None:
    """Write every derived tape."""
    for path, rows in derived().items():
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(rows)


if __name__ == "__main__":
    main()
