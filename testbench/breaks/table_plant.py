# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of the simulated machine, and of the translation that makes it fast."""

from testbench.breaks.harness import breaks_of

__all__ = ["PLANT"]

CAVITY = "unit/plant/test_cavity.py"
RANDOM = "unit/simulators/test_random_modules.py"

PLANT = (
    *breaks_of(
        "testbench/plant/cavity.cpp", CAVITY,
        ("one.volume += mm3 * one.weight / total;", "one.volume += mm3 * one.weight / front;",
         "walls and front share one volume"),
        ("const double deeper = mm3 / total * 1000;", "const double deeper = mm3 / front * 1000;",
         "what the walls take does not deepen the front"),
        ("std::min(one.height, below_um - top)", "one.height",
         "only walls beside the electrode widen"),
        ("p_.current_power) *", "0.0) *", "a greater current cuts wider"),
        ("p_.wall_debris * debris *", "p_.wall_debris *", "debris widens the walls"),
        ("last.volume += section_mm2 * here / 1000;", "last.volume += area_ * here / 1000;",
         "the front is as wide as its overcut"),
    ),
    *breaks_of(
        "testbench/plant/motor.hpp", "unit/plant/test_axis.py",
        ("(count_ - own_.index) % own_.turn == 0", "count_ % own_.turn == 0",
         "an index has its own place"),
    ),
    *breaks_of(
        "testbench/plant/sinker.cpp", CAVITY,
        ("    // What the walls lose is debris as well.\n    debris_ += thickness",
         "    debris_ += 0.5 * thickness", "debris is all that was removed"),
    ),
    *breaks_of(
        "testbench/plant/motor.hpp", "unit/plant/test_axis.py",
        ("return nut() + error();", "return nut();", "a wrong screw takes the axis beside"),
        ("own_.slope * nut() + own_.wave", "own_.wave", "its errors add up"),
    ),
    *breaks_of(
        "testbench/plant/gap.cpp", "unit/plant/test_gap.py",
        ("gate_ == Gate::sensing ? p_.comparator.sensing_level_a", "false ? 0",
         "the sensing source has a level of current of its own"),
    ),
    *breaks_of(
        "testbench/plant/wire_gap.cpp", "unit/plant/test_wire.py",
        ("bridged_ && way <= bridge_stretch_", "bridged_",
         "a contact in a kerf ends by the way back"),
        ("way <= bridge_stretch_", "way <= 0.0", "a contact lasts as long as its stretch"),
    ),
    *breaks_of(
        "testbench/plant/plant.cpp", "unit/plant/test_axis.py",
        ("    catch_up();\n    const std::map", "    const std::map",
         "an axis has moved in every clock before it is looked at"),
        ("    add_up();\n    steps(from);", "    steps(from);",
         "each one of a DAC's stream has the sign of its clock"),
        ("if (!lower.pressed && !upper.pressed && pulses", "if (pulses",
         "a limit switch stays pressed within its hysteresis"),
        ("(std::abs(p_.side.limit_scatter_um) / 2 + 1)", "(1.0)",
         "an axis is looked at wherever it can press a switch"),
        ("    quiet_ = still_ && coder_lines_.sound();\n    gap_", "    quiet_ = still_;\n    gap_",
         "a coder's faulty lines are looked at in every clock"),
    ),
    *breaks_of(
        "testbench/plant/plant.cpp", "unit/plant/test_gap.py",
        ("        powered_ = coil;\n        look_at_gates();", "        powered_ = coil;",
         "the main source goes with the contactor"),
        ("    lines_ = ~0u;\n", "", "a comparator's fault comes at once"),
    ),
    *breaks_of(
        "testbench/plant/wire.cpp", "unit/plant/test_survey.py",
        ("std::max(radius - DENTED_UM, 0.0)", "radius - DENTED_UM",
         "a thin wire sees the material inside it"),
        ("counts) + half", "counts)", "cells count by their surface"),
        ("if (still != 0 && there", "if (there", "a cell that is gone is no nearest one"),
        ("counts = there + span;", "counts = there + span - 2;", "what counts is seen"),
    ),
    *breaks_of(
        "testbench/plant/motor.hpp", "unit/plant/test_axis.py",
        ("std::max(position_, end) < upper_ - SURE &&", "true ||",
         "an axis whose coder changes in a tick is followed clock by clock"),
    ),
    *breaks_of(
        "testbench/plant/workpiece.cpp", "unit/plant/test_wire.py",
        ("if (left == 0)", "if (left < 20000)", "what is left of a cell is taken later"),
    ),
    *breaks_of(
        "testbench/native/emission.py", RANDOM,
        ('f"s.settled{reader} = 0;"', '""', "a part is computed after any change of what it reads"),
    ),
    *breaks_of(
        "testbench/native/writer.py", RANDOM,
        ("changed ? 0 : {settled} | 1ull", "{settled} | 1ull",
         "a part that has changed something has settled in no state"),
    ),
    *breaks_of(
        "testbench/native/plan.py", RANDOM,
        ('(tuple(ports["B"]), 1), here=True)', '(tuple(ports["A"]), 1), here=True)',
         "one operand matters while the other one is set"),
    ),
    *breaks_of(
        "testbench/native/parity.py", RANDOM,
        ("len(group) < MOST and ", "", "eight nibbles at most are taken together"),
    ),
)
