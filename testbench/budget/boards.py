# SPDX-License-Identifier: Apache-2.0
"""Cells and clock of every board's layout are budgets.

``python -m testbench.budget.boards BOARD...`` reads what ``gapkeeper build`` has left and lays
nothing out. A figure that is more than ``CHANGE`` away from its budget, to either side, is told
with both figures, and the exit status is 1. A smaller or faster layout gets a new budget too, so
that the gain is not lost unseen. So does a board that has no budget yet: its figures are told.
A figure that is missing or no number is told, too.
"""

import argparse
import json
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from softcore.build import BOARDS, BUILD, MANIFEST

__all__ = ["BUDGETS", "CHANGE", "BoardBudget", "changes", "main"]

CHANGE = 0.05


@dataclass(frozen=True)
class BoardBudget:
    """What a layout had when its budget was set.

    Members
    -------
    luts : int
        Look-up tables of the layout, including those in carry pairs and small RAMs.
    lut4, ccu2c, ff : int
        Look-up tables, carry pairs and flip-flops after synthesis.
    ram, bram, dsp : int
        Memories of 16 x 4 bits, block RAMs of 18 Kbit, multipliers of 18 bits.
    mhz : float
        What the controller's clock reaches.
    """

    luts: int
    lut4: int
    ccu2c: int
    ff: int
    ram: int
    bram: int
    dsp: int
    mhz: float


BUDGETS: dict[str, BoardBudget] = {
        "ulx3s": BoardBudget(luts=28_359, lut4=16_485, ccu2c=4511, ff=14_070, ram=198, bram=151,
                         dsp=4, mhz=50.1),
        "ulx3s_45f": BoardBudget(luts=28_356, lut4=16_498, ccu2c=4505, ff=14_071, ram=198, bram=107,
                             dsp=4, mhz=51.4),
        "colorlight_i9": BoardBudget(luts=28_422, lut4=16_572, ccu2c=4501, ff=14_102, ram=198,
                                 bram=107, dsp=4, mhz=52.9),
}


def changes(name: str, manifest: dict[str, Any]) -> list[str]:
    """What is further than ``CHANGE`` from the budget of a board, one sentence for each figure.

    So is a figure that is missing or no number. ``manifest`` is that of ``softcore.build``.
    """
    budget, found = BUDGETS.get(name), _figures(manifest)
    said = [f"{name}: {figure} is missing from the manifest, or no number"
            for figure, now in found.items() if now is None]
    if budget is None:
        return said or [f"{name}: no budget yet, measured is {BoardBudget(**found)}"]
    for figure, now in found.items():
        then = getattr(budget, figure)
        if now is not None and abs(now - then) > CHANGE * then:
            said.append(f"{name}: {figure} {now:g}, budget {then:g} ({now / then - 1:+.1%})")
    return said


def _figures(manifest: dict[str, Any]) -> dict[str, Any]:
    """Each figure of a ``BoardBudget``; None where the manifest has no number.

    A clock that is no number makes the slowest clock none: a comparison would pass over it.
    """
    cells, clocks = (_table(manifest.get(name)) for name in ("cells", "clocks_mhz"))
    reached = [_number(_table(clock).get("reached")) for clock in clocks.values()]
    slowest = None if None in reached else min(reached, default=None)
    return {field.name: slowest if field.name == "mhz" else _number(cells.get(field.name))
            for field in fields(BoardBudget)}


def _table(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _number(value: Any) -> Any:
    """A finite number as it is, else None. Neither is an integer that no float can hold."""
    return value if isinstance(value, int | float) and abs(value) <= sys.float_info.max else None


def _judged(name: str, path: Path) -> list[str]:
    """What there is to say about the manifest of a board, at this path."""
    if not path.exists():
        return [f"{name}: there is no layout to judge; gapkeeper build {name} makes it"]
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        manifest = None
    if not isinstance(manifest, dict):
        return [f"{name}: its manifest is damaged; gapkeeper build {name} makes it anew"]
    return changes(name, manifest)


def main(folder: Path = BUILD) -> None:
    """Judge the boards that are named on the command line, built in ``folder``."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("boards", nargs="+", choices=BOARDS, metavar="BOARD")
    said = []
    for name in parser.parse_args().boards:
        said += _judged(name, folder / name / MANIFEST)
    for sentence in said:
        print(sentence, file=sys.stderr)
    sys.exit(bool(said))


if __name__ == "__main__":
    main()
