# SPDX-License-Identifier: Apache-2.0
"""Auxiliary functions: M, S and T codes to the machine side, with a handshake."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["AuxiliaryFunctions"]

LETTERS = 3  # M, S, T


class AuxiliaryFunctions(wiring.Component):
    """Sends one function at a time, and waits until the machine side has done it.

    After ``send``, ``function`` is the code. The handshake has three waits: for FIN to be low (it
    may still be high from before); with the letter's strobe up, for FIN to rise; with the strobe
    down, for FIN to fall. ``function`` is stable from the clock after ``send``, at least one clock
    before the strobe, until ``busy`` falls and beyond. ``busy`` is high from the clock after
    ``send`` to the end. If FIN answers at once this takes 3 clocks.

    After ``timeout`` clocks without the awaited level the block gives up: strobe and ``busy`` fall
    and ``timed_out`` is high for one clock. A ``timeout`` of 0 counts as 1. ``safe`` drops strobe
    and function in the next clock, without ``timed_out``. A ``send`` does nothing while ``safe`` or
    ``busy`` is high, or with a letter of 3.

    Ref: the M/S/T codes, their strobes and FIN: first patent, heavy-current switchboard of Fig. 4.

    Members
    -------
    send : In(1)
        Send a function.
    code : In(16), letter : In(2)
        The number, and the letter: 0 M, 1 S, 2 T. Read with ``send``.
    timeout : In(32)
        Longest wait, in clocks.
    safe : In(1)
        Outputs must be safe.
    fin : In(1)
        The machine side has finished.
    function : Out(16)
        The code.
    strobe : Out(3)
        The code is an M, S, T function.
    busy : Out(1)
        A function is under way.
    timed_out : Out(1)
        FIN did not come in time: high for one clock.
    """

    send: In(1)
    code: In(16)
    letter: In(2)
    timeout: In(32)
    safe: In(1)
    fin: In(1)
    function: Out(16)
    strobe: Out(LETTERS)
    busy: Out(1)
    timed_out: Out(1)

    def elaborate(self, platform):
        m = Module()

        letter = Signal(2)
        waited = Signal(32)  # clocks of this wait so far
        late = Signal()      # this is the last clock of the wait
        m.d.comb += late.eq(waited + 1 >= self.timeout)

        m.d.sync += [self.timed_out.eq(0), waited.eq(waited + 1)]

        def wait(state, *, until, strobe, then):
            with m.State(state):
                with m.If(until):   # whether safe or not: a long way to many bits
                    m.d.sync += waited.eq(0)
                with m.If(self.safe):
                    m.d.sync += self.strobe.eq(0)
                    m.next = "Idle"
                with m.Elif(until):
                    m.d.sync += self.strobe.eq(strobe)
                    m.next = then
                with m.Elif(late):
                    m.d.sync += [self.strobe.eq(0), self.timed_out.eq(1)]
                    m.next = "Idle"

        with m.FSM() as states:
            with m.State("Idle"):
                m.d.sync += waited.eq(0)
                with m.If(self.send & (self.letter < LETTERS) & ~self.safe):
                    m.d.sync += [self.function.eq(self.code), letter.eq(self.letter)]
                    m.next = "Preparing"
            wait("Preparing", until=~self.fin, strobe=C(1, LETTERS) << letter, then="Asking")
            wait("Asking", until=self.fin, strobe=0, then="Ending")
            wait("Ending", until=~self.fin, strobe=0, then="Idle")
            m.d.comb += self.busy.eq(~states.ongoing("Idle"))

        return m
