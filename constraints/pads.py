# SPDX-License-Identifier: Apache-2.0
"""Signals of the machine at the pins of a device: the one table of them."""

from dataclasses import dataclass

__all__ = ["AXES", "CHAIN", "CHAINED", "FIXED", "FLASH_CLOCK", "PADS", "POWER", "Pad"]

AXES = 3


@dataclass(frozen=True)
class Pad:
    """A signal that leaves the device: ``direction`` is ``"i"`` or ``"o"``, ``width`` its pins.

    ``doc`` describes it in a sentence, for ``docs/reference/pins.md``. ``level`` is that of each
    pin while nothing else is known, true = active: of an input in the first clocks, until it has
    come through, and of an output in reset. An ``optional`` input may have no pins on a board: then
    it keeps its level.
    """

    name: str
    direction: str
    width: int = 1
    doc: str = ""
    level: int = 0
    optional: bool = False


PADS = (
    Pad("rx", "i", doc="Serial link from the host; idle high.", level=1),
    Pad("tx", "o", doc="Serial link to the host; idle high.", level=1),
    Pad("enc_a", "i", AXES, "Quadrature encoders, phase A, by axis, X first."),
    Pad("enc_b", "i", AXES, "Quadrature encoders, phase B."),
    Pad("enc_index", "i", AXES, "Their index, once in a turn: for homing on it (setting 560).",
        optional=True),
    Pad("gap_high", "i", doc="Comparator: gap voltage above the open level."),
    Pad("gap_arc", "i", doc="Comparator: gap voltage below the arc level."),
    Pad("gap_short", "i", doc="Comparator: gap voltage below the short level."),
    Pad("gap_current", "i", doc="Comparator: current flows in the gap. For shorts by the current "
        "(setting 467) the driver of gap_sense must lower its level while that is on."),
    Pad("gap_noise", "i", doc="The discharge has high frequencies (optional detector)."),
    Pad("gap_reference", "o", 3, "References of the comparators, open, arc, short: density of "
        "ones."),
    Pad("adc_select", "o", doc="Serial converter of gap voltage and fluid cell: select."),
    Pad("adc_clock", "o", doc="Its clock.", level=1),
    Pad("adc_command", "o", doc="Its input."),
    Pad("adc_data", "i", doc="Its output."),
    Pad("estop", "i", doc="Emergency stop: true stops the machine.", level=1),
    Pad("drive_fault", "i", AXES, "A drive's fault: true stops the machine. The third drive of a "
        "wire machine is that of the wire, and a broken wire is its fault."),
    Pad("limit_low", "i", AXES, "Lower limit switches: true stops the machine."),
    Pad("limit_high", "i", AXES, "Upper limit switches: true stops the machine."),
    Pad("fluid_low", "i", doc="The fluid is too low: true stops the machine while it discharges."),
    Pad("fin", "i", doc="The machine side has done the auxiliary function."),
    Pad("arm", "i", doc="A person at the machine allows the discharge: a push-button."),
    Pad("dac", "o", AXES, "Velocity command: density of ones."),
    Pad("dac_negative", "o", AXES, "Its sign."),
    Pad("step", "o", AXES, "Steps, for drives that take them."),
    Pad("dir", "o", AXES, "Direction of the steps."),
    Pad("drive_enable", "o", AXES, "The drives' enable."),
    Pad("contactor", "o", doc="The main contactor of the discharge's power supply; it falls off "
        "whenever outputs are safe."),
    Pad("gap_on", "o", doc="Gate of the discharge."),
    Pad("gap_level", "o", 6, "Level of the discharge's current."),
    Pad("gap_sense", "o", doc="Gate of the sensing source. It must have a voltage that may be "
        "touched (below 60 V DC) and be limited by its own resistance."),
    Pad("gap_supply", "o", 5, "Open voltage (4 bits) and polarity (electrode negative) of the "
        "power supply."),
    Pad("auxiliary_code", "o", 16, "Code of an M, S or T function."),
    Pad("auxiliary_strobe", "o", 3, "The strobe of its letter."),
    Pad("safe", "o", doc="The interlock holds the outputs: a lamp.", level=1),
    Pad("flash_select", "o", doc="Serial flash memory of the board: select."),
    Pad("flash_command", "o", doc="Its input. Its clock leaves the device by a pin of its own, "
        "which is in no list: the one for loading the bitstream."),
    Pad("flash_data", "i", doc="Its output."),
)
# It leaves an ECP5 by a primitive, through the pin that loads the bitstream.
FLASH_CLOCK = Pad("flash_clock", "o", doc="Clock of the board's flash memory.")

# Outputs that put power on the machine, or move it, while they are active.
POWER = frozenset({"drive_enable", "contactor", "gap_on", "gap_sense", "gap_level", "gap_supply",
                   "step", "dac", "auxiliary_strobe", "chain"})

# Slow outputs, which a board with few pins leads out through shift registers: their order there.
CHAINED = ("auxiliary_code", "auxiliary_strobe", "gap_supply")
CHAIN = Pad("chain", "o", 3, "Shift registers (data, shift clock, latch clock) for "
            + ", ".join(f"`{name}`" for name in CHAINED) + ".")


# Pins with a fixed level, where the board has them: what they drive, and the levels, first bit low.
FIXED = {
    Pad("flash_keep", "o", 2, "Write protection and hold of the flash memory: always high, which "
        "is inactive."): 0b11,
    Pad("esp32_quiet", "o", 2, "Enable of the board's ESP32, always low, and its GPIO0, always "
        "high: so it neither drives pins that it shares nor loads another bitstream."): 0b10,
}
