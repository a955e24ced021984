# SPDX-License-Identifier: Apache-2.0
"""The gap: classes of discharges, signals for the motion, and the fluid."""

from collections.abc import Mapping

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.gap.conduction import Conduction
from rtl.gap.contact import ContactGuard
from rtl.gap.discriminator import Discriminator
from rtl.gap.feed_mode import FeedCalculator, FeedMode
from rtl.gap.fluid import FluidDetector
from rtl.gap.mean_level import MeanLevel
from rtl.gap.preset_counter import PresetCounters
from rtl.gap.reference import References
from rtl.gap.removal import RemovalDetector
from rtl.gap.sampler import Sampler
from rtl.gap.scope import GapScope
from rtl.gap.short import ShortDetector
from rtl.motion.motion import STEERING
from rtl.power.condition import Condition

__all__ = ["Gap"]


class Gap(wiring.Component):
    """Discriminator, short detector, contact guard, servo, feed modes, fluid and oscilloscope.

    Parameters
    ----------
    registers : mapping of str to wiring.Signature
        Register blocks ``gap``, ``servo``, ``fluid``, ``feed`` and ``scope`` as on the bus, and
        those in which a condition is staged.
    clock_hz : int
        Frequency of the clock.
    scope_depth : int
        Entries of the oscilloscope (``rtl.gap.scope``); 0 for none.

    Members
    -------
    registers : In(Signature of the five blocks)
        See ``softcore/regmap.py``.
    motion : Out(STEERING)
        Signals to and from the motion.
    state : In(4), cycle : In(32)
        State of the retraction, and the clock count, for the oscilloscope.
    condition : In(rtl.power.condition.in_force)
        Words of the condition in force.
    safe, machining, in_position : In(1)
        Outputs are safe; the discharge is on; every axis is in position.
    waiting : In(1)
        Power supply and comparators do not follow the condition yet. The servo holds, and mean
        and distance stand still. Ss by pulses goes on; Ss by the mean voltage begins anew.
    wanted : In(1)
        Firmware wants the discharge, whether it is allowed or not.
    on, sense, forget : In(1)
        Gates of both sources; the classes of the last pulses are out of date (``rtl.power.power``).
    high, arc, short, current, noise : In(1)
        Comparators: above the open level, below the arc level, below the short level, current
        flows (``sense`` lowers its threshold), the discharge has high frequencies.
    reference : Out(3)
        Streams that set the first three levels.
    adc_select, adc_clock, adc_command : Out(1), adc_data : In(1)
        Converter of gap voltage and fluid cell.
    look : Out(1)
        Sensing pulses are wanted while the discharge is off.
    abnormal : Out(1)
        The pulse under way is an arc or a short.
    ignited : Out(1)
        The main pulse under way has ignited.
    trip : Out(1)
        Contact, and the axes are too fast to stop: a cause of the interlock.
    fluid_news : Out(1)
        The class, the fluid's level or a fault of its detector has changed.

    Attributes
    ----------
    short_detector : ShortDetector
        For proofs to look at.
    """

    BLOCKS = ("gap", "servo", "fluid", "feed", "scope")

    def __init__(self, *, registers: Mapping[str, wiring.Signature], clock_hz: int,
                 scope_depth: int = 4096):
        self.clock_hz = clock_hz
        self.scope = GapScope(depth=scope_depth) if scope_depth else None
        self.short_detector = ShortDetector()
        self.voltage_valid = Signal()
        self.converted = Signal()   # the converter ran in the last clock, so a strobe is new
        super().__init__({
            "registers": In(wiring.Signature({name: Out(registers[name])
                                              for name in self.BLOCKS})),
            "motion": Out(STEERING), "state": In(4), "cycle": In(32),
            "condition": In(Condition.in_force(registers)),
            **{name: In(1) for name in (
                "safe", "machining", "in_position", "waiting", "wanted", "on", "sense", "forget",
                "high", "arc", "short", "current", "noise", "adc_data")},
            "reference": Out(3),
            **{name: Out(1) for name in ("adc_select", "adc_clock", "adc_command", "look",
                                         "abnormal", "ignited", "trip", "fluid_news")},
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.discriminator = discriminator = Discriminator()
        m.submodules.short = short = self.short_detector
        m.submodules.contact = guard = ContactGuard(clock_hz=self.clock_hz)
        m.submodules.references = references = References()
        m.submodules.counters = counters = PresetCounters()
        m.submodules.removal = removal = RemovalDetector()
        m.submodules.feed_mode = calculator = FeedCalculator()
        discharging = Signal()
        m.d.comb += discharging.eq(self.machining & ~self.safe & ~self.motion.quiet)
        self._discriminate(m, discriminator, references)
        self._shorts(m, discriminator, short, discharging)
        self._mean_level(m, short, discharging)
        self._contact(m, discriminator, short, guard)
        self._servo(m, discriminator, short, counters, calculator, discharging)
        self._voltage(m, removal)
        self._feed(m, calculator, removal, short, discharging)
        sampler = self._fluid(m, removal)
        if self.scope is not None:
            m.submodules.scope = self.scope
            self._scope(m, discriminator, short, sampler)
        return m

    def _discriminate(self, m, discriminator, references):
        """The class of each pulse."""
        registers = self.registers.gap
        gates = Signal(2)  # delayed as in the pads, which have a register too
        m.d.sync += gates.eq(Cat(self.on, self.sense))
        # The condition may change in the clock in which its last pulse gets its class.
        m.d.sync += discriminator.delay_least.eq(self.condition.gap_delay_least)
        m.d.sync += [
            discriminator.use_current.eq(self.condition.gap_criteria_current),
            discriminator.use_delay.eq(self.condition.gap_criteria_delay),
            discriminator.use_noise.eq(self.condition.gap_criteria_noise),
            discriminator.relaxation.eq(self.condition.gap_criteria_relaxation),
        ]
        m.d.sync += discriminator.from_ignition.eq(self.condition.power_wait_time != 0)
        m.d.comb += [
            discriminator.on.eq(gates[0]), discriminator.sense.eq(gates[1]),
            discriminator.high.eq(self.high), discriminator.arc.eq(self.arc),
            discriminator.short.eq(self.short), discriminator.current.eq(self.current),
            discriminator.noise.eq(self.noise),
            discriminator.blanking.eq(registers.blanking),
            discriminator.settle.eq(registers.settle), discriminator.confirm.eq(registers.confirm),
            registers.open_count.eq(discriminator.open_count),
            registers.ok_count.eq(discriminator.ok_count),
            registers.dame_count.eq(discriminator.dame_count),
            registers.short_count.eq(discriminator.short_count),
            registers.status_last.eq(discriminator.last),
            self.abnormal.eq(discriminator.abnormal), self.ignited.eq(discriminator.ignited),
            references.level[0].eq(self.condition.gap_reference_open),
            references.level[1].eq(self.condition.gap_reference_arc),
            references.level[2].eq(self.condition.gap_reference_short),
            self.reference.eq(references.stream),
        ]

    def _shorts(self, m, discriminator, short, discharging):
        """The short signal Ss, from pulses shorted by the voltage or by the current."""
        registers, motion = self.registers.gap, self.motion
        m.submodules.conduction = conduction = Conduction()
        by_current = Signal()
        m.d.comb += [
            short.sample.eq(discriminator.sample),
            conduction.on.eq(discriminator.on), conduction.sense.eq(discriminator.sense),
            conduction.current.eq(self.current), conduction.delay.eq(registers.short_current),
            by_current.eq(registers.short_current != 0),
            short.sample_shorted.eq(Mux(by_current, conduction.last,
                                        discriminator.sample_shorted)),
            short.shorted_now.eq(Mux(by_current, conduction.now, discriminator.shorted_now)),
            short.needed.eq(registers.short_ratio_needed),
            short.window.eq(registers.short_ratio_window),
            short.duration.eq(registers.short_duration),
            short.clear_needed.eq(registers.clear_needed),
            short.restart.eq(self.forget),
            registers.status_shorted.eq(short.shorted),
            # With the discharge off a short counts as contact.
            motion.shorted.eq(short.shorted & self.machining),
            motion.completed.eq(short.completed),
            motion.discharging.eq(discharging),
        ]

    def _mean_level(self, m, short, discharging):
        """The short signal Ss by the mean voltage."""
        registers = self.registers.gap
        m.submodules.mean_level = mean = MeanLevel()
        m.d.comb += [
            mean.sample.eq(self.registers.fluid.voltage), mean.sample_valid.eq(self.voltage_valid),
            mean.pulse.eq(self.on),
            mean.on.eq(discharging & ~short.shorted & ~self.waiting),
            mean.level.eq(registers.short_mean), mean.window.eq(registers.short_mean_time),
            short.by_mean.eq(registers.short_mean != 0), short.mean_low.eq(mean.low),
        ]

    def _contact(self, m, discriminator, short, guard):
        """Contact of electrode and work while the discharge is off."""
        registers, motion = self.registers.gap, self.motion
        m.d.comb += [
            guard.off.eq(~self.machining), guard.safe.eq(self.safe), guard.quiet.eq(motion.quiet),
            guard.wanted.eq(motion.wanted), guard.away.eq(motion.away),
            guard.moving.eq(motion.moving), guard.reverse.eq(motion.reverse),
            guard.fast.eq(motion.fast), guard.settled.eq(self.in_position),
            guard.lag_time.eq(registers.lag_time), guard.clear_needed.eq(registers.clear_needed),
            guard.sample.eq(discriminator.sample & discriminator.sample_sensing),
            guard.sample_shorted.eq(short.sample_shorted), guard.shorted.eq(short.shorted),
            motion.wait.eq(guard.wait), motion.contact.eq(guard.contact),
            self.look.eq(guard.look), self.trip.eq(guard.trip),
        ]

    def _servo(self, m, discriminator, short, counters, calculator, discharging):
        """Steps back and forward, by counted classes or by the mean voltage."""
        registers, motion, condition = self.registers.servo, self.motion, self.condition
        stepped = calculator.mode == FeedMode.ZERO
        m.d.comb += [
            counters.sample.eq(discriminator.sample & ~discriminator.sample_sensing),
            counters.kind.eq(discriminator.kind),
            counters.dame.eq(condition.servo_presets_dame),
            counters.open.eq(condition.servo_presets_open),
            counters.ok.eq(condition.servo_presets_ok),
            counters.mode.eq(condition.servo_counting_mode),
            counters.window.eq(condition.servo_counting_window),
            counters.weight.eq(condition.servo_counting_weight),
            counters.period.eq(registers.period),
            # Without discharge pulses there is nothing to count.
            counters.freeze.eq(motion.held | short.shorted | ~discharging | self.waiting
                               | ~registers.control),
            registers.status_dame.eq(counters.dame_full),
            registers.status_open.eq(counters.open_full),
            registers.status_held.eq(motion.held),
            motion.servo.eq(registers.control | stepped),
            motion.step.eq(Mux(stepped, 1, condition.servo_step)),
        ]
        # In registers, to meet timing: the bounds of the motion are computed from them.
        m.d.sync += [motion.up.eq(Mux(stepped, calculator.up, counters.up)),
                     motion.down.eq(Mux(stepped, calculator.down, counters.down))]
        with m.If(counters.up):
            m.d.sync += registers.ups.eq(registers.ups + 1)
        with m.If(counters.down):
            m.d.sync += registers.downs.eq(registers.downs + 1)

    def _voltage(self, m, removal):
        """Mean gap voltage, and its drop per unit distance."""
        registers, motion = self.registers.feed, self.motion
        # Good: neither arc nor short, and the comparators see a main pulse. A clock later, for the
        # gate depends on every cause of ``safe``, and the sums are wide.
        m.d.sync += removal.burning.eq(self.on & self.current & ~self.arc & ~self.short)
        m.d.comb += [
            removal.on.eq(registers.control_measure & self.wanted),
            # A short, and the way back and forth, tell nothing about the stock ahead.
            removal.discard.eq(~motion.at_front | self.registers.gap.status_shorted | self.safe),
            removal.hold.eq(motion.paused | self.waiting),
            removal.pulse.eq(motion.pulse), removal.rate.eq(motion.rate),
            removal.shares.eq(registers.control_shares),
            removal.share.eq(self.condition.feed_share),
            removal.reference.eq(self.condition.feed_reference_drop),
            removal.no_load.eq(self.condition.feed_no_load),
            removal.ratio_min.eq(registers.bounds_lowest),
            removal.ratio_max.eq(registers.bounds_highest),
            removal.unit.eq(registers.unit), removal.window.eq(registers.window),
            removal.least.eq(registers.least),
            registers.voltage_mean.eq(removal.mean), registers.voltage_drop.eq(removal.drop),
            registers.status_ratio.eq(removal.ratio), registers.status_windows.eq(removal.windows),
            registers.status_known.eq(removal.known),
        ]

    def _feed(self, m, calculator, removal, short, discharging):
        """Feed at the front by the mean gap voltage."""
        registers, motion = self.registers.feed, self.motion
        m.d.comb += [
            calculator.mode.eq(registers.control_mode),
            calculator.rate.eq(motion.rate),
            calculator.reference.eq(self.condition.feed_reference_voltage),
            calculator.gain.eq(registers.gain), calculator.highest.eq(registers.highest),
            calculator.mean.eq(removal.mean), calculator.known.eq(removal.known),
            calculator.ratio.eq(removal.ratio),
            calculator.held.eq(motion.held | short.shorted | ~discharging | self.waiting),
            registers.in_force.eq(calculator.feed),
            motion.feed.eq(calculator.feed),
        ]

    def _fluid(self, m, removal):
        """Converter and fluid detector; return the converter's front end.

        While the converter runs for the oscilloscope alone, no other block sees its samples.
        """
        registers = self.registers.fluid
        sampler = Sampler(clock_hz=self.clock_hz)
        runs = registers.control_convert | (0 if self.scope is None else self.scope.runs)
        m.submodules.sampler = EnableInserter(runs)(sampler)
        m.d.sync += self.converted.eq(runs)
        fault = Signal()    # of the converter, when it last ran for more than the oscilloscope
        was = Signal()      # ``fault`` a clock ago
        m.d.comb += fault.eq(Mux(registers.control_convert, sampler.fault, was))
        m.d.sync += was.eq(fault)
        m.submodules.fluid = fluid = FluidDetector()
        m.d.comb += [
            self.adc_select.eq(sampler.adc_select), self.adc_clock.eq(sampler.adc_clock),
            self.adc_command.eq(sampler.adc_command), sampler.adc_data.eq(self.adc_data),
            registers.voltage.eq(sampler.voltage),
            removal.sample.eq(sampler.voltage),
            removal.sample_valid.eq(self.voltage_valid),
            self.voltage_valid.eq(sampler.voltage_valid & registers.control_convert),
            fluid.sample.eq(sampler.fluid),
            fluid.sample_valid.eq(sampler.fluid_valid & registers.control_convert),
            fluid.threshold_0.eq(registers.threshold_0),
            fluid.threshold_1.eq(registers.threshold_1),
            fluid.threshold_2.eq(registers.threshold_2), fluid.hysteresis.eq(registers.hysteresis),
            fluid.lowest.eq(registers.bounds_lowest), fluid.highest.eq(registers.bounds_highest),
            fluid.manual.eq(registers.control_manual),
            fluid.manual_class.eq(registers.control_manual_class),
            registers.level.eq(fluid.level),
            registers.status_class.eq(fluid.class_),
            registers.status_measured.eq(fluid.measured), registers.status_known.eq(fluid.known),
            registers.status_broken_low.eq(fluid.broken_low),
            registers.status_broken_high.eq(fluid.broken_high),
            registers.status_disordered.eq(fluid.disordered),
            registers.status_fault.eq(fault),
        ]
        state = Cat(fluid.class_, fluid.measured, fluid.known, fluid.broken_low, fluid.broken_high,
                    fluid.disordered, fault)
        before = Signal(len(state))
        m.d.sync += before.eq(state)
        m.d.comb += self.fluid_news.eq(state != before)
        return sampler

    def _scope(self, m, discriminator, short, sampler):
        """The oscilloscope sees what the discriminator sees, and the samples and states."""
        scope, registers = self.scope, self.registers.scope
        entry = scope.entry
        m.d.comb += [
            scope.high.eq(discriminator.high), scope.arc.eq(discriminator.arc),
            scope.short.eq(discriminator.short), scope.current.eq(discriminator.current),
            scope.noise.eq(discriminator.noise), scope.on.eq(discriminator.on),
            scope.sense.eq(discriminator.sense), scope.sample.eq(discriminator.sample),
            scope.sample_sensing.eq(discriminator.sample_sensing),
            scope.kind.eq(discriminator.kind),
            scope.voltage.eq(sampler.voltage), scope.voltage_valid.eq(sampler.voltage_valid
                                                                        & self.converted),
            scope.shorted.eq(short.shorted), scope.state.eq(self.state),
            scope.cycle.eq(self.cycle),
            scope.arm.eq(registers.order_arm & registers.order_strobe),
            scope.stop.eq(registers.order_stop & registers.order_strobe),
            scope.force.eq(registers.order_force & registers.order_strobe),
            scope.source.eq(registers.trigger_source), scope.classes.eq(registers.trigger_classes),
            scope.level.eq(registers.trigger_level), scope.after.eq(registers.after),
            registers.status_recording.eq(scope.recording), registers.status_count.eq(scope.count),
            registers.depth.eq(scope.depth), registers.time.eq(scope.time),
            scope.place.eq(registers.place), scope.choose.eq(registers.place_strobe),
            scope.following.eq(registers.entry_rest_strobe),
            registers.entry_stamp.eq(entry.stamp), registers.entry_voltage.eq(entry.voltage),
            registers.entry_sampled.eq(entry.sampled), registers.entry_high.eq(entry.high),
            registers.entry_arc.eq(entry.arc), registers.entry_short.eq(entry.short),
            registers.entry_current.eq(entry.current), registers.entry_noise.eq(entry.noise),
            registers.entry_on.eq(entry.on), registers.entry_sense.eq(entry.sense),
            registers.entry_pulse.eq(entry.pulse),
            registers.entry_rest_shorted.eq(entry.shorted),
            registers.entry_rest_state.eq(entry.state),
        ]
