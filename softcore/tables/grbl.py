# SPDX-License-Identifier: Apache-2.0
"""Settings of grbl 1.1 that its senders read: the only place where they are written down.

None of them is stored: each is a constant of this controller, or follows from our own settings.
``python -m softcore.generate`` makes the firmware's table (``base/grbl_table.c``) and a part of the
page ``docs/reference/settings.md`` of it. Plain data: imports nothing from Amaranth.

Ref: the list of settings in the documentation of grbl 1.1 (``doc/markdown/settings.md``).
"""

from dataclasses import dataclass
from typing import Literal

__all__ = ["GRBL_SETTINGS", "SOURCES", "GrblSetting", "Source"]

Source = Literal["constant", "on", "number", "resolution", "speed", "acceleration", "travel",
                 "feed", "length"]
# Source of the value. ``on`` is 1 if the setting that it follows from is not 0, ``number`` is that
# setting, ``feed`` and ``length`` are it in mm/min and in um. From ``resolution`` on they are sent
# with three decimals, as in grbl.
SOURCES: tuple[Source, ...] = ("constant", "on", "number", "resolution", "speed", "acceleration",
                               "travel", "feed", "length")


@dataclass(frozen=True, kw_only=True)
class GrblSetting:
    """A setting with grbl's number and meaning, which ``$$`` lists and nobody can set.

    ``value`` is that of a constant. ``axis`` counts from X, 0. ``follows`` has the names of our
    settings that it follows from, at most two; a refusal to set it names them.
    """

    number: int
    title: str
    unit: str
    source: Source
    meaning: str
    value: int = 0
    axis: int = 0
    follows: tuple[str, ...] = ()


def _constant(number: int, title: str, value: int, meaning: str) -> GrblSetting:
    return GrblSetting(number=number, title=title, unit="", source="constant", value=value,
                       meaning=meaning)


def _homing(number: int, title: str, unit: str, source: Source, follows: str,
            meaning: str) -> GrblSetting:
    return GrblSetting(number=number, title=title, unit=unit, source=source, meaning=meaning,
                       follows=(follows,))


GRBL_SETTINGS: tuple[GrblSetting, ...] = (
    _constant(10, "status report, mask", 3,
              "Sum of 1 (reports have `MPos`) and 2 (they have `Bf`). There is no other form of "
              "report."),
    _constant(13, "reports in inches", 0, "Reports are in mm, even under G20."),
    _constant(20, "soft limits", 1, "They are always in force: `${low_x_um}` to `${high_z_um}`."),
    _constant(21, "hard limits", 1, "The limit switches are always in force."),
    _homing(22, "homing", "", "on", "home_order", "`$H` homes the axes of `${home_order}`."),
    _homing(23, "homing, axes downwards, mask", "", "number", "home_down", "As `${home_down}`."),
    _homing(24, "homing, slow approach", "mm/min", "feed", "home_slow_mm_min",
            "As `${home_slow_mm_min}`."),
    _homing(25, "homing, fast approach", "mm/min", "feed", "home_fast_mm_min",
            "As `${home_fast_mm_min}`."),
    _constant(26, "homing, debounce of a switch, ms", 1,
              "A switch counts as released after 1 ms, and as pressed after two clocks."),
    _homing(27, "homing, pull-off", "mm", "length", "home_pull_off_um",
            "As `${home_pull_off_um}`."),
    _constant(32, "laser mode", 0, "There is none."),
    *(GrblSetting(number=100 + k, title=f"resolution of {axis}", unit="step/mm",
                  source="resolution", axis=k,
                  follows=(f"gear_steps_{axis.lower()}", f"gear_pulses_{axis.lower()}"),
                  meaning="Steps of an axis with step/direction output, edges of the coder of any "
                  "other: by its gear.")
      for k, axis in enumerate("XYZ")),
    *(GrblSetting(number=110 + k, title=f"highest speed of {axis}", unit="mm/min", source="speed",
                  axis=k, follows=("highest_speed_mm_min", f"highest_speed_{axis.lower()}"),
                  meaning="`${highest_speed_mm_min}`, which limits the speed along the path, but "
                  f"at most what the clock allows and `${{highest_speed_{axis.lower()}}}`.")
      for k, axis in enumerate("XYZ")),
    *(GrblSetting(number=120 + k, title=f"acceleration of {axis}", unit="mm/s2",
                  source="acceleration", axis=k, follows=("acceleration_mm_s2",),
                  meaning="`${acceleration_mm_s2}`, which is the acceleration along the path.")
      for k, axis in enumerate("XYZ")),
    *(GrblSetting(number=130 + k, title=f"travel of {axis}", unit="mm", source="travel", axis=k,
                  follows=(f"low_{axis.lower()}_um", f"high_{axis.lower()}_um"),
                  meaning=f"From `${{low_{axis.lower()}_um}}` below zero to "
                  f"`${{high_{axis.lower()}_um}}`; along the axis of the jumps not beyond "
                  "`${soft_limit_um}`.")
      for k, axis in enumerate("XYZ")),
)
