# SPDX-License-Identifier: Apache-2.0
"""Synthetic basic data for the roughing planner.

``python -m host.roughing.synthetic`` writes the files.

No machine was measured. The least undersize of a current IP at a depth d (mm) on an area A (mm²) is

    U = 30 + 9 IP + (0.6 + 0.28 IP) d^0.85 (1 + 0.1 log2(A / 50))   µm

which has the properties of basic data: it rises with the current, with the depth (secondary
discharges widen a deep cavity) and with the area. The tables of CN 1112469 A are drawings that are
not in its text; nothing is taken from them. The stock left, and its correction for a coarser
finish, are invented too. Every area has all currents, even those too great for a small electrode.
"""

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

from host.roughing.basic import FOLDER, file_name

__all__ = ["AREAS_MM2", "CURRENTS", "DEPTHS_MM", "ELECTRODE", "WORKPIECE", "files", "undersize_um"]

ELECTRODE, WORKPIECE = "copper", "steel"
AREAS_MM2 = (20, 50, 100, 200, 400)
CURRENTS = tuple(range(1, 16))
DEPTHS_MM = (0, 0.5, 1, 2, 3, 5, 7.5, 10, 15, 20, 30, 40)
FINISH = {1: 0.0, 2: -1.5, 3: -2.5, 5: -4.0, 10: -7.0}  # um Rmax: side stock against that at 1


def undersize_um(area_mm2: float, ip: float, depth_mm: float) -> float:
    """Least undersize, um."""
    spread = 1 + 0.1 * math.log2(area_mm2 / 50)
    return float(30 + 9 * ip + (0.6 + 0.28 * ip) * depth_mm**0.85 * spread)


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{value:g}" for value in values) + "]"


def _text(area_mm2: float) -> str:
    lines = [
        "# SPDX-License-Identifier: Apache-2.0",
        "# SYNTHETIC: nobody has measured these. Made by `python -m host.roughing.synthetic`.",
        f'electrode = "{ELECTRODE}"',
        f'workpiece = "{WORKPIECE}"',
        f"area_mm2 = {area_mm2}",
        'source = "synthetic"',
        f"depth_mm = {_numbers(DEPTHS_MM)}",
        "",
        "[finish]",
        f"rmax_um = {_numbers(FINISH)}",
        f"side_um = {_numbers(FINISH.values())}",
    ]
    for ip in CURRENTS:
        lines += [
            "",
            "[[current]]",
            f"ip = {ip}",
            f"bottom_um = {12 + 3 * ip:g}",
            f"side_um = {10 + 2.5 * ip:g}",
            "undersize_um = " + _numbers(round(undersize_um(area_mm2, ip, depth), 1)
                                         for depth in DEPTHS_MM),
        ]
    return "\n".join(lines) + "\n"


def files() -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each file."""
    for area_mm2 in AREAS_MM2:
        yield file_name(ELECTRODE, WORKPIECE, area_mm2), _text(area_mm2)


def main(folder: Path = FOLDER) -> None:
    """Write the files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
