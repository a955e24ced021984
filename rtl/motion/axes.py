# SPDX-License-Identifier: Apache-2.0
"""The axes of the machine: soft limits, error counters, outputs and supervision, joined."""

from collections.abc import Mapping

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.axis import Axis
from rtl.motion.feed_forward import FORWARD_BITS
from rtl.motion.limits import SoftLimits
from rtl.motion.supervision import RATE_TICKS, TICK_S, tick_clocks

__all__ = ["Axes"]

REST_S = 0.1    # without axis pulses: from then on the following error at rest is supervised
MISFIT_UM = 20  # allowed between a coder and the model of its drive


class Axes(wiring.Component):
    """From axis pulses Pi to the drives, and back from the coders, for every axis.

    Parameters
    ----------
    registers : mapping of str to wiring.Signature
        Register blocks ``axis_x``, ``axis_y`` and so on, and ``pitch``, as their owner on the bus
        has them.
    letters : str
        The axes, such as ``"xyz"``; every vector has one bit for each, the first one lowest.
    clock_hz, pulses_per_mm : int
        Clock, and unit of position.
    dac : str
        See ``rtl.motion.axis``.
    fastest_mm_s : float
        Speed that no drive exceeds, as its coder counts it.

    Members
    -------
    registers : In(Signature of the blocks)
        See ``softcore/regmap.py``.
    safe : In(1)
        Outputs are safe.
    pi, pi_reverse, downwards, mark : In
        See ``rtl.motion.motion``.
    forward : In(signed(16)) x axes
        Velocity feed-forward; see ``rtl.motion.feed_forward``.
    ahead : In(1)
        It is in force.
    resting : In(1)
        No path pulses are commanded.
    left_low, left_high : In(axes)
        Limit switches that the axis is leaving: no pulses further onto them.
    enc_a, enc_b : In(axes)
        Lines of the coders.
    dac, dac_negative, step, dir, drive_enable : Out(axes)
        To the drives.
    in_position : Out(1)
        Every axis is within its window of its command.
    onto : Out(1)
        A pulse further onto such a switch came, and was refused.
    error_saturated, encoder, following_stopped, following_moving, coder, travel : Out(axes)
        Causes of the interlock, by axis.
    damaged : Out(axes)
        Registers of the axis are damaged.
    damaged_settings : Out(axes)
        In the clock before, one of its settings ``GUARDED`` differed from what firmware wrote.

    Attributes
    ----------
    axes : list of Axis
        By axis, for tests and proofs to look at.
    """

    FAULTS = ("error_saturated", "encoder", "following_stopped", "following_moving", "coder",
              "travel")
    SETTINGS = ("follow_stopped", "follow_moving", "window", "mode_step", "mode_reverse",
                "mode_swap", "mode_offset", "mode_friction", "step_time_width", "step_time_space",
                "step_time_setup", "model_gain", "model_lag", "gear_steps", "gear_surplus",
                "gear_strobe", "backlash_size", "backlash_strobe")
    GUARDED = ("low", "high", "follow_stopped", "follow_moving", "model_gain", "model_lag",
               "mode_step", "mode_reverse", "mode_swap", "mode_offset", "mode_friction",
               "gear_steps", "gear_surplus", "backlash_size")
    REPORTS = ("command", "position", "error", "overshoot", "backlash_taken_up",
               "status_saturated", "status_illegal", "status_check")

    def __init__(self, *, registers: Mapping[str, wiring.Signature], letters: str, clock_hz: int,
                 pulses_per_mm: int, dac: str, fastest_mm_s: float):
        self.letters = letters
        self.tick_clocks = tick_clocks(clock_hz)
        self.axes = [
            Axis(dac=dac, rest_clocks=max(1, round(REST_S * clock_hz)),
                 allowance=MISFIT_UM * pulses_per_mm // 1000,
                 fastest=round(fastest_mm_s * pulses_per_mm * TICK_S * RATE_TICKS))
            for _ in letters]
        count = len(letters)
        super().__init__({
            "registers": In(wiring.Signature({
                name: Out(registers[name])
                for name in (*(f"axis_{letter}" for letter in letters), "pitch")})),
            "safe": In(1),
            **{name: In(count) for name in ("pi", "pi_reverse", "downwards", "left_low",
                                            "left_high", "enc_a", "enc_b")},
            "mark": In(1),
            "forward": In(signed(FORWARD_BITS)).array(count), "ahead": In(1), "resting": In(1),
            **{name: Out(count) for name in ("dac", "dac_negative", "step", "dir", "drive_enable",
                                             *self.FAULTS, "damaged", "damaged_settings")},
            "in_position": Out(1), "onto": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        tick = self._tick(m)
        in_position, onto = [], []
        for index, (letter, axis) in enumerate(zip(self.letters, self.axes, strict=True)):
            m.submodules[f"axis_{letter}"] = axis
            m.submodules[f"limits_{letter}"] = limits = SoftLimits()
            own = getattr(self.registers, f"axis_{letter}")
            self._commands(m, index, axis, limits, own)
            self._reports(m, index, axis, limits, own)
            m.d.comb += axis.tick.eq(tick)
            in_position.append(axis.in_position)
            onto.append(limits.onto)
        m.d.comb += [self.in_position.eq(Cat(in_position).all()), self.onto.eq(Cat(onto).any())]
        return m

    def _tick(self, m):
        """A tick of the supervision."""
        count = Signal(range(self.tick_clocks))
        tick = Signal()
        m.d.sync += tick.eq(count == 0)
        with m.If(count == 0):
            m.d.sync += count.eq(self.tick_clocks - 1)
        with m.Else():
            m.d.sync += count.eq(count - 1)
        return tick

    def _commands(self, m, index, axis, limits, own):
        """Pulses within the soft limits, and the other inputs of the axis."""
        m.d.comb += [
            limits.pi.eq(self.pi[index]),
            limits.pi_reverse.eq(self.pi_reverse[index]),
            limits.command.eq(axis.command),
            limits.low.eq(own.low),
            limits.high.eq(own.high),
            limits.barred_low.eq(self.left_low[index]),
            limits.barred_high.eq(self.left_high[index]),
            limits.clear.eq(axis.adopt & axis.safe),

            axis.pi.eq(limits.passed),
            axis.pi_reverse.eq(limits.pi_reverse),
            axis.enc_a.eq(self.enc_a[index]),
            axis.enc_b.eq(self.enc_b[index]),
            axis.safe.eq(self.safe),
            axis.adopt.eq(own.adopt_strobe),
            axis.forward.eq(self.forward[index]),
            axis.ahead.eq(self.ahead),
            axis.resting.eq(self.resting),
            axis.pitch.eq(getattr(self.registers.pitch, self.letters[index])),
            axis.mark.eq(self.mark),
            # The lag tells from which side an axis comes. The segment does not: it may leave this
            # axis at rest, or move it the other way. Only an axis without lag takes the direction
            # from the segment, along which it goes back.
            axis.mark_reverse.eq(Mux(axis.error == 0, ~self.downwards[index], axis.error < 0)),
            *(getattr(axis, name).eq(getattr(own, name)) for name in self.SETTINGS),
        ]

    def _reports(self, m, index, axis, limits, own):
        """Outputs to the drive, status for firmware, and causes of the interlock."""
        m.d.comb += [
            self.dac[index].eq(axis.dac),
            self.dac_negative[index].eq(axis.dac_negative),
            self.step[index].eq(axis.step),
            self.dir[index].eq(axis.dir),
            self.drive_enable[index].eq(~self.safe),

            own.status_beyond_low.eq(limits.beyond_low),
            own.status_beyond_high.eq(limits.beyond_high),
            *(getattr(own, name).eq(getattr(axis, name)) for name in self.REPORTS),

            self.error_saturated[index].eq(axis.status_saturated),
            self.encoder[index].eq(axis.status_illegal),
            self.following_stopped[index].eq(axis.following_stopped),
            self.following_moving[index].eq(axis.following_moving),
            self.coder[index].eq(axis.status_check.any()),
            self.travel[index].eq(limits.beyond_low | limits.beyond_high),
            self.damaged[index].eq(axis.damaged),
        ]
        m.d.sync += self.damaged_settings[index].eq(
            Cat(getattr(self.registers.pitch, f"{self.letters[index]}_damaged"),
                *(getattr(own, f"{name}_damaged") for name in self.GUARDED)).any())
