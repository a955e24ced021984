# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.safety``: no discharge and no drive with a cause, live, latched or stale."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.power.power import Power
from rtl.safety.interlock import BY_AXIS, CLEAR_KEY, Cause, Interlock
from rtl.safety.watchdog import Watchdog
from testbench.formal.in_time import ASK, PERIOD, InTime
from testbench.formal.prover import prove

AXES = 2
SPLASH = 3   # clocks of fluid supervision
RELEASE = 2  # clocks of the limit switches
AT_ONCE = ("drive_fault", "error_saturated", "encoder", "following_stopped", "following_moving",
           "coder", "travel", "contact", "gate", "memory", "guard")


class InterlockContract(wiring.Component):
    """Watchdog, interlock and the gates of the sources, joined as in the controller.

    The specification is kept beside them, from the inputs alone: the present causes (``causes``),
    and whether one came that nobody has acknowledged since it went (``owed``).
    """

    estop: In(1)
    drive_fault: In(AXES)
    limit_low: In(AXES)
    limit_high: In(AXES)
    fluid_low: In(1)
    fluid_required: In(1)
    error_saturated: In(AXES)
    encoder: In(AXES)
    following_stopped: In(AXES)
    following_moving: In(AXES)
    coder: In(AXES)
    travel: In(AXES)
    contact: In(1)
    gate: In(1)
    memory: In(1)
    guard: In(1)
    stop: In(1)
    clear: In(1)
    clear_key: In(8)
    leave: In(1)
    leave_key: In(8)
    onto: In(1)
    pet: In(1)
    pet_key: In(8)
    machining: In(1)
    sensing: In(1)
    look: In(1)
    current: In(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.watchdog = watchdog = Watchdog(clock_hz=1_000_000, period_us=PERIOD)
        m.submodules.interlock = interlock = Interlock(
            clock_hz=1000, axes=AXES, limit_release_us=1000 * RELEASE, fluid_ms=SPLASH)
        m.submodules.power = power = Power(clock_hz=1_000_000, level_max=20, on_max=4, off_min=3,
                                           dead_ns=1000, limit_us=2, settle_us=1)
        m.d.comb += Assume(~ResetSignal("sync"))
        m.d.comb += [
            watchdog.pet.eq(self.pet), watchdog.key.eq(self.pet_key),
            interlock.watchdog.eq(watchdog.expired),
            interlock.clear.eq(self.clear), interlock.key.eq(self.clear_key),
            interlock.leave.eq(self.leave), interlock.leave_key.eq(self.leave_key),
            interlock.onto.eq(self.onto),
            interlock.discharging.eq(self.machining),
            power.machining.eq(self.machining & ~interlock.leaving),
            power.safe.eq(interlock.safe),
            power.sensing.eq(self.sensing), power.look.eq(self.look),
            power.current.eq(self.current), power.short.eq(1),
            power.latched.eq(1), power.settled.eq(1),
            interlock.gate.eq(self.gate | power.stuck),
        ]
        for name in (*AT_ONCE, "estop", "limit_low", "limit_high", "fluid_low", "fluid_required",
                     "stop"):
            if name != "gate":
                m.d.comb += getattr(interlock, name).eq(getattr(self, name))
        powered = Signal()
        m.d.comb += powered.eq(power.on | power.sense)

        def lasts(level, clocks):
            """Return whether a level has lasted so many clocks, up to the last."""
            seen = Signal(clocks)
            m.d.sync += seen.eq(Cat(level, seen))
            return seen.all()

        # Limit switches and fluid are causes at the latest when the level has lasted.
        causes = [self.estop, self.stop, power.stuck,
                  *(getattr(self, name).any() for name in AT_ONCE)]
        excused = []
        for switches, at, left in (
                (self.limit_low, interlock.at_low, interlock.left_low),
                (self.limit_high, interlock.at_high, interlock.left_high)):
            for axis in range(AXES):
                excuse = Signal(name=f"excuse_{left.name}_{axis}")
                excused.append((excuse, at[axis], left[axis], switches[axis]))
                causes.append(lasts(switches[axis], 2) & switches[axis] & ~excuse)
        causes.append(lasts(self.fluid_low, SPLASH) & self.machining & self.fluid_required)

        # The watchdog expires when calls come too late or too soon, or answers do not come. Its
        # own view must be the true one: the induction needs this.
        m.submodules.in_time = in_time = InTime()
        m.d.comb += [in_time.pet.eq(self.pet), in_time.key.eq(self.pet_key)]
        stale = in_time.late | in_time.mute
        causes.append(stale)
        m.d.comb += [Assert(watchdog.late == in_time.late), Assert(watchdog.expired == stale),
                     Assert(watchdog.asked == (in_time.answered >= ASK))]

        cause = Signal()
        owed = Signal(init=1)
        acknowledged = Signal()
        m.d.comb += [cause.eq(Cat(causes).any()),
                     acknowledged.eq(self.clear & (self.clear_key == CLEAR_KEY))]
        m.d.sync += owed.eq(cause | (owed & ~acknowledged))

        # SAFETY: from the same clock as a cause until it is gone and acknowledged.
        with m.If(cause | owed):
            m.d.comb += [Assert(interlock.safe), Assert(~powered)]
        m.d.comb += Assert(~(power.on & power.sense))

        # EXCUSES: only for a switch that is pressed at the request, while safe, until it is
        # released or another cause comes; and no discharge while there is one.
        asked = Signal()
        m.d.comb += asked.eq(self.leave & (self.leave_key == CLEAR_KEY) & interlock.safe)
        for excuse, at, left, switch in excused:
            released = lasts(~switch, RELEASE)
            with m.If(asked):
                m.d.sync += excuse.eq(at)
            with m.Elif(cause | self.onto | released):
                m.d.sync += excuse.eq(0)
            m.d.comb += Assert(~left | excuse)
            with m.If(left):
                m.d.comb += Assert(~power.on)
            m.d.comb += Cover(left & ~interlock.safe)

        self._bookkeeping(m, interlock, acknowledged)
        m.d.comb += [Cover(power.on), Cover(power.sense), Cover(power.sense & ~self.machining),
                     Cover(power.stuck & ~self.gate),
                     Cover(interlock.tripped & interlock.simultaneous[1:].all())]
        # Out of time by the main loop alone, by a call too soon, by the interrupts alone.
        hurried = Signal(2)  # clocks since a call that was too soon
        m.d.sync += hurried.eq(Cat(in_time.hasty & ~interlock.safe, hurried[0]))
        m.d.comb += [Cover(interlock.tripped & in_time.late & ~in_time.mute),
                     Cover(interlock.tripped & hurried[1]),
                     Cover(interlock.tripped & in_time.mute & ~in_time.late)]
        trips = Signal(2)
        with m.If(interlock.tripped):
            m.d.sync += trips.eq(trips + 1)
        m.d.comb += Cover((trips == 2) & ~interlock.safe)
        return m

    def _bookkeeping(self, m, interlock, acknowledged):
        """Check latch, first cause and trip strobe against the clock before."""
        ready = Signal()
        latched, live = Signal.like(interlock.live), Signal.like(interlock.live)
        clear, safe = Signal(), Signal()
        m.d.sync += [ready.eq(1), latched.eq(interlock.latched), live.eq(interlock.live),
                     clear.eq(acknowledged), safe.eq(interlock.safe)]
        m.d.comb += Assert(interlock.safe == (interlock.live | interlock.latched).any())
        # Latch and double differ only after a bit has changed by itself.
        m.d.comb += [Assert(interlock.double == ~interlock.latched), Assert(~interlock.torn)]
        with m.If(ready):
            # A bit falls only if its cause is acknowledged and gone, and rises only with its cause.
            m.d.comb += Assert((latched & ~interlock.latched & (~clear.replicate(len(live)) | live))
                               == 0)
            m.d.comb += Assert((interlock.latched & ~latched & ~live) == 0)
            m.d.comb += Assert((live & ~interlock.latched) == 0)
            # One strobe per trip: in the clock after safe rose, or in which safe would have fallen
            # if no new cause had come in the clock after the acknowledgement.
            before, cleared, known = Signal(), Signal(), Signal()
            m.d.sync += [before.eq(safe), cleared.eq(clear), known.eq(1)]
            with m.If(known & safe & ~before):
                m.d.comb += Assert(interlock.tripped)
            with m.If(known & interlock.tripped):
                m.d.comb += Assert(safe & ~latched.any() & (~before | cleared))
            with m.If(interlock.tripped):
                m.d.comb += Assert(interlock.simultaneous == live)
                m.d.comb += Assert(interlock.blamed.any() == Cat(
                    interlock.first == cause.value for cause in BY_AXIS).any())
                m.d.comb += Assert(live.bit_select(interlock.first, 1))
                for cause in Cause:
                    with m.If(interlock.first == cause.value):
                        m.d.comb += Assert((live & ((1 << cause.value) - 1)) == 0)
        for cause in Cause:
            if cause is not Cause.POWER_ON:
                m.d.comb += Cover(interlock.tripped & (interlock.first == cause.value))


def test_contract_holds(workdir):
    prove(InterlockContract(), workdir, depth=PERIOD + 4)


def test_contract_is_reachable(workdir):
    prove(InterlockContract(), workdir, depth=PERIOD + 6, mode="cover")
