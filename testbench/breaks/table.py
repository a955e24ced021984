# SPDX-License-Identifier: Apache-2.0
"""All planted breaks, and the changes that have no visible effect."""

from testbench.breaks.harness import Break, Equivalent
from testbench.breaks.table_axes import AXES
from testbench.breaks.table_blocks import BLOCKS
from testbench.breaks.table_boards import BOARDS
from testbench.breaks.table_gap import GAP
from testbench.breaks.table_link import LINK
from testbench.breaks.table_machine import MACHINE
from testbench.breaks.table_motion import MOTION
from testbench.breaks.table_panel import PANEL
from testbench.breaks.table_plant import PLANT
from testbench.breaks.table_safety import SAFETY
from testbench.breaks.table_scope import SCOPE
from testbench.breaks.table_storage import STORAGE

__all__ = ["EQUIVALENT", "SHORT", "TABLE"]

TABLE: tuple[Break, ...] = (
    SAFETY + GAP + MOTION + BLOCKS + MACHINE + AXES + LINK + PANEL + PLANT + BOARDS + SCOPE
    + STORAGE)

WINDOW = ("testbench/unit/firmware/test_path.py::test_window_moves_under_a_moving_machine",
          "testbench/unit/firmware/test_path.py::test_window_holds_what_is_commanded")
BEYOND = (
    "What is dropped lies 15 segments beyond that in which the machine was when the step began. If "
    "its position is there now, it has gone there since; and on the way there the command is as "
    "far as the position or further, so that the comparison of the command refuses as well. The "
    "new bound is in force before both, so that no command goes there between them.")

EQUIVALENT: tuple[Equivalent, ...] = (
    Equivalent(
        Break("rtl/safety/arming.py", "state.eq(OPEN), wait.eq(closing - 1)]", "state.eq(OPEN)]",
              ("testbench/unit/rtl/test_arming.py",), "the contacts' time begins anew"),
        "Only a closed contactor counts the time down, and only then is it looked at; the press "
        "that closes sets it, and reset does. So it is at its start whenever it counts."),
    Equivalent(
        Break("rtl/motion/retraction.py", "PREPARE = 6", "PREPARE = 3",
              ("testbench/formal/test_machine_bounds.py::test_no_retraction_goes_beyond_its_bounds",
               "testbench/unit/rtl/test_retraction.py"), "comparisons have clocks to spare"),
        "The comparisons follow the state within 3 clocks. The first bound of a retraction from "
        "rest takes one more, but the generator begins a pulse anew when it may go, and makes it "
        "5 clocks later. So 3 clocks are to spare, and the machine only goes 3 clocks sooner, "
        "which the contract states by this constant."),
    Equivalent(
        Break("softcore/firmware/path/path.c", " && difference(hal_position(), now) >= 0", "",
              WINDOW, "the window behind the machine stays"),
        BEYOND),
    Equivalent(
        Break("softcore/firmware/path/path.c", " && difference(hal_position(), now) <= 0", "",
              WINDOW, "the window ahead of the machine stays"),
        BEYOND),
    Equivalent(
        Break("softcore/firmware/interp/reader.c", "r->column = r->counted = r->length = 0;",
              "r->column = r->length = 0;", ("testbench/unit/firmware/test_reader.py",),
              "TV begins anew with each block"),
        "Only whether the count is even is looked at, and only with TV, which a tape has from its "
        "start or not at all: each block before was even, or the tape has ended there."),
    Equivalent(
        Break("softcore/firmware/app/program.c", "at == STAGE_EXECUTE && execute_paused()",
              "execute_paused()", ("testbench/unit/firmware/test_program.py",),
              "a stop is told as one"),
        "A block that is carried out stands still at its stop only between its begin and its end "
        "or abort (execute_begin, execute_abort), and for all that time the stage is EXECUTE."),
    Equivalent(
        Break("softcore/firmware/app/machine.c", "!locked && running", "running",
              ("testbench/unit/firmware/test_machine.py",
               "testbench/unit/firmware/test_program.py"), "a locked machine does not retract"),
        "A locked machine does not run: each place that locks takes run away before (machine_stop, "
        "machine_init), and only a program that was let through gives it. The link asks, too."),
)

# The short form: safe outputs, a guard of a place, and the firmware's end of a cut.
SHORT = ("rtl/safety/interlock.py: safe in the clock of a cause",
         "rtl/motion/backlash.py: a bit that turns over is told",
         "softcore/firmware/base/alarm.c: an alarm ends the discharge")
