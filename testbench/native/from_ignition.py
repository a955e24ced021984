# SPDX-License-Identifier: Apache-2.0
"""Pulse generator and discriminator, joined behind the pads' delay, as compiled code."""

import ctypes
from functools import cache
from itertools import pairwise

import numpy as np
from amaranth import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.gap.discriminator import Discriminator
from rtl.power.pulse_generator import PulseGenerator
from testbench.native.build import HERE
from testbench.native.component import component_library

__all__ = ["BACK", "OUT", "PULSE", "compiled"]

OUT, BACK = 1, 3    # clocks from a gate to its pin, and from a comparator's pin (``rtl.pads``)
# In the order that ``from_ignition.cpp`` takes them in.
PULSE = "on_time", "wait_time", "off_time", "blanking", "use_current", "delay"


class Joined(wiring.Component):
    """The two blocks as the controller joins them, with the pads' delay on either side."""

    on_time: In(20)
    wait_time: In(20)
    off_time: In(20)
    blanking: In(16)
    use_current: In(1)
    high: In(1)
    current: In(1)
    pin: Out(1)
    sample: Out(1)
    kind: Out(2)

    def elaborate(self, platform):
        m = Module()
        m.submodules.pulses = pulses = PulseGenerator()
        m.submodules.discriminator = judge = Discriminator()
        seen = [Signal(2, name=f"seen_{n}") for n in range(BACK)]
        m.d.sync += [self.pin.eq(pulses.on), seen[0].eq(Cat(self.high, self.current))]
        m.d.sync += [after.eq(before) for before, after in pairwise(seen)]
        m.d.comb += [
            pulses.enable.eq(1), pulses.on_time.eq(self.on_time),
            pulses.wait_time.eq(self.wait_time), pulses.off_time.eq(self.off_time),
            pulses.ignited.eq(judge.ignited),
            judge.on.eq(self.pin), judge.from_ignition.eq(1), judge.blanking.eq(self.blanking),
            judge.use_current.eq(self.use_current), Cat(judge.high, judge.current).eq(seen[-1]),
            self.sample.eq(judge.sample), self.kind.eq(judge.kind),
        ]
        return m


@cache
def _library():
    return component_library(Joined(), HERE / "from_ignition.cpp")


def compiled(pulses: np.ndarray) -> np.ndarray:
    """Clocks that the pin was high, those of them from the ignition on, and class of each pulse.

    ``pulses`` has a row of ``PULSE`` for each. ``delay`` is the clock of the pin in which the gap
    ignites. The class is 4 if there was none in the clock after the pulse.
    """
    pulses = np.ascontiguousarray(pulses, dtype=np.uint32)
    found = np.empty((len(pulses), 3), dtype=np.uint32)
    _library().ignition_run(ctypes.c_uint64(len(pulses)),
                            pulses.ctypes.data_as(ctypes.c_void_p),
                            found.ctypes.data_as(ctypes.c_void_p))
    return found
