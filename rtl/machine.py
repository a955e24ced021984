# SPDX-License-Identifier: Apache-2.0
"""The controller: every block, joined. The only wide file."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.auxiliary.functions import AuxiliaryFunctions
from rtl.axes import join_axes
from rtl.gap.contact import ContactGuard
from rtl.gap.discriminator import Discriminator
from rtl.gap.feed_law import FeedLaw, Law
from rtl.gap.fluid import FluidDetector
from rtl.gap.preset_counter import PresetCounters
from rtl.gap.reference import References
from rtl.gap.removal import RemovalDetector
from rtl.gap.sampler import Sampler
from rtl.gap.short import ShortDetector
from rtl.members import AXES, pins, registers
from rtl.motion.conservation import Conservation
from rtl.motion.distribution import Distributor
from rtl.motion.feed import PathPulseGenerator
from rtl.motion.path import SegmentWindow
from rtl.motion.ramp import Ramp
from rtl.motion.retraction import Retraction, State
from rtl.power.condition import Condition
from rtl.power.power import Power
from rtl.report import report
from rtl.safety.arming import Arming
from rtl.safety.interlock import Interlock
from rtl.safety.watchdog import Watchdog

__all__ = ["Machine"]



class Machine(wiring.Component):
    """An electric discharge machine's controller, without its processor.

    Firmware writes segments, rates and data; when to move, to retract and to discharge is decided
    here. From the sample that completes a short to the last path pulse are at most 8 clocks. Every
    output is in its safe state while ``safe`` is high.

    Parameters
    ----------
    clock_hz : int
        Frequency of ``sync``.
    pulses_per_mm : int
        Unit of position.
    slots : int
        Segments in the path window.
    jump_axis : int
        Axis along which a sinker jumps, or 15.
    level_max, on_max_s, off_min_s : int, float, float
        What no register can exceed: current level in IP, on-time and off-time in s.
    dac_kind : str
        ``"sigma_delta"`` or ``"pwm"``.
    arm_strapped : bool
        The discharge needs no press of the button ``arm``.
    fastest_mm_s, leaving_mm_s : float
        What no drive exceeds, by its coder; and the highest speed off a limit switch, in mm/s.

    Members
    -------
    cycle : In(32)
        Clock count, for events.
    hold : In(1)
        Feed hold by the operator, beside that of the register ``retraction.control``.
    abort : In(1)
        The operator's reset: no path pulse either way, and no discharge.
    memory_damaged : In(1)
        The processor's memory has read wrong: a cause of the interlock.
    silent : Out(1)
        The watchdog has expired, and for a second period nobody has called.

    The others: ``rtl.members.pins`` and the registers of ``softcore/regmap.py``.
    """

    def __init__(self, *, clock_hz: int, pulses_per_mm: int = 10_000, slots: int = 64,
                 jump_axis: int = 2, level_max: int = 20, on_max_s: float = 2e-3,
                 off_min_s: float = 5e-6, dac_kind: str = "sigma_delta",
                 arm_strapped: bool = False, fastest_mm_s: float = 240.0,
                 leaving_mm_s: float = 1.0):
        self.clock_hz = clock_hz
        self.pulses_per_mm = pulses_per_mm
        self.axes = len(AXES)
        self.slots = slots
        self.jump_axis = jump_axis
        self.level_max = level_max
        self.on_max_s = on_max_s
        self.off_min_s = off_min_s
        self.dac_kind = dac_kind
        self.arm_strapped = arm_strapped
        self.fastest_mm_s = fastest_mm_s
        self.leaving_mm_s = leaving_mm_s
        super().__init__({"cycle": In(32), "hold": In(1), "abort": In(1),
                          "memory_damaged": In(1), "silent": Out(1)} | pins() | registers())

    def clocks(self, seconds):
        """Clocks in so many seconds, at least 1."""
        return max(1, round(seconds * self.clock_hz))

    def elaborate(self, platform):
        m = Module()
        m.submodules.removal = removal = RemovalDetector()
        m.submodules.law = law = FeedLaw()
        m.submodules.contact = guard = ContactGuard(clock_hz=self.clock_hz)
        m.submodules.interlock = interlock = Interlock(clock_hz=self.clock_hz, axes=self.axes)
        retraction, entered, faults = self._motion(m, law, removal, guard, interlock)
        m.submodules.condition = condition = Condition()
        arming = self._arming(m)
        power = self._discharge(m, retraction, law, condition, guard, arming.armed)
        fluid = self._fluid(m, removal)
        self._law(m, law, removal, retraction, condition)
        faults |= {"contact": [guard.trip], "gate": [power.stuck]}
        self._safety(m, interlock, faults)
        report(m, self, retraction, entered, fluid, interlock, condition)
        m.submodules.auxiliary = auxiliary = AuxiliaryFunctions()
        m.d.comb += [
            *(getattr(auxiliary, name).eq(getattr(self, f"auxiliary_send_{name}"))
              for name in ("code", "letter")),
            auxiliary.send.eq(self.auxiliary_send_strobe),
            auxiliary.timeout.eq(self.auxiliary_timeout),
            auxiliary.safe.eq(self.safe), auxiliary.fin.eq(self.fin),
            self.auxiliary_status_busy.eq(auxiliary.busy),
            self.auxiliary_status_timed_out.eq(auxiliary.timed_out),
            self.auxiliary_code.eq(auxiliary.function),
            self.auxiliary_strobe.eq(auxiliary.strobe),
        ]
        return m

    def _motion(self, m, law, removal, guard, interlock):
        """Zc → Ps → Pp → Pi → Er → speed command, for the path and every axis."""
        m.submodules.feed = feed = PathPulseGenerator()
        m.submodules.ramp = ramp = Ramp()
        m.submodules.path = path = SegmentWindow(axes=self.axes, slots=self.slots)
        m.submodules.distributor = distributor = Distributor(axes=self.axes)
        m.submodules.retraction = retraction = Retraction()
        load, drop = Signal(), Signal()
        m.d.comb += load.eq(self.path_origin_strobe & ramp.rest)
        # Off a limit switch the machine creeps.
        creep = round(self.leaving_mm_s * self.pulses_per_mm * 2**32 / self.clock_hz)
        creeps = Signal()
        target = Mux(creeps, creep, retraction.target)
        m.d.sync += creeps.eq(interlock.leaving & (retraction.target > creep))

        m.d.comb += [
            feed.rate.eq(target),
            feed.go.eq(retraction.go),
            feed.reverse.eq(retraction.reverse),
            feed.bound.eq(retraction.bound),
            feed.pull.eq(ramp.pull),
            # What was stored when the outputs became safe, or it touched, will not be moved.
            drop.eq(self.safe | guard.contact),
            feed.load.eq(load | drop),
            feed.load_value.eq(Mux(load, 0, path.position)),

            ramp.start_rate.eq(self.ramp_start_rate),
            ramp.acceleration.eq(self.ramp_acceleration),
            ramp.target.eq(target),
            ramp.brake.eq(retraction.brake),
            ramp.ps.eq(feed.ps),
            ramp.room.eq(feed.room),
            ramp.ready.eq(path.ready),
            ramp.drop.eq(drop),

            path.select.eq(self.path_slot_select),
            path.select_strobe.eq(self.path_slot_select_strobe),
            path.data.eq(self.path_slot_data),
            path.data_strobe.eq(self.path_slot_data_strobe),
            path.pulse.eq(ramp.pp & ~drop),
            path.reverse.eq(retraction.reverse),
            path.ahead.eq(self.path_ahead),
            path.load.eq(load),
            path.load_slot.eq(self.path_origin),
            path.fast_ahead_new.eq(self.path_fast_ahead),
            path.fast_behind_new.eq(self.path_fast_behind),
            path.fast_slot.eq(self.path_fast_slot),
            path.fast_strobe.eq(self.path_fast_slot_strobe),

            *distributor.follow(path),
            distributor.restart.eq(load),

            self.path_command.eq(feed.command),
            self.path_position.eq(path.position),
            self.path_front.eq(path.front),
            self.path_slot.eq(path.slot),
            self.path_status_moving.eq(~ramp.rest),
            self.path_status_reverse.eq(retraction.reverse),
            self.path_status_state.eq(retraction.state),
            self.path_status_crowded.eq(retraction.crowded),
        ]
        for name in ("rate", "limit", "high_rate", "low_rate", "changeover", "low_lead",
                     "jump_distance", "jump_rate", "jump_high_rate", "commit_strobe",
                     "jump_period", "gain", "repeats", "settle"):
            m.d.comb += getattr(retraction, name).eq(getattr(self, f"retraction_{name}"))
        command = self.retraction_command_strobe
        m.d.comb += [
            retraction.commit_valid.eq(self.retraction_commit),
            retraction.run.eq(self.retraction_control_run & ~self.abort),
            retraction.hold.eq(self.retraction_control_hold | self.hold),
            retraction.retract.eq(command & self.retraction_command_retract),
            retraction.release.eq(command & self.retraction_command_release),
            retraction.safe.eq(self.safe),
            retraction.in_position.eq(self.path_status_in_position),
            retraction.cycle.eq(self.cycle),
            retraction.load.eq(load),
            law.rate.eq(path.rate),
            retraction.feed.eq(law.feed),
            retraction.highest.eq(path.highest),
            removal.pulse.eq(path.pulse & ~path.reverse & (retraction.state == State.FRONT)),
            retraction.ahead.eq(self.path_ahead),
            retraction.behind.eq(self.path_behind),
            retraction.floor.eq(self.path_floor),
            retraction.fast_ahead.eq(path.fast_ahead),
            retraction.fast_behind.eq(path.fast_behind),
            retraction.ready.eq(path.ready),
            retraction.command.eq(feed.command),
            retraction.position.eq(path.position),
            retraction.front.eq(path.front),
            retraction.pp.eq(ramp.pp),
            retraction.rest.eq(ramp.rest),
            retraction.steady.eq(ramp.steady),
            retraction.distance.eq(ramp.distance),
            retraction.wait.eq(guard.wait), retraction.contact.eq(guard.contact),
            guard.wanted.eq(retraction.wanted & feed.room), guard.away.eq(path.away),
            guard.moving.eq(~ramp.rest), guard.reverse.eq(retraction.reverse),
            guard.fast.eq(ramp.fast), guard.settled.eq(self.path_status_in_position),
            guard.quiet.eq(retraction.quiet),
            self.retraction_start.eq(retraction.start),
            self.retraction_first.eq(retraction.first),
            self.retraction_series.eq(retraction.series),
        ]

        faults = join_axes(m, self, distributor=distributor, retraction=retraction, path=path,
                           interlock=interlock)
        self._guard(m, feed, ramp, path, retraction, drop, faults)
        return retraction, path.entered, faults

    def _discharge(self, m, retraction, law, condition, guard, armed):
        """Discharge and sensing pulses, what they were, and the short signal Ss."""
        # Wanted by firmware, allowed by hand, not reset by the operator, nor on a limit switch.
        machining = Signal()
        m.d.comb += machining.eq(self.power_control_machining & armed & ~self.abort
                                 & ~self.safety_limits_leaving)
        m.submodules.power = power = Power(
            clock_hz=self.clock_hz, level_max=self.level_max, on_max=self.clocks(self.on_max_s),
            off_min=self.clocks(self.off_min_s))
        jumps = AXES[self.jump_axis] if self.jump_axis < self.axes else None
        m.d.comb += condition.follow(self)
        m.d.comb += [condition.position.eq(getattr(self, f"axis_{jumps}_position") if jumps else 0),
                     *power.follow(self, condition), power.machining.eq(machining)]
        m.submodules.discriminator = discriminator = Discriminator()
        m.submodules.short = short = ShortDetector()
        m.submodules.references = references = References()
        m.submodules.counters = counters = PresetCounters()
        gates = Signal(2)  # as the pads have them, which have a register too
        m.d.sync += gates.eq(Cat(power.on, power.sense))
        discharging = machining & ~self.safe & ~retraction.quiet
        stepped = law.law == Law.ZERO
        m.d.comb += [
            power.sensing.eq(retraction.sensing), power.quiet.eq(retraction.quiet),
            power.look.eq(guard.look), power.abnormal.eq(discriminator.abnormal),
            self.gap_reference.eq(references.stream),

            discriminator.on.eq(gates[0]), discriminator.sense.eq(gates[1]),
            *(getattr(discriminator, name).eq(getattr(self, f"gap_{name}"))
              for name in ("arc", "short", "current", "high", "noise", "blanking", "settle",
                           "confirm", "delay_least")),
            *(getattr(discriminator, f"use_{name}").eq(getattr(self, f"gap_criteria_{name}"))
              for name in ("current", "delay", "noise")),
            *(getattr(self, f"gap_{name}").eq(getattr(discriminator, name))
              for name in ("open_count", "ok_count", "dame_count", "short_count")),

            short.sample.eq(discriminator.sample),
            short.sample_shorted.eq(discriminator.sample_shorted),
            short.shorted_now.eq(discriminator.shorted_now),
            short.needed.eq(self.gap_short_ratio_needed),
            short.window.eq(self.gap_short_ratio_window),
            short.duration.eq(self.gap_short_duration),
            short.clear_needed.eq(self.gap_clear_needed),
            short.restart.eq(power.forget),
            self.gap_status_shorted.eq(short.shorted),
            self.gap_status_last.eq(discriminator.last),

            guard.off.eq(~machining), guard.safe.eq(self.safe),
            guard.lag_time.eq(self.gap_lag_time), guard.clear_needed.eq(self.gap_clear_needed),
            guard.sample.eq(discriminator.sample & discriminator.sample_sensing),
            guard.sample_shorted.eq(short.sample_shorted), guard.shorted.eq(short.shorted),

            counters.sample.eq(discriminator.sample & ~discriminator.sample_sensing),
            counters.kind.eq(discriminator.kind),
            *(getattr(counters, name).eq(getattr(condition, f"servo_presets_{name}"))
              for name in ("dame", "open", "ok")),
            counters.mode.eq(self.servo_control_mode), counters.period.eq(self.servo_period),
            counters.window.eq(self.servo_counting_window),
            counters.weight.eq(self.servo_counting_weight),
            # Without discharge pulses there is nothing to go by.
            counters.freeze.eq(retraction.held | short.shorted | ~discharging
                               | ~self.servo_control_on),
            law.held.eq(retraction.held | short.shorted | ~discharging),
            self.servo_status_dame.eq(counters.dame_full),
            self.servo_status_open.eq(counters.open_full),
            self.servo_status_held.eq(retraction.held),

            retraction.servo.eq(self.servo_control_on | stepped),
            retraction.step.eq(Mux(stepped, 1, condition.servo_step)),
            # Without the discharge it is contact.
            retraction.shorted.eq(short.shorted & machining),
            retraction.completed.eq(short.completed),
            retraction.discharging.eq(discharging),
        ]

        # In registers: the bounds of the motion are reckoned with them.
        m.d.sync += [retraction.up.eq(Mux(stepped, law.up, counters.up)),
                     retraction.down.eq(Mux(stepped, law.down, counters.down))]
        m.d.comb += [level.eq(getattr(condition, f"gap_reference_{name}")) for level, name in zip(
            references.level, ("open", "arc", "short"), strict=True)]
        with m.If(counters.up):
            m.d.sync += self.servo_ups.eq(self.servo_ups + 1)
        with m.If(counters.down):
            m.d.sync += self.servo_downs.eq(self.servo_downs + 1)
        return power

    def _arming(self, m):
        """The button that allows the discharge, and the contactor."""
        m.submodules.arming = arming = Arming(clock_hz=self.clock_hz, strapped=self.arm_strapped)
        m.d.comb += [
            arming.arm.eq(self.arm),
            arming.safe.eq(self.safe),
            arming.disarm.eq(self.safety_disarm_strobe),
            self.contactor.eq(arming.contactor),
            self.safety_arming_contactor.eq(arming.contactor),
            self.safety_arming_armed.eq(arming.armed),
        ]
        return arming

    def _fluid(self, m, removal):
        """Converter and fluid detector; returns whether there is news of the fluid."""
        sampler = Sampler(clock_hz=self.clock_hz)
        m.submodules.sampler = EnableInserter(self.fluid_control_convert)(sampler)
        m.submodules.fluid = fluid = FluidDetector()
        m.d.comb += [
            self.adc_select.eq(sampler.adc_select),
            self.adc_clock.eq(sampler.adc_clock),
            self.adc_command.eq(sampler.adc_command),
            sampler.adc_data.eq(self.adc_data),
            self.fluid_voltage.eq(sampler.voltage),
            removal.sample.eq(sampler.voltage),
            removal.sample_valid.eq(sampler.voltage_valid & self.fluid_control_convert),
            fluid.sample.eq(sampler.fluid),
            fluid.sample_valid.eq(sampler.fluid_valid & self.fluid_control_convert),
            *(getattr(fluid, name).eq(getattr(self, f"fluid_{name}"))
              for name in ("threshold_0", "threshold_1", "threshold_2", "hysteresis")),
            fluid.lowest.eq(self.fluid_bounds_lowest),
            fluid.highest.eq(self.fluid_bounds_highest),
            fluid.manual.eq(self.fluid_control_manual),
            fluid.manual_class.eq(self.fluid_control_manual_class),
            self.fluid_level.eq(fluid.level),
            self.fluid_status_class.eq(fluid.class_),
            *(getattr(self, f"fluid_status_{name}").eq(getattr(fluid, name))
              for name in ("measured", "known", "broken_low", "broken_high", "disordered")),
            self.fluid_status_fault.eq(sampler.fault),
        ]
        state = Cat(fluid.class_, fluid.measured, fluid.known, fluid.broken_low, fluid.broken_high,
                    fluid.disordered, sampler.fault)
        before = Signal(len(state))
        m.d.sync += before.eq(state)
        return state != before

    def _law(self, m, law, removal, retraction, condition):
        """Feed at the front by the mean gap voltage."""
        m.d.comb += [
            removal.on.eq(self.law_control_measure & self.power_control_machining),
            # A short and the way back and forth tell nothing of the stock ahead.
            removal.discard.eq((retraction.state != State.FRONT) | self.gap_status_shorted
                               | self.safe),
            removal.hold.eq(retraction.hold | ~retraction.run | retraction.crowded),
            removal.reference.eq(condition.law_reference_drop),
            removal.no_load.eq(condition.law_no_load),
            removal.ratio_min.eq(self.law_bounds_lowest),
            removal.ratio_max.eq(self.law_bounds_highest),
            law.law.eq(self.law_control_law),
            law.reference.eq(condition.law_reference_voltage),
            self.law_voltage_mean.eq(removal.mean),
            self.law_voltage_drop.eq(removal.drop),
            self.law_feed.eq(law.feed),
        ]
        for name in ("mean", "known", "ratio"):
            m.d.comb += getattr(law, name).eq(getattr(removal, name))
        for name in ("unit", "window", "least"):
            m.d.comb += getattr(removal, name).eq(getattr(self, f"law_{name}"))
        for name in ("gain", "highest"):
            m.d.comb += getattr(law, name).eq(getattr(self, f"law_{name}"))
        for name in ("ratio", "windows", "known"):
            m.d.comb += getattr(self, f"law_status_{name}").eq(getattr(removal, name))

    def _guard(self, m, feed, ramp, path, retraction, drop, faults):
        """Whether registers of the motion are damaged, and which: latched for firmware."""
        m.submodules.conservation = conservation = Conservation()
        m.d.comb += [
            conservation.command.eq(feed.command), conservation.position.eq(path.position),
            conservation.stored.eq(ramp.stored), conservation.ps.eq(feed.ps),
            conservation.pp.eq(ramp.pp), conservation.reverse.eq(retraction.reverse),
            conservation.drop.eq(drop),
        ]
        found = Cat(faults.pop("damaged"), path.damaged_word, path.damaged_segment,
                    path.damaged_place, conservation.damaged)
        told = Cat(self.safety_damage_axes, self.safety_damage_word, self.safety_damage_segment,
                   self.safety_damage_place, self.safety_damage_pulses)
        m.d.sync += told.eq(Mux(self.safety_clear_strobe, found, told | found))
        faults["guard"] = [found.any()]

    def _safety(self, m, interlock, faults):
        """Interlock and watchdog: the one place that decides whether outputs are safe."""
        m.submodules.watchdog = watchdog = Watchdog(clock_hz=self.clock_hz)
        m.d.comb += [
            watchdog.pet.eq(self.safety_pet_strobe),
            watchdog.key.eq(self.safety_pet),
            self.safety_period.eq(watchdog.limit),
            self.safety_watch_asked.eq(watchdog.asked),
            self.safety_watch_open.eq(watchdog.open),
            self.silent.eq(watchdog.silent),
            interlock.discharging.eq(self.power_control_machining),
            interlock.fluid_required.eq(self.safety_fluid),
            interlock.watchdog.eq(watchdog.expired),
            interlock.memory.eq(self.memory_damaged),
            interlock.stop.eq(self.safety_stop_strobe),
            interlock.clear.eq(self.safety_clear_strobe),
            interlock.key.eq(self.safety_clear),
            interlock.leave.eq(self.safety_leave_strobe),
            interlock.leave_key.eq(self.safety_leave),
            self.safe.eq(interlock.safe),
            self.safety_live.eq(interlock.live),
            self.safety_latched.eq(interlock.latched),
            self.safety_status_safe.eq(interlock.safe),
            self.safety_status_first.eq(interlock.first),
            self.safety_status_simultaneous.eq(interlock.simultaneous),
            self.safety_status_blamed.eq(interlock.blamed),
            self.safety_limits_low.eq(interlock.at_low),
            self.safety_limits_high.eq(interlock.at_high),
            self.safety_limits_leaving.eq(interlock.leaving),
        ]
        for name in ("estop", "drive_fault", "limit_low", "limit_high", "fluid_low"):
            m.d.comb += getattr(interlock, name).eq(getattr(self, name))
        for name, flags in faults.items():
            m.d.comb += getattr(interlock, name).eq(Cat(flags))
