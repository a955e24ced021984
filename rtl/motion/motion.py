# SPDX-License-Identifier: Apache-2.0
"""From the commanded path to axis pulses, as in the first patent, and its retraction."""

from collections.abc import Mapping

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.events import Happened
from rtl.motion.conservation import Conservation
from rtl.motion.distribution import Distributor
from rtl.motion.feed import PathPulseGenerator
from rtl.motion.feed_forward import FORWARD_BITS, FeedForward
from rtl.motion.path import SegmentWindow
from rtl.motion.ramp import Ramp
from rtl.motion.retraction import Retraction
from rtl.motion.retraction_members import DATA
from rtl.states import State

__all__ = ["STEERING", "Motion"]

# Signals between the gap and the motion; directions are the gap's.
STEERING = wiring.Signature({
    "shorted": Out(1),      # Ss, with the discharge on
    "completed": Out(1),    # the sample that completed it
    "discharging": Out(1),  # there are main pulses, or would be
    "wait": Out(1),         # discharge off, gap not known to be open: no forward pulse
    "contact": Out(1),      # discharge off, and the electrode touches the work
    "servo": Out(1),        # forward by steps only
    "up": Out(1), "down": Out(1),   # a step back, a step forward
    "step": Out(16),        # its length, pulses
    "feed": Out(30),        # at the front, 2**-32 pulse/clock

    "rate": In(30),         # F of the segment, 2**-32 pulse/clock
    "pulse": In(1),         # a path pulse forward, at the front
    "at_front": In(1),      # machining: neither retracting nor re-advancing
    "paused": In(1),        # on hold, stopped, or firmware behind
    "held": In(1),          # steps are lost
    "quiet": In(1),         # halted: no pulses at all
    "sensing": In(1),       # away from the front: sensing pulses only
    "wanted": In(1),        # forward pulses would come if ``wait`` and ``contact`` were low
    "away": In(1),          # the segment leads away from the work
    "moving": In(1), "reverse": In(1),
    "fast": In(1),          # above the start/stop speed
})


class Motion(wiring.Component):
    """Zc to axis pulses Pi, and the retraction that controls them.

    The generator makes path pulses Ps at the rate that the retraction allows. The ramp makes Pp of
    them. The window counts Pp along the path, and the distributor splits them over the axes. One
    path pulse back undoes one forward. ``damaged_word`` to ``damaged_rate`` say which guarded
    registers are damaged.

    Parameters
    ----------
    registers : mapping of str to wiring.Signature
        Register blocks ``path``, ``ramp`` and ``retraction``, as their owner on the bus has them.
    axes, slots : int
        See ``rtl.motion.path``.
    creep : int
        Highest rate while ``leaving``, 2**-32 pulse/clock.

    Members
    -------
    registers : In(Signature of the three blocks)
        See ``softcore/regmap.py``.
    gap : In(STEERING)
        The signals between gap and motion.
    safe, hold, abort, leaving, backpressure, in_position : In(1)
        Outputs are safe; feed hold by the operator; no path pulse in either direction; the machine
        is leaving a limit switch; firmware has not taken the events yet; every axis is in position.
    cycle : In(32)
        Clock count, for events.
    pi, pi_reverse : Out(axes)
        Axis pulses, and their direction: down.
    downwards : Out(axes)
        Axes that the segment leads down.
    forward : Out(signed(16)) x axes
        Velocity feed-forward of the axes.
    ahead : Out(1)
        It is in force.
    resting : Out(1)
        No path pulses are commanded.
    mark : Out(1)
        A retraction has ended: the axes note their overshoot from here.
    entered : Out(1)
        The front has entered another segment.
    event : Out(Happened)
        What the retraction did: each event for one clock, else the kind NONE.
    damaged_word, damaged_segment, damaged_place, damaged_pulses, damaged_rate : Out(1)
        See ``rtl.motion.path``, ``rtl.motion.conservation`` and ``rtl.motion.ramp``.

    Attributes
    ----------
    feed, ramp, path, distributor, retraction, conservation, feed_forward
        The blocks, for tests and proofs to look at.
    """

    BLOCKS = ("path", "ramp", "retraction")
    RETRACTION = Retraction  # a proof replaces it by its own

    def __init__(self, *, registers: Mapping[str, wiring.Signature], axes: int = 3,
                 slots: int = 64, creep: int = 0):
        self.creep = creep
        self.feed = PathPulseGenerator()
        self.ramp = Ramp()
        self.path = SegmentWindow(axes=axes, slots=slots)
        self.distributor = Distributor(axes=axes)
        self.retraction = self.RETRACTION()
        self.conservation = Conservation()
        self.feed_forward = FeedForward(axes=axes)
        super().__init__({
            "registers": In(wiring.Signature({name: Out(registers[name])
                                              for name in self.BLOCKS})),
            "gap": In(STEERING),
            **{name: In(1) for name in ("safe", "hold", "abort", "leaving", "backpressure",
                                        "in_position")},
            "cycle": In(32),
            "pi": Out(axes), "pi_reverse": Out(axes), "downwards": Out(axes),
            "forward": Out(signed(FORWARD_BITS)).array(axes), "ahead": Out(1), "resting": Out(1),
            "mark": Out(1), "entered": Out(1), "event": Out(Happened),
            **{f"damaged_{what}": Out(1)
               for what in ("word", "segment", "place", "pulses", "rate")},
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.feed = self.feed
        m.submodules.ramp = self.ramp
        m.submodules.path = self.path
        m.submodules.distributor = self.distributor
        m.submodules.retraction = self.retraction
        m.submodules.conservation = self.conservation
        m.submodules.feed_forward = self.feed_forward

        load, drop = Signal(), Signal()
        m.d.comb += [
            load.eq(self.registers.path.origin_strobe & self.ramp.rest),
            # Pulses still stored at a contact, or when the outputs become safe, are never moved.
            drop.eq(self.safe | self.gap.contact),
        ]
        target = self._pulses(m, load, drop)
        self._window(m, load, drop)
        self._ahead(m, target)
        self._program(m, load)
        self._tell(m)
        self._guard(m, drop)
        return m

    def _pulses(self, m, load, drop):
        """Path pulses Ps at the rate of the retraction, which is returned, and the ramp: Pp."""
        feed, ramp, retraction = self.feed, self.ramp, self.retraction
        registers, back = self.registers.ramp, retraction.reverse
        target = retraction.target
        if self.creep:  # the highest rate while the machine leaves a limit switch
            creeps = Signal()
            m.d.sync += creeps.eq(self.leaving & (target > self.creep))
            target = Mux(creeps, self.creep, target)
        m.d.comb += [
            feed.rate.eq(target),
            feed.go.eq(retraction.go),
            feed.reverse.eq(retraction.reverse),
            feed.bound.eq(retraction.bound),
            feed.pull.eq(ramp.pull),
            feed.load.eq(load | drop),
            feed.load_value.eq(Mux(load, 0, self.path.position)),

            # The direction changes at rest, and no pulse comes in the 6 clocks that follow.
            ramp.start_rate.eq(Mux(back, registers.back_start_rate, registers.start_rate)),
            ramp.acceleration.eq(Mux(back, registers.back_acceleration, registers.acceleration)),
            ramp.target.eq(target),
            ramp.brake.eq(retraction.brake),
            ramp.ps.eq(feed.ps),
            ramp.room.eq(feed.room),
            ramp.ready.eq(self.path.ready),
            ramp.drop.eq(drop),
        ]
        return target

    def _ahead(self, m, target):
        """Velocity feed-forward of the axes."""
        ahead, ramp, path = self.feed_forward, self.ramp, self.path
        # Up to the start/stop speed the ramp tells no rate: pulses come at the target, or not.
        rate = Signal(30)
        with m.If(ramp.fast):
            m.d.sync += rate.eq(ramp.speed)
        with m.Elif(self.retraction.go & self.feed.room):
            m.d.sync += rate.eq(Mux(target < ramp.start_rate, target, ramp.start_rate))
        with m.Else():
            m.d.sync += rate.eq(0)
        m.d.comb += [
            ahead.rate.eq(rate),
            ahead.reverse.eq(self.retraction.reverse),
            ahead.lead.eq(self.registers.ramp.lead),
            ahead.ready.eq(path.ready),
            ahead.length.eq(path.length), ahead.arc.eq(path.arc), ahead.major.eq(path.major),
            ahead.minor.eq(path.minor), ahead.divisor.eq(path.divisor),
            ahead.pace.eq(self.distributor.pace), ahead.along.eq(self.distributor.along),
            ahead.across.eq(self.distributor.across),
            *(mine.eq(its) for mine, its in zip(self.forward, ahead.speed, strict=True)),
            self.ahead.eq(ahead.ahead),
            self.resting.eq(rate == 0),
        ]
        for its, mine in zip(path.travel, ahead.travel, strict=True):
            wiring.connect(m, its, mine)

    def _window(self, m, load, drop):
        """Pp along the segments, and over the axes: Pi."""
        path, registers = self.path, self.registers.path
        self.distributor.follow(m, path)
        m.d.comb += [
            path.select.eq(registers.slot_select),
            path.select_strobe.eq(registers.slot_select_strobe),
            path.data.eq(registers.slot_data),
            path.data_strobe.eq(registers.slot_data_strobe),
            path.pulse.eq(self.ramp.pp & ~drop),
            path.reverse.eq(self.retraction.reverse),
            path.ahead.eq(registers.ahead),
            path.load.eq(load),
            path.load_slot.eq(registers.origin),
            path.fast_ahead_new.eq(registers.fast_ahead),
            path.fast_behind_new.eq(registers.fast_behind),
            path.fast_ahead_rate_new.eq(registers.fast_ahead_rate),
            path.fast_behind_rate_new.eq(registers.fast_behind_rate),
            path.fast_slot.eq(registers.fast_slot),
            path.fast_strobe.eq(registers.fast_slot_strobe),
            path.pace.eq(registers.pace),
            path.pace_slot.eq(registers.pace_slot),
            path.pace_strobe.eq(registers.pace_slot_strobe),

            self.distributor.restart.eq(load),
            self.pi.eq(self.distributor.pi),
            self.pi_reverse.eq(self.distributor.pi_reverse),
            self.downwards.eq(Cat(travel.negative for travel in path.travel)),
        ]

    def _program(self, m, load):
        """Inputs of the retraction."""
        retraction, registers = self.retraction, self.registers.retraction
        ramp, path, gap = self.ramp, self.path, self.gap
        order = registers.command_strobe
        m.d.comb += [
            *(getattr(retraction, name).eq(getattr(registers, name)) for name in DATA),
            retraction.commit_valid.eq(registers.commit),
            retraction.commit_strobe.eq(registers.commit_strobe),
            retraction.run.eq(registers.control_run & ~self.abort),
            retraction.hold.eq(registers.control_hold | self.hold),
            retraction.retract.eq(order & registers.command_retract),
            retraction.release.eq(order & registers.command_release),
            retraction.backpressure.eq(self.backpressure),
            retraction.safe.eq(self.safe),
            retraction.in_position.eq(self.in_position),
            retraction.cycle.eq(self.cycle),

            retraction.servo.eq(gap.servo), retraction.step.eq(gap.step),
            retraction.up.eq(gap.up), retraction.down.eq(gap.down),
            retraction.shorted.eq(gap.shorted), retraction.completed.eq(gap.completed),
            retraction.discharging.eq(gap.discharging),
            retraction.wait.eq(gap.wait), retraction.contact.eq(gap.contact),
            retraction.feed.eq(gap.feed),

            retraction.load.eq(load),
            retraction.highest.eq(path.highest),
            retraction.ahead.eq(self.registers.path.ahead),
            retraction.behind.eq(self.registers.path.behind),
            retraction.back_limit.eq(self.registers.path.back_limit),
            retraction.fast_ahead.eq(path.fast_ahead),
            retraction.fast_behind.eq(path.fast_behind),
            retraction.fast_ahead_rate.eq(path.fast_ahead_rate),
            retraction.fast_behind_rate.eq(path.fast_behind_rate),
            retraction.ready.eq(path.ready),
            retraction.command.eq(self.feed.command),
            retraction.position.eq(path.position),
            retraction.front.eq(path.front),
            retraction.pp.eq(ramp.pp), retraction.rest.eq(ramp.rest),
            retraction.steady.eq(ramp.steady), retraction.distance.eq(ramp.distance),
        ]

    def _tell(self, m):
        """Outputs to firmware, the gap and the axes."""
        retraction, ramp, path, gap = self.retraction, self.ramp, self.path, self.gap
        told, status = self.registers.retraction, self.registers.path
        m.d.comb += [
            status.command.eq(self.feed.command),
            status.position.eq(path.position),
            status.front.eq(path.front),
            status.slot.eq(path.slot),
            status.status_moving.eq(~ramp.rest),
            status.status_reverse.eq(retraction.reverse),
            status.status_in_position.eq(self.in_position),
            status.status_state.eq(retraction.state),
            status.status_backpressure.eq(self.backpressure),
            told.start.eq(retraction.start),
            told.first.eq(retraction.first),
            told.burst.eq(retraction.burst),

            gap.rate.eq(path.rate),
            gap.pulse.eq(path.pulse & ~path.reverse & (retraction.state == State.FRONT)),
            gap.at_front.eq(retraction.state == State.FRONT),
            gap.paused.eq(retraction.hold | ~retraction.run | self.backpressure),
            gap.held.eq(retraction.held),
            gap.quiet.eq(retraction.quiet),
            gap.sensing.eq(retraction.sensing),
            gap.wanted.eq(retraction.wanted & self.feed.room),
            gap.away.eq(path.away),
            gap.moving.eq(~ramp.rest),
            gap.reverse.eq(retraction.reverse),
            gap.fast.eq(ramp.fast),

            self.mark.eq(retraction.mark),
            self.entered.eq(path.entered),
            self.event.eq(retraction.event),
        ]

    def _guard(self, m, drop):
        """Whether guarded registers are damaged."""
        conservation, path = self.conservation, self.path
        m.d.comb += [
            conservation.command.eq(self.feed.command), conservation.position.eq(path.position),
            conservation.stored.eq(self.ramp.stored), conservation.ps.eq(self.feed.ps),
            conservation.pp.eq(self.ramp.pp), conservation.reverse.eq(self.retraction.reverse),
            conservation.drop.eq(drop),
            self.damaged_word.eq(path.damaged_word),
            self.damaged_segment.eq(path.damaged_segment),
            self.damaged_place.eq(path.damaged_place),
            self.damaged_pulses.eq(conservation.damaged),
            self.damaged_rate.eq(self.ramp.damaged),
        ]
