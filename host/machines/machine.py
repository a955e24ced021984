# SPDX-License-Identifier: Apache-2.0
"""Machines to run a tape on: built-in ones by name, others from a TOML file."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from host.errors import UsageError, cut, shown
from host.machines.axis_tables import LARGEST_PITCH_UM
from host.machines.drives import of_drives
from host.machines.machine_file import DRIVES, MACHINES, STEPS, WORDS, entries, said_range
from softcore.tables.conditions import level_max
from softcore.tables.settings import COARSEST_CODER, PITCH_POINTS, named, of_number

BUILT_IN = Path(__file__).parent
CONVERTER_V = 100.0     # gap voltage at the converter's full scale

Tables = dict[str, Any]     # of a machine's file, as TOML has them


def _check(name: str, tables: Tables) -> None:
    """Refuse a file that does not describe a machine, with one sentence.

    Of several faults, impossible values come first, then missing ones, then unknown names.
    """
    kind = tables.get("kind", WORDS["kind"][0])
    if kind not in WORDS["kind"]:
        raise UsageError(f"machine {name}: {_no_word('kind', kind)}")
    try:
        MACHINES[kind].model_validate(tables)
    except ValidationError as error:
        said = [_complaint(tables, kind, problem) for problem in error.errors(include_url=False)]
        _, first = min(said, key=lambda one: one[0])
        raise UsageError(f"machine {name}: {first}") from error
    for number, value in tables.get("settings", {}).items():
        if wrong := _wrong_setting(int(number), value):
            raise UsageError(f"machine {name}: settings.{number} {wrong}.")


def _wrong_setting(number: int, value: int) -> str:
    """Complaint about a value of a controller's setting; empty if the value is allowed."""
    setting = of_number(number)
    if setting is None:
        return "is no setting of the controller; docs/reference/settings.md lists them"
    if setting.name.startswith("pitch_"):
        return (f"({setting.name}) belongs to the table of a screw's error; a machine's file gives "
                "it as pitch_error_um of the axis")
    if setting.name == "home_order" and value:
        digits = str(value)
        if set(digits) - set("123") or len(set(digits)) != len(digits):
            return (f"(home_order) must have digits 1 (X), 2 (Y) and 3 (Z), each at most once, not "
                    f"{value}")
    if setting.lowest <= value <= setting.highest:
        return ""
    return f"({setting.name}) must be {setting.lowest} to {setting.highest}, not {value}"


def _complaint(tables: Tables, kind: str, problem: ErrorDetails) -> tuple[int, str]:
    """Rank of one of the model's complaints (the lowest is shown), and its sentence."""
    path = [str(part) for part in problem["loc"] if part != "[key]"]
    key = ".".join(path)
    if problem["type"] == "missing":
        return 1, (f"{key} is missing; a machine's file gives every number, as that of the machine "
                   f'{kind} does, or has base = "{kind}".')
    if problem["type"] in ("extra_forbidden", "model_type", "dict_type"):
        return 2, f"{key} is no number of a machine."
    if key.startswith("stock.steps"):
        return 0, (f"stock.steps must be 1 to {STEPS} pairs of a place in mm and a width of 0 to "
                   "10000 um, the places growing.")
    if path[1:2] == ["pitch_error_um"]:
        return 0, (f"{path[0]}.pitch_error_um must be a list of 2 to {PITCH_POINTS} errors of "
                   f"-{LARGEST_PITCH_UM} to {LARGEST_PITCH_UM} um.")
    value: Any = tables
    for part in path:
        value = value[part]
    if path[0] == "settings" and path[1].isdecimal() and re.match("0.", path[1]):
        return 0, f"{key} begins with 0; the number of a setting has no zeros before it."
    if key in WORDS:
        return 0, _no_word(key, value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return 0, f"{key} is no number."
    if path[0] == "settings":
        return 0, (f"{key} = {shown(value)} is no setting; one reads number = value, both whole, "
                   "not negative, and of at most 10 digits.")
    wanted = said_range(dict(entries(MACHINES[kind]))[key])
    return 0, f"{key} must be {wanted}, not {shown(value)}."


def _no_word(key: str, value: object) -> str:
    return f"{key} must be one of {', '.join(WORDS[key])}, not {shown(value)}."


def _tables(path: Path) -> Tables:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except RecursionError as error:
        raise UsageError(f"{path} is no machine description: its tables or lists are nested too "
                         "deep.") from error
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} is no machine description: {error}.") from error
    except ValueError as error:     # the only other one: int() takes no more digits
        raise UsageError(f"{path} is no machine description: one of its numbers has too many "
                         "digits.") from error


def _upon_base(name: str, tables: Tables) -> Tables:
    """Tables of a file, with all that it does not give from the machine that is its ``base``."""
    if "base" not in tables:
        return tables
    base = tables.pop("base")
    if not isinstance(base, str) or base not in MACHINES:
        raise UsageError(
            f"machine {name}: base must be one of {', '.join(MACHINES)}, not {shown(base)}.")
    whole = _upon_base(base, _tables(BUILT_IN / f"{base}.toml"))
    for key, value in tables.items():
        known = whole.get(key)
        whole[key] = known | value if isinstance(known, dict) and isinstance(value, dict) else value
    return whole


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
        """``sinker``, ``cavity`` (an electrode moves, and its cavity has walls) or ``wire``."""
        return str(self.tables.get("kind", "sinker"))

    @property
    def level_max(self) -> int:
        """Highest level of the discharge's current, in steps of the supply, in the gateware."""
        return level_max(self.number("current_max_a"), self.number("source", "step_a"))

    @property
    def start_mm(self) -> dict[str, float]:
        """Place of the electrode or wire when the program starts, from the workpiece's zero.

        A sinker's zero is where the electrode touches the top of the workpiece; a wire has no
        height.
        """
        if self.kind == "wire":
            return {"x": self.number("workpiece", "start_x_mm"),
                    "y": self.number("workpiece", "start_y_mm"), "z": 0.0}
        return {"x": 0.0, "y": 0.0, "z": self.number("initial_gap_um") / 1000}

    @property
    def start_line(self) -> str:
        """Block that an operator enters at the start, to declare that place."""
        x, y, z = (f"{place:.4f}" if place else "0" for place in self.start_mm.values())
        return f"G92 X{x} Y{y} Z{z}"

    @property
    def initial_gap_mm(self) -> float:
        """Height of the electrode over the top of the workpiece when the program starts."""
        return self.start_mm["z"]

    @property
    def settings(self) -> dict[str, int]:
        """The controller's settings, as ``$number=value``.

        Those that follow from the tables of the axes come first; ``[settings]`` wins over them.
        """
        derived = of_drives(self.name, {axis: self.tables.get(axis, {}) for axis in DRIVES})
        return derived | dict(self.tables.get("settings", {}))


def built_in() -> list[str]:
    """Names of the machines that come with the project."""
    return sorted(path.stem for path in BUILT_IN.glob("*.toml"))


def _check_current(machine: Machine) -> None:
    """Refuse a supply that can give no current, and one that the controller counts wrongly."""
    step_a, most_a = machine.number("source", "step_a"), machine.number("current_max_a")
    if machine.level_max < 1:
        raise UsageError(f"machine {machine.name}: current_max_a, {most_a:g} A, is less than one "
                         f"step of the supply, source.step_a, {step_a:g} A.")
    setting = named("current_step_ma")
    counted = machine.settings.get(str(setting.number), setting.default)
    if machine.kind != "wire" and counted != round(1000 * step_a):
        raise UsageError(
            f"machine {machine.name}: source.step_a is {step_a:g} A, and the controller counts a "
            f"step as {counted} mA (settings.{setting.number}).")


def _check_gears(machine: Machine) -> None:
    """Refuse settings of a gear that the controller would not put into force."""
    values = machine.settings
    step_axes = values.get(str(named("step_axes").number), 0)
    for index, axis in enumerate(DRIVES):
        steps, pulses = (values.get(str(named(f"gear_{what}_{axis}").number),
                                    named(f"gear_{what}_{axis}").default)
                         for what in ("steps", "pulses"))
        if steps > pulses or (not step_axes >> index & 1 and steps * COARSEST_CODER < pulses):
            raise UsageError(
                f"machine {machine.name}: settings.{named(f'gear_steps_{axis}').number} and "
                f"settings.{named(f'gear_pulses_{axis}').number} give {axis} {steps} steps or "
                f"edges for {pulses} pulses; there are at most as many, and with a coder at least "
                f"one for {COARSEST_CODER}.")


def load(name: str) -> Machine:
    """Machine by name or by the path of its TOML file.

    A file with ``base = "sinker"`` or ``"wire"`` gives only what differs from that machine.

    Raises
    ------
    UsageError
        If there is no such machine, or its file cannot be read, is not complete, or has impossible
        numbers.
    """
    path = Path(name) if name.lower().endswith(".toml") else BUILT_IN / f"{name}.toml"
    try:
        there = path.is_file()
    except OSError as error:    # too long, or in a folder that may not be read
        raise UsageError(
            f'the machine "{cut(name)}" cannot be read: {error.strerror}.') from error
    if not there:
        known = ", ".join(built_in()) or "none"
        raise UsageError(f'there is no machine "{name}": give a TOML file, or one of: {known}.')
    tables = _upon_base(path.stem, _tables(path))
    _check(path.stem, tables)
    machine = Machine(path.stem, tables)
    _check_gears(machine)
    _check_current(machine)
    return machine
