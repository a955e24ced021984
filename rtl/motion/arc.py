# SPDX-License-Identifier: Apache-2.0
"""Pulse distributor on arcs: path pulses become axis pulses along a piece of an arc, both ways."""

from amaranth import *
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.arithmetic import sum_or_difference

__all__ = ["FINE", "ArcDistributor", "ArcState"]

FINE = 64  # parts of a pulse in which a piece lies about its centre


class ArcState(wiring.Signature):
    """State with which the machine enters a piece: at its start, or at its end on the way back.

    ``pace`` is the major axis's share of a path pulse, times the divisor. ``error`` says how far
    outside the curve the place is. It is (x**2 + y**2 - R**2) / 64, with the coordinates x and y
    about the centre and the radius R, in 1/64 pulse. ``along`` and ``across`` are its slopes, 2 x
    and 2 y. A slope is positive if a step in the direction of travel increases the error.
    """

    def __init__(self):
        word = signed(32)
        super().__init__({"pace": Out(30), "error": Out(word), "along": Out(word),
                          "across": Out(word)})


class ArcDistributor(wiring.Component):
    """Pulse distributor over a piece of an arc in a plane: exact, and reversible to the pulse.

    Along a piece neither axis of the plane turns back, and the major axis is the faster one at
    every point. Firmware cuts an arc into such pieces, at its octants and as finely as the speed
    needs (``softcore/firmware/path/arc.h``). A path pulse makes no step or one step on each of the
    two axes, ``LATENCY`` clocks later.

    * The major axis goes by a digital differential analyser whose rate changes evenly: after k
      path pulses it has made ``floor((2 * P + divisor) / (2 * divisor))`` steps, with P the sum of
      the paces ``start.pace + i * change`` for i below k. With the cosine of the slope as pace the
      speed along the arc is even. At either end of a piece P must be a multiple of the divisor.
    * The minor axis depends on the major one alone. At each step of the major axis the block
      chooses between two neighbouring places: it takes the outer one if and only if the curve
      passes outside their midpoint (``error`` is below 0 there; ``outward`` says that minor steps
      lead away from the centre). So the place is never further than half a pulse from the curve.
      R**2 is rounded to whole units of ``error``; firmware's ``arc.h`` says what that costs.

    Both numbers depend on k alone: a pulse back undoes the steps of the pulse forward, and the
    reversed train is the mirror of the forward one. At a border between pieces ``enter`` loads
    firmware's words. They must equal the state that this block reaches from the other end.

    Path pulses come at most every 4 clocks. The words of the piece are read from the clock before a
    pulse to the one after it. ``enter`` comes at least 2 clocks before a pulse, and 4 after one.

    Ref: J. E. Bresenham, A linear algorithm for incremental digital display of circular arcs,
    Communications of the ACM 20 (2), 1977 (the midpoint of the neighbours).
    Proof: ``testbench/formal/test_arc.py``.

    Parameters
    ----------
    axes : int
        Number of axes, at least 2.
    width : int
        Bits of the divisor.
    reach : int
        Bits of the words of the state, with sign.
    fine : int
        Parts of a pulse in which the words of the state are, a multiple of 4.

    Attributes
    ----------
    remainder, pace, error, along, across : Signal
        State of the block, for proofs. ``remainder`` is twice the distance of the major axis from
        its nearest step, times the divisor. ``along`` and ``across`` stand half a step ahead: they
        are what the next step forward adds to ``error``.
    stage, taken, steps : Signal
        The pulse under way, for proofs: its age in clocks, one-hot, up to the fourth; the inputs
        that were stored with it; and whether the major and the minor axis step.

    Members
    -------
    pulse, reverse : In(1)
        A path pulse on an arc, and that it goes back.
    divisor : In(width)
        Of the pace, above 0.
    change : In(signed(32))
        Of the pace by a path pulse.
    outward : In(1)
        Minor steps lead away from the centre.
    major, minor : In(2)
        Numbers of the axes.
    negative : In(axes)
        Axes that go down when the path is travelled forwards.
    enter : In(1), state : In(ArcState)
        Load the state.
    pi, pi_reverse : Out(axes)
        Axis pulses Pi, one clock each, and their direction: down. They are low for other axes.

    Raises
    ------
    ValueError
        If there are fewer than 2 axes, or ``fine`` is no multiple of 4.
    """

    LATENCY = 5

    def __init__(self, *, axes=3, width=30, reach=32, fine=FINE):
        if axes < 2:
            raise ValueError(f"an arc needs at least 2 axes, not {axes!r}")
        if fine < 4 or fine % 4:
            raise ValueError(f"parts of a pulse must be a multiple of 4, not {fine!r}")
        self.axes = axes
        self.width = width
        self.reach = reach
        self.fine = fine
        # In the clock in which a step is owed, the remainder is up to three times the divisor.
        self.remainder, self.pace = Signal(signed(width + 3)), Signal(width + 2)
        # Between the steps of the two axes the error is up to a step further off.
        word = signed(reach + 2)
        self.error, self.along, self.across = Signal(word), Signal(word), Signal(word)
        self.stage = Signal(4)
        self.taken = Signal(data.StructLayout({
            "back": 1, "outward": 1, "major": 2, "minor": 2, "negative": axes}))
        self.steps = Signal(2)
        super().__init__({
            "pulse": In(1),
            "reverse": In(1),
            "divisor": In(width),
            "change": In(signed(32)),
            "outward": In(1),
            "major": In(2),
            "minor": In(2),
            "negative": In(axes),
            "enter": In(1),
            "state": In(ArcState()),
            "pi": Out(axes),
            "pi_reverse": Out(axes),
        })

    def elaborate(self, platform):
        m = Module()
        fine = self.fine
        remainder, pace, error = self.remainder, self.pace, self.error
        along, across = self.along, self.across
        taken, stage = self.taken, self.stage
        back = taken.back
        major, minor = self.steps

        # Stored for the pulse under way: the next segment's words may arrive meanwhile.
        m.d.sync += stage.eq(Cat(self.pulse, stage))
        with m.If(self.pulse):
            m.d.sync += [back.eq(self.reverse), taken.outward.eq(self.outward),
                         taken.major.eq(self.major), taken.minor.eq(self.minor),
                         taken.negative.eq(self.negative)]

        # Each register has a companion with its value one step earlier: so either direction takes
        # only an addition.
        pace_before = Signal.like(pace)
        m.d.sync += pace_before.eq(pace - self.change)
        with m.If(self.pulse):
            m.d.sync += pace.eq(Mux(self.reverse, pace_before, pace + self.change))
        due = Signal()
        m.d.comb += due.eq(Mux(back, remainder < -self.divisor, remainder >= self.divisor))
        with m.If(stage[0]):
            m.d.sync += major.eq(due)
        addend = Mux(stage[0], self.divisor, Mux(self.reverse, pace_before, pace)) << 1
        with m.If(self.pulse | (stage[0] & due)):
            m.d.sync += remainder.eq(sum_or_difference(
                remainder, addend, Mux(stage[0], ~back, self.reverse)))

        along_before, across_before = Signal.like(along), Signal.like(across)
        m.d.sync += [along_before.eq(along - 2 * fine), across_before.eq(across - 2 * fine)]
        with m.If(stage[1] & major):
            m.d.sync += along.eq(Mux(back, along_before, along + 2 * fine))

        # The midpoint is half a minor step away; the quarter corrects for the curvature.
        slope, middle = Signal.like(across), Signal.like(error)
        m.d.comb += [
            slope.eq(Mux(back, across_before, across)),
            middle.eq(sum_or_difference(error, slope >> 1, back).as_signed() - fine // 4),
        ]
        with m.If(stage[2]):
            m.d.sync += minor.eq(major & ((middle < 0) ^ ~taken.outward ^ back))
        step = Mux(stage[3], slope, Mux(back, along_before, along))
        with m.If((stage[1] & major) | (stage[3] & minor)):
            m.d.sync += error.eq(sum_or_difference(error, step, back))
        with m.If(stage[3] & minor):
            m.d.sync += across.eq(Mux(back, across_before, across + 2 * fine))

        for axis in range(self.axes):
            m.d.sync += self.pi[axis].eq(stage[3] & (((taken.major == axis) & major)
                                                     | ((taken.minor == axis) & minor)))
            m.d.sync += self.pi_reverse[axis].eq(back ^ taken.negative[axis])

        with m.If(self.enter):
            m.d.sync += [
                remainder.eq(0), pace.eq(self.state.pace), error.eq(self.state.error),
                along.eq(self.state.along + fine), across.eq(self.state.across + fine),
            ]

        return m
