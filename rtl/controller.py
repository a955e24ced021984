# SPDX-License-Identifier: Apache-2.0
"""The controller: motion, gap, power, safety and auxiliary functions, joined."""

from collections.abc import Mapping

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.auxiliary.functions import AuxiliaryFunctions
from rtl.gap.gap import Gap
from rtl.members import AXES, pins
from rtl.motion.axes import Axes
from rtl.motion.index import Index
from rtl.motion.motion import Motion
from rtl.power.condition import Condition
from rtl.power.power import Power
from rtl.power.settling import filter_clocks
from rtl.report import Report
from rtl.safety.arming import Arming
from rtl.safety.interlock import Interlock
from rtl.safety.watchdog import Watchdog

__all__ = ["Controller"]


class Controller(wiring.Component):
    """An electric discharge machine's controller, without its processor.

    Firmware writes segments, rates and data. This gateware decides when to move, to retract and to
    discharge. The last path pulse comes at most 8 clocks after the sample that completes a short.
    Every output is in its safe state while ``safe`` is high.

    Parameters
    ----------
    registers : mapping of str to wiring.Signature
        Register blocks, as their owner on the bus has them (``softcore.csr.interfaces``).
    clock_hz : int
        Frequency of ``sync``.
    pulses_per_mm : int
        Unit of position.
    slots : int
        Segments in the path window.
    jump_axis : int
        Number of the axis along which a sinker jumps, or 15 for none.
    level_max, on_max_s, off_min_s : int, float, float
        Limits that no register can exceed: current level in IP, on-time and off-time in s.
    latch_clocks : int
        Clocks from a change of ``gap_supply`` until the power supply follows it, at least 1.
    reference_rc_us : float
        Time constant of the filters behind ``gap_reference``, above 0.
    dac_kind : str
        ``"sigma_delta"`` or ``"pwm"``.
    scope_depth : int
        Entries of the gap oscilloscope (``rtl.gap.scope``); 0 for none.
    arm_strapped : bool
        The discharge needs no press of the button ``arm``.
    fastest_mm_s, leaving_mm_s : float
        Speed that no drive exceeds, as its coder counts it; and the highest speed while the machine
        leaves a limit switch; in mm/s.

    Members
    -------
    registers : In(Signature of the blocks)
        See ``softcore/regmap.py``.
    cycle : In(32)
        Clock count, for events.
    hold : In(1)
        Feed hold by the operator; the register ``retraction.control`` has another one.
    abort : In(1)
        The operator's reset: no path pulse in either direction, and no discharge.
    memory_damaged : In(1)
        The processor's memory has read wrong: a cause of the interlock.
    silent : Out(1)
        The watchdog has expired, and firmware has not called it for a second period.

    The others: ``rtl.members.pins``.
    """

    MOTION = Motion  # a proof replaces it by its own

    def __init__(self, *, registers: Mapping[str, wiring.Signature], clock_hz: int,
                 pulses_per_mm: int = 10_000, slots: int = 64, jump_axis: int = 2,
                 level_max: int = 20, on_max_s: float = 2e-3, off_min_s: float = 5e-6,
                 latch_clocks: int = 1, reference_rc_us: float = 200.0,
                 dac_kind: str = "sigma_delta", scope_depth: int = 4096,
                 arm_strapped: bool = False,
                 fastest_mm_s: float = 240.0, leaving_mm_s: float = 1.0):
        self.clock_hz = clock_hz
        self.pulses_per_mm = pulses_per_mm
        self.axes = len(AXES)
        self.slots = slots
        self.jump_axis = jump_axis

        self.motion = self.MOTION(registers=registers, axes=self.axes, slots=slots,
                                  creep=round(leaving_mm_s * pulses_per_mm * 2**32 / clock_hz))
        self.drives = Axes(registers=registers, letters=AXES, clock_hz=clock_hz,
                           pulses_per_mm=pulses_per_mm, dac=dac_kind, fastest_mm_s=fastest_mm_s)
        self.index = Index(axes=self.axes)
        self.gap = Gap(registers=registers, clock_hz=clock_hz, scope_depth=scope_depth)
        self.condition = Condition(registers=registers, latch=latch_clocks,
                                   settle=filter_clocks(clock_hz, reference_rc_us))
        self.power = Power(clock_hz=clock_hz, level_max=level_max, on_max=self._clocks(on_max_s),
                           off_min=self._clocks(off_min_s))
        self.interlock = Interlock(clock_hz=clock_hz, axes=self.axes)
        self.watchdog = Watchdog(clock_hz=clock_hz)
        self.arming = Arming(clock_hz=clock_hz, strapped=arm_strapped)
        self.auxiliary = AuxiliaryFunctions()
        self.report = Report(registers=registers, letters=AXES)
        self.stopped = Signal(init=1)   # ``safe``, a clock later
        super().__init__({
            "registers": In(wiring.Signature({name: Out(signature)
                                              for name, signature in registers.items()})),
            "cycle": In(32), "hold": In(1), "abort": In(1), "memory_damaged": In(1),
            "silent": Out(1)} | pins())

    def _clocks(self, seconds):
        """Clocks in so many seconds, at least 1."""
        return max(1, round(seconds * self.clock_hz))

    def elaborate(self, platform):
        m = Module()
        m.submodules.motion = self.motion
        m.submodules.drives = self.drives
        m.submodules.index = self.index
        m.submodules.gap = self.gap
        m.submodules.condition = self.condition
        m.submodules.power = self.power
        m.submodules.interlock = self.interlock
        m.submodules.watchdog = self.watchdog
        m.submodules.arming = self.arming
        m.submodules.auxiliary = self.auxiliary
        m.submodules.report = self.report
        for part in (self.motion, self.drives, self.gap):
            for name in part.registers.signature.members:
                wiring.connect(m, wiring.flipped(getattr(self.registers, name)),
                               getattr(part.registers, name))
        wiring.connect(m, wiring.flipped(self.registers.condition), self.condition.registers)
        wiring.connect(m, wiring.flipped(self.registers.event), self.report.registers)
        wiring.connect(m, self.gap.motion, self.motion.gap)
        wiring.connect(m, self.condition.words, self.gap.condition)

        self._motion(m)
        self._drives(m)
        self._discharge(m)
        self._arming(m)
        self._guard(m)
        self._safety(m)
        self._report(m)
        self._auxiliary(m)
        return m

    def _motion(self, m):
        motion = self.motion
        m.d.comb += [
            # A contact that trips must not be a halt first: motion learns of it at once.
            motion.safe.eq(self.stopped | self.gap.trip),
            motion.hold.eq(self.hold), motion.abort.eq(self.abort),
            motion.leaving.eq(self.interlock.leaving),
            motion.backpressure.eq(self.report.backpressure),
            motion.in_position.eq(self.drives.in_position), motion.cycle.eq(self.cycle),
        ]

    def _drives(self, m):
        drives, motion, interlock = self.drives, self.motion, self.interlock
        m.d.comb += [
            drives.safe.eq(self.safe),
            drives.pi.eq(motion.pi), drives.pi_reverse.eq(motion.pi_reverse),
            drives.downwards.eq(motion.downwards), drives.mark.eq(motion.mark),
            *(mine.eq(its) for mine, its in zip(drives.forward, motion.forward, strict=True)),
            drives.ahead.eq(motion.ahead),
            drives.resting.eq(motion.resting),
            drives.left_low.eq(interlock.left_low), drives.left_high.eq(interlock.left_high),
            drives.enc_a.eq(self.enc_a), drives.enc_b.eq(self.enc_b),
            self.index.line.eq(self.enc_index), self.index.safe.eq(self.stopped),
            self.index.arm.eq(self.registers.event.index),
            self.index.arm_strobe.eq(self.registers.event.index_strobe),
            self.dac.eq(drives.dac), self.dac_negative.eq(drives.dac_negative),
            self.step.eq(drives.step), self.dir.eq(drives.dir),
            self.drive_enable.eq(drives.drive_enable),
        ]

    def _discharge(self, m):
        """Condition in force, pulses, and the gap."""
        gap, power, condition = self.gap, self.power, self.condition
        registers = self.registers.power
        # Firmware wants it, a hand has armed it, no reset is pending, no limit switch is excused.
        machining = Signal()
        m.d.comb += machining.eq(registers.control_machining & self.arming.armed & ~self.abort
                                 & ~self.interlock.leaving)
        # The gap follows a clock later, as with ``safe``; pulses are off in the clock of a change.
        discharging = Signal()
        m.d.sync += discharging.eq(machining)
        jumps = AXES[self.jump_axis] if self.jump_axis < self.axes else None
        position = getattr(self.registers, f"axis_{jumps}").position if jumps else 0
        words = condition.words
        m.d.comb += [
            *condition.stage(self.registers),
            condition.position.eq(position), condition.between.eq(power.between),

            power.machining.eq(machining), power.safe.eq(self.safe),
            power.latched.eq(condition.latched), power.settled.eq(condition.settled),
            power.quiet.eq(gap.motion.quiet), power.sensing.eq(gap.motion.sensing),
            power.look.eq(gap.look), power.abnormal.eq(gap.abnormal),
            power.level.eq(words.power_level), power.on_time.eq(words.power_on_time),
            power.wait_time.eq(words.power_wait_time), power.ignited.eq(gap.ignited),
            power.off_time.eq(words.power_off_time), power.off_extra.eq(words.power_off_extra),
            power.reference.eq(words.gap_reference_short),
            power.sense_on.eq(registers.sense_on), power.sense_off.eq(registers.sense_off),
            power.cut.eq(registers.control_cut),
            power.current.eq(self.gap_current), power.short.eq(self.gap_short),
            registers.limits_level.eq(power.limit_level),
            registers.limits_off.eq(power.limit_off),
            self.gap_on.eq(power.on), self.gap_sense.eq(power.sense),
            self.gap_level.eq(power.level_out),
            self.gap_supply.eq(Cat(words.power_supply_voltage, words.power_supply_negative)),

            gap.safe.eq(self.stopped), gap.machining.eq(discharging),
            gap.wanted.eq(registers.control_machining),
            gap.waiting.eq(~condition.latched | ~condition.settled),
            gap.in_position.eq(self.drives.in_position),
            gap.state.eq(self.registers.path.status_state), gap.cycle.eq(self.cycle),
            gap.on.eq(power.on), gap.sense.eq(power.sense), gap.forget.eq(power.forget),
            gap.high.eq(self.gap_high), gap.arc.eq(self.gap_arc), gap.short.eq(self.gap_short),
            gap.current.eq(self.gap_current), gap.noise.eq(self.gap_noise),
            self.gap_reference.eq(gap.reference),
            self.adc_select.eq(gap.adc_select), self.adc_clock.eq(gap.adc_clock),
            self.adc_command.eq(gap.adc_command), gap.adc_data.eq(self.adc_data),
        ]

    def _arming(self, m):
        """The button that allows the discharge, and the contactor."""
        arming, registers = self.arming, self.registers.safety
        m.d.comb += [
            arming.arm.eq(self.arm), arming.safe.eq(self.safe),
            arming.disarm.eq(registers.disarm_strobe),
            self.contactor.eq(arming.contactor),
            registers.arming_contactor.eq(arming.contactor),
            registers.arming_armed.eq(arming.armed),
            registers.arming_pressed.eq(self.arm),
        ]

    def _guard(self, m):
        """Which guarded registers are damaged, latched for firmware."""
        motion, registers = self.motion, self.registers.safety
        found = Cat(self.drives.damaged, motion.damaged_word, motion.damaged_segment,
                    motion.damaged_place, motion.damaged_pulses, self.drives.damaged_settings,
                    registers.fluid_damaged, motion.damaged_rate)
        told = Cat(registers.damage_axes, registers.damage_word, registers.damage_segment,
                   registers.damage_place, registers.damage_pulses, registers.damage_settings,
                   registers.damage_fluid, registers.damage_rate, registers.damage_latch)
        # Damage of the interlock's own latch is a cause already.
        every = Cat(found, self.interlock.torn)
        m.d.sync += told.eq(Mux(registers.clear_strobe, every, told | every))
        m.d.comb += self.interlock.guard.eq(found.any())

    def _safety(self, m):
        """Interlock and watchdog: the one place that decides whether outputs are safe."""
        interlock, watchdog, registers = self.interlock, self.watchdog, self.registers.safety
        m.d.comb += [
            watchdog.pet.eq(registers.pet_strobe), watchdog.key.eq(registers.pet),
            registers.period.eq(watchdog.limit), self.silent.eq(watchdog.silent),
            registers.watch_asked.eq(watchdog.asked), registers.watch_open.eq(watchdog.open),

            interlock.estop.eq(self.estop), interlock.drive_fault.eq(self.drive_fault),
            interlock.limit_low.eq(self.limit_low), interlock.limit_high.eq(self.limit_high),
            interlock.fluid_low.eq(self.fluid_low),
            *(getattr(interlock, name).eq(getattr(self.drives, name)) for name in Axes.FAULTS),
            interlock.contact.eq(self.gap.trip), interlock.gate.eq(self.power.stuck),
            interlock.watchdog.eq(watchdog.expired), interlock.memory.eq(self.memory_damaged),
            interlock.discharging.eq(self.registers.power.control_machining),
            interlock.fluid_required.eq(registers.fluid),
            interlock.stop.eq(registers.stop_strobe),
            interlock.clear.eq(registers.clear_strobe), interlock.key.eq(registers.clear),
            interlock.leave.eq(registers.leave_strobe), interlock.leave_key.eq(registers.leave),
            interlock.onto.eq(self.drives.onto),

            self.safe.eq(interlock.safe), registers.status_safe.eq(self.stopped),
            registers.latched.eq(interlock.latched), registers.status_first.eq(interlock.first),
            registers.status_simultaneous.eq(interlock.simultaneous),
            registers.status_blamed.eq(interlock.blamed),
            registers.limits_low.eq(interlock.at_low), registers.limits_high.eq(interlock.at_high),
            registers.limits_leaving.eq(interlock.leaving),
        ]
        for name in registers.signature.members:
            if name.startswith("inputs_"):
                m.d.sync += getattr(registers, name).eq(
                    getattr(self, name.removeprefix("inputs_")))
        # Outputs are safe at once. Motion, the gap and firmware follow a clock later: on an FPGA
        # the way from a cause through all of them is longer than a clock.
        m.d.sync += [self.stopped.eq(self.safe), registers.live.eq(interlock.live)]

    def _report(self, m):
        """Events, in one queue."""
        report, interlock, fluid = self.report, self.interlock, self.registers.fluid
        m.d.comb += [
            report.cycle.eq(self.cycle), report.slot.eq(self.registers.path.slot),
            report.path.eq(self.registers.path.position),
            *(report.position[index].eq(getattr(self.registers, f"axis_{letter}").position)
              for index, letter in enumerate(AXES)),
            report.retraction.eq(self.motion.event), report.entered.eq(self.motion.entered),
            report.tripped.eq(interlock.tripped), report.first.eq(interlock.first),
            report.blamed.eq(interlock.blamed), report.gate.eq(self.power.stuck),
            report.indexed.eq(self.index.found),
            report.switched.eq(self.condition.switched), report.count.eq(self.condition.count),
            report.depth.eq(self.condition.at),
            report.fluid_news.eq(self.gap.fluid_news), report.fluid_class.eq(fluid.status_class),
            report.fluid_level.eq(fluid.level),
            report.fluid_state.eq(Cat(
                fluid.status_broken_low, fluid.status_broken_high, fluid.status_disordered,
                fluid.status_fault, fluid.status_measured)),
        ]

    def _auxiliary(self, m):
        """M, S and T functions of the machine side."""
        auxiliary, registers = self.auxiliary, self.registers.auxiliary
        m.d.comb += [
            auxiliary.code.eq(registers.send_code), auxiliary.letter.eq(registers.send_letter),
            auxiliary.send.eq(registers.send_strobe), auxiliary.timeout.eq(registers.timeout),
            auxiliary.safe.eq(self.safe), auxiliary.fin.eq(self.fin),
            registers.status_busy.eq(auxiliary.busy),
            registers.status_timed_out.eq(auxiliary.timed_out),
            self.auxiliary_code.eq(auxiliary.function),
            self.auxiliary_strobe.eq(auxiliary.strobe),
        ]
