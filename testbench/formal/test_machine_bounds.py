# SPDX-License-Identifier: Apache-2.0
"""Proof on the joined machine: a retraction never goes beyond its limit, nor beyond the floor."""

import pytest
from amaranth import *
from amaranth.hdl import Assert, Assume, Cover

from rtl.controller import Controller
from rtl.events import Cause
from rtl.motion.motion import Motion
from rtl.motion.retraction import Retraction, State
from testbench.formal.joined import joined, motion_alone
from testbench.formal.prover import prove

SETTLED = 6     # clocks that a floor has stood: the bound has followed it
FAR = 1 << 29   # no two coordinates of the path lie so far apart: 50 m


class Bounded(Retraction):
    """No pulse of a retraction leads beyond its limit, nor beyond the floor.

    The limit is measured from the front at the first short of a series, for others from the front;
    the floor counts once it has stood for ``SETTLED`` clocks. Coordinates of the path, those that
    firmware gives too, lie within ``FAR`` of each other; all else is free, when they change, too.
    """

    def __init__(self):
        self.pulse = Signal()   # Ps
        super().__init__()

    def _bounds(self, m, own):
        bounds = super()._bounds(m, own)
        jump = own.cause == Cause.JUMP
        base, reach, limit = Signal(signed(32)), Signal(31), Signal(signed(32))
        m.d.comb += [
            base.eq(Mux(own.returning & (own.cause == Cause.SHORT), self.first, self.front)),
            reach.eq(Mux(jump, own.force["jump_distance"], own.force["limit"])),
            limit.eq(base - reach),
        ]
        floor, stood = Signal(signed(32)), Signal(range(SETTLED + 1))
        m.d.sync += floor.eq(self.floor)
        with m.If(self.floor != floor):
            m.d.sync += stood.eq(0)
        with m.Elif(stood != SETTLED):
            m.d.sync += stood.eq(stood + 1)

        def beyond(place, bound):
            return (place - bound)[:32].as_signed() < 0

        def near(place):
            apart = (place - self.front)[:32].as_signed()
            return (apart < FAR) & (apart > -FAR)

        m.d.comb += [Assume(near(place)) for place in (
            self.floor, self.behind, self.ahead, self.first, self.command)]
        m.d.comb += [Assume(own.force[word] < FAR) for word in ("limit", "jump_distance")]

        back = Signal()
        m.d.comb += back.eq((self.state == State.RETRACTING) | (self.state == State.AT_LIMIT))
        with m.If(back & self.pulse):
            m.d.comb += Assert(~beyond(self.command, limit))
            with m.If(stood == SETTLED):
                m.d.comb += Assert(~beyond(self.command, floor))
        # What makes the argument close: it goes back, with data.
        with m.If(back):
            m.d.comb += [Assert(self.reverse), Assert(jump | own.force["valid"])]
        at_limit = (self.state == State.AT_LIMIT) & (self.position == self.command)
        m.d.comb += [
            Cover(at_limit & (self.command == limit) & beyond(floor, limit)),
            Cover(at_limit & (self.command == floor) & beyond(limit, floor)),
            Cover(back & jump & self.pulse & (self.command == limit)),
        ]
        return bounds


class BoundedMotion(Motion):
    """Motion with it; no more pulses come than the ramp can store."""

    RETRACTION = Bounded

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.d.comb += [self.retraction.pulse.eq(self.feed.ps),
                     Assume(~self.feed.ps | (self.ramp.stored != (1 << 24) - 1))]
        return m


class Machine(Controller):
    """The joined machine with it."""

    MOTION = BoundedMotion


@pytest.mark.soak
def test_no_retraction_goes_beyond_its_bounds(workdir):
    prove(motion_alone(BoundedMotion), workdir, depth=10)


@pytest.mark.soak
def test_no_retraction_of_the_joined_machine_goes_beyond_its_bounds(workdir):
    prove(joined(Machine), workdir, depth=10)


@pytest.mark.soak
def test_both_bounds_are_reached(workdir):
    prove(motion_alone(BoundedMotion), workdir, depth=64, mode="cover")
