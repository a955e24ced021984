# SPDX-License-Identifier: Apache-2.0
"""What a Python program may give to the simulated machine: a refusal is one sentence.

A value of another type is a ``TypeError``, one out of its range a ``ValueError``.
"""

from numbers import Integral, Real
from pathlib import Path

import numpy as np

from host.errors import shown
from host.machines import machine as machines
from host.machines.machine_file import (
    DRIVES,
    MACHINES,
    MachineFile,
    allows,
    bounds,
    entries,
    said_range,
)

__all__ = ["LONGEST_S", "SEEDS", "change", "clock", "load", "name_of", "number", "whole"]

SEEDS = 2**64
LONGEST_S = 10**9   # of machine time: its clocks can be counted in 64 bits

# The gateware and the simulation are built for these.
BUILT = {"clock_hz", "pulses_per_mm", "current_max_a"}
# The machine starts with these.
BEGINNINGS = {"initial_gap_um", "workpiece", "stock", "cavity"}
# Numbers of an axis that become settings of the controller, and are nothing else.
SETTINGS = {f"{axis}.{name}" for axis in DRIVES
            for name in ("highest_mm_min", "low_mm", "high_mm", "pitch_from_mm", "pitch_step_mm")}

# Ranges of what can be forced; the others are masks and flags. NaN, and -1 of a short, leave it to
# the physics.
MASK = (0, 15)
FREE = {"force.gap_um": (-10**6, 10**6), "force.debris": (0, 10**9),
        "force.fluid_ohm_cm": (1, 10**12)}
RATE = "force.encoder_noise_hz"


def name_of(value: object, what: str = "a name") -> str:
    """A text."""
    if not isinstance(value, str):
        raise TypeError(f"{what} must be a text, not {shown(value)}")
    return value


def load(machine: object) -> machines.Machine:
    """Machine by name, or by the path of its file."""
    if isinstance(machine, Path):
        return machines.load(str(machine))
    return machines.load(name_of(machine, "machine"))


def number(what: str, value: object, lowest: float, highest: float) -> float:
    """A number within its range, both ends allowed."""
    if not lowest <= _real(what, value) <= highest:
        raise ValueError(f"{what} must be {lowest} to {highest}, not {_plain(value)}")
    return float(_real(what, value))


def whole(what: str, value: object, lowest: int, highest: int) -> int:
    """A whole number within its range, both ends allowed."""
    real = _real(what, value)
    if not lowest <= real <= highest or int(real) != real:
        raise ValueError(f"{what} must be a whole number from {lowest} to {highest}, not "
                         f"{_plain(value)}")
    return int(real)


def clock(value: object) -> int:
    """A clock of the controller, in Hz: the range is that of a machine's file."""
    lowest, highest = bounds(MachineFile.model_fields["clock_hz"])
    return whole("clock_hz", value, int(lowest), int(highest))


def change(kind: str, name: object, value: object, *, running: bool) -> tuple[str, float]:
    """A number of a machine, or what is forced, and the value that it gets.

    ``running`` says whether a clock has passed since it was switched on.
    """
    name = name_of(name)
    if isinstance(value, bool | np.bool_):
        value = int(value)
    if name.startswith("force."):
        return name, _forced(name, value)
    if name.startswith("read."):
        raise ValueError(f"{shown(name)} is a reading, and cannot be set")
    if name in SETTINGS or name.startswith("settings."):
        raise ValueError(f"{shown(name)} is a setting of the controller: send it as a line, $ and "
                         "its number = value")
    field = dict(entries(MACHINES[kind])).get(name)
    if field is None:
        raise ValueError(f"a machine of the kind {kind} has no number {shown(name)}")
    if field.annotation is not float:
        raise ValueError(f"{shown(name)} is a word or a list, and cannot be changed: give another "
                         "machine's file")
    if name in BUILT:
        raise ValueError(f"{shown(name)} cannot be changed: the simulation is built for it; give "
                         "another machine's file")
    if running and name.partition(".")[0] in BEGINNINGS:
        raise ValueError(f"{shown(name)} cannot be changed any more: the machine starts with it, "
                         "and its clock runs")
    real = _real(name, value)
    if not allows(field, real):
        raise ValueError(f"{name} must be {said_range(field)}, not {_plain(value)}")
    return name, float(real)


def _forced(name: str, value: object) -> float:
    if name in FREE:
        lowest, highest = FREE[name]
        real = _real(name, value)
        if real != real or lowest <= real <= highest:
            return float(real)
        raise ValueError(f"{name} must be {lowest} to {highest}, or NaN (not forced), not "
                         f"{_plain(value)}")
    if name == RATE:
        return number(name, value, 1, 10**9)
    return float(whole(name, value, *((-1, 1) if name == "force.short" else MASK)))


def _real(what: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{what} must be a number, not {shown(value)}")
    return int(value) if isinstance(value, Integral) else float(value)


def _plain(value: object) -> str:
    """A number as a sentence shows it, without its type."""
    return shown(_real("", value))
