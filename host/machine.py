# SPDX-License-Identifier: Apache-2.0
"""Machines to run a tape on: built-in ones by name, others from a TOML file."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from host.errors import UsageError

ROOT = Path(__file__).parents[1]
BUILT_IN = ROOT / "testbench" / "plant"

Tables = dict[str, Any]     # of a machine's file, as TOML has them

# Below, the firmware cannot keep up with its watchdog; above is no device.
LOWEST_CLOCK_HZ, HIGHEST_CLOCK_HZ = 2_000_000, 100_000_000

NUMBER = re.compile("[0-9]{1,10}")  # of a setting; the controller has 32 bits

# Words of a file; each kind of machine has the numbers of its example. A file that does not say its
# kind is a sinker's.
WORDS = {"kind": ("sinker", "wire"), "stock.kind": ("solid", "wall", "circle", "rectangle")}
STEPS = 16  # of the stock's width, at most

# Lowest and highest of a number, both allowed: what the controller is built for, and what the
# formulas of the plant bear (they divide by most of these).
SHARE, ANY, DIVISOR, SHAPE = (0, 1), (0, 10**9), (0.001, 10**9), (0.1, 10)
BOUNDS = {
    "clock_hz": (LOWEST_CLOCK_HZ, HIGHEST_CLOCK_HZ), "pulses_per_mm": (10_000, 10_000),
    "initial_gap_um": (0, 100_000), "tick_us": (1, 100), "removal_scale": (0.001, 1_000_000),
    "axis.full_speed_mm_s": (1, 1000), "axis.max_speed_mm_s": (1, 200),
    "axis.max_acceleration_mm_s2": (1, 1_000_000), "axis.speed_loop_ms": DIVISOR,
    "axis.current_loop_ms": DIVISOR, "axis.filter_ms": DIVISOR, "axis.brake_mm_s2": (1, 1_000_000),
    "axis.step_gain_per_s": (1, 100_000),
    "gap.area_mm2": DIVISOR, "gap.arc_removal": SHARE, "gap.ignition_delay_us": DIVISOR,
    "gap.ignition_slope_um": DIVISOR, "gap.ignition_power": (0, 100),
    "gap.ignition_conductivity": (0, 10), "gap.ignition_law": SHARE,
    "gap.weibull_width_um": DIVISOR, "gap.weibull_narrow_shape": SHAPE,
    "gap.weibull_wide_shape": SHAPE, "gap.fluid_ohm_cm": (1, 10**12),
    "fluid.drift_end_ohm_cm": (1, 10**12), "fluid.cell_per_cm": DIVISOR,
    "fluid.cell_parallel_ohm": DIVISOR, "fluid.cell_series_ohm": DIVISOR,
    "source.open_v": (1, 1000), "source.supply_step_v": (1, 1000), "source.negative_removal": SHARE,
    "source.rise_us": DIVISOR, "source.fall_us": DIVISOR, "source.sensing_v": (1, 60),
    "source.sensing_a": DIVISOR, "source.burning_spread_v": (0, 10), "source.arc_spread_v": (0, 10),
    "comparator.fixed": SHARE, "comparator.reference_full_v": (1, 1000),
    "comparator.reference_rc_us": DIVISOR, "comparator.noise_miss": SHARE,
    "debris.time_s": DIVISOR, "debris.depth_mm": DIVISOR, "debris.exchange_depth_mm": DIVISOR,
    "debris.deionisation_us": DIVISOR, "debris.bridge_gap_um": DIVISOR,
    "debris.stretch_depth_mm": DIVISOR,
    "wire.diameter_mm": (0.02, 1), "wire.crater_us": (0.1, 1000), "wire.deflection_um_a": (0, 100),
    "wire.deflection_ms": (0.01, 10_000), "wire.break_ms": (0.1, 10_000),
    "workpiece.thickness_mm": (0.1, 1000), "workpiece.cell_um": (0.5, 10),
    "workpiece.start_x_mm": (-1000, 1000), "workpiece.start_y_mm": (-1000, 1000),
    "stock.edge_mm": (-1000, 1000), "stock.hole_mm": (0, 1000), "stock.size_x_mm": (0, 1000),
    "stock.size_y_mm": (0, 1000),
    "gap.delay_square_us": DIVISOR, "gap.delay_linear_us": (-1000, 1000),
    "gap.delay_constant_us": DIVISOR, "gap.delay_least_um": (0, 100), "gap.reach_um": (10, 200),
    "gap.engagement_um": (0, 50), "debris.flow_gap_um": DIVISOR, "debris.flow_spread": (0, 3),
    "debris.flow_time_s": DIVISOR, "debris.random_short_per_us": SHARE,
    "debris.random_short_um": DIVISOR, "debris.clog_least": (0.01, 1), "debris.clog_most": SHARE,
    "side.fin_answers": SHARE, "side.contactor_ms": (0, 1000),
    "side.limit_low_mm": (-10_000, -0.1),
    "side.limit_high_mm": (0.1, 10_000),
}


def _check(name: str, tables: Tables, prefix: str = "") -> None:
    """Refuse what is not a number a machine can have."""
    for key, value in tables.items():
        if isinstance(value, dict):
            _check(name, value, f"{prefix}{key}.")
        elif prefix + key in WORDS:
            if value not in WORDS[prefix + key]:
                raise UsageError(f"machine {name}: {prefix}{key} must be one of "
                                 f"{', '.join(WORDS[prefix + key])}, not {value!r}.")
        elif prefix + key == "stock.steps":
            _check_steps(name, value)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise UsageError(f"machine {name}: {prefix}{key} is no number.")
        elif prefix == "settings.":
            if not (NUMBER.fullmatch(key) and NUMBER.fullmatch(str(value))):
                raise UsageError(f"machine {name}: {prefix}{key} = {value} is no setting; one "
                                 "reads number = value, both whole, not negative, and of at most "
                                 "10 digits.")
        else:
            lowest, highest = BOUNDS.get(prefix + key, ANY)
            if not lowest <= value <= highest:  # nor is what is not a number
                wanted = lowest if lowest == highest else f"{lowest} to {highest}"
                raise UsageError(f"machine {name}: {prefix}{key} must be {wanted}, not {value}.")


def _check_steps(name: str, steps: Any) -> None:
    """Refuse what is no list of steps of the stock: places that grow, with widths."""
    def number(value: object) -> bool:
        return isinstance(value, int | float) and not isinstance(value, bool)

    sound = isinstance(steps, list) and 1 <= len(steps) <= STEPS and all(
        isinstance(step, list) and len(step) == 2 and all(map(number, step))
        and abs(step[0]) <= 10_000 and 0 <= step[1] <= 10_000 for step in steps)
    if not sound or any(after[0] <= before[0] for before, after in pairwise(steps)):
        raise UsageError(f"machine {name}: stock.steps must be 1 to {STEPS} pairs of a place in mm "
                         "and a width of 0 to 10000 um, the places growing.")


def _keys(tables: Tables, prefix: str = "") -> Iterator[str]:
    """Names of all numbers but the settings, which are the controller's."""
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _keys(value, f"{prefix}{key}.")
        elif prefix + key == "kind":
            continue
        elif prefix != "settings.":
            yield prefix + key


def _complete(name: str, tables: Tables) -> None:
    """Refuse a file that lacks a number, or has one of a name that no machine has."""
    kind = tables.get("kind", "sinker")
    known = list(_keys(_tables(BUILT_IN / f"{kind}.toml")))
    given = set(_keys(tables))
    missing = next((key for key in known if key not in given), None)
    if missing:
        raise UsageError(f"machine {name}: {missing} is missing; a machine's file gives every "
                         f"number, as that of the machine {kind} does.")
    strange = sorted(given - set(known))
    if strange:
        raise UsageError(f"machine {name}: {strange[0]} is no number of a machine.")


def _tables(path: Path) -> Tables:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} is no machine description: {error}.") from error


@dataclass(frozen=True)
class Machine:
    """A machine: its name and the tables of its file, units in the keys' names."""

    name: str
    tables: Tables

    def number(self, *names: str) -> float:
        """One number of the file, by table and key."""
        value: Any = self.tables
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
    def kind(self) -> str:
        """What moves: the electrode of a sinker, or a wire."""
        return str(self.tables.get("kind", "sinker"))

    @property
    def start_mm(self) -> dict[str, float]:
        """Where electrode or wire stands when the program starts, from the workpiece's zero.

        A sinker's is at the electrode's place on the top of the workpiece; a wire has no height.
        """
        if self.kind == "wire":
            return {"x": self.number("workpiece", "start_x_mm"),
                    "y": self.number("workpiece", "start_y_mm"), "z": 0.0}
        return {"x": 0.0, "y": 0.0, "z": self.number("initial_gap_um") / 1000}

    @property
    def initial_gap_mm(self) -> float:
        """Height of the electrode over the top of the workpiece when the program starts."""
        return self.start_mm["z"]

    @property
    def settings(self) -> dict[str, int]:
        """The controller's settings, as ``$number=value``."""
        return dict(self.tables.get("settings", {}))


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
