# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of blocks that stop nothing by themselves: paths, outputs, queues and orders.

With them every block of the gateware has a break; see ``test_breaks.py``.
"""

from testbench.breaks.harness import breaks_of

__all__ = ["BLOCKS"]

DAC = "unit/rtl/test_dac.py"
BLOCKS = (
    *breaks_of(
        "rtl/auxiliary/functions.py", "unit/rtl/test_auxiliary.py",
        ('until=self.fin, strobe=0, then="Ending"', 'until=self.fin, strobe=0, then="Idle"',
         "a function ends when FIN has fallen"),
        ("late.eq(waited + 1 >= self.timeout)", "late.eq(waited >= self.timeout)",
         "a FIN that does not come is waited for no longer than stated"),
    ),
    *breaks_of(
        "softcore/sleep.py", "unit/softcore/test_sleep.py",
        ("(left == 0) | self.wake | self.ack", "(left == 0) | self.wake",
         "a sleep does not interrupt an access"),
        ("o_gated=self.gated)", "o_gated=Signal())", "the processor has a clock",
         "cosim/test_session.py"),
    ),
    *breaks_of(
        "softcore/uart.py", "unit/softcore/test_uart.py",
        ("Cat(self.tx, frame).eq(frame), timer.eq(self.divisor - 1)",
         "Cat(self.tx, frame).eq(frame), timer.eq(self.divisor)",
         "each bit takes the same time"),
    ),
    *breaks_of(
        "rtl/lib/debounce.py", "unit/rtl/test_lib.py",
        ("Mux(self.steady, self.fall - 1, self.rise - 1)",
         "Mux(self.steady, self.rise - 1, self.fall - 1)", "rise and fall have their own times"),
    ),
    *breaks_of(
        "rtl/lib/event_queue.py", "unit/rtl/test_lib.py",
        ("self.push & (~self.full | self.pop)", "self.push & ~self.full",
         "an entry has the place of one that leaves in its clock"),
    ),
    *breaks_of(
        "rtl/lib/shift_output.py", "unit/rtl/test_shift_output.py",
        ("self.latch.eq(half == last - 1)", "self.latch.eq(half == last - 2)",
         "the latch comes after the last bit"),
    ),
    *breaks_of(
        "rtl/motion/arc.py", "unit/rtl/test_arc.py",
        ("as_signed() - fine // 4)", "as_signed() - fine // 2)",
         "the midpoint is corrected for the curvature"),
        ("remainder < -self.divisor", "remainder <= -self.divisor",
         "an arc steps back where it has stepped", "formal/test_arc.py::test_major_holds"),
        ("(middle < 0) ^ ~taken.outward ^ back", "(middle < 0) ^ ~taken.outward",
         "and so does its other axis"),
    ),
    *breaks_of(
        "rtl/motion/axis.py", "unit/rtl/test_axis.py",
        ("self.furthest.eq(Mux(behind, self.size, 0))", "self.furthest.eq(self.size)",
         "the overshoot counts from where the command is"),
    ),
    *breaks_of(
        "rtl/motion/dac.py", DAC,
        ("total.eq(self.magnitude + remainder)", "total.eq(self.magnitude)",
         "PWM carries over what a period cannot hold"),
        ("whole.eq(total[BITS:].as_signed() - self.high)", "whole.eq(total[BITS:].as_signed())",
         "a pulse that was sent is taken off the noise of the modulator"),
        ("with m.If(whole > 3):\n                m.d.sync += noise[BITS:].eq(3)",
         "with m.If(whole > 3):\n                m.d.sync += noise[BITS:].eq(2)",
         "that noise is limited to four pulses"),
        ("modulator.enable.eq(wanted & ~turning & ~self.safe)",
         "modulator.enable.eq(wanted & ~self.safe)",
         "no pulse comes in the clock in which the sign changes"),
    ),
    *breaks_of(
        "rtl/motion/distribution.py", "unit/rtl/test_distribution.py",
        ("(self.major == axis) | (self.minor == axis)", "(self.major == axis)",
         "the line leaves both axes of an arc alone"),
        ("self.pi[axis].eq(line.pi[axis] | arc.pi[axis])", "self.pi[axis].eq(line.pi[axis])",
         "the pulses of an arc go to the axes"),
    ),
    *breaks_of(
        "rtl/motion/distributor.py", "unit/rtl/test_distributor.py",
        ("remainder < -self.length", "remainder <= -self.length",
         "a line steps back where it has stepped"),
        ("with m.If(self.restart):\n                m.d.sync += remainder.eq(0)",
         "with m.If(self.restart):\n                m.d.sync += remainder.eq(remainder)",
         "a restart forgets the remainder"),
    ),
    *breaks_of(
        "rtl/motion/figures.py",
        "unit/rtl/test_retraction.py unit/rtl/test_retraction_orders.py",
        ("since.eq(2)", "since.eq(1)", "the latency counts from the completing sample"),
        ("self.clocks.eq(now + 1)]", "self.clocks.eq(now)]",
         "the duration of the plateau belongs to its pulses"),
    ),
    *breaks_of(
        "rtl/motion/servo.py", "unit/rtl/test_servo.py",
        ("back.eq(self.on & self.up)", "back.eq(self.on & self.up & ~self.down)",
         "of two strobes that for a wider gap wins"),
    ),
    *breaks_of(
        "rtl/motion/step_dir.py", "unit/rtl/test_step_dir.py",
        ("remaining.eq(self.setup)", "remaining.eq(1)", "the direction comes before the step"),
        ("[self.step.eq(0), remaining.eq(self.space)]\n        with m.Elif(remaining > 1)",
         "[self.step.eq(0), remaining.eq(1)]\n        with m.Elif(remaining > 1)",
         "the first step after the safe state keeps its distance"),
    ),
    *breaks_of(
        "rtl/pads.py", "unit/rtl/test_pads.py",
        ("self.auxiliary_strobe & before", "self.auxiliary_strobe",
         "a strobe is sent a frame after its code"),
        ("value = Signal(len(port), init=init, ", "value = Signal(len(port), ",
         "a pin starts at its safe level"),
    ),
    *breaks_of(
        "rtl/power/condition.py", "unit/rtl/test_condition.py",
        ("with m.If(switch.take):", "with m.If(switch.pending):",
         "words come into force between two pulses"),
    ),
    *breaks_of(
        "rtl/power/condition_switch.py", "unit/rtl/test_condition_switch.py",
        ("with m.If(self.restart | further[-1])", "with m.If(further[-1])",
         "the furthest position counts from the restart on"),
        ("self.take.eq(self.pending & self.between)", "self.take.eq(self.pending)",
         "a switch waits for the end of the pulse"),
    ),
    # The first scenario sees these natively and, in the soak, under cocotb.
    *breaks_of(
        "rtl/report.py", "cosim/test_scenarios.py",
        ("event.first.eq(self.retraction.first)", "event.first.eq(self.retraction.second)",
         "the end of a retraction is told with its distance"),
    ),
    *breaks_of(
        "rtl/controller.py", "cosim/test_scenarios.py",
        ("report.retraction.eq(self.motion.event), ", "", "retractions are told"),
    ),
    *breaks_of(
        "rtl/motion/axes.py", "cosim/test_scenarios.py",
        ("Cat(in_position).all()", "Cat(in_position).any()",
         "a retraction turns when all axes are in position"),
    ),
)
