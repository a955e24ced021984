# SPDX-License-Identifier: Apache-2.0
"""What a board must offer, and what is said of one.

A board is an Amaranth platform with a resource for each of ``PADS`` (or for ``CHAIN`` in place of
those of ``CHAINED``), under the pad's name, and a ``Board`` that tells how to build for it. Where
a pin must be inverted so that its wire is active-high, or so that a broken wire is a fault, the
resource says so (``PinsN``).
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from amaranth.build import Platform

__all__ = ["CHAIN", "CHAINED", "PADS", "Board", "Pad"]

AXES = 3


@dataclass(frozen=True)
class Pad:
    """A signal that leaves the device: ``direction`` is ``"i"`` or ``"o"``, ``width`` its pins."""

    name: str
    direction: str
    width: int = 1


PADS = (
    # Serial link to the host; idle high.
    Pad("rx", "i"), Pad("tx", "o"),
    # Quadrature encoders, by axis, X first, as every vector of axes.
    Pad("enc_a", "i", AXES), Pad("enc_b", "i", AXES),
    # Comparators of the gap: above the open level; below the arc level; below the short level;
    # current flows.
    Pad("gap_high", "i"), Pad("gap_arc", "i"), Pad("gap_short", "i"), Pad("gap_current", "i"),
    # The discharge has high frequencies (optional detector).
    Pad("gap_noise", "i"),
    # References of the first three, open, arc, short: density of ones.
    Pad("gap_reference", "o", 3),
    # Serial converter of gap voltage and fluid cell.
    Pad("adc_select", "o"), Pad("adc_clock", "o"), Pad("adc_command", "o"), Pad("adc_data", "i"),
    # Emergency stop, drive faults, limit switches, fluid too low: true stops the machine. The third
    # drive of a wire machine is that of the wire, and a broken wire is its fault.
    Pad("estop", "i"), Pad("drive_fault", "i", AXES),
    Pad("limit_low", "i", AXES), Pad("limit_high", "i", AXES), Pad("fluid_low", "i"),
    # The machine side has done the auxiliary function.
    Pad("fin", "i"),
    # A person at the machine allows the discharge: a push-button.
    Pad("arm", "i"),
    # Velocity command: density of ones, and sign. Or steps. The drives' enable.
    Pad("dac", "o", AXES), Pad("dac_negative", "o", AXES),
    Pad("step", "o", AXES), Pad("dir", "o", AXES), Pad("drive_enable", "o", AXES),
    # The main contactor of the discharge's power supply; it falls off whenever outputs are safe.
    Pad("contactor", "o"),
    # Gates of the discharge and of the sensing source, and the current's level. The sensing source
    # must have a voltage that may be touched (below 60 V DC) and be limited by its own resistance.
    Pad("gap_on", "o"), Pad("gap_level", "o", 6), Pad("gap_sense", "o"),
    # Open voltage (4 bits) and polarity (electrode negative) of the power supply.
    Pad("gap_supply", "o", 5),
    # Code of an M, S or T function, and the strobe of its letter.
    Pad("auxiliary_code", "o", 16), Pad("auxiliary_strobe", "o", 3),
    # The interlock holds the outputs: a lamp.
    Pad("safe", "o"),
)

# Shift registers (data, shift clock, latch clock) for slow outputs, where pins are short.
CHAIN = Pad("chain", "o", 3)
CHAINED = ("auxiliary_code", "auxiliary_strobe", "gap_supply")


@dataclass(frozen=True)
class Board:
    """A board that bitstreams are built for.

    Members
    -------
    name : str
        What ``gapkeeper build`` calls it.
    title : str
        What its maker calls it.
    platform : callable
        Makes its Amaranth platform.
    clock_hz : int
        Frequency of the controller; the board's crystal, or a multiple of it that the PLL makes.
    memory_size : int
        Bytes of block RAM for the processor.
    arm_strapped : bool
        The discharge needs no press of the button ``arm``: whoever builds the machine so has said
        that no hand at it is wanted.
    pin_list : Path
        Its pins as the layout tool reads them; committed, and compared by a test.
    """

    name: str
    title: str
    platform: Callable[[], Platform]
    clock_hz: int
    memory_size: int
    pin_list: Path
    arm_strapped: bool = False
