# SPDX-License-Identifier: Apache-2.0
"""The controller's settings that follow from the tables of a machine's axes."""

from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import pairwise
from typing import Any

from host.errors import UsageError
from host.machines.axis_tables import Drive
from softcore.tables.settings import (
    COARSEST_CODER,
    LARGEST_GEAR,
    LARGEST_PITCH_ERROR,
    NO_PITCH_ERROR,
    PULSES_PER_MM,
    STEEPEST_PITCH,
    named,
)

__all__ = ["of_drives"]


def _gear(machine: str, axis: str, drive: Drive) -> Fraction:
    """Steps, or edges of the coder, for each pulse of the path.

    Raises
    ------
    UsageError
        If the gateware has no such gear.
    """
    # As written: a pitch of 2.54 mm is 127/50, and no binary fraction nearby.
    steps, travel = Fraction(str(drive.steps_per_turn)), Fraction(str(drive.pitch_mm))
    gear = steps / (travel * PULSES_PER_MM)
    what = "steps" if drive.output == "step" else "edges"
    if gear > 1:
        raise UsageError(
            f"machine {machine}: {axis} has {float(steps / travel):g} {what} per mm "
            f"({axis}.steps_per_turn, {axis}.pitch_mm); the most are {PULSES_PER_MM}, one for each "
            "pulse of the path.")
    if drive.output != "step" and gear * COARSEST_CODER < 1:
        raise UsageError(
            f"machine {machine}: the coder of {axis} has {float(steps / travel):g} edges per mm "
            f"({axis}.steps_per_turn, {axis}.pitch_mm); the least are "
            f"{PULSES_PER_MM // COARSEST_CODER}.")
    if gear.denominator > LARGEST_GEAR:
        raise UsageError(
            f"machine {machine}: the gear of {axis}, {gear.numerator} {what} for "
            f"{gear.denominator} pulses ({axis}.steps_per_turn, {axis}.pitch_mm), needs more than "
            f"{LARGEST_GEAR} pulses; give a rounder number.")
    return gear


def _screw(machine: str, axis: str, drive: Drive) -> Iterator[tuple[str, int]]:
    """Names and values of the settings of an axis's pitch error.

    Raises
    ------
    UsageError
        If the table has a single point, is too steep or too wide, or lies where the axis never is.
    """
    errors = [round(error * PULSES_PER_MM / 1000) for error in drive.pitch_error_um]
    if not errors:
        return
    if len(errors) == 1:
        raise UsageError(f"machine {machine}: {axis}.pitch_error_um has one point; a table has two "
                         "or more.")
    step = round(drive.pitch_step_mm * PULSES_PER_MM)
    for point, (before, after) in enumerate(pairwise(errors), 2):
        if abs(after - before) * STEEPEST_PITCH > step:
            raise UsageError(
                f"machine {machine}: {axis}.pitch_error_um changes by {abs(after - before) / 10:g} "
                f"um up to point {point}; the most are {step / STEEPEST_PITCH / 10:g} um, a "
                f"hundredth of {axis}.pitch_step_mm.")
    if max(errors) - min(errors) > LARGEST_PITCH_ERROR:
        raise UsageError(
            f"machine {machine}: errors of {axis}.pitch_error_um lie "
            f"{(max(errors) - min(errors)) / 10:g} um apart; the most are "
            f"{LARGEST_PITCH_ERROR / 10:g} um.")
    end = drive.pitch_from_mm + (len(errors) - 1) * drive.pitch_step_mm
    if end <= drive.low_mm or drive.pitch_from_mm >= drive.high_mm:
        raise UsageError(
            f"machine {machine}: the points of {axis}.pitch_error_um, {drive.pitch_from_mm:g} to "
            f"{end:g} mm, lie beyond the travel, {axis}.low_mm to {axis}.high_mm.")
    yield f"pitch_points_{axis}", len(errors)
    yield f"pitch_first_{axis}", round(-drive.pitch_from_mm * PULSES_PER_MM)
    yield f"pitch_step_{axis}", step
    for point, error in enumerate(errors, 1):
        yield f"pitch_{axis}_{point}", NO_PITCH_ERROR + error


def of_drives(machine: str, tables: Mapping[str, Mapping[str, Any]]) -> dict[str, int]:
    """Settings by number, as ``$number=value``, of the tables of the axes, by their letter.

    Only what differs from a setting's default is given. Backlash and pitch errors are rounded to
    pulses of 0.1 um.

    Raises
    ------
    UsageError
        If an axis needs a gear or a table of its screw that there is not.
    """
    found: dict[str, int] = {}
    stepping = swapped = 0

    def give(name: str, value: int) -> None:
        setting = named(name)
        if value != setting.default:
            found[str(setting.number)] = value

    for index, (axis, table) in enumerate(tables.items()):
        drive = Drive(**table)
        swapped |= round(drive.reversed) << index
        if drive.output == "step":
            stepping |= 1 << index
        gear = _gear(machine, axis, drive)
        # In steps or edges per mm, where that is whole.
        scale = Fraction(PULSES_PER_MM, gear.denominator)
        whole = int(scale) if scale.denominator == 1 else 1
        give(f"gear_steps_{axis}", gear.numerator * whole)
        give(f"gear_pulses_{axis}", gear.denominator * whole)
        give(f"backlash_{axis}", round(drive.backlash_um * PULSES_PER_MM / 1000))
        for name, value in _screw(machine, axis, drive):
            give(name, value)
        give(f"highest_speed_{axis}", round(drive.highest_mm_min))
        give(f"low_{axis}_um", round(-1000 * drive.low_mm))
        give(f"high_{axis}_um", round(1000 * drive.high_mm))
    give("step_axes", stepping)
    give("reversed_drives", swapped)
    return found
