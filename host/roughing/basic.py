# SPDX-License-Identifier: Apache-2.0
"""Basic data of the roughing planner: undersize and stock of each current, for a few areas.

There is one TOML file for an electrode material, a workpiece material and an area. The format, and
how to enter your own data, is in ``tapes/basic/README.md``.

Ref: CN 1112469 A, basic data memory 23, Figures 3 and 4 (whose numbers are not in its text).
"""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn

from host.errors import UserError
from host.places import ROOT
from host.words import exact

__all__ = ["FOLDER", "BasicData", "file_name", "read_all", "read_file"]

FOLDER = ROOT / "tapes" / "basic"
FILES = "*_*_*mm2.toml"
TABLE = "current"
KEYS = {"": {"electrode", "workpiece", "area_mm2", "source", "depth_mm", "finish", TABLE},
        "finish": {"rmax_um", "side_um"},
        TABLE: {"ip", "bottom_um", "side_um", "undersize_um"}}
TITLES = {"finish": "[finish]", TABLE: f"[[{TABLE}]]"}
# What the memory of the soft core holds: for an area, and for a pair of materials.
MOST_CURRENTS, MOST_DEPTHS, MOST_FINISHES = 16, 12, 6
MOST_DIFFERENCE_UM = 3000   # of a finish's stock on the side
# Largest value and digits behind the point; the soft core keeps whole numbers of the last digit.
BOUNDS = {"area_mm2": (100_000, 2), "depth_mm": (1000, 3), "ip": (63, 2), "bottom_um": (6000, 1),
          "side_um": (6000, 1), "undersize_um": (6000, 1), "rmax_um": (100, 1)}


@dataclass(frozen=True)
class BasicData:
    """Basic data of one area, and the path of their file as it was given.

    ``undersize_um[row][column]`` is the least undersize of ``ip[row]`` at ``depth_mm[column]``.
    ``finish_um`` has pairs of a roughness (um Rmax) and by how much the side stock differs from
    that for 1 um.
    """

    name: str
    electrode: str
    workpiece: str
    area_mm2: float
    source: str
    depth_mm: tuple[float, ...]
    ip: tuple[float, ...]
    bottom_um: tuple[float, ...]
    side_um: tuple[float, ...]
    undersize_um: tuple[tuple[float, ...], ...]
    finish_um: tuple[tuple[float, float], ...]

    def column(self, depth: int) -> tuple[float, ...]:
        """Least undersize of each current at one depth."""
        return tuple(row[depth] for row in self.undersize_um)


def file_name(electrode: str, workpiece: str, area_mm2: float) -> str:
    """Name that a file of basic data must have."""
    return f"{electrode}_{workpiece}_{area_mm2:.8g}mm2.toml"


def _materials(path: Path) -> str:
    """What the name of a file has before its area."""
    return path.name.rsplit("_", 1)[0]


def _pair(path: Path) -> tuple[str, ...]:
    """Electrode and workpiece of a file: its name alone is ambiguous (copper_tungsten_steel)."""
    named = _materials(path)
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        values = {}
    pair = str(values.get("electrode")), str(values.get("workpiece"))
    return pair if "_".join(pair) == named else tuple(named.split("_", 1))


class _Reader:
    """Takes values out of a file; a refusal names value and line."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            why = getattr(error, "strerror", None) or "it is no text"
            raise UserError(f"{path} cannot be read: {why}.") from error
        self.lines = text.splitlines()
        try:
            self.values = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise UserError(f"{path} is no TOML: {error}.") from error

    def refuse(self, why: str, key: str = "", table: str = "", row: int = 0) -> NoReturn:
        """Raise, with the line of a key: of the file, of a table, or of its row from 0."""
        raise UserError(f"{self.path}, line {self._line(key, table, row)}: {why}.")

    def _line(self, key: str, table: str, row: int) -> int:
        at, here, seen = 0, "", -1
        for number, line in enumerate(self.lines, 1):
            header = re.match(r"\s*\[+\s*([A-Za-z0-9_-]+)\s*\]+", line)
            if header:
                here = header[1]
                seen += here == table
            if here == table and (not table or table != TABLE or seen == row):
                at = at or number
                if key and re.match(rf"\s*(\[.*\.\s*)?[\"']?{re.escape(key)}[\"']?\s*[]=]", line):
                    return number
        # A table within a line, or key by key.
        return at or next((number for number, line in enumerate(self.lines, 1)
                           if table and re.match(rf"\s*{table}\b", line)), 1)

    def known(self, values: dict[str, Any], table: str = "", **place: Any) -> None:
        """Refuse a key that a table does not have."""
        for name in sorted(set(values) - KEYS[table]):
            of_table = not table and isinstance(values[name], dict | list)
            key = name or '""'
            self.refuse(f"{key} is not known" + (f" in {TITLES[table]}" if table else ""), key,
                        table=name if of_table else table, **place)

    def number(self, name: str, value: object, key: str, most: int | None = None,
               **place: Any) -> float:
        """Check one number against its bounds, or a signed one against ``most``."""
        greatest, digits = BOUNDS[name]
        limit = greatest if most is None else most
        least = 0 if most is None else -most
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse(f"{name} must be a number, not {value!r}", key, **place)
        if not least <= value <= limit:
            told = exact(value) if abs(value) < 1e300 else "a number of more than 300 digits"
            self.refuse(f"{name} must be {least} to {limit}, not {told}", key, **place)
        if round(value, digits) != value:
            self.refuse(f"{name} has at most {digits} digits behind the point, unlike {value!r}",
                        key, **place)
        return float(value)

    def numbers(self, name: str, table: str, values: dict[str, Any], **place: Any) -> list[Any]:
        """Take a list of numbers."""
        found = values.get(name)
        if not isinstance(found, list) or not found:
            self.refuse(f"{name} must be a list of numbers" if name in values
                        else f"{name} is missing", name, table=table, **place)
        return found

    def ordered(self, name: str, values: Sequence[float], key: str, must: str = "rise",
                what: str = "", **place: Any) -> None:
        """Check that numbers rise, do not fall or do not rise."""
        for one, two in pairwise(values):
            if {"rise": two <= one, "not fall": two < one, "not rise": two > one}[must]:
                self.refuse(f"{name} must {must}{what}, but {exact(two)} follows {exact(one)}",
                            key, **place)


def _head(read: _Reader) -> tuple[float, list[float]]:
    for key in ("electrode", "workpiece", "source"):
        if not isinstance(read.values.get(key), str) or not read.values[key]:
            read.refuse(f"{key} is missing" if key not in read.values
                        else f"{key} must be a name", key)
    for key in ("area_mm2",):
        if key not in read.values:
            read.refuse(f"{key} is missing")
    area = read.number("area_mm2", read.values["area_mm2"], "area_mm2")
    if not area:
        read.refuse("area_mm2 must not be 0", "area_mm2")
    depths = [read.number("depth_mm", one, "depth_mm")
              for one in read.numbers("depth_mm", "", read.values)]
    read.ordered("depth_mm", depths, "depth_mm")
    if len(depths) > MOST_DEPTHS:
        read.refuse(f"more than {MOST_DEPTHS} depths", "depth_mm")
    name = file_name(read.values["electrode"], read.values["workpiece"], area)
    if read.path.name != name:
        read.refuse(f"a file with these materials and this area is called {name}", "electrode")
    return area, depths


def _rows(read: _Reader,
          depths: list[float]) -> tuple[dict[str, list[float]], list[tuple[float, ...]]]:
    rows = read.values.get(TABLE)
    if not isinstance(rows, list) or len(rows) < 2:
        read.refuse("at least two tables [[current]] are needed", table=TABLE)
    if len(rows) > MOST_CURRENTS:
        read.refuse(f"more than {MOST_CURRENTS} currents", table=TABLE, row=MOST_CURRENTS)
    found: dict[str, list[float]] = {"ip": [], "bottom_um": [], "side_um": []}
    undersizes: list[tuple[float, ...]] = []
    for index, row in enumerate(rows):
        place: dict[str, Any] = {"table": TABLE, "row": index}
        if not isinstance(row, dict):
            read.refuse(f"current must be tables [[{TABLE}]], not {row!r}", TABLE)
        read.known(row, TABLE, row=index)
        for key, values in found.items():
            if key not in row:
                read.refuse(f"{key} is missing", key, **place)
            values.append(read.number(key, row[key], key, **place))
            read.ordered(key, values[-2:], key, "rise" if key == "ip" else "not fall",
                         " from current to current", **place)
        if not found["ip"][-1]:
            read.refuse("ip must not be 0", "ip", **place)
        values = [read.number("undersize_um", one, "undersize_um", **place)
                  for one in read.numbers("undersize_um", TABLE, row, row=index)]
        if len(values) != len(depths):
            read.refuse(f"undersize_um has {len(values)} values for {len(depths)} depths",
                        "undersize_um", **place)
        read.ordered("undersize_um", values, "undersize_um", what=" with the depth", **place)
        for depth, value in enumerate(values):
            read.ordered("undersize_um", [row[depth] for row in undersizes[-1:]] + [value],
                         "undersize_um", what=f" with the current (at {exact(depths[depth])} mm)",
                         **place)
        undersizes.append(tuple(values))
    return found, undersizes


def _finish(read: _Reader) -> tuple[tuple[float, float], ...]:
    table = read.values.get("finish", {})
    if not isinstance(table, dict):
        read.refuse("finish must be a table", "finish")
    if not table:
        return ((1.0, 0.0),)
    read.known(table, "finish")
    rough = [read.number("rmax_um", one, "rmax_um", table="finish")
             for one in read.numbers("rmax_um", "finish", table)]
    side = read.numbers("side_um", "finish", table)
    for one in side:
        read.number("side_um", one, "side_um", most=MOST_DIFFERENCE_UM, table="finish")
    if len(rough) > MOST_FINISHES:
        read.refuse(f"more than {MOST_FINISHES} roughnesses", "rmax_um", table="finish")
    if len(side) != len(rough):
        read.refuse(f"side_um has {len(side)} values for {len(rough)} roughnesses", "side_um",
                    table="finish")
    read.ordered("rmax_um", rough, "rmax_um", table="finish")
    read.ordered("side_um", side, "side_um", "not rise", " with the roughness", table="finish")
    pairs = tuple(zip(rough, map(float, side), strict=True))
    if (1.0, 0.0) not in pairs:
        read.refuse("side_um must be 0 where rmax_um is 1: it is the difference from the stock for "
                    "1 um", "side_um", table="finish")
    return pairs


def read_file(path: Path) -> BasicData:
    """Read one file.

    Raises
    ------
    UserError
        If it cannot be read, is incomplete, or has numbers that do not rise where they must.
    """
    read = _Reader(path)
    read.known(read.values)
    area, depths = _head(read)
    found, undersizes = _rows(read, depths)
    return BasicData(
        name=str(path), electrode=read.values["electrode"], workpiece=read.values["workpiece"],
        area_mm2=area, source=read.values["source"], depth_mm=tuple(depths), ip=tuple(found["ip"]),
        bottom_um=tuple(found["bottom_um"]), side_um=tuple(found["side_um"]),
        undersize_um=tuple(undersizes), finish_um=_finish(read))


def read_all(electrode: str, workpiece: str, folder: Path = FOLDER) -> list[BasicData]:
    """Basic data of a pair of materials, by area.

    Raises
    ------
    UserError
        If there are no data, if one of the files is refused, or if depths or finishes differ.
    """
    pairs = {path: _pair(path) for path in folder.glob(FILES)}
    if (electrode, workpiece) not in pairs.values():
        have = ", ".join(sorted({" on ".join(pair) for pair in pairs.values()})) or "nothing"
        raise UserError(f"there are no basic data of {electrode} on {workpiece} in {folder}, "
                        f"only of {have}.")
    data = sorted((read_file(path) for path, pair in pairs.items()
                   if pair == (electrode, workpiece)), key=lambda one: one.area_mm2)
    for one in data[1:]:
        if one.depth_mm != data[0].depth_mm:
            raise UserError(f"{one.name} has other depths than {data[0].name}: the files of a pair "
                            "of materials need the same.")
        if one.finish_um != data[0].finish_um:
            raise UserError(f"{one.name} has another table of finishes than {data[0].name}: the "
                            "files of a pair of materials need the same.")
    return data
