# SPDX-License-Identifier: Apache-2.0
"""Clock of the controller, made from a board's crystal."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Pll"]

OSCILLATOR_HZ = 600_000_000  # the PLL's own, which must lie between 400 and 800 MHz
LARGEST_DIVISOR = 128


class Pll(wiring.Component):
    """The PLL of an ECP5: one clock made from another.

    The oscillator of the PLL runs at 600 MHz. One divider makes ``clock`` of it. Another one makes
    the frequency of ``source``, to which the PLL compares its oscillator.

    Ref: Lattice FPGA-TN-02200, sysCLOCK PLL.

    Parameters
    ----------
    source_hz, clock_hz : int
        Both frequencies; 600 MHz is a multiple of each, at most 128 times.

    Members
    -------
    source : In(1)
        The clock that comes in.
    clock : Out(1)
        The clock that goes out.
    locked : Out(1)
        ``clock`` is good. Asynchronous.

    Raises
    ------
    ValueError
        If the PLL cannot make the frequency.
    """

    source: In(1)
    clock: Out(1)
    locked: Out(1)

    def __init__(self, *, source_hz: int, clock_hz: int):
        if any(OSCILLATOR_HZ % hz or OSCILLATOR_HZ // hz > LARGEST_DIVISOR
               for hz in (source_hz, clock_hz)):
            raise ValueError(f"the PLL cannot make {clock_hz} Hz from {source_hz} Hz")
        self.source_hz = source_hz
        self.clock_hz = clock_hz
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        divisor = OSCILLATOR_HZ // self.clock_hz
        compared = OSCILLATOR_HZ // self.source_hz
        feedback = Signal()
        m.submodules.pll = Instance(
            "EHXPLLL",
            a_ICP_CURRENT="12", a_LPF_RESISTOR="8", a_MFG_ENABLE_FILTEROPAMP="1",
            a_MFG_GMCREF_SEL="2",
            p_PLLRST_ENA="DISABLED", p_INTFB_WAKE="DISABLED", p_STDBY_ENABLE="DISABLED",
            p_DPHASE_SOURCE="DISABLED",
            p_OUTDIVIDER_MUXA="DIVA", p_OUTDIVIDER_MUXB="DIVB",
            p_CLKI_DIV=1, p_CLKFB_DIV=1, p_FEEDBK_PATH="CLKOS",
            p_CLKOP_ENABLE="ENABLED", p_CLKOP_DIV=divisor, p_CLKOP_CPHASE=divisor - 1,
            p_CLKOP_FPHASE=0,
            p_CLKOS_ENABLE="ENABLED", p_CLKOS_DIV=compared, p_CLKOS_CPHASE=compared - 1,
            p_CLKOS_FPHASE=0,
            i_RST=0, i_STDBY=0, i_PHASESEL0=0, i_PHASESEL1=0, i_PHASEDIR=1, i_PHASESTEP=1,
            i_PHASELOADREG=1, i_PLLWAKESYNC=0, i_ENCLKOP=0,
            i_CLKI=self.source, i_CLKFB=feedback, o_CLKOP=self.clock, o_CLKOS=feedback,
            o_LOCK=self.locked)
        return m
