# SPDX-License-Identifier: Apache-2.0
"""Cells and clock of every board's layout are budgets.

``python -m testbench.budget.boards BOARD...`` reads what ``gapkeeper build`` has left and lays
nothing out. A figure that is more than ``CHANGE`` away from its budget, to either side, is told
with both figures, and the exit status is 1. A smaller or faster layout gets a new budget too, so
that the gain is not lost unseen. So does a board that has no budget yet: its figures are told.
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
    ff, bram, dsp : int
        Flip-flops, block RAMs of 18 Kbit, multipliers of 18 bits.
    mhz : float
        What the controller's clock reaches.
    """

    luts: int
    ff: int
    bram: int
    dsp: int
    mhz: float


BUDGETS: dict[str, BoardBudget] = {
    "ulx3s": BoardBudget(luts=25_717, ff=13_017, bram=151, dsp=4, mhz=47.9),
    "ulx3s_45f": BoardBudget(luts=25_765, ff=13_018, bram=107, dsp=4, mhz=51.8),
    "colorlight_i9": BoardBudget(luts=25_748, ff=13_018, bram=107, dsp=4, mhz=51.6),
}


def changes(name: str, manifest: dict[str, Any]) -> list[str]:
    """What is further than ``CHANGE`` from the budget of a board, one sentence for each figure.

    ``manifest`` is that of ``softcore.build``.
    """
    budget = BUDGETS.get(name)
    found = BoardBudget(**{field: manifest["cells"][field] for field in
                           ("luts", "ff", "bram", "dsp")},
                        mhz=min(clock["reached"] for clock in manifest["clocks_mhz"].values()))
    if budget is None:
        return [f"{name}: no budget yet, measured is {found}"]
    said = []
    for field in fields(BoardBudget):
        now, then = getattr(found, field.name), getattr(budget, field.name)
        if abs(now - then) > CHANGE * then:
            said.append(f"{name}: {field.name} {now:g}, budget {then:g} ({now / then - 1:+.1%})")
    return said


def main(folder: Path = BUILD) -> None:
    """Judge the boards that are named on the command line, built in ``folder``."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("boards", nargs="+", choices=BOARDS, metavar="BOARD")
    said = []
    for name in parser.parse_args().boards:
        manifest = folder / name / MANIFEST
        said += (changes(name, json.loads(manifest.read_text(encoding="utf-8")))
                 if manifest.exists() else
                 [f"{name}: there is no layout to judge; gapkeeper build {name} makes it"])
    for sentence in said:
        print(sentence, file=sys.stderr)
    sys.exit(bool(said))


if __name__ == "__main__":
    main()
