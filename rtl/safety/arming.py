# SPDX-License-Identifier: Apache-2.0
"""Arming: a hand at the machine allows the discharge."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.lib.debounce import Debounce

__all__ = ["Arming"]

OPEN, CLOSED = 0b01, 0b10  # two bits, so that no single changed bit closes the contactor


class Arming(wiring.Component):
    """Closes the main contactor on an edge of a push-button, until anything makes outputs safe.

    A press is a rise of ``arm`` after which it stays high for ``button_ms``, having been low for
    as long before. In the next clock the press closes ``contactor``, unless outputs are ``safe``
    or ``disarm`` is high then. A button that was held before does not count: it must be released
    first. ``contactor`` opens in the same clock as ``safe`` rises, and in the clock after
    ``disarm``; it stays open until the next press. ``armed`` follows ``close_ms`` later, when the
    contacts have closed: only then are discharges allowed. It falls in the clock after ``safe`` or
    ``disarm`` rises, so that causes of ``safe`` may depend on it; its users must check ``safe``
    as well.

    ``strapped`` replaces the button: the contactor closes as soon as nothing forbids it. A board's
    file sets it if its builder wants no button.

    Proof: ``testbench/formal/test_arming.py``.

    Parameters
    ----------
    clock_hz : int
        Frequency of the clock.
    button_ms : int
        Shortest press, and shortest release before it. At least 1 clock is used.
    close_ms : int
        From the coil to closed contacts. At least 1 clock is used.
    strapped : bool
        There is no button.

    Members
    -------
    arm : In(1)
        The push-button, synchronised.
    safe : In(1)
        Outputs must be safe.
    disarm : In(1)
        Firmware asks for a new press: a strobe. Firmware cannot arm.
    contactor : Out(1)
        Coil of the main contactor.
    armed : Out(1)
        The discharge is allowed.
    """

    def __init__(self, *, clock_hz, button_ms=10, close_ms=30, strapped=False):
        self.clock_hz = clock_hz
        self.button_ms = button_ms
        self.close_ms = close_ms
        self.strapped = strapped
        super().__init__({
            "arm": In(1), "safe": In(1), "disarm": In(1), "contactor": Out(1), "armed": Out(1),
        })
        # For the proof too.
        bounce = max(1, clock_hz * button_ms // 1000)
        self.button = None if strapped else Debounce(rise=bounce, fall=bounce)  # high if released
        self.held = Signal(init=1)  # high in reset: a held button must be released first

    def elaborate(self, platform):
        m = Module()
        closing = max(1, self.clock_hz * self.close_ms // 1000)

        pressed = Signal()
        if self.strapped:
            m.d.comb += pressed.eq(1)
        else:
            m.submodules.button = self.button
            m.d.comb += [self.button.raw.eq(~self.arm),
                         pressed.eq(~self.held & ~self.button.steady)]
            m.d.sync += self.held.eq(~self.button.steady)

        state = Signal(2, init=OPEN)
        # Clocks until the contacts have closed, less one: then its sign, a register, arms. A
        # comparison would be long before everything that depends on it.
        wait = Signal(range(-1, closing), init=closing - 1)
        m.d.comb += [
            self.contactor.eq((state == CLOSED) & ~self.safe),
            self.armed.eq((state == CLOSED) & wait[-1]),
        ]
        with m.If(self.safe | self.disarm):
            m.d.sync += [state.eq(OPEN), wait.eq(closing - 1)]
        with m.Elif(state == CLOSED):
            with m.If(~wait[-1]):
                m.d.sync += wait.eq(wait - 1)
        with m.Elif(pressed):
            m.d.sync += [state.eq(CLOSED), wait.eq(closing - 1)]

        return m
