# SPDX-License-Identifier: Apache-2.0
"""Interlock: makes the outputs safe, and latches the reason."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.debounce import Debounce

__all__ = ["BY_AXIS", "CLEAR_KEY", "Cause", "Interlock"]

CLEAR_KEY = 0x5A


class Cause(enum.Enum, shape=5):
    """Causes. The number is the bit in every vector, and the priority (0 is the highest)."""

    POWER_ON = 0
    ESTOP = 1
    DRIVE_FAULT = 2
    LIMIT_LOW = 3
    LIMIT_HIGH = 4
    FLUID_LOW = 5
    WATCHDOG = 6
    ERROR_SATURATED = 7
    ENCODER = 8
    FOLLOWING_STOPPED = 9
    FOLLOWING_MOVING = 10
    FIRMWARE = 11
    CODER = 12
    TRAVEL = 13
    CONTACT = 14
    GATE = 15
    MEMORY = 16
    GUARD = 17


# Those that an axis raises.
BY_AXIS = (Cause.DRIVE_FAULT, Cause.LIMIT_LOW, Cause.LIMIT_HIGH, Cause.ERROR_SATURATED,
           Cause.ENCODER, Cause.FOLLOWING_STOPPED, Cause.FOLLOWING_MOVING, Cause.CODER,
           Cause.TRAVEL)


class Interlock(wiring.Component):
    """Keeps outputs safe until every cause is gone and someone has acknowledged it.

    ``safe`` is high in the same clock as any cause (gates only, no register) and from then on until
    cleared. ``latched`` holds each cause from the clock after it was live. ``clear`` with the key
    drops every latched cause that is not live in the same clock, and nothing else. The key acts in
    that clock only, so a cause that comes back must be cleared again. Out of reset ``power_on`` is
    latched.

    A trip is a clock with a cause while nothing is latched: ``safe`` rises then, or would just have
    fallen. In the clock after it ``tripped`` is high. ``first`` (lowest number wins), ``blamed``
    (the axes that raised it, if axes raise that cause) and ``simultaneous`` then describe the
    causes live in the clock of the trip. They stay until the next trip; but when a clear leaves
    causes and the first is not among them, they describe those that are left.

    ``latched`` has a double. If the two differ, a bit has changed by itself: that is the cause
    ``guard`` in the same clock, and ``torn`` is high. From the next clock on both hold the causes
    of either. A trip counts a cause as latched only if ``latched`` and its double both have it. So
    a changed bit is a trip if nothing else was latched.

    Debouncing: a limit switch is a cause in the clock after 2 clocks in a row with it (a single
    clock is a disturbance), until it has been released for ``limit_release_us``. A change of the
    fluid level counts after ``fluid_ms``. All other causes count at once. Low fluid is a cause only
    while ``discharging`` and ``fluid_required`` are high.

    To leave a limit switch: ``leave`` with the key, while ``safe``, excuses the switches that are
    causes then. From the next clock on they are no causes, and ``left_low`` and ``left_high`` name
    them. Upstream, the discharge must then be off, motion slow, and no pulse may go further onto
    them. An excuse ends when its switch is released. All excuses end with any cause, and with
    ``onto``: a pulse onto one of them was refused.

    Proof: ``testbench/formal/test_interlock.py``.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    axes : int
        Width of the members by axis, at least 1.
    limit_release_us : int
        Time for which a limit switch must be released. At least 1 clock is used.
    fluid_ms : int
        Time for which the fluid must be low, or back: it splashes. At least 1 clock is used.

    Members
    -------
    estop : In(1)
        Emergency stop.
    drive_fault, limit_low, limit_high : In(axes)
        From the drives and the switches.
    fluid_low : In(1)
        The fluid is below its level.
    discharging : In(1)
        The discharge is wanted. Not its gate: that depends on ``safe``.
    fluid_required : In(1)
        Low fluid trips.
    watchdog : In(1)
        The watchdog has expired.
    error_saturated, encoder, following_stopped, following_moving : In(axes)
        Faults of the axes.
    coder : In(axes)
        The coder does not fit what the axis does.
    travel : In(axes)
        A command would have left the axis' soft limits.
    contact : In(1)
        The electrode touches the work while the discharge is off, too fast to stop.
    gate : In(1)
        The gap has current or voltage with both sources off.
    memory : In(1)
        The processor's memory has read wrong.
    guard : In(1)
        A register differs from its copy or from its parity.
    stop : In(1)
        Firmware asks for a trip: a strobe.
    clear : In(1), key : In(8)
        Acknowledgement: a strobe, and its key.
    leave : In(1), leave_key : In(8)
        Excuse the limit switches: a strobe, and the same key.
    onto : In(1)
        No more excuses.
    live : Out(18), latched : Out(18)
        Causes, bit by ``Cause``.
    safe : Out(1)
        Outputs must be safe.
    first : Out(5)
        Number of the first cause.
    blamed : Out(axes)
        Axes of the first cause.
    simultaneous : Out(18)
        Causes that came with the first, itself included.
    tripped : Out(1)
        A trip: high for one clock.
    at_low, at_high : Out(axes)
        Limit switches, debounced.
    left_low, left_high : Out(axes)
        Limit switches that are excused.
    leaving : Out(1)
        Any of them is excused.
    torn : Out(1)
        The latch and its double differ.

    Attributes
    ----------
    double : Signal
        The double of ``latched``, inverted, for tests and proofs.

    Raises
    ------
    ValueError
        If ``axes`` is less than 1.
    """

    def __init__(self, *, clock_hz, axes=3, limit_release_us=1000, fluid_ms=50):
        if axes < 1:
            raise ValueError(f"there must be at least 1 axis, not {axes!r}")
        self.clock_hz = clock_hz
        self.axes = axes
        self.limit_release_us = limit_release_us
        self.fluid_ms = fluid_ms
        causes = len(Cause)
        super().__init__({
            "estop": In(1), "drive_fault": In(axes), "limit_low": In(axes), "limit_high": In(axes),
            "fluid_low": In(1), "discharging": In(1), "fluid_required": In(1),
            "watchdog": In(1), "error_saturated": In(axes), "encoder": In(axes),
            "following_stopped": In(axes), "following_moving": In(axes),
            "coder": In(axes), "travel": In(axes), "contact": In(1), "gate": In(1),
            "memory": In(1), "guard": In(1),
            "stop": In(1), "clear": In(1), "key": In(8),
            "leave": In(1), "leave_key": In(8), "onto": In(1),
            "live": Out(causes), "latched": Out(causes, init=1 << Cause.POWER_ON.value),
            "safe": Out(1), "first": Out(5, init=Cause.POWER_ON.value), "blamed": Out(axes),
            "simultaneous": Out(causes, init=1 << Cause.POWER_ON.value), "tripped": Out(1),
            "at_low": Out(axes), "at_high": Out(axes), "left_low": Out(axes),
            "left_high": Out(axes), "leaving": Out(1), "torn": Out(1),
        })
        # Inverted, or synthesis would merge the two.
        self.double = Signal(causes, init=(1 << causes) - 1 - (1 << Cause.POWER_ON.value))

    def elaborate(self, platform):
        m = Module()

        release = max(1, self.clock_hz * self.limit_release_us // 1_000_000)
        splash = max(1, self.clock_hz * self.fluid_ms // 1000)

        def steady(name, raw, *, rise, fall):
            m.submodules[name] = debounce = Debounce(rise=rise, fall=fall)
            m.d.comb += debounce.raw.eq(raw)
            return debounce.steady

        for end, switches, level in (("low", self.limit_low, self.at_low),
                                     ("high", self.limit_high, self.at_high)):
            for axis in range(self.axes):
                m.d.comb += level[axis].eq(
                    steady(f"{end}_{axis}", switches[axis], rise=2, fall=release))
        m.d.comb += self.leaving.eq((self.left_low | self.left_high).any())
        fluid_low = steady("fluid", self.fluid_low, rise=splash, fall=splash)
        causes = {
            Cause.POWER_ON: C(0, 1),  # only ever latched, by reset
            Cause.ESTOP: self.estop,
            Cause.DRIVE_FAULT: self.drive_fault,
            Cause.LIMIT_LOW: self.at_low & ~self.left_low,
            Cause.LIMIT_HIGH: self.at_high & ~self.left_high,
            Cause.FLUID_LOW: fluid_low & self.discharging & self.fluid_required,
            Cause.WATCHDOG: self.watchdog,
            Cause.ERROR_SATURATED: self.error_saturated,
            Cause.ENCODER: self.encoder,
            Cause.FOLLOWING_STOPPED: self.following_stopped,
            Cause.FOLLOWING_MOVING: self.following_moving,
            Cause.FIRMWARE: self.stop,
            Cause.CODER: self.coder,
            Cause.TRAVEL: self.travel,
            Cause.CONTACT: self.contact,
            Cause.GATE: self.gate,
            Cause.MEMORY: self.memory,
            Cause.GUARD: self.guard | self.torn,
        }
        either, both = (Signal(len(Cause)) for _ in range(2))
        m.d.comb += [
            either.eq(self.latched | ~self.double),
            both.eq(self.latched & ~self.double),
            self.torn.eq((self.latched ^ ~self.double).any()),
            self.live.eq(Cat(causes[cause].any() for cause in Cause)),
            self.safe.eq((self.live | self.latched).any()),
        ]

        lowest = Signal(5)
        whose = Signal(self.axes)
        for cause in reversed(Cause):
            with m.If(self.live[cause.value]):
                m.d.comb += [lowest.eq(cause.value),
                             whose.eq(causes[cause] if cause in BY_AXIS else 0)]

        clear = Signal()
        trip = Signal()
        moot = Signal()  # the first cause is no longer among those that are left
        m.d.comb += [
            clear.eq(self.clear & (self.key == CLEAR_KEY)),
            trip.eq(~both.any()),
            moot.eq(clear & ~self.live.bit_select(self.first, 1)),
        ]
        latched = Signal.like(self.latched)
        m.d.comb += latched.eq(Mux(clear, self.live, either | self.live))
        m.d.sync += [self.latched.eq(latched), self.double.eq(~latched)]
        m.d.sync += self.tripped.eq(trip & self.live.any())
        with m.If(self.live.any() & (trip | moot)):
            m.d.sync += [self.first.eq(lowest), self.blamed.eq(whose),
                         self.simultaneous.eq(self.live)]

        leave = Signal()
        m.d.comb += leave.eq(self.leave & (self.leave_key == CLEAR_KEY) & self.safe)
        for left, level in (self.left_low, self.at_low), (self.left_high, self.at_high):
            with m.If(leave):
                m.d.sync += left.eq(level)
            with m.Elif(self.onto | self.live.any()):
                m.d.sync += left.eq(0)
            with m.Else():
                m.d.sync += left.eq(left & level)

        return m
