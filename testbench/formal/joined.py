# SPDX-License-Identifier: Apache-2.0
"""The joined machine, and its motion alone, with every input free: what proofs look at.

Registers, coders, comparators and buttons are inputs, so nothing that firmware does is assumed.
"""

from amaranth import *
from amaranth.hdl import Assume
from amaranth.lib import wiring

from rtl.controller import Controller
from rtl.motion.motion import Motion
from softcore.csr import interfaces
from softcore.regmap import OWNED

__all__ = ["CLOCK_HZ", "joined", "motion_alone"]

CLOCK_HZ = 2_000_000


class Free(wiring.Component):
    """A component whose every input is free, and which is not reset on the way."""

    def __init__(self, component):
        self.component = component
        super().__init__(component.signature)

    def elaborate(self, platform):
        m = Module()
        m.submodules.component = self.component
        m.d.comb += Assume(~ResetSignal("sync"))
        wiring.connect(m, wiring.flipped(self), self.component)
        return m


def joined(controller: type[Controller]) -> Free:
    """A controller, by the class that a proof made of it."""
    return Free(controller(registers=interfaces(OWNED), clock_hz=CLOCK_HZ))


def motion_alone(motion: type[Motion]) -> Free:
    """Motion with a window of two segments: what it can do is reached in fewer clocks alone.

    Every input is free, those from the gap, too: it can do all that it can in the joined machine.
    """
    return Free(motion(registers=interfaces(OWNED), slots=2))
