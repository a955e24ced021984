# SPDX-License-Identifier: Apache-2.0
"""Machines to run a tape on: built-in ones by name, others from a TOML file."""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from host.errors import UsageError

ROOT = Path(__file__).parents[1]
BUILT_IN = ROOT / "testbench" / "plant"


# Below, the firmware cannot keep up with its watchdog; above is no device.
LOWEST_CLOCK_HZ, HIGHEST_CLOCK_HZ = 2_000_000, 100_000_000
POSITIVE = "clock_hz", "pulses_per_mm", "removal_scale", "tick_us"


def _check(name, tables, prefix=""):
    """Refuse what is not a number a machine can have."""
    for key, value in tables.items():
        if isinstance(value, dict):
            _check(name, value, f"{prefix}{key}.")
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise UsageError(f"machine {name}: {prefix}{key} is no number.")
        elif not math.isfinite(value):
            raise UsageError(f"machine {name}: {prefix}{key} must be finite, not {value}.")
        elif prefix == "settings." and not (key.isdecimal() and isinstance(value, int)
                                            and value >= 0):
            raise UsageError(f"machine {name}: {prefix}{key} = {value} is no setting; one reads "
                             "number = value, both whole and not negative.")
    if not prefix:
        for key in POSITIVE:
            if key in tables and not tables[key] > 0:
                raise UsageError(f"machine {name}: {key} must be above 0, not {tables[key]}.")
        clock_hz = tables.get("clock_hz", LOWEST_CLOCK_HZ)
        if not LOWEST_CLOCK_HZ <= clock_hz <= HIGHEST_CLOCK_HZ:
            raise UsageError(f"machine {name}: clock_hz must be {LOWEST_CLOCK_HZ} to "
                             f"{HIGHEST_CLOCK_HZ}, not {clock_hz}.")


def _keys(tables, prefix=""):
    """Names of all numbers but the settings, which are the controller's."""
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _keys(value, f"{prefix}{key}.")
        elif prefix != "settings.":
            yield prefix + key


def _complete(name, tables):
    """Refuse a file that lacks a number, or has one of a name that no machine has."""
    known = list(_keys(_tables(BUILT_IN / "sinker.toml")))
    given = set(_keys(tables))
    missing = next((key for key in known if key not in given), None)
    if missing:
        raise UsageError(f"machine {name}: {missing} is missing; a machine's file gives every "
                         "number, as that of the sinker does.")
    strange = sorted(given - set(known))
    if strange:
        raise UsageError(f"machine {name}: {strange[0]} is no number of a machine.")


def _tables(path):
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} is no machine description: {error}.") from error


@dataclass(frozen=True)
class Machine:
    """A machine: its name and the tables of its file, units in the keys' names."""

    name: str
    tables: dict

    def number(self, *names: str) -> float:
        """One number of the file, by table and key."""
        value = self.tables
        for name in names:
            value = value.get(name) if isinstance(value, dict) else None
        if not isinstance(value, int | float):
            raise UsageError(f"machine {self.name}: {'.'.join(names)} is missing or no number.")
        return value

    @property
    def clock_hz(self) -> int:
        return int(self.number("clock_hz"))

    @property
    def pulses_per_mm(self) -> int:
        return int(self.number("pulses_per_mm"))

    @property
    def removal_scale(self) -> float:
        return self.number("removal_scale")

    @property
    def initial_gap_mm(self) -> float:
        """Height of the electrode over the top of the workpiece when the program starts."""
        return self.number("initial_gap_um") / 1000

    @property
    def settings(self) -> dict[str, int]:
        """The controller's settings, as ``$number=value``."""
        return self.tables.get("settings", {})


def built_in() -> list[str]:
    """Names of the machines that come with the project."""
    return sorted(path.stem for path in BUILT_IN.glob("*.toml"))


def load(name: str) -> Machine:
    """Machine by name or by the path of its TOML file.

    Raises
    ------
    UsageError
        If there is none, or its file cannot be read, is not complete, or has numbers that no
        machine can have.
    """
    path = Path(name) if name.lower().endswith(".toml") else BUILT_IN / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(built_in()) or "none"
        raise UsageError(f'there is no machine "{name}": give a TOML file, or one of: {known}.')
    tables = _tables(path)
    _check(path.stem, tables)
    _complete(path.stem, tables)
    return Machine(path.stem, tables)
