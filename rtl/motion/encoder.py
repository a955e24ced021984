# SPDX-License-Identifier: Apache-2.0
"""Quadrature decoder: the two phases of a pulse coder to feedback pulses (FP)."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Encoder", "filtered"]


def filtered(m, line, level, samples, name):
    """Glitch filter of ``samples`` clocks from ``line`` to ``level``; returns its next level.

    ``level`` has changed once ``line`` has had its new level in ``samples`` clocks running.
    """
    following = Signal(name=f"{name}_following")
    history = Signal(samples - 1, name=f"{name}_history")
    recent = Cat(line, history)
    m.d.comb += following.eq(Mux(level, recent.any(), recent.all()))
    m.d.sync += [level.eq(following), history.eq(recent)]
    return following


class Encoder(wiring.Component):
    """Four feedback pulses for each period of the two phases.

    A phase is taken to have changed once it has had its new level in ``samples`` clocks running;
    shorter glitches are ignored. One changed phase is one feedback pulse, up if ``a`` leads ``b``.
    Both changed in one clock is a jump: the direction cannot be known, nothing is counted and
    ``illegal`` stays set until ``clear``.

    The latency is ``samples`` clocks: with the first clock of a clean new level as clock 0, ``fp``
    (or ``jump``) is high in clock ``samples``. A phase must hold each level for ``samples`` clocks
    and the two must change in different clocks: four clocks from edge to edge are ample for
    ``samples=3``. For ``settle`` clocks after reset the levels are taken over without counting.

    Proof: ``testbench/formal/test_encoder.py``.

    Parameters
    ----------
    samples : int
        Length of the glitch filter in clocks, at least 1 (which filters nothing).
    settle : int
        Clocks after reset in which nothing is counted, at least ``samples``.

    Members
    -------
    a : In(1)
        First phase, synchronous to the clock.
    b : In(1)
        Second phase, synchronous to the clock.
    clear : In(1)
        Clear ``illegal``; it wins over a jump in the same clock.
    a_level : Out(1)
        First phase after the filter, in step with ``fp``.
    b_level : Out(1)
        Second phase after the filter.
    fp : Out(1)
        Feedback pulse, for one clock.
    fp_reverse : Out(1)
        Its direction, high for down (``b`` leads). Valid while ``fp`` is high.
    jump : Out(1)
        Both phases changed in one clock: high for one clock, once for each time.
    illegal : Out(1)
        There was a jump since ``clear``; rises with ``jump``.

    Raises
    ------
    ValueError
        If ``samples`` or ``settle`` is too small.
    """

    def __init__(self, *, samples=3, settle=15):
        if samples < 1:
            raise ValueError(f"glitch filter must have at least 1 sample, not {samples!r}")
        if settle < samples:
            raise ValueError(f"settling must last at least the {samples} clocks of the glitch "
                             f"filter, not {settle!r}")
        self.samples = samples
        self.settle = settle
        super().__init__({
            "a":          In(1),
            "b":          In(1),
            "clear":      In(1),
            "a_level":    Out(1),
            "b_level":    Out(1),
            "fp":         Out(1),
            "fp_reverse": Out(1),
            "jump":       Out(1),
            "illegal":    Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        a = filtered(m, self.a, self.a_level, self.samples, "a")
        b = filtered(m, self.b, self.b_level, self.samples, "b")

        settling = Signal(range(self.settle + 1), init=self.settle)
        with m.If(settling != 0):
            m.d.sync += settling.eq(settling - 1)

        a_changed = (a != self.a_level) & (settling == 0)
        b_changed = (b != self.b_level) & (settling == 0)
        m.d.sync += [
            self.fp.eq(a_changed ^ b_changed),
            # Going up, the new level of ``a`` differs from the old one of ``b``, no matter which
            # of the two changed.
            self.fp_reverse.eq(a == self.b_level),
            self.jump.eq(a_changed & b_changed),
            self.illegal.eq((self.illegal | (a_changed & b_changed)) & ~self.clear),
        ]

        return m
