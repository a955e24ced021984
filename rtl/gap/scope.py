# SPDX-License-Identifier: Apache-2.0
"""Gap oscilloscope: a ring of stamped entries of what the gap's blocks see, with a trigger."""

from amaranth import *
from amaranth.lib import data, enum, memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from rtl.gap.discriminator import PulseClass
from rtl.states import Pulse, State

__all__ = ["Entry", "GapScope", "Recording", "Trigger"]

DEEPEST = 1 << 15


class Trigger(enum.Enum, shape=3):
    """What the oscilloscope waits for."""

    NOW = 0         # nothing: the first clock is the trigger's
    SHORT = 1       # Ss rises
    RETRACTION = 2  # a retraction starts
    CLASS = 3       # a pulse gets one of some classes
    RISE = 4        # a sample of the gap voltage is at the level or above; the last was below
    FALL = 5        # a sample is below the level; the last was not


class Recording(enum.Enum, shape=2):
    """State of the oscilloscope."""

    IDLE = 0        # not armed since reset, or stopped
    ARMED = 1       # records, and waits for the trigger
    TRIGGERED = 2   # records what follows the trigger
    FULL = 3        # the record can be read


class Entry(data.Struct):
    """An entry of the ring: the inputs of one clock."""

    stamp: 9        # clocks since the entry before
    voltage: 12     # last sample of the gap voltage
    sampled: 1      # that sample came in this clock
    high: 1
    arc: 1
    short: 1
    current: 1
    noise: 1
    on: 1
    sense: 1
    pulse: Pulse
    shorted: 1
    state: 3        # number of a ``rtl.motion.retraction.State``


STAMP = Entry.as_shape()["stamp"].width
# Levels: an entry is written when one of them changes.
LEVELS = ("high", "arc", "short", "current", "noise", "on", "sense", "shorted", "state")


class GapScope(wiring.Component):
    """Records the gap's signals around a trigger, without any effect on them.

    ``arm`` empties the ring. From the next clock on the block looks at every clock. It writes an
    entry for a clock

    * that is the first, or the trigger's;
    * in which a level differs from the clock before;
    * in which a sample has come, or a pulse has got its class;
    * that is the 511th after the clock of the last entry.

    So the stamps add up to the time since the first entry, whose stamp is 0. When the ring is full,
    each entry replaces the oldest.

    The trigger's clock is the first in which what ``source`` names happens, or ``force`` is high.
    In the first clock a high Ss does not count as rising, and a retraction under way does not count
    as starting; the first sample crosses no level. Later triggers have no effect. The recording is
    ``FULL`` with the ``after``-th entry after the trigger's. Entries are numbered from 0 for the
    oldest; that of the trigger is then ``count - 1 - after``. ``stop`` ends the recording: neither
    its clock nor a later one gets an entry. If ``arm`` comes in the same clock, ``arm`` wins.

    ``recording``, ``count`` and ``time`` show the effect of a clock in the second clock after it,
    but that of ``arm`` and ``stop`` in the next one. ``time`` is ``cycle`` in the clock after the
    trigger's.

    ``choose`` selects the entry ``place`` to be read, ``following`` the next one; ``entry`` shows
    it in the second clock after that. Reading does not change the recording. Read it only after it
    has ended: while it runs, the numbers of the entries change.

    ``source``, ``classes``, ``level`` and ``after`` may change only while no recording runs. Before
    ``arm`` no register of the block changes, so that it costs a simulation nothing.

    Parameters
    ----------
    depth : int
        Entries, a power of two, 16 to 32768. They have 36 bits.

    Members
    -------
    voltage : In(12), voltage_valid : In(1)
        Sample of the converter, and that it is new (``rtl.gap.sampler``).
    high, arc, short, current, noise, on, sense : In(1)
        Comparators and gates, as the discriminator sees them.
    sample, sample_sensing : In(1), kind : In(PulseClass)
        A pulse was classified (``rtl.gap.discriminator``).
    shorted : In(1), state : In(3)
        Ss, and the state of the retraction.
    cycle : In(32)
        Clock count.
    arm, stop, force : In(1)
        Orders.
    source : In(Trigger)
        What the oscilloscope waits for.
    classes : In(6)
        Classes that ``Trigger.CLASS`` waits for: bit n - 1 for the ``Pulse`` n.
    level : In(12)
        Level of ``Trigger.RISE`` and ``Trigger.FALL``, in steps of the converter.
    after : In(16)
        Entries after the trigger's, less than ``depth``; higher bits are ignored.
    recording : Out(Recording)
        State.
    runs : Out(1)
        The recording is armed or triggered.
    count : Out(16)
        Entries in the ring.
    time : Out(32)
        Clock count of the trigger, see above.
    choose, following : In(1), place : In(16)
        Which entry is read: number ``place``, or the next.
    entry : Out(Entry)
        The entry that is read.

    Attributes
    ----------
    now : Signal
        The inputs of the last clock, as an ``Entry``; for tests to look at.

    Raises
    ------
    ValueError
        If ``depth`` is not possible.
    """

    voltage: In(12)
    voltage_valid: In(1)
    high: In(1)
    arc: In(1)
    short: In(1)
    current: In(1)
    noise: In(1)
    on: In(1)
    sense: In(1)
    sample: In(1)
    sample_sensing: In(1)
    kind: In(PulseClass)
    shorted: In(1)
    state: In(3)
    cycle: In(32)
    arm: In(1)
    stop: In(1)
    force: In(1)
    source: In(Trigger)
    classes: In(6)
    level: In(12)
    after: In(16)
    recording: Out(Recording)
    runs: Out(1)
    count: Out(16)
    time: Out(32)
    choose: In(1)
    following: In(1)
    place: In(16)
    entry: Out(Entry)

    def __init__(self, *, depth: int):
        if not 16 <= depth <= DEEPEST or depth & (depth - 1):
            raise ValueError("the oscilloscope's depth must be a power of two from 16 to "
                             f"{DEEPEST}, not {depth!r}")
        self.depth = depth
        self.now = Signal(Entry)
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        bits = exact_log2(self.depth)

        runs = self.runs
        m.d.comb += runs.eq((self.recording == Recording.ARMED)
                            | (self.recording == Recording.TRIGGERED))

        now = self.now
        was = Signal(Entry)  # ``now`` of the clock before
        looked = Signal()   # ``now`` is of a clock since arming
        first = Signal()    # ... and of the first one
        forced = Signal()   # ``force`` of the last clock
        with m.If(runs):
            m.d.sync += [
                now.high.eq(self.high), now.arc.eq(self.arc), now.short.eq(self.short),
                now.current.eq(self.current), now.noise.eq(self.noise),
                now.on.eq(self.on), now.sense.eq(self.sense),
                now.shorted.eq(self.shorted), now.state.eq(self.state),
                now.voltage.eq(self.voltage), now.sampled.eq(self.voltage_valid),
                now.pulse.eq(self._pulse(m)), forced.eq(self.force),
                was.eq(now), looked.eq(1), first.eq(~looked),
            ]

        stamp = Signal(STAMP)       # clocks since the last entry
        changed = Signal()          # a level differs from the clock before
        news = Signal()             # there is a reason for an entry
        triggers = Signal()         # this is the trigger's clock
        taken = Signal()            # an entry is written
        m.d.comb += [
            changed.eq(Cat(now[name] != was[name] for name in LEVELS).any()),
            news.eq(first | changed | now.sampled | (now.pulse != Pulse.NONE) | stamp.all()),
            triggers.eq((self.recording == Recording.ARMED)
                        & (forced | self._happens(m, now, was, first))),
            taken.eq(runs & looked & (news | triggers)),
        ]

        m.submodules.ring = ring = memory.Memory(shape=Entry.as_shape().size, depth=self.depth,
                                                 init=[])
        write, read = ring.write_port(), ring.read_port()
        newest = Signal(bits)       # where the next entry goes
        whole = Signal()            # the ring is full
        left = Signal(bits)         # entries still to come
        entry = Signal(Entry)
        m.d.comb += [
            entry.eq(now), entry.stamp.eq(stamp),
            write.addr.eq(newest), write.data.eq(entry), write.en.eq(taken),
            self.count.eq(Mux(whole, self.depth, newest)),
        ]
        with m.If(runs & looked):
            m.d.sync += stamp.eq(Mux(taken, 1, stamp + 1))
        with m.If(taken):
            m.d.sync += [newest.eq(newest + 1), whole.eq(whole | newest.all()),
                         left.eq(left - 1)]
            with m.If(triggers):
                m.d.sync += [left.eq(self.after), self.time.eq(self.cycle),
                             self.recording.eq(Recording.TRIGGERED)]
            with m.If(Mux(triggers, self.after[:bits] == 0,
                          (self.recording == Recording.TRIGGERED) & (left == 1))):
                m.d.sync += self.recording.eq(Recording.FULL)
        with m.If(self.arm):
            m.d.sync += [self.recording.eq(Recording.ARMED), newest.eq(0), whole.eq(0),
                         looked.eq(0), stamp.eq(0)]
        with m.Elif(self.stop):
            m.d.sync += self.recording.eq(Recording.IDLE)

        place = Signal(bits)
        with m.If(self.choose):
            m.d.sync += place.eq(Mux(whole, newest, 0) + self.place)
        with m.Elif(self.following):
            m.d.sync += place.eq(place + 1)
        m.d.comb += [read.addr.eq(place), self.entry.eq(read.data)]
        return m

    def _pulse(self, m):
        """The pulse that has got its class in this clock."""
        pulse = Signal(Pulse)
        with m.If(self.sample), m.Switch(Cat(self.kind, self.sample_sensing)):
            for kind in PulseClass:
                with m.Case(kind.value):
                    m.d.comb += pulse.eq(Pulse[kind.name])
            with m.Case(PulseClass.SHORT.value | 4):
                m.d.comb += pulse.eq(Pulse.SENSED_SHORT)
            with m.Default():
                m.d.comb += pulse.eq(Pulse.SENSED_OPEN)
        return pulse

    def _happens(self, m, now, was, first):
        """What the trigger waits for is in ``now``."""
        known = Signal()    # there was a sample since arming
        below = Signal()    # ... and the last one was below the level
        low = Signal()      # the present sample is below the level
        crosses = Signal()  # ... and the last one was not, or the other way round
        m.d.comb += [low.eq(now.voltage < self.level),
                     crosses.eq(now.sampled & known & (low != below))]
        with m.If(self.arm):
            m.d.sync += known.eq(0)
        with m.Elif(now.sampled):
            m.d.sync += [known.eq(1), below.eq(low)]

        def back(entry):
            return ((entry.state == State.STOPPING.value)
                    | (entry.state == State.RETRACTING.value))

        happens = Signal()
        with m.Switch(self.source):
            with m.Case(Trigger.NOW):
                m.d.comb += happens.eq(1)
            with m.Case(Trigger.SHORT):
                m.d.comb += happens.eq(now.shorted & ~was.shorted & ~first)
            with m.Case(Trigger.RETRACTION):
                m.d.comb += happens.eq(back(now) & ~back(was) & ~first)
            with m.Case(Trigger.CLASS):
                m.d.comb += happens.eq(Cat(0, self.classes).bit_select(now.pulse.as_value(), 1))
            with m.Case(Trigger.RISE):
                m.d.comb += happens.eq(crosses & ~low)
            with m.Case(Trigger.FALL):
                m.d.comb += happens.eq(crosses & low)
        return happens
