# SPDX-License-Identifier: Apache-2.0
"""Waiting until what a condition sets outside of the device is in force there too."""

from math import ceil, log

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import bits_for

__all__ = ["LEFT", "Settling", "filter_clocks"]

LEFT = 0.01     # share of a change that may be left when a reference counts as settled
LONGER = 24     # bits of the register


def filter_clocks(clock_hz: int, rc_us: float) -> int:
    """Clocks in which an RC filter has made all but ``LEFT`` of a change, rounded up; at least 1.

    With a time constant of 200 us it takes 921 us.
    """
    return max(1, ceil(rc_us * 1e-6 * -log(LEFT) * clock_hz))


class Settling(wiring.Component):
    """Says whether the power supply and the comparators follow the condition in force.

    The words of a condition change in one clock. But the order to the power supply may leave
    through shift registers, and the references of the comparators pass filters. ``latched`` is
    low in the clock in which ``supply`` differs from the clock before, and up to ``latch``
    clocks in all. ``settled`` does the same for ``reference`` and ``settle`` clocks. A change
    that comes meanwhile begins the time anew. Both are low in the first clocks after reset, the
    longer of both times, as nothing is known of the outside then.

    The register ``longer`` prolongs both times, if it is higher. It acts from the next change
    on. Nothing shortens them: they are constants of the netlist.

    Proof, with the sources: ``testbench/formal/test_settling.py``.

    Parameters
    ----------
    latch, settle : int
        Clocks from a change on until the power supply follows its order, and the comparators
        their references; at least 1.

    Members
    -------
    supply : In(5)
        Order to the power supply.
    reference : In(30)
        Levels of the three references.
    longer : In(24)
        In clocks.
    latched : Out(1)
        The power supply has its order.
    settled : Out(1)
        The comparators have their references.

    Raises
    ------
    ValueError
        If a time is less than 1.
    """

    def __init__(self, *, latch, settle):
        if latch < 1 or settle < 1:
            raise ValueError("the outside takes at least 1 clock to follow, "
                             f"not {latch!r} and {settle!r}")
        self.latch = latch
        self.settle = settle
        super().__init__({"supply": In(5), "reference": In(30), "longer": In(LONGER),
                          "latched": Out(1), "settled": Out(1)})

    def elaborate(self, platform):
        m = Module()
        first = max(self.latch, self.settle)
        for word, clocks, steady in ((self.supply, self.latch, self.latched),
                                     (self.reference, self.settle, self.settled)):
            before = Signal.like(word, name=f"{word.name}_before")
            changed = Signal(name=f"{word.name}_changed")
            # Clocks to come.
            left = Signal(max(bits_for(first), LONGER), init=first, name=f"{word.name}_left")
            m.d.sync += before.eq(word)
            m.d.comb += [changed.eq(word != before), steady.eq(~changed & (left == 0))]
            with m.If(changed):
                m.d.sync += left.eq(Mux(self.longer > clocks, self.longer, clocks) - 1)
            with m.Elif(left != 0):
                m.d.sync += left.eq(left - 1)
        return m
