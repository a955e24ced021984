# SPDX-License-Identifier: Apache-2.0
"""Proof on ``rtl.motion.arc``: the steps depend on the place alone, so it is reversible.

There are two proofs: the major axis along the path, and the minor axis along the major one, for any
steps of the major axis.
"""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In

from rtl.motion.arc import ArcDistributor
from testbench.formal.prover import prove

COUNT, WIDTH, REACH, FINE = 3, 4, 7, 4
WIDE = signed(12)  # nothing overflows in it
WORD = signed(REACH)
LAST = 5  # clocks after a pulse from which on its age does not matter


class ArcContract(wiring.Component):
    """Two axes that go along a piece, turn anywhere, and may enter it again at either end.

    On entering, the state is loaded as from another piece. While ``other`` is high the words belong
    to another piece too: this may be so except from the clock before a pulse to the one after it.
    """

    def __init__(self, piece, *, width=WIDTH):
        self.width = width
        super().__init__({"pulse": In(1), "reverse": In(1), "other": In(1), "enter": In(1),
                          "at_end": In(1), "any_piece": In(data.StructLayout(piece)),
                          "any_pace": In(width), "any_divisor": In(width)})

    def elaborate(self, platform):
        self.m = m = Module()
        m.submodules.dut = self.dut = dut = ArcDistributor(axes=2, width=self.width, reach=REACH,
                                                           fine=FINE)
        m.d.comb += Assume(~ResetSignal("sync"))
        self.piece = piece = Signal.like(self.any_piece)
        self.chosen, self.entered = chosen, entered = Signal(), Signal()
        m.d.sync += chosen.eq(1)
        with m.If(~chosen):
            m.d.sync += piece.eq(self.any_piece)
        m.d.comb += Assert(chosen | ~entered)

        self.age = age = Signal(range(LAST + 1), init=LAST)  # clocks since the last pulse
        self.back = back = Signal()
        self.pulsed, enter, other = Signal(), Signal(), Signal()
        idle = Signal()  # a pulse would come too early
        m.d.comb += [
            self.pulsed.eq(self.pulse & entered & ~idle & (age >= 3) & self.may_go()),
            enter.eq(self.enter & chosen & ~self.pulsed & (age >= 3)),
            other.eq(self.other & ~self.pulsed & (age != 0)),
            dut.pulse.eq(self.pulsed), dut.reverse.eq(self.reverse), dut.enter.eq(enter),
            dut.major.eq(Mux(other, 1, 0)), dut.minor.eq(Mux(other, 0, 1)),
            dut.negative.eq(Mux(other, 1, 2)),
        ]
        m.d.sync += idle.eq(enter | other)
        with m.If(self.pulsed):
            m.d.sync += [age.eq(0), back.eq(self.reverse)]
        with m.Elif(age != LAST):
            m.d.sync += age.eq(age + 1)
        with m.If(enter):
            m.d.sync += entered.eq(1)

        # The pulse under way keeps its inputs.
        taken = dut.taken
        m.d.comb += [Assert(age <= LAST), Assert(dut.stage == Cat(age == at for at in range(4))),
                     Assert((dut.pi == 0) | (age == 0) | (age == 4))]
        with m.If(age <= 3):
            m.d.comb += [Assert(entered), Assert(taken.back == back), Assert(taken.major == 0),
                         Assert(taken.minor == 1), Assert(taken.negative == 2)]

        self.describe(enter, other)
        return m

    def wide(self, value, name):
        """A value, wide enough."""
        self.m.d.comb += (copy := Signal(WIDE, name=name)).eq(value)
        return copy

    def steps(self, axis, enter, entry, *, since):
        """Steps of an axis, forwards, and those with what a pulse ``since`` clocks old decided."""
        m, dut, age = self.m, self.dut, self.age
        count = Signal(signed(COUNT + 2), name=f"count_{axis}")
        now, due = Signal.like(count, name=f"now_{axis}"), Signal.like(count, name=f"due_{axis}")
        down = dut.pi_reverse[axis] ^ (axis == 1)
        m.d.comb += [
            now.eq(count + Mux(dut.pi[axis], Mux(down, -1, 1), 0)),
            due.eq(now + Mux((age >= since) & (age <= 3) & dut.steps[axis],
                             Mux(self.back, -1, 1), 0)),
        ]
        # What is decided still comes out.
        m.d.sync += count.eq(Mux(enter, entry + now - due, now))
        return now, due


class MajorContract(ArcContract):
    """After k path pulses the major axis has made the steps for the sum of k paces."""

    def __init__(self):
        super().__init__({"length": COUNT, "divisor": WIDTH, "pace": WIDTH,
                          "change": signed(WIDTH + 1), "major": COUNT})

    def may_go(self):
        self.place = Signal(COUNT)
        return Mux(self.reverse, self.place != 0, self.place != self.piece.length)

    def describe(self, enter, other):
        m, dut, piece, place, age = self.m, self.dut, self.piece, self.place, self.age

        def due(place):  # steps, times twice the divisor
            return 2 * place * piece.pace + piece.change * (place * (place - 1))

        # A path pulse asks for one step at most, and the axis comes to the end of the piece.
        last = self.wide(piece.pace + piece.change * (piece.length - 1), "last")
        for rule in (piece.length != 0, piece.divisor != 0, piece.pace <= piece.divisor,
                     (last >= 0) & (last <= piece.divisor),
                     due(piece.length) == 2 * piece.divisor * piece.major):
            m.d.comb += Assume(~self.chosen | rule)

        end = Mux(self.at_end, piece.length, 0)
        m.d.comb += [dut.divisor.eq(Mux(other, ~piece.divisor, piece.divisor)),
                     dut.change.eq(Mux(other, ~piece.change, piece.change)),
                     dut.state.pace.eq(piece.pace + piece.change * end)]
        now, to = self.steps(0, enter, Mux(self.at_end, piece.major, 0), since=1)
        turned = Signal()
        with m.If(self.pulsed):
            m.d.sync += [place.eq(Mux(self.reverse, place - 1, place + 1)),
                         turned.eq((turned | (self.reverse & (place == 3))) & (place != 0))]
        with m.If(enter):
            m.d.sync += [place.eq(end), turned.eq(0)]

        remainder = self.wide(due(place) - 2 * piece.divisor * to, "remainder")
        with m.If(self.entered):
            m.d.comb += [
                Assert(place <= piece.length), Assert(dut.remainder == remainder),
                Assert(dut.pace == (piece.pace + piece.change * place)[:len(dut.pace)]),
                Assert((now >= 0) & (now <= piece.major)),
            ]
            with m.If(age != 0):  # at most half a step off
                m.d.comb += [Assert((remainder >= -piece.divisor) & (remainder < piece.divisor)),
                             Assert((to >= 0) & (to <= piece.major))]
                with m.If(place == 0):
                    m.d.comb += Assert(to == 0)
                with m.If(place == piece.length):
                    m.d.comb += Assert(to == piece.major)
        m.d.comb += [
            Cover(turned & (place == piece.length) & (age == 4) & (piece.change == sign)
                  & (piece.major == 3) & (piece.length == 5)) for sign in (-1, 1)]


def test_major_holds(workdir):
    prove(MajorContract(), workdir, depth=3)


def test_major_is_reachable(workdir):
    prove(MajorContract(), workdir, depth=40, mode="cover")


class MinorContract(ArcContract):
    """With every step of the major axis the minor axis is at the place nearest to the curve.

    There is one such place beside each place on the major axis, from whichever side the machine
    came. A pulse that turns back undoes the minor step and the state of the pulse before it.
    ``MajorContract`` shows the same for the major axis.
    """

    def __init__(self):
        super().__init__({"outward": 1, "error": WORD, "along": WORD, "across": WORD}, width=1)

    def may_go(self):
        # The major axis may step with any pulse.
        self.m.d.comb += [self.dut.divisor.eq(self.any_divisor), self.dut.change.eq(self.any_pace),
                          self.dut.state.pace.eq(self.any_pace)]
        return 1

    def describe(self, enter, other):
        m, dut, piece, age, back = self.m, self.dut, self.piece, self.age, self.back
        major, minor = dut.steps
        m.d.comb += [dut.outward.eq(piece.outward ^ other), dut.state.error.eq(piece.error),
                     dut.state.along.eq(piece.along), dut.state.across.eq(piece.across)]

        def midpoints(error, across, name):  # the errors half a step further, and half a step back
            half = across >> 1
            return (self.wide(error + half - FINE // 4, f"further_{name}"),
                    self.wide(error - half + FINE - FINE // 4, f"nearer_{name}"))

        def nearest(error, across, name):  # the curve passes between them
            further, nearer = midpoints(error, across, name)
            return Mux(piece.outward, (nearer < 0) & (further >= 0), (nearer >= 0) & (further < 0))

        # Where the machine stood before the pulse under way.
        error, along, across = (Signal.like(word) for word in (dut.error, dut.along, dut.across))
        with m.If(age == 0):
            m.d.sync += [error.eq(dut.error), along.eq(dut.along), across.eq(dut.across)]
        slope = self.wide(Mux(back, along - 2 * FINE, along), "slope")
        both = self.wide(slope + Mux(back, across - 2 * FINE, across), "both")

        # The place before the last pulse, and that pulse's steps: a pulse that turns undoes them.
        past = [Signal.like(word, name=f"past_{at}") for at, word in enumerate(
            (error, along, across))]
        known, last, last_back = Signal(), Signal(2), Signal()
        with m.If(age == 3):
            m.d.sync += [known.eq(1), last.eq(dut.steps), last_back.eq(back)]
            m.d.sync += [then.eq(now) for then, now in zip(past, (error, along, across),
                                                           strict=True)]
        with m.If(enter):
            m.d.sync += known.eq(0)

        # The rule: the outer of two neighbours if the curve passes outside their midpoint.
        further, nearer = midpoints(dut.error, dut.across, "rule")
        due = Signal()
        m.d.comb += due.eq(major & Mux(back, (nearer < 0) ^ piece.outward,
                                       (further >= 0) ^ piece.outward))

        # It is an arc: the words fit, the piece is entered at the place nearest to the curve,
        # neither axis turns back, and the major one goes further.
        limit = 1 << (REACH - 1)
        for word in (dut.along, dut.across):
            m.d.comb += Assume(~self.entered | ((word >= -limit) & (word < limit)))
        m.d.comb += [Assume(~self.chosen | nearest(piece.error, piece.across + FINE, "start")),
                     Assume(~piece.across[0])]
        with m.If((age == 3) & major):
            m.d.comb += Assume(Mux(piece.outward, slope <= 0, slope >= 0))
        with m.If((age == 3) & due):
            m.d.comb += Assume(Mux(piece.outward, both >= FINE, both <= -FINE))

        with m.If(self.entered):
            m.d.comb += Assert(~dut.across[0])
            with m.If(age <= 3):
                m.d.comb += Assert(dut.taken.outward == piece.outward)
            with m.If((age == 0) | (age >= 4)):
                m.d.comb += Assert(nearest(dut.error, dut.across, "now"))
            with m.Else():
                m.d.comb += [Assert(nearest(error, across, "before")), Assert(dut.across == across)]
            with m.If(age == 1):
                m.d.comb += [Assert(dut.error == error), Assert(dut.along == along)]
            with m.If((age == 2) | (age == 3)):
                m.d.comb += [
                    Assert(dut.along == along + Mux(major, Mux(back, -2 * FINE, 2 * FINE), 0)),
                    Assert(dut.error == Mux(major, Mux(back, error - slope, error + slope), error)),
                ]
            with m.If(age == 3):
                m.d.comb += Assert(minor == due)
        standing = (age == 0) | (age >= 4)
        here = [Mux(standing, word, before) for word, before in (
            (dut.error, error), (dut.along, along), (dut.across, across))]
        by = [Mux(last_back, 2 * FINE - word, word) for word in past[1:]]
        turn = (age == 3) & known & (back != last_back)
        m.d.comb += Assume(~turn | (major == last[0]))
        with m.If(self.entered & known):
            m.d.comb += [
                Assert(nearest(past[0], past[2], "past")), Assert(~turn | (minor == last[1])),
                Assert(here[0] == past[0] + Mux(last[0], by[0], 0) + Mux(last[1], by[1], 0)),
                *(Assert(here[1 + at] == past[1 + at]
                         + Mux(last[at], Mux(last_back, -2 * FINE, 2 * FINE), 0)) for at in (0, 1)),
            ]
        made, down = Signal(2), Signal()
        m.d.sync += [made.eq(Mux(age == 3, dut.steps, 0)), down.eq(back)]
        m.d.comb += [Assert(dut.pi == made),
                     Assert((made == 0) | (dut.pi_reverse == Cat(down, ~down)))]
        m.d.comb += [Cover(turn & minor & (piece.outward == outward) & (back == way))
                     for outward in (0, 1) for way in (0, 1)]


def test_minor_holds(workdir):
    prove(MinorContract(), workdir, depth=2)


def test_minor_is_reachable(workdir):
    prove(MinorContract(), workdir, depth=20, mode="cover")
