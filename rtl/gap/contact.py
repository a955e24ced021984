# SPDX-License-Identifier: Apache-2.0
"""Contact guard: while the discharge is off, sensing pulses tell of contact with the work."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["ContactGuard"]


class ContactGuard(wiring.Component):
    """Keeps the electrode from being pressed into the work while the discharge is off.

    *Looks.* During a look, ``look`` asks for sensing pulses. A look begins in the clock after the
    first one in which motion is ``wanted`` or going on (``moving``). It ends when there is neither
    and the axes have ``settled``, or after ``settle`` clocks without motion. ``safe``, ``quiet``
    and the discharge end it in the same clock. So an electrode that stands has no voltage.

    *Before a motion.* ``clear_needed`` clear samples in a row of one look (0 counts as 1) show that
    the gap is open, from the next clock to the end of the look. Until then ``wait`` stops forward
    pulses while the discharge is off, except in a segment that leads ``away``.

    *Contact* is the signal Ss in a look, unless the motion is backwards along the path: ``contact``
    is high in the same clocks. In a segment that leads ``away`` the electrode may still touch when
    it starts: there Ss is contact only once the gap was known to be open. In the first clock of
    ``safe`` contact still counts, since it is a cause of ``safe`` itself.

    *Too fast to stop.* ``trip`` is ``contact`` while the ramp is above the start/stop speed
    (``fast``), and for ``lag_time`` clocks after: until then the axes still lag behind, and would
    go on into the work although the command has stopped.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    settle_ms : int
        Longest time of a look after the motion, rounded up to clocks. In 200 ms an axis with a
        position loop gain of 50 1/s has made up all but 0.005 % of its lag.

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
        Contact, and the axes are too fast to stop.

    Attributes
    ----------
    clears, known : Signal(8), Signal(1)
        For proofs: clear samples of the look in a row (wraps), and whether the gap is known to be
        open.

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

        # Clocks for which the axes may still lag, less one: at -1, by its sign alone, no more.
        lags = Signal(signed(29), init=-1)
        with m.If(self.fast):
            m.d.sync += lags.eq(self.lag_time - 1)
        with m.Elif(~lags[-1]):
            m.d.sync += lags.eq(lags - 1)

        m.d.comb += [
            self.wait.eq(self.off & ~self.away & ~known),
            self.contact.eq(looking & active & self.shorted & ~self.reverse
                            & (known | ~self.away)),
            self.trip.eq(self.contact & (self.fast | ~lags[-1])),
        ]
        return m
