# SPDX-License-Identifier: Apache-2.0
"""The whole controller, and its motion alone, with every input free, for proofs.

Registers, coders, comparators and buttons are inputs, so nothing is assumed about firmware.
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
    """A component with every input free and without any reset after the first clock."""

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
    """A controller of the class that a proof derived from it."""
    return Free(controller(registers=interfaces(OWNED), clock_hz=CLOCK_HZ))


def motion_alone(motion: type[Motion]) -> Free:
    """Motion with a window of two segments; alone it reaches its states in fewer clocks.

    Every input is free, those from the gap included: so it has every behaviour that it has in the
    whole controller.
    """
    return Free(motion(registers=interfaces(OWNED), slots=2))
