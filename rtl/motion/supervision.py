# SPDX-License-Identifier: Apache-2.0
"""Supervision of a pulse coder: whether its pulses fit what the axis does."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.arithmetic import sum_or_difference
from rtl.states import Check

__all__ = ["GAIN_BITS", "RATE_TICKS", "TICK_S", "Supervision", "tick_clocks"]

TICK_S = 32e-6
RATE_TICKS = 32
GAIN_BITS = 14


def tick_clocks(clock_hz: int) -> int:
    """Clocks of a tick.

    Raises
    ------
    ValueError
        If the clock is too slow for what a tick takes.
    """
    clocks = round(clock_hz * TICK_S)
    if clocks < Supervision.STEPS:
        raise ValueError(f"a clock of {clock_hz} Hz has {clocks} clocks in a tick of "
                         f"{TICK_S * 1e6:g} us, and the supervision needs {Supervision.STEPS}")
    return clocks


def _size(a):
    """Magnitude of a signed value, one less below 0."""
    return (a ^ a[-1].replicate(len(a)))[:len(a) - 1]


class Supervision(wiring.Component):
    """Compares feedback pulses with a model of the drive, in force without any setting.

    The drive is commanded a speed of ``gain`` times ``size``: Er with the feed-forward, without the
    offset and the friction that are made up for. In every tick the model's speed approaches that
    command by 1/128 of the difference: a lag of 4 ms, as filter and speed loop have. While
    ``standing`` the commanded speed counts as 0 unless ``size`` is above 15, since a real drive has
    an offset; while the path rests too, unless it is above 63, since a drive with friction stands
    still at such a command.

    ``check`` is raised, and stays until ``clear``, when one of these fails:

    * *Misfit.* The difference between the model's travel and the pulses that came is at most
      ``allowance`` plus half of the model's own travel. Both decay by 1/512 a tick (16 ms). So the
      drive's gain may be wrong by half in any motion. The allowance is for lags other than 4 ms.
    * *Share.* A stretch ends when 128 pulses were commanded or came, and 512 ticks have passed
      since 16 pulses were commanded. In a stretch at least 1/8 and at most 8 times as many pulses
      come as were commanded, in the commanded direction. A new stretch begins when one has passed,
      at each change of the commanded direction, and when the drive is commanded to stand. At 8192
      pulses a stretch ends whatever its time. So a lost coder is found after some pulses, however
      slow the axis is. A wrong gain setting trips the axis in motion; it never hides a lost coder.
    * *Edges.* When 512 ticks have passed since 16 pulses were commanded, without a change of the
      commanded direction and without rest, both phases have an edge in every 80 to 144 pulses that
      are commanded (up to 207 where a stretch ends after more than 128). With a ``coarse`` coder
      that is in every 640 to 1152: the model may be ahead by some edges at the end of a motion.
    * *Rate.* In 32 ticks no more than ``fastest`` pulses of either direction come.

    When a check fails, a more exact finding replaces it if there is one: ``SILENT``, ``PHASE_A`` or
    ``PHASE_B`` if both phases, or one, had no edge while 64 pulses were commanded (512 with a
    ``coarse`` coder); else ``AGAINST``
    if more than 16 pulses came against at least 16 commanded.

    While ``on`` is low, or after a finding, nothing is checked. All sums are cleared then, and the
    model's speed follows the feedback pulses: so the model is right for a drive that is enabled
    while it coasts. A tick during which this was so, even in part, is not judged.

    Latency: a tick is judged ``STEPS`` clocks after ``tick``; ``RATE`` comes 1 clock after the
    first excess pulse. Ticks are at least ``STEPS`` clocks apart.

    Exact model: ``testbench/models/supervision.py``.
    Proof: ``testbench/formal/test_supervision.py``.

    Parameters
    ----------
    allowance : int
        Misfit allowed beside the model's share, in pulses.
    fastest : int
        Pulses allowed in 32 ticks.

    Members
    -------
    tick : In(1)
        A tick of ``TICK_S``.
    gain : In(14)
        Velocity gain of the position loop, in 2**-20 pulse/tick per pulse of ``size``.
    size : In(15), negative : In(1)
        Magnitude and sign of the velocity command, without offset and friction.
    standing : In(1)
        The axis is in position.
    resting : In(1)
        No path pulses are commanded.
    fp, fp_reverse : In(1)
        Feedback pulse and its direction.
    a, b : In(1)
        Phases of the coder, filtered.
    coarse : In(1)
        An edge of the coder is more than a pulse.
    on : In(1)
        The drive follows ``size``.
    clear : In(1)
        Clear the finding.
    check : Out(Check)
        The finding.
    told : Out(signed(22))
        Speed commanded, 2**-12 pulse/tick, and one less below 0; while ``on`` is low, that of the
        feedback pulses. For ``tell``, which is high in one clock of each tick, 17 after it.
    tell : Out(1)
    up, down : Out(1)
        Direction in which the model's drive will move in 1 ms, at its present acceleration: so
        long filter and current loop take. Both are low at rest. They change 20 clocks after
        ``tick``.

    Raises
    ------
    ValueError
        If ``allowance`` or ``fastest`` is below 1.
    """

    SIZE, GAIN = 15, GAIN_BITS   # bits of the velocity command and of the gain
    PACE, CAME = 21, 10          # bits of a speed (a product of those two), and of a tick's pulses
    LAG, MEMORY = 7, 9           # shifts of the model's lag and of the misfit's decay
    LEAST, BEGUN = 7, 4          # log2 of the least pulses of a stretch, and when its time begins
    STILL = 6                    # log2 of the command at which a drive may stand still at rest
    LONGEST = 13                 # log2 of the pulses after which a stretch ends at any time
    SHARE = 3                    # shift for the bounds of a share, 1/8 and 8 times
    LIVELY, COARSELY = 6, 9      # log2 of the pulses commanded without an edge
    FRACTION, COARSE = 12, 8     # bits below the pulse of speeds and travels, and of the misfit
    FINER = 8                    # additional ones of Er times the gain
    STEPS = SIZE + 6

    def __init__(self, *, allowance=200, fastest=2458):
        for name, value in (("allowance", allowance), ("highest rate", fastest)):
            if value < 1:
                raise ValueError(f"the {name} must be at least 1 pulse, not {value!r}")
        self.allowance = allowance
        self.fastest = fastest
        # For tests: clocks since the tick, speed of the model, misfit, and the pulses commanded and
        # come in the present stretch.
        self.step = Signal(range(self.STEPS + 1), init=self.STEPS)
        self.valid = Signal()  # ``on`` since before the tick, and nothing found
        self.came = Signal(signed(self.CAME))
        self.speed = Signal(signed(self.PACE + 1))
        self.misfit = Signal(signed(self.PACE + self.MEMORY - self.FRACTION + self.COARSE + 2))
        self.way = Signal(self.LONGEST + 1 + self.FRACTION)
        self.back = Signal(signed(self.LONGEST + 2))
        self.side = Signal()
        self.lively = Signal(2)  # phases with an edge in the last spans
        super().__init__({
            "tick":       In(1),
            "gain":       In(self.GAIN),
            "size":       In(self.SIZE),
            "negative":   In(1),
            "standing":   In(1),
            "resting":    In(1),
            "fp":         In(1),
            "fp_reverse": In(1),
            "a":          In(1),
            "b":          In(1),
            "coarse":     In(1),
            "on":         In(1),
            "clear":      In(1),
            "check":      Out(Check),
            "told":       Out(signed(self.PACE + 1)),
            "tell":       Out(1),
            "up":         Out(1),
            "down":       Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        step = self.step
        at = {name: step == self.SIZE + index for index, name in enumerate(
            ("leak", "tell", "add", "take", "compare", "judge"))}
        at["multiply"] = step < self.SIZE
        valid = self.valid
        with m.If(self.tick):
            m.d.sync += step.eq(0)
        with m.Elif(step != self.STEPS):
            m.d.sync += step.eq(step + 1)
        with m.If(~self.on | (self.check != Check.NONE)):
            m.d.sync += valid.eq(0)
        with m.Elif(self.tick):
            m.d.sync += valid.eq(1)

        came = self._came(m)
        speed, change = self._model(m, at, valid, came)
        # A quarter of what the lag leaves open is 1 ms of the acceleration.
        soon = ((speed << 2) + change) >> 2
        down, pace = speed[-1], _size(speed)
        with m.If(at["take"]):
            m.d.sync += [self.up.eq(~soon[-1] & soon.any()),
                         self.down.eq(soon[-1] & ~soon.all())]
        over = self._misfit(m, at, valid, speed, pace, came)
        fails, against, lively, silent, missing = self._stretch(m, at, valid, pace, down, came)
        rated = self._rate(m, valid)

        found = Signal(Check)
        with m.If(silent):
            m.d.comb += found.eq(Check.SILENT)
        with m.Elif(~lively[0]):
            m.d.comb += found.eq(Check.PHASE_A)
        with m.Elif(~lively[1]):
            m.d.comb += found.eq(Check.PHASE_B)
        with m.Elif(against):
            m.d.comb += found.eq(Check.AGAINST)
        with m.Elif(fails):
            m.d.comb += found.eq(Check.SHARE)
        with m.Else():
            m.d.comb += found.eq(Check.MODEL)

        with m.If(self.clear):
            m.d.sync += self.check.eq(Check.NONE)
        with m.Elif(self.check == Check.NONE):
            with m.If(rated):
                m.d.sync += self.check.eq(Check.RATE)
            with m.Elif(at["judge"] & valid & self.on & (over | fails | missing)):
                m.d.sync += self.check.eq(found)

        return m

    def _came(self, m):
        """Pulses that came in the tick before the last one; the count saturates."""
        came = self.came
        count = Signal(signed(self.CAME))
        most = (1 << (self.CAME - 1)) - 1
        full = Mux(self.fp_reverse, count == -most, count == most)
        pulse = Mux(self.fp_reverse, -1, 1)
        with m.If(self.tick):
            m.d.sync += [came.eq(count), count.eq(Mux(self.fp, pulse, 0))]
        with m.Elif(self.fp & ~full):
            m.d.sync += count.eq(count + pulse)
        return came

    def _model(self, m, at, valid, came):
        """Speed of the model, signed, 2**-12 pulse/tick, and what it lacks of that commanded."""
        # Er times the gain, from the top bit of Er on.
        factor = Signal(self.SIZE)
        told = Signal(self.SIZE + self.GAIN)
        negative = Signal()
        small = self.standing & Mux(self.resting, ~self.size[self.STILL:].any(),
                                    ~self.size[self.BEGUN:].any())
        with m.If(self.tick):
            m.d.sync += [factor.eq(Mux(small, 0, self.size)), told.eq(0),
                         negative.eq(self.negative)]
        with m.Elif(at["multiply"]):
            m.d.sync += [factor.eq(factor << 1),
                         told.eq((told << 1) + Mux(factor[-1], self.gain, 0))]

        # It has LAG more bits below, so that the division by the lag loses nothing, and a model
        # at rest stays exactly at 0.
        total = Signal(signed(self.PACE + 1 + self.LAG))
        speed = self.speed
        change = Signal(signed(len(speed)))
        m.d.comb += [
            speed.eq(total >> self.LAG),
            change.eq(Mux(at["leak"], speed, Mux(valid, told[self.FINER:], came << self.FRACTION))),
        ]
        minus = at["leak"] | (valid & negative)
        with m.If(at["leak"] | at["tell"]):
            m.d.sync += total.eq(sum_or_difference(total, change, minus))
        m.d.comb += [
            self.told.eq(change.as_unsigned() ^ minus.replicate(len(change))),
            self.tell.eq(at["tell"]),
        ]
        lacks = Signal(signed(len(speed) + 1))
        with m.If(at["tell"]):
            m.d.sync += lacks.eq(self.told - speed)
        return speed, lacks

    def _misfit(self, m, at, valid, speed, pace, came):
        """Whether the misfit is more than allowed."""
        below = self.FRACTION - self.COARSE
        misfit = self.misfit
        memory = Signal(len(misfit))  # the model's travel in either direction, decaying
        change = Signal.like(misfit)
        excess = Signal.like(misfit)
        with m.If(at["leak"]):
            m.d.comb += change.eq(misfit >> self.MEMORY)
        with m.Elif(at["add"]):
            m.d.comb += change.eq(speed >> below)
        with m.Else():
            m.d.comb += change.eq(came << self.COARSE)
        with m.If(~valid):
            m.d.sync += [misfit.eq(0), memory.eq(0)]
        with m.Else():
            with m.If(at["leak"] | at["add"] | at["take"]):
                m.d.sync += misfit.eq(sum_or_difference(misfit, change, ~at["add"]))
            with m.If(at["leak"] | at["add"]):
                m.d.sync += memory.eq(sum_or_difference(
                    memory, Mux(at["leak"], memory >> self.MEMORY, pace >> below), at["leak"]))
        with m.If(at["compare"]):
            m.d.sync += excess.eq(_size(misfit) - (memory >> 1))
        return excess > self.allowance << self.COARSE

    def _stretch(self, m, at, valid, pace, down, came):
        """Share fails; pulses came against; phases with edges; none has any; edges are missing."""
        way, back, side = self.way, self.back, self.side  # 2**-12 pulse; pulses in its direction
        time = Signal(self.MEMORY + 1)  # ticks, up to its top bit
        pulses = way[self.FRACTION:]
        size = _size(back)
        begins = Signal()
        m.d.comb += begins.eq(~pace.any() | (down != side))

        few, many, ends = Signal(), Signal(), Signal()
        with m.If(at["compare"]):
            m.d.sync += [
                few.eq(back < (pulses >> self.SHARE)),
                many.eq((back >> self.SHARE) > pulses),
                ends.eq(pulses[self.LONGEST] | size[self.LONGEST] | (
                    time[-1] & (pulses[self.LEAST:].any() | size[self.LEAST:].any()))),
            ]
        with m.If(~valid | (at["judge"] & ends) | (at["add"] & begins)):
            m.d.sync += [way.eq(0), back.eq(0), time.eq(0)]
        with m.Elif(at["add"]):
            m.d.sync += [way.eq(way + pace), back.eq(sum_or_difference(back, came, side))]
        with m.Elif(at["take"] & ~time[-1] & pulses[self.BEGUN:].any()):
            m.d.sync += time.eq(time + 1)
        with m.If(at["add"] & begins):
            m.d.sync += side.eq(down)

        # Edges are collected over two spans of so many commanded pulses, so that an edge counts as
        # missing only after at least one whole span. A span goes on when a new stretch begins.
        phases = Cat(self.a, self.b)
        before = Signal(2)
        fresh, stale = Signal(2, init=0b11), Signal(2, init=0b11)
        mark = Signal()
        edges = phases ^ before
        m.d.sync += [before.eq(phases), fresh.eq(fresh | edges)]
        with m.If(~valid | (at["add"] & begins)):
            m.d.sync += [fresh.eq(0b11), stale.eq(0b11), mark.eq(0)]
        with m.Elif(at["take"] & (Mux(self.coarse, pulses[self.COARSELY], pulses[self.LIVELY])
                                  != mark)):
            m.d.sync += [fresh.eq(edges), stale.eq(fresh), mark.eq(~mark)]
        with m.Elif(at["judge"] & ends):
            m.d.sync += mark.eq(0)
        lasting = Signal()  # this motion has gone on for the time of a stretch
        with m.If(~valid | (at["add"] & begins)):
            m.d.sync += lasting.eq(0)
        with m.Elif(time[-1]):
            m.d.sync += lasting.eq(1)
        lively = self.lively
        m.d.comb += lively.eq(fresh | stale)

        against = (back < -(1 << self.BEGUN)) & pulses[self.BEGUN:].any()
        # A phase may have its last edge just before the end of a span, the other one just after it.
        # Well within a span a phase that goes on alone has had an edge in it.
        within = Mux(self.coarse, pulses[self.COARSELY - 2:self.COARSELY].any(),
                     pulses[self.BEGUN:self.LIVELY].any())
        silent = Mux(within, ~lively.all() & ~fresh.any(), ~lively.any())
        return ends & (few | many), against, lively, silent, lasting & within & ~lively.all()

    def _rate(self, m, valid):
        """Whether too many pulses came."""
        ticks = Signal(range(RATE_TICKS))
        count = Signal(range(self.fastest + 1))
        last = Signal()
        with m.If(self.tick):
            m.d.sync += ticks.eq(ticks + 1)
        m.d.comb += last.eq(self.tick & ticks.all())
        with m.If(~valid):
            m.d.sync += count.eq(0)
        with m.Elif(last):
            m.d.sync += count.eq(self.fp)
        with m.Elif(self.fp & (count != self.fastest)):
            m.d.sync += count.eq(count + 1)
        return valid & self.on & self.fp & (count == self.fastest) & ~last
