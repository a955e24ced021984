# SPDX-License-Identifier: Apache-2.0
"""The controller's own settings: the only place where number, range and default are written down.

Their numbers begin at ``FIRST``. Lower numbers are grbl's, see ``softcore.tables.grbl``.

``python -m softcore.generate`` makes the firmware's table (``base/settings_table.c``) and the page
``docs/reference/settings.md`` of it; the host reads it. Plain data: imports nothing from Amaranth.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

__all__ = ["FIRST", "GROUPS", "SETTINGS", "Setting", "assign", "named", "of_number"]

FIRST = 400

LARGEST_ERROR = (1 << 17) - 1   # pulses: range of the gateware's error counter
LARGEST_GAIN = 400              # 1/s: what the gateware's model of the drive can express
# The model of a slower loop says later that a coder is lost: with 5 1/s the axis has gone 0.44 mm.
LEAST_GAIN = 10
FARTHEST = 20_000_000           # um: within UNITS_POSITION_LIMIT of the firmware
PULSES_PER_MM = 10_000          # of the path
LARGEST_GEAR = 1 << 16
COARSEST_CODER = 20             # pulses for an edge, at most
LARGEST_BACKLASH = (1 << 13) - 1    # pulses
# With a coder that is lost at rest nothing but this bounds the speed by a wrong offset: 1.3 mm/s.
NO_OFFSET = 256                 # steps of the DAC: what stands for none, as a setting has no sign
LARGEST_FRICTION = (1 << 7) - 1
# Of the table of a screw's pitch error.
PITCH_POINTS = 16
LARGEST_PITCH_ERROR = (1 << 12) - 1     # pulses
NO_PITCH_ERROR = 5000                   # what stands for none
STEEPEST_PITCH = 100                    # least pulses of way for a pulse of error
DAC_STEPS = "steps of the DAC"
TRAVEL = 299_000                # um: 1 mm before the limit switches of the built-in machines

# Groups of settings, with their headings on the page. When a setting changes, the firmware applies
# its group again; those of ``gap`` and ``program`` are read where they are needed.
GROUPS = {
    "detector": "Shorts, pulses and sensing",
    "motion": "Speeds and short bursts",
    "axes": "Axes and coders",
    "drives": "Drives: gear, direction and backlash",
    "travel": "Travel",
    "loop": "Position loop and arcs",
    "side": "Machine side",
    "gap": "Classes of pulses, servo, fluid and feed",
    "program": "Programs and power supply",
    "pitch": "Pitch of the screws",
}
Group = Literal["detector", "motion", "axes", "drives", "travel", "loop", "side", "gap", "program",
                "pitch"]


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A number that the host writes as ``$number=value``; whole and not negative.

    ``$ES`` sends ``title`` and ``unit``. ``meaning`` is for the page; ``{name}`` stands for the
    number of another setting and ``{alarm_name}`` for that of an alarm. Only an operator's switch
    can change at ``any_time``, the others not while a program runs. A setting that ``guards`` the
    machine cannot change while the machine moves or machines either. ``switches_off`` names the
    guard that the value 0 switches off, for the status report; ``""`` if there is none.
    """

    number: int
    name: str
    title: str
    unit: str
    default: int
    lowest: int
    highest: int
    group: Group
    meaning: str
    guards: bool = True
    switches_off: str = ""
    any_time: bool = False


def _set(number: int, name: str, title: str, unit: str, bounds: tuple[int, int, int], group: Group,
         meaning: str, *, guards: bool = True, switches_off: str = "",
         any_time: bool = False) -> Setting:
    """Setting with its default, lowest and highest value as ``bounds``."""
    default, lowest, highest = bounds
    return Setting(number=number, name=name, title=title, unit=unit, default=default,
                   lowest=lowest, highest=highest, group=group, meaning=meaning, guards=guards,
                   switches_off=switches_off, any_time=any_time)


def _travel(number: int, end: str, axis: str) -> Setting:
    below = " below zero" if end == "lower" else ""
    return _set(number, f"{'low' if end == 'lower' else 'high'}_{axis.lower()}_um",
                f"{end} end of {axis}{below}", "um", (TRAVEL, 0, FARTHEST), "travel",
                f"{end.capitalize()} soft limit of {axis}: its distance{below} in the machine "
                "frame.")


def _pitch(first: int) -> tuple[Setting, ...]:
    """Tables of the axes' pitch errors, the first of their numbers being ``first``."""
    return (
        *(_set(first + k, f"pitch_points_{axis.lower()}",
               f"screw of {axis}: points (0 no table)", "", (0, 0, PITCH_POINTS), "pitch",
               f"Points of the table by which the error of {axis}'s screw is made up for, with "
               "steps and with a coder on the motor. 0: there is none. A change of a table loses "
               "the position, and is in force when it is known again.")
          for k, axis in enumerate("XYZ")),
        *(_set(first + 3 + k, f"pitch_first_{axis.lower()}",
               f"screw of {axis}: first point below zero", "pulses",
               (0, 0, FARTHEST * PULSES_PER_MM // 1000), "pitch", "Place of the lowest point: its "
               "distance below zero in the machine frame, a pulse being 0.1 µm.")
          for k, axis in enumerate("XYZ")),
        *(_set(first + 6 + k, f"pitch_step_{axis.lower()}",
               f"screw of {axis}: from point to point", "pulses",
               (200_000, 10_000, 1_000_000), "pitch", "Distance from each point to the next.")
          for k, axis in enumerate("XYZ")),
        *(_set(first + 9 + PITCH_POINTS * k + point, f"pitch_{axis.lower()}_{point + 1}",
               f"screw: too far up ({NO_PITCH_ERROR} not), {axis}{point + 1}", "pulses",
               (NO_PITCH_ERROR, NO_PITCH_ERROR - LARGEST_PITCH_ERROR,
                NO_PITCH_ERROR + LARGEST_PITCH_ERROR), "pitch",
               f"True place less commanded place of {axis} at point {point + 1}. {NO_PITCH_ERROR} "
               f"is none, {NO_PITCH_ERROR + 12} is 1.2 µm too far up, {NO_PITCH_ERROR - 12} 1.2 µm "
               "too far down.")
          for k, axis in enumerate("XYZ") for point in range(PITCH_POINTS)))


SETTINGS: tuple[Setting, ...] = (
    _set(400, "short_needed", "short: shorted pulses needed", "pulses", (4, 1, 32), "detector",
         "The gap counts as shorted when this many of the last pulses (`${short_window}`) were "
         "shorted."),
    _set(401, "short_window", "short: of the last pulses", "pulses", (5, 1, 32), "detector",
         "Number of the last pulses for `${short_needed}`."),
    _set(402, "short_duration_us", "short: or shorted for so long (0 never)", "us", (0, 0, 300_000),
         "detector", "The gap also counts as shorted when no sample was clear for this time. 0: "
         "only `${short_needed}` counts."),
    _set(403, "clear_needed", "short: clear samples that end it", "samples", (3, 1, 255),
         "detector",
         "A short ends after this many clear samples in a row."),
    _set(404, "blanking_ns", "gap: pulse start to comparators read", "ns", (3000, 0, 1_000_000),
         "detector", "Time from the start of a pulse until the comparators at the gap are read."),
    _set(405, "sense_on_ns", "sensing pulse on-time", "ns", (10_000, 100, 1_000_000), "detector",
         "On-time of the sensing pulses: weak pulses that detect contact."),
    _set(406, "sense_off_ns", "sensing pulse off-time", "ns", (40_000, 100, 1_000_000), "detector",
         "Off-time of the sensing pulses."),
    _set(407, "gain_pulses", "depth that ends a short burst", "pulses", (10, 1, 65_535),
         "motion", "Shorts belong to one short burst until the machine is this much further than "
         "at the first of them. A pulse is 0.1 µm."),
    _set(408, "repeats", "returns of a short that halt (0 no bound)", "shorts", (20, 0, 255),
         "motion", "Alarm {alarm_halt_burst} comes when this many shorts have followed the first "
         "one of a short burst. 0: it never comes.",
         switches_off="repeats"),
    _set(409, "settle_us", "rest at the limit before the halt", "us", (500, 0, 300_000), "motion",
         "How long the axes rest at the retractable limit or the back limit, still short, before "
         "alarm {alarm_halt_limit} or {alarm_halt_back_limit}."),
    _set(410, "start_speed_um_s", "start/stop speed", "um/s", (10_000, 1, 1_000_000), "motion",
         "The machine reaches speeds up to this at once, without a ramp, and stops from them at "
         "once."),
    _set(411, "acceleration_mm_s2", "acceleration", "mm/s2", (1000, 1, 100_000), "motion",
         "Acceleration along the path above the start/stop speed."),
    _set(412, "highest_speed_mm_min", "highest speed and rapid feed", "mm/min", (1800, 1, 60_000),
         "motion", "Speed of G00, and the highest that a program may ask for."),
    _set(413, "follow_stopped", "lag at rest", "pulses",
         (LARGEST_ERROR, 1, LARGEST_ERROR), "axes",
         "At rest, an axis that is further than this from its command trips the interlock."),
    _set(414, "follow_moving", "lag in motion", "pulses",
         (LARGEST_ERROR, 1, LARGEST_ERROR), "axes",
         "In motion, an axis that is further than this from its command trips the interlock."),
    _set(415, "soft_limit_um", "upper end of the jump axis, machine frame", "um",
         (100_000, 0, FARTHEST), "travel", "Upper soft limit of the jump axis, along which a "
         "sinker jumps. The lower one of this and the axis's own upper end is in force."),
    _set(416, "step_axes", "axes with step/direction output, mask", "", (0, 0, 7), "axes",
         "Axes driven by step pulses: the sum of 1 for X, 2 for Y, 4 for Z. Such an axis has no "
         "coder, so the controller cannot know whether it has moved."),
    _set(417, "reversed_encoders", "axes whose encoder counts down, mask", "", (0, 0, 7), "axes",
         "Axes whose coder counts down when the axis moves up: the sum of 1 for X, 2 for Y, 4 for "
         "Z."),
    _set(418, "step_width_ns", "step pulse width", "ns", (1000, 1, 100_000), "axes",
         "How long a step pulse is high."),
    _set(419, "step_space_ns", "step pulse space", "ns", (1000, 1, 100_000), "axes",
         "Least time for which it is low before the next one."),
    _set(420, "step_setup_ns", "direction before step", "ns", (1000, 1, 100_000), "axes",
         "Time from a change of direction to the first step."),
    _set(421, "window", "lag up to which an axis is in position", "pulses",
         (15, 1, 4095), "axes", "An axis no further than this from its command is in position. A "
         "drive with an offset or friction comes to rest within it: 15 pulses at 50 1/s are "
         "0.075 mm/s. If it needs more, the supervision of its coder trips; it accepts up to 63 at "
         "rest, whatever this setting is. `${drive_offset_x}` to `${drive_friction_z}` make up for "
         "both."),
    _set(422, "tv", "tape: TV check", "", (0, 0, 1), "program",
         "1: a block with an odd number of characters is refused (alarm {alarm_tv}).",
         guards=False),
    _set(423, "block_skip", "blocks with / are skipped", "", (1, 0, 1), "program",
         "1: blocks that begin with `/` are skipped. 0: they are carried out. It holds "
         "from the next block on that is read.", guards=False, any_time=True),
    _set(424, "optional_stop", "M01 stops", "", (0, 0, 1), "program",
         "1: M01 stops as M00 does. 0: it does nothing.", guards=False, any_time=True),
    _set(425, "fin_ms", "longest wait for the machine side", "ms", (500, 1, 60_000), "side",
         "Alarm {alarm_fin} comes if the machine side has not answered an M, S or T in this time."),
    _set(426, "fluid_required", "low fluid trips while discharging", "", (1, 0, 1), "side",
         "1: fluid below its level stops the machine while it discharges. 0: it does not.",
         switches_off="fluid"),
    _set(427, "settle_ns", "gap: ignition to comparators read", "ns", (1000, 0, 100_000),
         "detector", "Time from the ignition of a discharge until the comparators are read."),
    _set(428, "confirm_ns", "gap: arc or short so long is cut off", "ns", (500, 0, 100_000),
         "detector", "A pulse is cut off when it has been an arc or a short for this time."),
    _set(429, "delay_least_ns", "gap: shortest ignition delay of a good pulse", "ns",
         (0, 0, 1_000_000), "gap",
         "A pulse that ignites sooner counts as an arc, if `${criteria}` includes the delay. It "
         "tells pulses apart only if it is longer than `${blanking_ns}`. A condition with T has "
         "its own."),
    _set(430, "criteria", "gap: 1 ignition by current, 2 delay tells arcs, 4 noise does", "",
         (0, 0, 7), "gap", "How pulses are judged, as a sum. 1: ignition is detected by the "
         "current and not by the voltage. 2: a pulse with a short ignition delay is an arc. 4: a "
         "pulse without high-frequency noise is an arc. 2 and 4 together: a pulse is an arc only "
         "if both hold. A condition with F has its own."),
    _set(431, "servo_period_us", "servo: time between steps", "us", (20_000, 1, 300_000), "gap",
         "Time between two steps of the servo, forward or back (G95 P1).", guards=False),
    _set(432, "servo_mode", "servo: 0 accumulate, 1 in a row, 2 total, 3 relative, 4 own gate, "
         "5 good alone", "",
         (0, 0, 5), "gap", "How the servo counts pulses. 0: it adds them up, and enough good "
         "pulses clear the counts. 1: it counts only pulses in a row. 2: it counts the pulses of a "
         "window of `${servo_window}`. 3: each good pulse subtracts `${servo_weight}`. 4: as 0, "
         "but a step of the servo clears only the counter that was full, and not both. 5: it "
         "counts good pulses alone; as many as the preset in the time between two steps widen the "
         "gap, fewer narrow it. A condition with J has its own.", guards=False),
    _set(433, "servo_window", "servo: pulses of a window (total)", "pulses", (50, 1, 255), "gap",
         "Pulses of a window in mode 2 of `${servo_mode}`. A condition with W has its own.",
         guards=False),
    _set(434, "servo_weight", "servo: weight of a good pulse (relative)", "", (1, 0, 15), "gap",
         "Number that a good pulse subtracts in mode 3 of `${servo_mode}`. A condition with S has "
         "its own.", guards=False),
    _set(435, "no_discharge_um", "servo: way without a discharge (0 no bound)", "um",
         (2000, 0, 1_000_000), "gap", "Alarm {alarm_no_discharge} comes when the servo has gone "
         "this far without a discharge. 0: it never comes.", switches_off="no discharge"),
    _set(436, "fluid_mode", "fluid: 0 class by hand, 1 as measured, 2 by hand and measured", "",
         (0, 0, 2), "gap", "The class of the fluid that is in force. 0: that of `${fluid_class}`. "
         "1: the measured one. 2: that of `${fluid_class}`; the measured class is only reported."),
    _set(437, "fluid_class", "fluid: class by hand, 0 highest resistance", "", (0, 0, 3), "gap",
         "Class of the fluid, entered by hand. 0 has the highest resistance."),
    *(_set(438 + k, f"fluid_threshold_{k}", f"fluid: code between the classes {k} and {k + 1}",
           "codes", (code, 0, 4095), "gap", f"Code of the converter between the classes {k} and "
           f"{k + 1} of the fluid. The three thresholds must descend.")
      for k, code in enumerate((3670, 2819, 707))),
    _set(441, "fluid_hysteresis", "fluid: hysteresis", "codes", (20, 0, 255), "gap",
         "How far the code must go beyond a threshold before the class changes."),
    _set(442, "fluid_lowest", "fluid: lowest code of a sound cell", "codes", (40, 0, 4095), "gap",
         "Below it the wire to the conductivity cell counts as shorted (alarm {alarm_fluid})."),
    _set(443, "fluid_highest", "fluid: highest code of a sound cell", "codes", (4030, 0, 4095),
         "gap", "Above it the wire to the conductivity cell counts as broken (alarm "
         "{alarm_fluid})."),
    _set(444, "no_progress_s", "servo: time at the front without progress (0 no bound)", "s",
         (600, 0, 86_400), "gap", "Alarm {alarm_no_progress} comes when the machine has machined "
         "under G95 at the front of the path for this time without moving forward. G94 does not "
         "wait for the gap, and has no such alarm. 0: it never comes.",
         switches_off="no progress"),
    _set(445, "feed_mode_window_us", "feed P2, P3: time of a mean voltage", "us",
         (20_000, 100, 10_000_000), "gap", "Time over which G95 P2 and P3 take the mean of the gap "
         "voltage.", guards=False),
    _set(446, "feed_mode_gain_zero", "feed P2: gain", "um/min per V", (500, 1, 1_000_000), "gap",
         "Gain of G95 P2: feed per volt of difference between mean voltage and reference.",
         guards=False),
    _set(447, "feed_mode_gain_feed", "feed P3: gain", "um/min per V", (100, 1, 1_000_000), "gap",
         "Gain of G95 P3: change of the feed F per volt of difference between mean voltage and "
         "reference.", guards=False),
    _set(448, "feed_mode_unit_um", "feed P4: unit distance", "um", (10, 1, 6000), "gap",
         "Distance over which G95 P4 takes a mean.", guards=False),
    _set(449, "feed_mode_longest_ms", "feed P4, P5: longest time of a unit distance", "ms",
         (1000, 1, 60_000), "gap", "If the unit distance takes longer than this time, "
         "G95 P4 and P5 measure over the time.", guards=False),
    _set(450, "feed_mode_least_mv", "feed P4: lowest Ex", "mV", (200, 1, 90_000), "gap",
         "A lower Ex counts as this value in G95 P4.", guards=False),
    _set(451, "feed_mode_ratio_lowest", "feed P4, P5: lowest Es/Ex", "1/1000",
         (250, 1, 15_999), "gap",
         "Lowest Es/Ex of G95 P4 and P5; a lower ratio counts as this.", guards=False),
    _set(452, "feed_mode_ratio_highest", "feed P4, P5: highest Es/Ex", "1/1000",
         (4000, 1, 15_999), "gap",
         "Highest Es/Ex of G95 P4 and P5; a higher ratio counts as this.", guards=False),
    _set(453, "feed_mode_no_load", "feed P4: no-load voltage 0 computed, 1 measured in the gap", "",
         (0, 0, 1), "gap", "Source of the no-load voltage of G95 P4. 0: calculated from the "
         "condition. 1: measured at the gap, whenever it is open for long enough.", guards=False),
    _set(454, "arc_difference_nm", "arc: largest difference of start and end radius", "nm",
         (3000, 0, 100_000), "program", "An arc whose radii at start and end differ by more is "
         "refused (alarm {alarm_arc}). With inches 2.54 times as much is allowed.",
         guards=False),
    _set(455, "current_step_ma", "power supply: one step of its current", "mA", (1500, 50, 15_000),
         "program", "Current of one step of the power supply. After a change, a program has to "
         "give its condition C again."),
    _set(456, "loop_gain", "velocity gain of the position loop", "1/s",
         (50, LEAST_GAIN, LARGEST_GAIN), "loop", "Gain of the drives' position loop. It limits "
         "speeds on arcs, and the supervision of the coders uses it."),
    _set(457, "arc_deviation_nm", "arc: how far the lag may lead inside (0 no bound)", "nm",
         (2000, 0, 1_000_000), "loop", "On an arc the lag of the axes moves the path inwards. The "
         "speed on arcs is limited so that it moves by no more than this in the loop that is in "
         "force (`${feed_forward}`), with drives that are up to a tenth slower than "
         "`${loop_gain}` says. 0: no such limit."),
    *(_travel(458 + k, "lower", axis) for k, axis in enumerate("XYZ")),
    *(_travel(461 + k, "upper", axis) for k, axis in enumerate("XYZ")),
    _set(464, "short_mean_mv", "short: by a mean voltage below this (0 by pulses)", "mV",
         (0, 0, 90_000), "detector", "The gap counts as shorted when the mean of its voltage, "
         "off-time included, is below this, as in the prior art of the fourth patent. 0: when so "
         "many pulses were shorted (`${short_needed}`). Either way `${clear_needed}` ends it. A "
         "preset must be well above 0 and well below the mean while machining."),
    _set(465, "short_mean_us", "short: time of that mean", "us", (5000, 50, 300_000), "detector",
         "Time over which the mean of `${short_mean_mv}` is taken, while pulses are on. If the "
         "converter takes few samples in it (one in 1.7 us on a board, 17 us in the simulation), "
         "the mean scatters, and a sound gap may count as shorted."),
    _set(466, "feed_mode_discharge_um", "feed P5: unit distance", "um", (20, 1, 6000), "gap",
         "Distance over which G95 P5 measures the discharge. The loop swings if it is much shorter "
         "than the contact of electrode and work along the path.", guards=False),
    _set(467, "short_current_ns", "short: by current within this time (0 by voltage)", "ns",
         (0, 0, 1_000_000), "detector", "Which pulses count as shorted, for a short and for "
         "contact. 0: those with a voltage below the short level. Else those in which current "
         "flows without an ignition delay, as in the detector of the first patent: within this "
         "time from the start, or within `${blanking_ns}` if that is longer. A discharge that "
         "ignites in it counts, too. For the sensing pulses the comparator of the current needs a "
         "level of its own, below what they carry."),
    _set(469, "feed_forward", "velocity feed-forward (0 plain loop)", "%", (100, 0, 100),
         "loop", "Share of the path's speed that goes to the drives at once, beside the position "
         "loop. 100: an axis lags only as far as its drive does by itself. 0: the plain loop of "
         "the first patent, in which an axis moves only as far as it lags. `gapkeeper tune` "
         "measures what the drives allow."),
    _set(470, "back_acceleration_mm_s2", "way back: acceleration (0 as forward)", "mm/s2",
         (0, 0, 100_000), "motion", "Acceleration along the path on the way back, above "
         "`${back_start_speed_um_s}`. 0: that of `${acceleration_mm_s2}`."),
    _set(471, "back_start_speed_um_s", "way back: start/stop speed (0 as forward)", "um/s",
         (0, 0, 1_000_000), "motion", "Start/stop speed on the way back. 0: that of "
         "`${start_speed_um_s}`."),
    _set(480, "ignition_lag_ns", "gap: delay of comparators and driver at an ignition", "ns",
         (0, 0, 100_000), "gap", "A condition with A1 counts its on-time from the ignition. The "
         "discharge burns longer by the delay from the gap to the comparator's pin and from the "
         "gate's pin to the gap; this time is subtracted. The delay of the controller's own pads, "
         "4 clocks, always is."),
    _set(490, "jog_silence_ms", "jog: longest silence of the host", "ms", (500, 50, 5000),
         "program", "A jog ends when for this time neither `?` nor a jog has come from the host, "
         "as when its cable is pulled."),
    _set(510, "follow_us", "wait for supply and comparators (0 as built)", "us", (0, 0, 300_000),
         "detector", "The first discharge pulse after a change of open voltage, polarity or a "
         "level of the comparators waits at least so long. The times of the board are never "
         "shortened."),
    *(_set(520 + k, f"gear_steps_{axis.lower()}", f"gear of {axis}: steps or edges", "steps",
           (PULSES_PER_MM, 1, LARGEST_GEAR), "drives",
           f"Electronic gear of {axis}: so many steps, or with a coder so many of its edges (four "
           f"for each line), for `${{gear_pulses_{axis.lower()}}}` pulses. A mm has 10 000 pulses: "
           "while that setting is 10 000, this one is the steps or edges per mm. Steps are rounded "
           "to the nearest, by the count of pulses alone; pulses of a coder by the count of its "
           "edges alone. After a change the position is lost; it is not accepted with more steps "
           f"or edges than pulses, nor with more than {COARSEST_CODER} pulses for an edge.")
      for k, axis in enumerate("XYZ")),
    *(_set(523 + k, f"gear_pulses_{axis.lower()}", f"gear of {axis}: in so many pulses", "pulses",
           (PULSES_PER_MM, 1, LARGEST_GEAR), "drives",
           f"Pulses for `${{gear_steps_{axis.lower()}}}`, at least as many. After a "
           "change the position is lost.")
      for k, axis in enumerate("XYZ")),
    *(_set(526 + k, f"backlash_{axis.lower()}", f"backlash of {axis}", "pulses",
           (0, 0, LARGEST_BACKLASH), "drives",
           f"Play between drive and {axis}, a pulse being 0.1 µm. While {axis} goes down, the "
           "drive stands further down by it. It is taken up at 3.1 mm/s, beside the motion. After "
           "a change the position is lost, and the axis counts as having come up: so reference it "
           "upwards.")
      for k, axis in enumerate("XYZ")),
    _set(529, "reversed_drives", "drives that turn the other way, mask", "", (0, 0, 7), "drives",
         "Axes whose drive moves up at a command down: the sum of 1 for X, 2 for Y, 4 for Z. It "
         "inverts the direction pin and the sign of the velocity command. After a change the "
         "position is lost."),
    *(_set(530 + k, f"highest_speed_{axis.lower()}", f"highest speed of {axis} (0 no own bound)",
           "mm/min", (0, 0, 60_000), "motion",
           f"The speed along the path is limited so that {axis} goes no faster, on the way back "
           "and in jumps as well. An arc is limited by the slower axis of its plane.")
      for k, axis in enumerate("XYZ")),
    _set(533, "home_order", "homing: order of axes, 1 X, 2 Y, 3 Z (0 off)", "", (312, 0, 321),
         "travel", "`$H` homes these axes in this order: each digit names one, at most once. 312 "
         "is Z, then X, then Y. 0: there is no homing.", guards=False),
    _set(534, "home_down", "homing: axes whose reference is below, mask", "", (3, 0, 7),
         "travel", "Axes whose reference is the lower limit switch: the sum of 1 for X, 2 for Y, 4 "
         "for Z. The others have it at their upper end.", guards=False),
    _set(535, "home_slow_mm_min", "homing: slow approach", "mm/min", (25, 1, 600), "travel",
         "Speed of the second approach, which measures, and at which the axis leaves the switch; "
         "the latter is at most 60.", guards=False),
    _set(536, "home_fast_mm_min", "homing: fast approach", "mm/min", (500, 1, 60_000), "travel",
         "Speed of the first approach; at most `${highest_speed_mm_min}`. The axis must be able to "
         "stop behind the switch from it, with its drive off.", guards=False),
    _set(537, "home_pull_off_um", "homing: pull-off", "um", (1000, 10, 20_000), "travel",
         "How far the axis goes away from its reference switch. There it stands at the end of its "
         "travel: at its soft limit on that side.", guards=False),
    _set(538, "single_block", "single block", "", (0, 0, 1), "program",
         "1: a tape stops after each of its blocks, as at M00: the discharge is off, and `~` goes "
         "on. Switched on in a run, it stops after the first block that is not planned yet.",
         guards=False, any_time=True),
    _set(539, "dry_run_mm_min", "dry run: feed of cuts (0 off)", "mm/min", (0, 0, 60_000),
         "program", "Not 0: M03 switches no discharge on and needs no arming, G95 does not serve, "
         "and cuts go at this feed, at most `${highest_speed_mm_min}`. Overrides scale it. Rapids, "
         "jogs and touch-offs keep their speeds."),
    _set(540, "corner_deviation_nm", "corner: how far the lag may round it (0 no bound)", "nm",
         (5000, 0, 1_000_000), "loop", "The lag of the drives rounds corners. Before a corner, "
         "either way, the speed is lowered so that the axes leave the path by no more than this "
         "in the loop that is in force (`${feed_forward}`, `${loop_gain}`). A bend counts too if "
         "it would need it at `${highest_speed_mm_min}`. 0: no such bound."),
    _set(541, "drive_lag_us", "lag of the slowest drive, with its dead time", "us",
         (4096, 500, 20_000), "loop", "How late a drive follows its velocity command. Speeds at "
         "corners and on arcs follow from it while `${feed_forward}` is in force. `gapkeeper tune` "
         "measures it; `${model_lag_x_us}` to `${model_lag_z_us}` are those of the feed-forward."),
    *(_set(number, f"step_{name}_{axis}_ns", f"{title}, {axis.upper()} (0 that of all)", "ns",
           (0, 0, 100_000), "axes", f"As `${{step_{name}_ns}}`, for an amplifier that differs from "
           "the others. 0: that of all axes.")
      for number, (name, title, axis) in enumerate(
          ((name, title, axis) for name, title in (("width", "step pulse width"),
                                                   ("space", "step pulse space"),
                                                   ("setup", "direction before step"))
           for axis in "xyz"), start=542)),
    *(_set(number, f"drive_offset_{axis}", f"offset of {axis.upper()}'s drive made up for, "
           f"{NO_OFFSET} none", DAC_STEPS, (NO_OFFSET, 1, 2 * NO_OFFSET - 1), "axes",
           "Velocity command at which the axis stands still; it is added to that of the position "
           f"loop. {NO_OFFSET} is none, {NO_OFFSET + 10} is 10 steps upwards, {NO_OFFSET - 10} 10 "
           "downwards. The DAC has 32768 steps to full scale; `${loop_gain}` times one path pulse "
           "is the speed of one. `gapkeeper tune` measures it.")
      for number, axis in enumerate("xyz", start=551)),
    *(_set(number, f"drive_friction_{axis}", f"friction of {axis.upper()}'s drive made up for",
           DAC_STEPS, (0, 0, LARGEST_FRICTION), "axes",
           "Velocity command that friction takes: it is added in the direction of motion. For "
           "drives whose speed falls short by friction; an amplifier with an integral part needs "
           "none. With some 35 steps more than there is friction an axis swings about its place "
           "and never rests; to lower the setting then, press the emergency stop. `gapkeeper tune` "
           "measures it.")
      for number, axis in enumerate("xyz", start=554)),
    *(_set(number, f"model_lag_{axis}_us", f"lag of {axis.upper()}'s drive, for the feed-forward",
           "us", (4096, 500, 8000), "loop",
           "The way by which the drive is behind its command anyway is no error to be made up for: "
           "`${feed_forward}` leaves it out, reckoned with this lag. A little less than the true "
           "one follows arcs best. `gapkeeper tune` proposes it.")
      for number, axis in enumerate("xyz", start=557)),
    _set(560, "home_index", "homing: axes homed on the index, mask", "", (0, 0, 7), "travel",
         "Axes whose reference is the index of the coder that comes first behind the pull-off: the "
         "sum of 1 for X, 2 for Y, 4 for Z. They stand on it at the end of their travel. 0: the "
         "switch alone.", guards=False),
    _set(561, "home_index_um", "homing: longest way to the index", "um", (12_000, 100, 1_000_000),
         "travel", "How far such an axis goes on from the pull-off at `${home_slow_mm_min}`, if no "
         "index comes: a turn of its coder, and some more.", guards=False),
    *_pitch(562),
)


def named(name: str, table: Iterable[Setting] = SETTINGS) -> Setting:
    """Setting of a name. ``KeyError`` if there is none."""
    for setting in table:
        if setting.name == name:
            return setting
    raise KeyError(name)


def of_number(number: int, table: Iterable[Setting] = SETTINGS) -> Setting | None:
    """Setting of a number, or None."""
    return next((setting for setting in table if setting.number == number), None)


def assign(name: str, value: int, table: Iterable[Setting] = SETTINGS) -> str:
    """Line that gives a setting a value: ``$number=value``.

    Raises
    ------
    KeyError
        If there is no setting of that name.
    ValueError
        If the value is out of its range.
    """
    setting = named(name, table)
    if not setting.lowest <= value <= setting.highest:
        raise ValueError(f"setting {setting.number} ({name}) must be {setting.lowest} to "
                         f"{setting.highest}, not {value}")
    return f"${setting.number}={value}"
