# SPDX-License-Identifier: Apache-2.0
"""Proof on the whole controller: a retraction passes neither its limit nor the back limit."""

import pytest
from amaranth import *
from amaranth.hdl import Assert, Assume, Cover

from rtl.controller import Controller
from rtl.events import Cause
from rtl.motion.motion import Motion
from rtl.motion.retraction import Retraction
from rtl.states import State
from testbench.formal.joined import joined, motion_alone
from testbench.formal.prover import prove

SETTLED = 6     # clocks for which a back limit must be constant: then the bound has followed it
FAR = 1 << 29   # coordinates of the path are less far apart: 50 m


class Bounded(Retraction):
    """No pulse of a retraction leads beyond its limit, nor beyond the back limit.

    For a short, the limit is measured from the front at the first short of its short burst; for
    any other retraction, from the front. The back limit counts once it has been constant for
    ``SETTLED`` clocks. All coordinates, those that firmware writes included, lie within ``FAR`` of
    each other. All else is free, also when it changes.
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
        back_limit, stood = Signal(signed(32)), Signal(range(SETTLED + 1))
        m.d.sync += back_limit.eq(self.back_limit)
        with m.If(self.back_limit != back_limit):
            m.d.sync += stood.eq(0)
        with m.Elif(stood != SETTLED):
            m.d.sync += stood.eq(stood + 1)

        def beyond(place, bound):
            return (place - bound)[:32].as_signed() < 0

        def near(place):
            apart = (place - self.front)[:32].as_signed()
            return (apart < FAR) & (apart > -FAR)

        m.d.comb += [Assume(near(place)) for place in (
            self.back_limit, self.behind, self.ahead, self.first, self.command)]
        m.d.comb += [Assume(own.force[word] < FAR) for word in ("limit", "jump_distance")]

        back = Signal()
        m.d.comb += back.eq((self.state == State.RETRACTING) | (self.state == State.AT_LIMIT))
        with m.If(back & self.pulse):
            m.d.comb += Assert(~beyond(self.command, limit))
            with m.If(stood == SETTLED):
                m.d.comb += Assert(~beyond(self.command, back_limit))
        # Needed for the induction: a state of going back has valid data.
        with m.If(back):
            m.d.comb += [Assert(self.reverse), Assert(jump | own.force["valid"])]
        at_limit = (self.state == State.AT_LIMIT) & (self.position == self.command)
        m.d.comb += [
            Cover(at_limit & (self.command == limit) & beyond(back_limit, limit)),
            Cover(at_limit & (self.command == back_limit) & beyond(limit, back_limit)),
            Cover(back & jump & self.pulse & (self.command == limit)),
        ]
        return bounds


class BoundedMotion(Motion):
    """Motion with the property; no more pulses come than the ramp can store."""

    RETRACTION = Bounded

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.d.comb += [self.retraction.pulse.eq(self.feed.ps),
                     Assume(~self.feed.ps | (self.ramp.stored != (1 << 24) - 1))]
        return m


class Bounded(Controller):
    """The controller with the property in its motion."""

    MOTION = BoundedMotion


@pytest.mark.soak
def test_no_retraction_goes_beyond_its_bounds(workdir):
    prove(motion_alone(BoundedMotion), workdir, depth=10)


@pytest.mark.soak
def test_no_retraction_of_the_controller_goes_beyond_its_bounds(workdir):
    prove(joined(Bounded), workdir, depth=10)


@pytest.mark.soak
def test_both_bounds_are_reached(workdir):
    prove(motion_alone(BoundedMotion), workdir, depth=64, mode="cover")
