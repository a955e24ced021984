# SPDX-License-Identifier: Apache-2.0
"""Retraction: when to go back along the path, how far, and how to come forward again."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from rtl.events import Cause, Event, Halt, Phase, Reason
from rtl.motion.figures import Figures
from rtl.motion.retraction_members import MEMBERS, STAGED
from rtl.motion.servo import Servo
from rtl.states import State

__all__ = ["Retraction"]


class _Own:
    """Signals that the parts of ``Retraction`` share; private to it."""

    def __init__(self):
        self.cause = Signal(Cause)
        self.reason = Signal(Reason)
        self.halt = Signal(Halt)
        self.returning = Signal()    # a short burst is under way
        self.moving = Signal()       # the state lets the machine move
        self.forward = Signal()      # the state is one that goes forward
        self.turns = Signal()        # the servo wants to go the other way
        self.outgoing = Signal()     # the last state was the front, or coming to rest from there
        self.ending = Signal()       # the retraction is over, and the machine comes to rest
        self.rested = Signal(7)      # at rest, in the last clocks
        self.at_rest = Signal()
        self.announce = Signal()     # the state just entered has an event of its own to report
        self.stamp = Signal(32)      # when the retraction was ordered
        self.before = Signal(30)     # rate then
        self.settle = Signal(24)
        self.prepare = Signal(range(Retraction.PREPARE + 1))
        self.walk = Signal(31)       # the operator's walk in force
        # Set by ``elaborate``: data in force, the servo, the bounds and whether they are valid, the
        # jump timer, figures for events.
        self.force = self.servo = self.bounds = self.ready = self.jump_due = self.figures = None


class Retraction(wiring.Component):
    """The retraction program of the first patent, started and stepped in gateware.

    It steers the path-pulse generator and the ramp: whether pulses may come (``go``), which way,
    at what rate and to what bound. At the front it lets the segment's feed through. On a short, a
    jump or the operator's order it comes to rest, goes back, and re-advances at the high speed to
    the changeover position and at the low speed to the start point:

    * The start point BS is where machining stopped. That is ``front``, the furthest coordinate
      commanded, except under servo, which may have drawn back. The limit is measured from
      ``first``, the front at the first short of a short burst. A short burst ends when machining is
      ``gain`` pulses beyond ``first``. No pulse goes back beyond the higher of ``first - limit``
      and ``back_limit``. A jump goes back to ``front - jump_distance``, or to ``back_limit``.
    * A retraction for a short ends exactly at the pulse at which the short is gone. If the short is
      still there at the limit after ``settle`` clocks in position, the machine halts. A retraction
      for a jump or the operator ends at its distance; if the gap is short there, one for a short
      follows.
    * The re-advance changes from high to low exactly at ``BS - changeover``; if less was retracted,
      all of it is low. ``hold`` stops re-advance and machining, but never a retraction. So does
      ``backpressure``: firmware has not taken the events yet.
    * With ``walk`` the operator's retraction ends at ``front - walk``, whatever the limit is, or at
      ``back_limit``. No re-advance passes that place, and the machine stands there, with sensing
      pulses only. ``retract`` in the re-advance goes back again. So the operator walks back and
      forward along the path by new values of ``walk``; 0 leads to the front and on. A value is
      taken over at rest.
    * A short at the front or in the re-advance starts a retraction. At or below the start/stop
      speed no pulse Ps follows ``shorted``; above it, only those needed to come to rest. Without
      valid data, or at the ``repeats``th return of the short in a short burst, it halts instead.

    With ``servo`` the machine moves by strobes only: each ``down`` moves it ``step`` pulses forward
    and each ``up`` ``step`` pulses back, at the segment's feed, from where it is in that clock. It
    never leaves the loaded segments. An ``up`` that would pass ``front - limit`` or ``back_limit``
    halts instead. While ``held`` is high, strobes are lost: the servo is off, or the machine is
    not at the front, or it is on hold.

    With the discharge off ``rtl.gap.contact`` watches: no forward pulse Ps is made while ``wait``
    or ``contact`` is high, and ``contact`` in a forward state halts; stored pulses must then be
    dropped. ``wanted``: forward pulses would come if neither these two nor the bound stopped them.

    No rate is above ``highest``, the bound of the segment in which the machine is, in 2**-28
    pulse/clock (0 for no bound). Like ``feed`` it holds within the segment: a faster machine must
    have slowed down before. It has at ``fast_ahead`` and ``fast_behind``: from there on the ramp is
    at the start/stop speed, and no rate is above that of the place, so that the drives can follow
    round the corner behind it.

    ``go`` falls in the same clock as ``shorted`` rises. From a machine at rest then, the first
    reversed pulse can come ``PREPARE + 2`` clocks later. ``commit`` puts the data words in force
    together, at once at the front, or on the next return there.

    Ref: first patent (retraction conditions in the tape), Figs. 2 to 4. The rules where it is
    silent: docs/reference/retraction.md.

    Members
    -------
    state : Out(State)
        What the motion is doing.
    The others, with their units: ``rtl.motion.retraction_members``.
    """

    PREPARE = 6   # clocks until bounds and comparisons have followed a change of state
    MARGIN = 4    # pulses before a bound at which the ramp is back at the start/stop speed

    def __init__(self):
        super().__init__(MEMBERS | {"state": Out(State)})

    def elaborate(self, platform):
        m = Module()
        own = _Own()
        own.force = self._data_in_force(m)
        own.servo = self._servo(m)
        own.bounds = self._bounds(m, own)
        own.ready = self._preparation(m, own)
        self._walk(m, own)
        own.jump_due = self._jump_timer(m)
        own.figures = self._figures(m, own)
        self._motion(m, own)
        self._rate(m, own)

        with m.Switch(self.state):
            with m.Case(State.FRONT):
                self._at_the_front(m, own)
            with m.Case(State.STOPPING):
                self._stopping(m, own)
            with m.Case(State.RETRACTING):
                self._retracting(m, own)
            with m.Case(State.AT_LIMIT):
                self._at_the_limit(m, own)
            with m.Case(State.HIGH):
                self._re_advancing(m, own, Phase.HIGH, own.force["changeover"],
                                   ~own.bounds["before_changeover"], State.LOW)
            with m.Case(State.LOW):
                self._re_advancing(m, own, Phase.LOW, 0, own.bounds["at_front"], State.FRONT)
            with m.Case(State.HALTED):
                self._halted(m, own)

        self._start_and_burst(m, own)
        # These override the states; of several, the last one wins.
        with m.If(own.forward & self.contact):
            m.d.sync += self._halts(own, Halt.CONTACT)
        with m.If(self.safe):
            m.d.sync += [self.state.eq(State.HALTED), own.halt.eq(Halt.NONE), own.announce.eq(0)]
        with m.If(self.load):
            m.d.sync += [
                self.state.eq(State.FRONT), self.reverse.eq(0), own.prepare.eq(self.PREPARE),
                own.halt.eq(Halt.NONE), own.returning.eq(0), self.burst.eq(0),
                own.announce.eq(0), own.ending.eq(0),
            ]

        return m

    def _servo(self, m):
        """The gap servo, which is on at the front only."""
        m.submodules.gap_servo = servo = Servo()
        m.d.comb += [
            servo.on.eq(self.servo & (self.state == State.FRONT)),
            self.held.eq(~servo.on | self.hold | ~self.run),
            servo.up.eq(self.up),
            servo.down.eq(self.down),
            servo.step.eq(self.step),
            servo.command.eq(self.command),
        ]
        return servo

    def _preparation(self, m, own):
        """Signal that bounds and comparisons have followed the last change of state."""
        with m.If(own.prepare != 0):
            m.d.sync += own.prepare.eq(own.prepare - 1)
        return own.prepare == 0

    def _walk(self, m, own):
        """Take a new walk over at rest: in motion the bound must not come nearer than braking."""
        with m.If(self.rest & (own.walk != self.walk)):
            m.d.sync += [own.walk.eq(self.walk), own.prepare.eq(self.PREPARE)]

    def _figures(self, m, own):
        """What the events tell of a retraction: its latency, pulses and clocks."""
        m.submodules.figures = figures = Figures()
        m.d.comb += [
            figures.stopping.eq(self.state == State.STOPPING),
            figures.retracting.eq(self.state == State.RETRACTING),
            figures.moving.eq(own.moving),
            figures.steady.eq(self.steady), figures.pp.eq(self.pp),
            figures.reverse.eq(self.reverse), figures.completed.eq(self.completed),
        ]
        return figures

    def _motion(self, m, own):
        """Whether the state lets the machine move, and whether the machine is at rest."""
        state = self.state
        # ``rested`` covers 7 clocks: by then the last pulse has reached axes and comparisons.
        m.d.sync += own.rested.eq(Cat(self.rest & self.ready, own.rested))
        m.d.comb += [
            own.at_rest.eq(self.rest & own.rested.all()),
            own.forward.eq((state == State.FRONT) | (state == State.HIGH) | (state == State.LOW)),
            own.turns.eq((state == State.FRONT) & (self.reverse != own.servo.back)),
        ]
        with m.If(own.forward):
            m.d.comb += [
                self.wanted.eq(self.run & ~self.hold & own.ready & ~self.shorted & ~self.safe
                               & ~own.turns & ~self.backpressure),
                own.moving.eq(self.wanted & ~self.wait & ~self.contact),
            ]
        with m.Elif(state == State.RETRACTING):
            m.d.comb += own.moving.eq(self.run & own.ready & ~own.ending & ~self.safe
                                      & ((own.cause != Cause.SHORT) | self.shorted))
        m.d.comb += [
            self.go.eq(own.moving & ~own.bounds["enough"]),
            self.sensing.eq(~((state == State.FRONT) | ((state == State.LOW) & ~own.walk.any())
                              | (state == State.HALTED))),
            self.quiet.eq(state == State.HALTED),
        ]

    def _rate(self, m, own):
        """Rate of the state, bounded by those of the segment and of a corner."""
        force, jump = own.force, own.cause == Cause.JUMP
        wanted = Signal(30)
        with m.Switch(self.state):
            with m.Case(State.HIGH):
                m.d.comb += wanted.eq(Mux(jump, force["jump_high_rate"], force["high_rate"]))
            with m.Case(State.LOW):
                m.d.comb += wanted.eq(force["low_rate"])
            with m.Case(State.RETRACTING):
                m.d.comb += wanted.eq(Mux(jump, force["jump_rate"], force["rate"]))
            with m.Default():
                m.d.comb += wanted.eq(self.feed)
        # In registers, to meet timing: the ramp computes much with the target.
        none = (1 << len(self.highest)) - 1
        segment, corner, bound = (Signal(self.highest.shape(), name=f"{name}_bound")
                                  for name in ("segment", "corner", "rate"))
        at_corner = Mux(self.reverse, self.fast_behind_rate, self.fast_ahead_rate)
        m.d.comb += [
            segment.eq(Mux(self.highest.any(), self.highest, none)),
            corner.eq(Mux(own.bounds["near_corner"] & at_corner.any(), at_corner, none)),
        ]
        m.d.sync += [
            bound.eq(Mux(corner < segment, corner, segment)),
            self.target.eq(Mux(wanted[4:] > bound, bound << 4, wanted)),
        ]

    def _orders(self, own, why):
        """Come to rest, then go back."""
        return [self.state.eq(State.STOPPING), own.cause.eq(why), own.stamp.eq(self.cycle),
                own.before.eq(self.target)]

    def _halts(self, own, why):
        """Stop by an alarm."""
        return [self.state.eq(State.HALTED), own.halt.eq(why), own.announce.eq(1)]

    def _reports(self, kind, detail, first=0, second=0, cycle=None):
        """Tell an event, of this clock unless another is given."""
        event = self.event
        return [event.kind.eq(kind), event.detail.eq(detail), event.first.eq(first),
                event.second.eq(second), event.cycle.eq(self.cycle if cycle is None else cycle)]

    def _at_the_front(self, m, own):
        with m.If(own.announce):
            m.d.sync += own.announce.eq(0)
            m.d.comb += self._reports(Event.RESUME, 0)
        with m.If(self.run & self.shorted):
            m.d.sync += self._orders(own, Cause.SHORT)
        with m.Elif(self.run & self.retract):
            m.d.sync += self._orders(own, Cause.OPERATOR)
        with m.Elif(self.run & own.jump_due & ~self.hold):
            m.d.sync += self._orders(own, Cause.JUMP)
        with m.Elif(self.run & ~self.hold & own.servo.refused):
            m.d.sync += self._halts(own, Halt.SERVO)
        with m.Elif(own.turns & self.rest):
            m.d.sync += [self.reverse.eq(own.servo.back), own.prepare.eq(self.PREPARE)]

    def _stopping(self, m, own):
        with m.If(self.rest):
            m.d.sync += [self.reverse.eq(1), own.prepare.eq(self.PREPARE), own.ending.eq(0)]
            last = Signal()
            m.d.comb += last.eq(own.returning & (self.repeats != 0)
                                & (self.burst + 1 >= self.repeats))
            with m.If((own.cause != Cause.JUMP) & ~own.force["valid"]):
                m.d.sync += self._halts(own, Halt.NO_DATA)
            with m.Elif((own.cause == Cause.SHORT) & last):
                m.d.sync += self._halts(own, Halt.BURST)
            with m.Else():
                m.d.sync += self.state.eq(State.RETRACTING)
                m.d.comb += self._reports(Event.RETRACTION_START, own.cause, own.figures.latency,
                                          own.before, own.stamp)
            with m.If(own.cause == Cause.SHORT):
                with m.If(own.returning):
                    m.d.sync += self.burst.eq(self.burst + 1)
                with m.Else():
                    m.d.sync += [own.returning.eq(1), self.burst.eq(0), self.first.eq(self.front)]

    def _retracting(self, m, own):
        with m.If(own.ending):
            with m.If(own.at_rest):
                self._retracted(m, own)
        with m.Elif((own.cause == Cause.SHORT) & ~self.shorted):
            m.d.sync += [own.ending.eq(1), own.reason.eq(Reason.CLEARED)]
        with m.Elif(own.ready & own.bounds["at_target"] & self.rest):
            m.d.sync += [own.settle.eq(0), own.reason.eq(
                Mux(own.bounds["back_limit_wins"], Reason.PATH_START, Reason.LIMIT))]
            with m.If(own.cause == Cause.SHORT):
                m.d.sync += self.state.eq(State.AT_LIMIT)
            with m.Else():
                m.d.sync += own.ending.eq(1)

    def _retracted(self, m, own):
        """At rest at the end of the way back: halt, go back again, or come forward."""
        m.d.comb += self.mark.eq(1)
        m.d.comb += self._reports(Event.RETRACTION_END, own.reason, own.figures.pulses,
                                  own.figures.clocks)
        m.d.sync += [own.ending.eq(0), own.prepare.eq(self.PREPARE), own.announce.eq(1)]
        with m.If(own.halt != Halt.NONE):
            m.d.sync += self.state.eq(State.HALTED)
        with m.Elif(self.shorted):
            # The gap is short at the top of a jump, or again in the clock in which a short ended.
            m.d.sync += own.announce.eq(0)
            m.d.sync += self._orders(own, Cause.SHORT)
        with m.Else():
            m.d.sync += [self.reverse.eq(0), self._re_advances(own)]

    def _at_the_limit(self, m, own):
        with m.If(~self.shorted):
            m.d.sync += [self.state.eq(State.RETRACTING), own.ending.eq(1),
                         own.reason.eq(Reason.CLEARED)]
        with m.Elif(own.settle == self.settle):
            m.d.sync += [
                self.state.eq(State.RETRACTING), own.ending.eq(1),
                own.halt.eq(Mux(own.reason == Reason.PATH_START, Halt.BACK_LIMIT, Halt.LIMIT)),
            ]
        with m.Elif(self.in_position):
            m.d.sync += own.settle.eq(own.settle + 1)

    def _re_advances(self, own):
        """Come forward: at the high speed, if the changeover lies ahead."""
        return self.state.eq(Mux(own.bounds["before_changeover"], State.HIGH, State.LOW))

    def _re_advancing(self, m, own, phase, changeover, arrived, then):
        """Come forward at one of the two speeds, until ``arrived``."""
        with m.If(own.announce):
            m.d.sync += own.announce.eq(0)
            m.d.comb += self._reports(Event.READVANCE, phase, self.start - self.position,
                                      changeover)
        with m.Elif(self.run & self.shorted):
            m.d.sync += self._orders(own, Cause.SHORT)
        with m.Elif(own.ready & arrived):
            m.d.sync += [self.state.eq(then), own.announce.eq(1)]
        with m.If(self.run & self.retract & ~self.shorted):
            m.d.sync += [self._orders(own, Cause.OPERATOR), own.announce.eq(0)]

    def _halted(self, m, own):
        with m.If(own.announce & (own.halt != Halt.NONE)):
            m.d.sync += own.announce.eq(0)
            m.d.comb += self._reports(Event.HALT, own.halt)
        with m.Elif(self.release & ~self.safe):
            m.d.sync += [
                own.halt.eq(Halt.NONE), self.reverse.eq(0), own.prepare.eq(self.PREPARE),
                own.cause.eq(Cause.OPERATOR), own.returning.eq(0), self.burst.eq(0),
                own.announce.eq(1), self._re_advances(own),
            ]

    def _start_and_burst(self, m, own):
        """Keep the start point while the machine is away from it; progress ends a short burst."""
        machining = (self.state == State.FRONT) | ((self.state == State.STOPPING) & own.outgoing)
        with m.If(machining):
            m.d.sync += self.start.eq(self.position)
        m.d.sync += own.outgoing.eq(machining)
        with m.If(own.returning & (self.state == State.FRONT)
                  & ((self.position - self.first)[:32].as_signed() >= self.gain)):
            m.d.sync += [own.returning.eq(0), self.burst.eq(0)]

    def _data_in_force(self, m):
        """Take the staged words over together, at the front."""
        staged = {word: getattr(self, word) for word in STAGED}
        force = {word: Signal.like(value, name=f"{word}_in_force")
                 for word, value in staged.items()}
        force["valid"] = Signal(name="valid")
        pending = Signal()
        valid = Signal()
        with m.If(self.commit_strobe):
            m.d.sync += [pending.eq(1), valid.eq(self.commit_valid)]
        with m.Elif(pending & (self.state == State.FRONT)):
            m.d.sync += pending.eq(0)
            m.d.sync += [force[word].eq(value) for word, value in staged.items()]
            m.d.sync += force["valid"].eq(valid)
        return force

    def _bounds(self, m, own):
        """Bounds of the motion, and comparisons with them; each a few clocks late."""
        force, cause, returning, servo = own.force, own.cause, own.returning, own.servo

        def later(a, b):
            """``a`` lies further along the path than ``b`` (coordinates wrap)."""
            return (a - b)[:32].as_signed() > 0

        served = Signal(signed(32))      # the servo's goal, within the loaded segments
        with m.If(servo.back):
            m.d.sync += served.eq(Mux(later(self.behind, servo.goal), self.behind, servo.goal))
        with m.Else():
            m.d.sync += served.eq(Mux(later(servo.goal, self.ahead), self.ahead, servo.goal))

        away = self.state != State.FRONT
        walking = own.walk.any()
        stop = Signal(signed(32))        # end of the operator's walk
        reach = Signal(31)
        target = Signal(signed(32))      # end of the way back by the limit
        lowest = servo.lowest            # ... by the back limit too
        loaded = Signal(signed(32))      # ... and within the loaded segments
        back_limit_wins = Signal()
        changeover = Signal(signed(32))
        leading = Signal(signed(32))     # braking for it, the ramp has the low rate at changeover
        high = Signal(signed(32))
        low = Signal(signed(32))
        before_changeover = Signal()
        at_front = Signal()
        at_target = Signal()
        m.d.sync += [
            reach.eq(Mux(away & (cause == Cause.JUMP), force["jump_distance"],
                         Mux(away & (cause == Cause.OPERATOR) & walking, own.walk,
                             # Without data the back limit alone bounds the servo.
                             Mux(force["valid"], force["limit"], (1 << 31) - 1)))),
            stop.eq(self.front - own.walk),
            target.eq(Mux(returning & (cause == Cause.SHORT), self.first, self.front) - reach),
            back_limit_wins.eq(later(self.back_limit, target)),
            lowest.eq(Mux(later(self.back_limit, target), self.back_limit, target)),
            loaded.eq(Mux(later(self.behind, lowest), self.behind, lowest)),
            changeover.eq(self.start - force["changeover"]),
            leading.eq(changeover + force["low_lead"]),
            high.eq(Mux(later(leading, self.ahead), self.ahead, leading)),
            low.eq(Mux(later(self.start, self.ahead), self.ahead, self.start)),
            before_changeover.eq(later(changeover, self.position)),
            at_front.eq(~later(self.start, self.position)),
            at_target.eq(~later(self.command, lowest)),
        ]
        with m.Switch(self.state):
            with m.Case(State.FRONT):
                m.d.sync += self.bound.eq(Mux(self.servo, served, self.ahead))
            with m.Case(State.RETRACTING, State.AT_LIMIT):
                m.d.sync += self.bound.eq(loaded)
            with m.Case(State.HIGH):
                m.d.sync += self.bound.eq(Mux(walking & later(high, stop), stop, high))
            with m.Case(State.LOW):
                m.d.sync += self.bound.eq(Mux(walking & later(low, stop), stop, low))

        # The ramp must be able to stop before the bound, and must be slow at a corner.
        to_bound = Signal(signed(32))
        to_corner = Signal(signed(32))
        near_bound = Signal()
        near_corner = Signal()
        needed = Signal(25)
        # More stored pulses than the braking distance would only delay the stop.
        under_way = Signal(signed(32))
        enough = Signal()
        m.d.sync += [
            needed.eq(self.distance + self.MARGIN),
            to_bound.eq(Mux(self.reverse, self.position - self.bound,
                            self.bound - self.position)),
            to_corner.eq(Mux(self.reverse, self.position - self.fast_behind,
                             self.fast_ahead - self.position)),
            near_bound.eq(to_bound <= needed),
            near_corner.eq(to_corner <= needed),
            under_way.eq(Mux(self.reverse, self.position - self.command,
                             self.command - self.position)),
            enough.eq(under_way > needed),
        ]
        m.d.comb += self.brake.eq(near_bound | near_corner | ~own.moving)
        return {"back_limit_wins": back_limit_wins, "before_changeover": before_changeover,
                "at_front": at_front, "at_target": at_target, "enough": enough,
                "near_corner": near_corner}

    def _jump_timer(self, m):
        """Machining time since the last jump."""
        elapsed = Signal(32)
        due = Signal()
        m.d.comb += due.eq((self.jump_period != 0) & (elapsed >= self.jump_period))
        with m.If(self.jump_period == 0):
            m.d.sync += elapsed.eq(0)
        with m.Elif(self.state != State.FRONT):
            with m.If(due):
                m.d.sync += elapsed.eq(0)
        with m.Elif(self.discharging & self.run & ~self.hold & ~due):
            m.d.sync += elapsed.eq(elapsed + 1)
        return due
