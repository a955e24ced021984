# SPDX-License-Identifier: Apache-2.0
"""Pulse distributor: ramped path pulses become axis pulses along a segment, both ways."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.arithmetic import sum_or_difference

__all__ = ["LineDistributor", "Travel"]


class Travel(wiring.Signature):
    """Steps of one axis in a segment: ``magnitude`` of them, downwards if ``negative``."""

    def __init__(self):
        super().__init__({"magnitude": Out(31), "negative": Out(1)})


class LineDistributor(wiring.Component):
    """Digital differential analyser over a straight segment, for any number of axes.

    After k of the ``length`` path pulses of a segment an axis with travel t has made
    ``floor((2 * k * t + length) / (2 * length))`` steps: at most half a pulse off the line, and
    exactly t at the end. That number depends on k alone, so a pulse back undoes the steps of the
    pulse forward, and the reversed train is the mirror of the forward one. The remainders are
    zero at both ends of a segment, so nothing has to be done at a border between segments.

    A path pulse makes no step or one step on every axis, ``LATENCY`` clocks later. Path pulses come
    at most every 3 clocks; ``length`` and ``travel`` are read in the clock of the pulse and the
    one after it.

    Ref: J. E. Bresenham, Algorithm for computer control of a digital plotter, IBM Systems Journal
    4 (1), 1965 (the half-pulse bound). Proof: ``testbench/formal/test_distributor.py``.

    Parameters
    ----------
    axes : int
        Number of axes, at least 1.
    width : int
        Bits of ``length``.

    Attributes
    ----------
    remainders : list of Signal
        The remainder of each axis, for proofs: twice the distance from the nearest step, times the
        length. It is at least ``-length`` and below ``length``, except in the clock after a pulse.

    Members
    -------
    pulse : In(1)
        A path pulse.
    reverse : In(1)
        It goes back. Read with ``pulse``.
    length : In(width)
        Path pulses of the segment, at least 1.
    travel : In(Travel) x axes
        Steps of each axis, at most ``length``.
    other : In(1) x axes
        On this segment the axis belongs to an arc, so this block does not step it. Read with
        ``pulse``.
    restart : In(1)
        Clear the remainders: the machine stands at a border.
    pi : Out(axes)
        Axis pulses Pi, one clock each.
    pi_reverse : Out(axes)
        They count down. Valid with ``pi``.

    Raises
    ------
    ValueError
        If there is no axis.
    """

    LATENCY = 2

    def __init__(self, *, axes=3, width=30):
        if axes < 1:
            raise ValueError(f"a distributor needs at least 1 axis, not {axes!r}")
        self.axes = axes
        self.width = width
        # In the clock in which a step is due, a remainder is up to three times the length.
        self.remainders = [Signal(signed(width + 3), name=f"remainder_{axis}")
                           for axis in range(axes)]
        super().__init__({
            "pulse": In(1),
            "reverse": In(1),
            "length": In(width),
            "travel": In(Travel()).array(axes),
            "other": In(1).array(axes),
            "restart": In(1),
            "pi": Out(axes),
            "pi_reverse": Out(axes),
        })

    def elaborate(self, platform):
        m = Module()

        second = Signal()
        back = Signal()
        m.d.sync += second.eq(self.pulse & ~self.restart)
        with m.If(self.pulse):
            m.d.sync += back.eq(self.reverse)

        for axis, remainder in enumerate(self.remainders):
            travel = self.travel[axis]
            steps = Signal(name=f"steps_{axis}")
            m.d.comb += steps.eq(Mux(back, remainder < -self.length, remainder >= self.length))
            m.d.sync += self.pi[axis].eq(0)
            operand = Signal(self.width + 2, name=f"operand_{axis}")
            m.d.comb += operand.eq(Mux(second, self.length << 1, travel.magnitude << 1))
            moved = sum_or_difference(remainder, operand, Mux(second, ~back, self.reverse))
            with m.If((self.pulse & ~self.other[axis]) | (second & steps)):
                m.d.sync += remainder.eq(moved)
            with m.If(second & steps):
                m.d.sync += [self.pi[axis].eq(1), self.pi_reverse[axis].eq(back ^ travel.negative)]
            with m.If(self.restart):
                m.d.sync += remainder.eq(0)

        return m
