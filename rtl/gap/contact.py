# SPDX-License-Identifier: Apache-2.0
"""Contact guard: watches with sensing pulses for the work while the discharge is off."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ContactGuard"]


class ContactGuard(wiring.Component):
    """Nothing is pressed into the work while the discharge is off.

    *Looks.* ``look`` asks for sensing pulses: from the clock after the first in which motion is
    ``wanted`` or going on (``moving``), until there has been neither and the axes have ``settled``,
    or have not for ``settle`` clocks. So there is no voltage at an electrode that stands, and none
    while the discharge is on, nor with ``safe`` or ``quiet``: these end a look in the same clock.

    *Before it moves.* The gap is known to be open from the clock after ``clear_needed`` clear
    samples in a row (0 as 1) of this look, until its end. Until then ``wait`` holds forward pulses
    back while the discharge is off, but for a segment that leads ``away``.

    *Contact* is the signal Ss in a look, unless the motion is backwards along the path: ``contact``
    is high in the same clocks. In a segment that leads ``away`` the electrode may still touch when
    it sets out: there it is contact only once the gap was known to be open. In the first clock of
    ``safe`` it still counts: it is a cause itself.

    *Too fast to stop.* ``trip`` is ``contact`` while the ramp is above the start/stop speed
    (``fast``), and for ``lag_time`` clocks after: until then the axes are still on their way, and
    a command that stops would let them press on.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    settle_ms : int
        The longest that a look lasts after the motion, rounded up to clocks. Axes of 50 1/s have
        come within 0.005 % of their lag by then.

    Members
    -------
    off : In(1)
        The discharge is off.
    safe, quiet : In(1)
        Outputs are safe; the machine has halted.
    wanted : In(1)
        A forward pulse would come but for ``wait`` and ``contact``.
    moving, reverse, fast : In(1)
        The ramp is not at rest, goes backwards, is above the start/stop speed.
    settled : In(1)
        Every axis is in position.
    away : In(1)
        The segment leads away from the work.
    lag_time : In(28)
        In clocks. Read while ``fast`` is high.
    sample, sample_shorted : In(1)
        A sensing pulse was classified; it was shorted.
    clear_needed : In(8)
        In samples.
    shorted : In(1)
        The signal Ss.
    look : Out(1)
        Sensing pulses are wanted.
    wait : Out(1)
        No forward pulses yet.
    contact : Out(1)
        The electrode touches the work.
    trip : Out(1)
        ... and the axes are too fast.

    Attributes
    ----------
    clears, known : Signal(8), Signal(1)
        Clear samples of the look in a row (wraps), and whether the gap is known to be open; for
        proofs.

    Proof: ``testbench/formal/test_contact.py``.

    Raises
    ------
    ValueError
        If ``settle_ms`` is below 1.
    """

    def __init__(self, *, clock_hz, settle_ms=200):
        if settle_ms < 1:
            raise ValueError("a look lasts at least 1 ms longer than the motion, "
                             f"not {settle_ms!r}")
        self.settle = -(-clock_hz * settle_ms // 1000)
        super().__init__({
            "off": In(1), "safe": In(1), "quiet": In(1), "wanted": In(1), "moving": In(1),
            "reverse": In(1), "fast": In(1), "settled": In(1), "away": In(1), "lag_time": In(28),
            "sample": In(1), "sample_shorted": In(1), "clear_needed": In(8), "shorted": In(1),
            "look": Out(1), "wait": Out(1), "contact": Out(1), "trip": Out(1),
        })
        self.clears = Signal(8)
        self.known = Signal()

    def elaborate(self, platform):
        m = Module()

        active = Signal()
        looking = Signal()
        still = Signal(range(self.settle + 1))  # clocks of the look without motion
        m.d.comb += [
            active.eq(self.off & ~self.quiet),
            self.look.eq(looking & active & ~self.safe),
        ]
        with m.If(self.wanted | self.moving):
            m.d.sync += [looking.eq(active & ~self.safe), still.eq(0)]
        with m.Else():
            m.d.sync += [looking.eq(self.look & ~self.settled & (still + 1 < self.settle)),
                         still.eq(still + 1)]

        clear = Signal()
        clears, known = self.clears, self.known
        m.d.comb += clear.eq(self.sample & ~self.sample_shorted)
        with m.If(~self.look):
            m.d.sync += [clears.eq(0), known.eq(0)]
        with m.Elif(self.sample):
            m.d.sync += clears.eq(Mux(self.sample_shorted, 0, clears + 1))
            with m.If(clear & (clears + 1 >= self.clear_needed)):
                m.d.sync += known.eq(1)

        lags = Signal(28)   # clocks for which the axes may still
        with m.If(self.fast):
            m.d.sync += lags.eq(self.lag_time)
        with m.Elif(lags.any()):
            m.d.sync += lags.eq(lags - 1)

        m.d.comb += [
            self.wait.eq(self.off & ~self.away & ~known),
            self.contact.eq(looking & active & self.shorted & ~self.reverse
                            & (known | ~self.away)),
            self.trip.eq(self.contact & (self.fast | lags.any())),
        ]
        return m
