# SPDX-License-Identifier: Apache-2.0
"""Conduction: whether a pulse carries current without an ignition delay."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Conduction"]


class Conduction(wiring.Component):
    """Says of each pulse whether current flows without an ignition delay, as in a short.

    A pulse is a run of clocks with ``on`` high, or with ``sense`` high and ``on`` low. It conducts
    if ``current`` is high in this clock and was high in every earlier clock of the pulse except its
    first ``delay`` ones. In those the current may be missing, since the comparator follows the
    gates late. So a discharge that ignites within ``delay`` clocks counts as conducting too.

    ``now`` tells it in the same clock, ``last`` one clock later. ``rtl.gap.discriminator`` gives
    the sample of a pulse in the clock after the pulse: there ``last`` is about the whole pulse.

    Ref: first patent (retraction from the tape): a shorting detector that monitors the contact "in
    the form of the conduction current". The first patent does not say how to tell a short from a
    discharge; the delay is ours.

    Members
    -------
    on, sense : In(1)
        Gates of the main and of the sensing source.
    current : In(1)
        Gap current above its threshold; in a sensing pulse, above the threshold of these.
    delay : In(16)
        Clocks at the start of a pulse that may be without current.
    now, last : Out(1)
        The pulse conducts, as of this clock; as of the last one.
    """

    on: In(1)
    sense: In(1)
    current: In(1)
    delay: In(16)
    now: Out(1)
    last: Out(1)

    def elaborate(self, platform):
        m = Module()

        gates = Signal(2)       # main, sensing: never both
        before = Signal(2)
        same = Signal()         # the pulse goes on
        age = Signal(16)        # clocks of the pulse before this one
        over = Signal()         # the delay was over before this clock
        m.d.comb += [
            gates.eq(Cat(self.on, self.sense & ~self.on)),
            same.eq(gates == before),
            self.now.eq((gates != 0) & self.current & (self.last | ~(same & over))),
        ]
        m.d.sync += [
            before.eq(gates),
            age.eq(Mux(same, age + 1, 1)),
            over.eq(Mux(same, over | (age == self.delay), self.delay == 0)),
            self.last.eq(self.now),
        ]

        return m
