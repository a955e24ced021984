# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of the firmware that knows the axes: references, drives, gears and screws."""

from testbench.breaks.harness import breaks_of

__all__ = ["AXES"]

HOMING = "unit/firmware/test_homing.py"
INDEX = "unit/firmware/test_homing_index.py"
COARSE = "cosim/test_coarse_homing.py"
WIRING = "unit/firmware/test_wiring.py"

AXES = (
    *breaks_of(
        "softcore/firmware/app/homing.c", HOMING,
        ("axes != 1u << homing_now.axis", "!axes",
         "the switch of another axis is an alarm"),
        ("cause != (homing_now.down ? CAUSE_LIMIT_LOW : CAUSE_LIMIT_HIGH)",
         "cause < CAUSE_LIMIT_LOW", "the switch at the other end is an alarm"),
        ("if (!(axes >> homing_now.axis & 1))", "if (!axes)", "the index is that of its axis",
         INDEX),
        ("} else if (homing_now.phase == HOMING_INDEX) {", "} else {",
         "an index that nobody looks for does nothing", INDEX),
    ),
    *breaks_of(
        "softcore/firmware/app/homing_cycle.c", HOMING,
        ("    machine_lose_position();\n", "", "the position is lost until the cycle has ended"),
        ("        if (all || partly)\n", "", "homing of some axes finds no others"),
        ("    if (pressed()) {\n        fail", "    if (0) {\n        fail",
         "a switch that sticks is an alarm"),
        ("default: fail(FAULT_HOME_NOT_FOUND", "default: if (slow) fail(FAULT_HOME_NOT_FOUND",
         "a cycle without a switch ends"),
        ("    settings_renew();\n    control_begin_path();", "    control_begin_path();",
         "the soft limits follow the frame"),
        ("homed(homing_now.switched + homing_axis_pull_off())",
         "homed(hal_axis_command(homing_now.axis) + homing_axis_pull_off())",
         "the frame is that of the switch"),
        ("homed(homing_now.index)", "homed(homing_now.switched + homing_axis_pull_off())",
         "the frame is that of the index", INDEX),
        ("case HOMING_INDEX: fail(", "case HOMING_INDEX: if (slow) break; fail(",
         "a search without an index ends", INDEX),
    ),
    *breaks_of(
        "softcore/firmware/app/homing_index.c", INDEX,
        ("    if (homing_now.passed && ", "    if (0 && ",
         "an index before the pull-off is near, too"),
        ("homing_now.index - hal_axis_command(homing_now.axis)", "0",
         "the axis goes back onto its index"),
        ("um < travel ? um", "um != travel ? um", "the search stays within the travel"),
    ),
    *breaks_of(
        "softcore/firmware/app/meter.c", COARSE,
        ("settings_edge(axis) + rests", "1u + rests", "a jog ends between two edges of a coder"),
    ),
    *breaks_of(
        "softcore/firmware/app/control.c", HOMING,
        ("    homing_stop();\n", "", "an alarm ends homing"),
        ("    lines_alarm();\n", "", "no line that waits outlives an alarm",
         "unit/firmware/test_overtaken.py"),
        ("    gap_end_trial();\n", "", "a reset ends the trial of levels", WIRING),
        ("|| homes) &&", ") &&", "a reset during homing is an alarm"),
    ),
    *breaks_of(
        "softcore/firmware/app/machine.c", "unit/firmware/test_drives.py",
        ("        settings_renew_drives();\n", "",
         "an unlock removes damage of a gear, a backlash or a direction"),
    ),
    *breaks_of(
        "softcore/firmware/app/control.c", "unit/firmware/test_drives.py",
        ("!settings_gears(f) || !pitch_sound(f)", "!pitch_sound(f)",
         "no position with a gear that does not fit"),
        ("!settings_gears(f) || !pitch_sound(f)", "!settings_gears(f)",
         "nor with a screw that is too wrong", "unit/firmware/test_pitch.py"),
    ),
    *breaks_of(
        "softcore/firmware/app/pitch_watch.c",
        "unit/firmware/test_pitch.py cosim/test_screw_reference.py",
        (" && !machine_position_lost()", "", "nothing moves while the position is lost"),
    ),
    *breaks_of(
        "softcore/firmware/base/pitch.c", "unit/firmware/test_pitch.py",
        ("(1 << 29)", "0", "to the nearest pulse"),
        ("change < 0 ? -product : product", "product", "errors fall as well"),
        ("(high % step << 12) / step", "0", "the slope is exact"),
        ("point + 1 >= points", "point >= points", "beyond the end it is that of the end"),
        ("(int32_t)way <= 0", "0", "and before the start that of the start"),
        ("point_of(axis, next)), STEEPEST", "point_of(axis, next - 1)), STEEPEST",
         "a wrong point is named"),
        ("    if (!points)\n        return 0;\n", "", "without a table there is no error"),
        (" - settings_pitch(axis);", ";", "what is made up for stays when the position is known"),
        ("error_here(axis) - reference[axis]", "error_here(axis)",
         "no axis moves when its position becomes known"),
        ("if (most - least > WIDEST)", "if (most > WIDEST)", "errors are not too far apart"),
    ),
    *breaks_of(
        "softcore/firmware/app/homing_cycle.c", "unit/firmware/test_pitch.py",
        ("!settings_gears(f) || !pitch_sound(f)", "!settings_gears(f)",
         "no homing with a screw that is too wrong"),
    ),
    *breaks_of(
        "softcore/firmware/base/settings.c", "unit/firmware/test_drives.py",
        ("#define COARSEST_CODER 20", "#define COARSEST_CODER 21", "no coder is coarser than said"),
        ("edge > 1 && window < edge", "edge > 99 && window < edge",
         "an axis within an edge of its place is in position", COARSE),
    ),
    *breaks_of(
        "softcore/firmware/app/homing_cycle.c", "unit/firmware/test_drives.py",
        ("!settings_gears(f) || !pitch_sound(f)", "!pitch_sound(f)",
         "no homing with a gear that does not fit"),
    ),
    *breaks_of(
        "softcore/firmware/path/history.c", "unit/firmware/test_drives.py",
        ("(uint64_t)part * most > room", "(uint64_t)part * most > 2 * room",
         "no axis exceeds its speed on a line"),
        ("own && own < most && (axis", "own && 2 * own < most && (axis", "nor on an arc"),
        ("        s->tight = move->highest != 0;\n", "", "slow before a slower axis"),
    ),
)
