# SPDX-License-Identifier: Apache-2.0
"""Gear of a coder that is coarser than a pulse: m pulses for n edges."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.gear import GEAR_BITS

__all__ = ["REST_BITS", "CoderGear"]

REST_BITS = GEAR_BITS + 5   # so the pulses of seven edges may be due, with any gear


class CoderGear(wiring.Component):
    """Makes the edges of a coder into pulses.

    With ``n = steps``, ``m = steps + surplus`` and E the sum of all edges since ``clear``, the sum
    P of the pulses made since then goes to

        P = floor((E m + floor(n / 2)) / n)

    by one pulse in every clock without an edge: E m/n rounded to the nearest, half a pulse upwards.
    So P depends on E alone: an edge has the same place from both sides, and no error adds up.

    The first pulse of an edge comes two clocks after it. An edge is lost if E m - P n would reach
    2**20 with it, which takes seven edges at least: the coder was too fast. ``lost`` says so.

    ``clear`` begins to count anew, with the ``steps`` and ``surplus`` of that clock; they change
    only then. An edge of that clock does not count.

    A bit of its state that turns over would shift the pulses against the edges for good. So it has
    a parity.

    Proof: ``testbench/formal/test_coder_gear.py``.

    Members
    -------
    edge, edge_reverse : In(1)
        Edge of the coder, and its direction: down.
    steps : In(16)
        n, at least 1.
    surplus : In(16)
        m - n, so that n is at most m. The sum m is at most 2**16.
    clear : In(1)
        Begin to count.
    forget : In(1)
        Clear ``lost``.
    fp, fp_reverse : Out(1)
        Pulse, and its direction: down.
    lost : Out(1)
        An edge was lost, since ``forget``.
    damaged : Out(1)
        The parity of the state was wrong in the clock before; it stays wrong until ``clear``.
    """

    edge: In(1)
    edge_reverse: In(1)
    steps: In(GEAR_BITS, init=1)
    surplus: In(GEAR_BITS)
    clear: In(1)
    forget: In(1)
    fp: Out(1)
    fp_reverse: Out(1)
    lost: Out(1)
    damaged: Out(1)

    def __init__(self):
        # For proofs: E m + floor(n/2) - P n, which is from 0 to n - 1 once no pulse is due; and the
        # parity, which makes the number of ones odd. Reset belongs to n = m = 1.
        self.rest = Signal(signed(REST_BITS))
        self.parity = Signal(init=1)
        super().__init__()

    def elaborate(self, platform):
        m = Module()

        rest = self.rest
        down = Signal()
        way = Signal(GEAR_BITS + 1)
        changed = Signal(signed(REST_BITS + 1))
        over = Signal()
        following = Signal(signed(REST_BITS))
        m.d.comb += [
            # An edge goes on by m its way; a pulse upwards by n down, and one downwards up.
            way.eq(Mux(self.edge, self.steps + self.surplus, self.steps)),
            down.eq(Mux(self.edge, self.edge_reverse, ~rest[-1])),
            changed.eq(rest + Mux(down, -way, way)),
            over.eq(changed[-1] != changed[-2]),
            following.eq(rest),
        ]
        m.d.sync += [
            rest.eq(following),
            # Not made anew from the state: what is damaged stays so.
            self.parity.eq(self.parity ^ rest.as_unsigned().xor() ^ following.as_unsigned().xor()),
            self.damaged.eq(~(rest.as_unsigned().xor() ^ self.parity)),
            self.fp.eq(0),
            self.fp_reverse.eq(rest[-1]),
            self.lost.eq((self.lost | (self.edge & over & ~self.clear)) & ~self.forget),
        ]
        with m.If(self.edge):
            with m.If(~over):
                m.d.comb += following.eq(changed)
        with m.Elif(rest[-1] | ~changed[-1]):
            m.d.comb += following.eq(changed)
            m.d.sync += self.fp.eq(~self.clear)
        with m.If(self.clear):
            m.d.comb += following.eq(self.steps >> 1)
            m.d.sync += self.parity.eq(~following.as_unsigned().xor())

        return m
