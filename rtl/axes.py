# SPDX-License-Identifier: Apache-2.0
"""The axes of the machine: soft limits, error counters, outputs and supervision, joined."""

from amaranth import *

from rtl.members import AXES
from rtl.motion.axis import Axis
from rtl.motion.limits import SoftLimits
from rtl.motion.supervision import RATE_TICKS, TICK_S, tick_clocks

__all__ = ["join_axes"]

REST_S = 0.1    # without axis pulses: from then on the following error at rest is supervised
MISFIT_UM = 20  # of a coder and the model of its drive


def _tick(m, clock_hz):
    """A tick of the supervision."""
    count = Signal(range(tick_clocks(clock_hz)))
    tick = Signal()
    m.d.sync += tick.eq(count == 0)
    with m.If(count == 0):
        m.d.sync += count.eq(tick_clocks(clock_hz) - 1)
    with m.Else():
        m.d.sync += count.eq(count - 1)
    return tick


def join_axes(m, machine, *, distributor, retraction, path, interlock):
    """Add the axes to the module of a ``Machine``; from its distributor's pulses to its pins.

    Returns by cause of the interlock what the axes say, a list by axis, and in ``damaged`` which
    have damaged registers.
    """
    tick = _tick(m, machine.clock_hz)
    in_position, onto = [], []
    faults = {name: [] for name in ("error_saturated", "encoder", "following_stopped",
                                    "following_moving", "coder", "travel", "damaged")}
    for index, letter in enumerate(AXES):
        def own(name, letter=letter):
            return getattr(machine, f"axis_{letter}_{name}")

        axis = Axis(dac=machine.dac_kind, rest_clocks=machine.clocks(REST_S),
                    allowance=MISFIT_UM * machine.pulses_per_mm // 1000,
                    fastest=round(machine.fastest_mm_s * machine.pulses_per_mm
                                  * TICK_S * RATE_TICKS))
        limits = SoftLimits()
        m.submodules[f"axis_{letter}"] = axis
        m.submodules[f"limits_{letter}"] = limits
        m.d.comb += [
            limits.pi.eq(distributor.pi[index]),
            limits.pi_reverse.eq(distributor.pi_reverse[index]),
            limits.command.eq(axis.command),
            limits.low.eq(own("low")),
            limits.high.eq(own("high")),
            limits.barred_low.eq(interlock.left_low[index]),
            limits.barred_high.eq(interlock.left_high[index]),
            limits.clear.eq(axis.adopt & axis.safe),
            own("status_beyond_low").eq(limits.beyond_low),
            own("status_beyond_high").eq(limits.beyond_high),

            axis.pi.eq(limits.passed),
            axis.pi_reverse.eq(limits.pi_reverse),
            axis.enc_a.eq(machine.enc_a[index]),
            axis.enc_b.eq(machine.enc_b[index]),
            axis.safe.eq(machine.safe),
            axis.adopt.eq(own("adopt_strobe")),
            axis.mark.eq(retraction.mark),
            # The axis lags, and comes from the side on which it is: the segment in which the
            # path has ended may not move it, or move it the other way. Only an axis without lag
            # is told by the segment, along which it goes back.
            axis.mark_reverse.eq(Mux(axis.error == 0, ~path.travel[index].negative,
                                     axis.error < 0)),
            axis.tick.eq(tick),
            machine.dac[index].eq(axis.dac),
            machine.dac_negative[index].eq(axis.dac_negative),
            machine.step[index].eq(axis.step),
            machine.dir[index].eq(axis.dir),
            machine.drive_enable[index].eq(~machine.safe),
        ]
        for name in ("follow_stopped", "follow_moving", "window", "mode_step", "mode_reverse",
                     "step_time_width", "step_time_space", "step_time_setup", "gain"):
            m.d.comb += getattr(axis, name).eq(own(name))
        for name in ("command", "position", "error", "overshoot", "status_saturated",
                     "status_illegal", "status_check"):
            m.d.comb += own(name).eq(getattr(axis, name))
        in_position.append(axis.in_position)
        onto.append(limits.onto)
        for name, flag in (
                ("error_saturated", axis.status_saturated), ("encoder", axis.status_illegal),
                ("following_stopped", axis.following_stopped),
                ("following_moving", axis.following_moving), ("coder", axis.status_check.any()),
                ("travel", limits.beyond_low | limits.beyond_high),
                ("damaged", axis.damaged)):
            faults[name].append(flag)
    m.d.comb += [machine.path_status_in_position.eq(Cat(in_position).all()),
                 interlock.onto.eq(Cat(onto).any())]
    return faults
