# SPDX-License-Identifier: Apache-2.0
"""Tables of a machine's axes in its file: the drive that all have, and where one differs."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from softcore.tables.settings import LARGEST_PITCH_ERROR, PITCH_POINTS

__all__ = ["DIVISOR", "LARGEST_PITCH_UM", "SHARE", "Apart", "Axis", "Drive", "Flag", "Table",
           "number"]

SHARE, DIVISOR = (0, 1), (0.001, 10**9)
LARGEST_PITCH_UM = LARGEST_PITCH_ERROR / 10     # a pulse is 0.1 um


def number(unit: str, bounds: tuple[float, float], meaning: str,
            default: float | None = None) -> Any:
    """A number of a machine, both of its bounds allowed. ``unit`` is ``""`` for a pure number.

    With a ``default`` it may be left out.
    """
    return Field(... if default is None else default, ge=bounds[0], le=bounds[1],
                 description=meaning,
                 json_schema_extra={"unit": unit})


@dataclass(frozen=True)
class Apart:
    """Of a number whose range begins at 0: nothing between 0 and ``least`` is allowed."""

    least: float

    def __get_pydantic_core_schema__(self, source: Any,
                                     handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._check, handler(source))

    def allows(self, value: float) -> bool:
        """Whether a value within the range is allowed."""
        return value <= 0 or value >= self.least

    def _check(self, value: float) -> float:
        if not self.allows(value):
            raise ValueError("it lies between 0 and the least")
        return value


Flag = Annotated[float, Apart(1)]       # of a ``SHARE``: 0 or 1
Count = Annotated[float, Apart(1e-4)]   # mm: 0, or at least a pulse
Pulse = Annotated[float, Apart(0.1)]    # um: the same
Whole = Annotated[float, Apart(1)]


class Table(BaseModel):
    """A table of numbers. All must be given, and no others; text and booleans are refused."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Axis(Table):
    """The drive of each axis."""

    dac: Literal["sigma_delta", "pwm"] = Field(
        description="Velocity command, as pulses on a pin: `sigma_delta`, whose ripple lies at "
        "high frequencies, or `pwm`, with a period of 1024 clocks, for amplifiers that want one. "
        "The gateware is built for it.")
    full_speed_mm_s: float = number("mm/s", (1, 1000),
        "Speed at full scale of the converter, which is reached at 32 768 pulses of following "
        "error Er.")
    max_speed_mm_s: float = number("mm/s", (1, 200), "Highest speed of the motor.")
    max_acceleration_mm_s2: float = number("mm/s²", (1, 1_000_000),
        "Highest acceleration, by the current limit of the amplifier.")
    speed_loop_ms: float = number("ms", DIVISOR, "Time constant of the speed loop.")
    current_loop_ms: float = number("ms", DIVISOR, "Time constant of the current loop.")
    filter_ms: float = number("ms", DIVISOR, "Time constant of the low pass behind the converter.")
    brake_mm_s2: float = number("mm/s²", (1, 1_000_000), "Deceleration with the drive disabled.")
    step_gain_per_s: float = number("1/s", (1, 100_000),
        "Gain of the position loop of a stepping drive, if the axis is driven by step pulses.")
    dead_time_ms: float = number("ms", (0, 20), "Dead time of the amplifier.", default=0.0)
    offset_mm_s: float = number("mm/s", (-10, 10),
        "Speed at which the drive moves with a command of zero.", default=0.0)
    friction_mm_s: float = number("mm/s", (0, 10),
        "Coulomb friction, as the speed by which the speed loop falls short of its command.",
        default=0.0)


PitchError = Annotated[float, Field(ge=-LARGEST_PITCH_UM, le=LARGEST_PITCH_UM)]


class Drive(Table):
    """One axis where it differs from the others: its output, gear, play, screw, speed and travel.

    From this table the controller's settings of the axis follow; `[settings]` wins over it, but for
    the table of the screw's error. A table, and each of its numbers, may be left out.
    """

    output: Literal["velocity", "step"] = Field(default="velocity",
        description="What drives the axis: `velocity`, a velocity command with a coder on the "
        "motor; or `step`, steps and direction, without a coder.")
    steps_per_turn: float = number("", (1, 1_000_000),
        "Steps of a turn of the screw: full steps of the motor, times microsteps of its amplifier, "
        "times the reduction. With a coder its edges of a turn, four for each line. At most 10 000 "
        "per mm, and at least 500 of a coder.", 10_000)
    pitch_mm: float = number("mm", (0.01, 1000), "Travel of a turn of the screw.", 1)
    reversed: Flag = number("", SHARE,
        "1: the drive turns the other way, so its direction is inverted.", 0)
    index_mm: Count = number("mm", (0, 1000),
        "Travel between two indices of the coder, each as wide as a count; 0: it has none.", 0)
    index_at_mm: float = number("mm", (-20_000, 20_000),
        "Place of an index, from where the axis started.", 0)
    backlash_um: Pulse = number("µm", (0, 819.1),
        "Play between drive and axis. The controller makes up for it.", 0)
    screw_um_m: float = number("µm/m", (-10_000, 10_000),
        "Error of the simulated screw: how much too far up it takes the axis for each metre up "
        "from where the axis started.", 0)
    screw_wave_um: float = number("µm", (0, 400),
        "Periodic error of that screw, its amplitude: a sine of the place, 0 at the start.", 0)
    screw_wave_mm: float = number("mm", (0.1, 10_000), "Wavelength of the periodic error.", 5)
    pitch_error_um: list[PitchError] = Field(default=[], max_length=PITCH_POINTS,
        description="Table by which the controller makes up for the screw's error, as it was "
        "measured: true place less commanded place at points a `pitch_step_mm` apart, from the "
        "lowest one up. It changes by at most a hundredth of `pitch_step_mm` from one to the next. "
        "Empty: no table.")
    pitch_from_mm: float = number("mm", (-20_000, 0),
        "Place of its first point, in the machine frame.", 0)
    pitch_step_mm: float = number("mm", (1, 100), "Distance of its points.", 20)
    highest_mm_min: Whole = number("mm/min", (0, 60_000),
        "Highest speed that the controller lets the axis have; 0: no own bound.", 0)
    low_mm: float = number("mm", (-20_000, 0), "Lower soft limit, in the machine frame.", -299)
    high_mm: float = number("mm", (0, 20_000), "Upper soft limit.", 299)
