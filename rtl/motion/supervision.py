# SPDX-License-Identifier: Apache-2.0
"""Supervision of a pulse coder: whether it tells what its axis does."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.arithmetic import sum_or_difference

__all__ = ["GAIN_BITS", "RATE_TICKS", "TICK_S", "Check", "Supervision", "tick_clocks"]

TICK_S = 32e-6
RATE_TICKS = 32
GAIN_BITS = 14


class Check(enum.Enum, shape=3):
    """What was found first."""

    NONE = 0
    MODEL = 1    # the axis goes another way than the model of its drive
    SILENT = 2   # no edge of either phase
    PHASE_A = 3  # B alone has edges
    PHASE_B = 4  # A alone has edges
    AGAINST = 5  # against the command
    SHARE = 6    # much less, or much more, than the drive was told
    RATE = 7     # faster than any drive


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

    The drive is told ``gain`` times Er. In every tick the model's speed comes nearer to that by
    1/128 of the way: a lag of 4 ms, that of filter, current loop and speed loop. Within ``window``,
    but for Er above 15, the drive is told to stand: a real one has an offset.

    ``check`` is raised, and stays until ``clear``, when one of these fails:

    * *Misfit.* The difference of the model's way and the pulses that came, forgotten by 1/512 a
      tick (in 16 ms), is no more than ``allowance`` and half of the model's own way, forgotten as
      fast. So the drive's gain may be off by half in any motion: the half makes room for as much of
      the difference as such a drive ever has. The allowance is for lags other than 4 ms.
    * *Share.* Over a stretch of at least 128 pulses told, or come, and 512 ticks (from its 16th
      pulse on) there came at least 1/8 of what was told, in its direction, and at most 8 times as
      much. A stretch begins anew when it has passed, at each change of the direction that is told,
      and when the drive is told to stand. At 8192 pulses it ends whatever its time. So a coder that
      is lost is found after some pulses, however slow the axis; and a gain that is set wrong makes
      the axis trip in motion, but never blind.
    * *Rate.* In 32 ticks there came no more than ``fastest`` pulses of either direction.

    What fails tells more than that if it can: ``SILENT``, ``PHASE_A`` and ``PHASE_B`` if no edge
    of a phase, or of both, came while the drive was told 32 pulses; then ``AGAINST`` if there came
    more than 16 pulses against at least 16 that were told.

    While ``on`` is low, or something has been found, nothing is checked, and nothing kept but the
    model's speed, which then follows the feedback pulses: so a drive that is enabled while it
    coasts is known to do so. A tick in which it was so is not judged.

    Latency: a tick is judged ``STEPS`` clocks after ``tick``; ``RATE`` comes 1 clock after the
    pulse too many. Ticks are at least ``STEPS`` clocks apart.

    The sums in exact numbers: ``testbench/models/supervision.py``.
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
        Velocity gain of the position loop, in 2**-20 pulse/tick per pulse of Er.
    size : In(15), negative : In(1)
        Er as the DAC has it.
    standing : In(1)
        Er is within the window in which the axis is in position.
    fp, fp_reverse : In(1)
        Feedback pulse and its direction.
    a, b : In(1)
        Phases of the coder, filtered.
    on : In(1)
        The drive follows ``size``.
    clear : In(1)
        Forget what was found.
    check : Out(Check)
        What was found.

    Raises
    ------
    ValueError
        If ``allowance`` or ``fastest`` is below 1.
    """

    SIZE, GAIN = 15, GAIN_BITS   # bits: of the velocity command, of the gain,
    PACE, CAME = 21, 10          # of a speed (all that they can make), of the pulses of a tick
    LAG, MEMORY = 7, 9           # shifts: of the model, and of the misfit
    LEAST, BEGUN = 7, 4          # logarithms of pulses: of a stretch, and where its time begins
    LONGEST = 13                 # ... where it ends
    SHARE = 3                    # shift
    LIVELY = 5                   # logarithm of the pulses told without an edge
    FRACTION, COARSE = 12, 8     # bits below the pulse: of speeds and ways; of the misfit
    FINER = 8                    # ... more of Er times the gain
    STEPS = SIZE + 6

    def __init__(self, *, allowance=200, fastest=2458):
        for name, value in (("allowance", allowance), ("highest rate", fastest)):
            if value < 1:
                raise ValueError(f"the {name} must be at least 1 pulse, not {value!r}")
        self.allowance = allowance
        self.fastest = fastest
        # To look at: clocks since the tick, speed of the model, misfit; and of the stretch under
        # way what was told and what came.
        self.step = Signal(range(self.STEPS + 1), init=self.STEPS)
        self.valid = Signal()  # ``on`` since before the tick, and nothing found
        self.came = Signal(signed(self.CAME))
        self.speed = Signal(signed(self.PACE + 1))
        self.misfit = Signal(signed(self.PACE + self.MEMORY - self.FRACTION + self.COARSE + 2))
        self.way = Signal(self.LONGEST + 1 + self.FRACTION)
        self.back = Signal(signed(self.LONGEST + 2))
        self.side = Signal()
        super().__init__({
            "tick":       In(1),
            "gain":       In(self.GAIN),
            "size":       In(self.SIZE),
            "negative":   In(1),
            "standing":   In(1),
            "fp":         In(1),
            "fp_reverse": In(1),
            "a":          In(1),
            "b":          In(1),
            "on":         In(1),
            "clear":      In(1),
            "check":      Out(Check),
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
        speed = self._model(m, at, valid, came)
        down = speed[-1]
        pace = _size(speed)
        over = self._misfit(m, at, valid, speed, pace, came)
        fails, against, lively = self._stretch(m, at, valid, pace, down, came)
        rated = self._rate(m, valid)

        found = Signal(Check)
        with m.If(~lively.any()):
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
            with m.Elif(at["judge"] & valid & self.on & (over | fails)):
                m.d.sync += self.check.eq(found)

        return m

    def _came(self, m):
        """Pulses that came in the tick before the last, as far as they can be counted."""
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
        """Speed of the model, signed, 2**-12 pulse/tick."""
        # Er times the gain, from the top bit of Er on.
        factor = Signal(self.SIZE)
        told = Signal(self.SIZE + self.GAIN)
        negative = Signal()
        small = self.standing & ~self.size[self.BEGUN:].any()
        with m.If(self.tick):
            m.d.sync += [factor.eq(Mux(small, 0, self.size)), told.eq(0),
                         negative.eq(self.negative)]
        with m.Elif(at["multiply"]):
            m.d.sync += [factor.eq(factor << 1),
                         told.eq((told << 1) + Mux(factor[-1], self.gain, 0))]

        # With the bits below that the lag divides by: nothing is lost, and rest is rest.
        total = Signal(signed(self.PACE + 1 + self.LAG))
        speed = self.speed
        change = Signal(signed(len(speed)))
        m.d.comb += [
            speed.eq(total >> self.LAG),
            change.eq(Mux(at["leak"], speed, Mux(valid, told[self.FINER:], came << self.FRACTION))),
        ]
        with m.If(at["leak"] | at["tell"]):
            minus = at["leak"] | (valid & negative)
            m.d.sync += total.eq(sum_or_difference(total, change, minus))
        return speed

    def _misfit(self, m, at, valid, speed, pace, came):
        """Whether the misfit is more than allowed."""
        below = self.FRACTION - self.COARSE
        misfit = self.misfit
        memory = Signal(len(misfit))  # of the model's way, in any direction
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
        """Whether the share fails, what came went against, and which phases had edges."""
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

        # Edges since the last but one time that so many pulses were told; known to be missing only
        # when as many have been.
        phases = Cat(self.a, self.b)
        before = Signal(2)
        fresh, stale = Signal(2, init=0b11), Signal(2, init=0b11)
        mark = Signal()
        edges = phases ^ before
        m.d.sync += [before.eq(phases), fresh.eq(fresh | edges)]
        with m.If(~valid | (at["add"] & begins)):
            m.d.sync += [fresh.eq(0b11), stale.eq(0b11), mark.eq(0)]
        with m.Elif(at["take"] & (pulses[self.LIVELY] != mark)):
            m.d.sync += [fresh.eq(edges), stale.eq(fresh), mark.eq(~mark)]

        against = (back < -(1 << self.BEGUN)) & pulses[self.BEGUN:].any()
        return ends & (few | many), against, fresh | stale

    def _rate(self, m, valid):
        """Whether a pulse came too many."""
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
