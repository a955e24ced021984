# SPDX-License-Identifier: Apache-2.0
"""The wires between a board and its machine: what they must withstand, and why a pin is as it is.

A ``Wire`` places a pad of ``constraints.board.PADS`` on a board. The pin list, the table of wires,
the drawing and the test for a device without a bitstream are made of it.

**Without a bitstream** an ECP5 lets its pins go. A weak resistor inside the device then pulls each
of them. The data sheet of the ECP5 family (FPGA-DS-02012) gives 30 to 150 uA for a pull in either
direction; this figure, and that some pull is there at all, are from memory. Which direction it has
in an empty device was not looked up, so the worse one is assumed: up. A resistor on the wire must
win against it.
"""

from dataclasses import dataclass

from amaranth.build import Attrs, Pins, PinsN, Resource

__all__ = ["CONFIGURATION_SITES", "GROUND_OHM", "KINDS", "LOW_MAX_V", "PULL_MAX_A", "Kind", "Wire",
           "resource", "unloaded_high", "unloaded_v"]

SUPPLY_V = 3.3
PULL_MAX_A = 150e-6     # of the device's own pull, from memory of the data sheet
RECEIVER_MAX_A = 10e-6  # of what hangs on the wire: an isolator's input, a gate driver's
LOW_MAX_V = 0.8         # highest low level of LVCMOS33
GROUND_OHM = 2200       # the resistor to ground on every wire that must be low

# Sites of bank 8 of the package BG381. The device uses them to load its bitstream, and may drive
# them meanwhile. From amaranth_boards.ulx3s (the flash), from Lattice's pin-out of the package
# (R3 DOUT, T2 SN, T3 WRITEN, U2 CS1N), and from memory (the others).
CONFIGURATION_SITES = frozenset(
    ("R1", "R2", "R3", "T1", "T2", "T3", "U1", "U2", "U3", "V1", "V2", "W1", "W2", "Y2"))


@dataclass(frozen=True)
class Kind:
    """A kind of wire: ``withstand`` is what it and its isolator must withstand, in a sentence."""

    title: str
    withstand: str


KINDS = {
    "link": Kind("serial link", "3.3 V; it stays on the board, and the computer's USB ground is "
                 "the board's: put an isolator into the USB cable."),
    "converter": Kind("serial converter", "3.3 V at some MHz, on the board or within 10 cm of it; "
                      "its analogue side is the divider's."),
    "coder": Kind("pulse coder", "5 V differential from the motor, 10 m in the cable tray of the "
                  "drives: line receiver with 3.3 V outputs, fast isolator (10 Mbit/s)."),
    "comparator": Kind("gap comparator", "the highest open voltage of the power supply at its "
                       "divider, and the discharge's common-mode steps: isolator of 50 kV/us or "
                       "more, delay below 100 ns."),
    "contact": Kind("contact", "24 V through a contact in the machine, broken by any fault: "
                    "an isolated 24 V input that gives 3.3 V while current flows."),
    "button": Kind("push-button", "24 V through a make contact at the machine: an isolated 24 V "
                   "input; a broken wire is an unpressed button."),
    "drive": Kind("drive command", "the drive's own input: an isolator, then a filter to ±10 V, or "
                  "5 V opto inputs for step and direction."),
    "enable": Kind("enable of power", "a relay or a drive's enable input of 24 V behind an "
                   "isolator; without current it is off."),
    "gate": Kind("gate of the discharge", "the power supply's gate driver, at the potential of the "
                 "electrode: isolator of 50 kV/us or more."),
    "reference": Kind("reference", "an isolator and a filter to the comparators' ground, with the "
                      "time constant of the board's file (`reference_rc_us`)."),
    "relay": Kind("relay drivers", "24 V relays behind shift registers with 3.3 V inputs and an "
                  "output enable."),
    "memory": Kind("flash memory", "nothing: it is on the board."),
    "esp32": Kind("ESP32", "nothing: it is on the board."),
    "lamp": Kind("lamp", "nothing: it is on the board."),
}


@dataclass(frozen=True)
class Wire:
    """A pad's place on a board.

    Members
    -------
    pad : str
        Name in ``PADS``, or ``chain``.
    pins : str
        Its pins, first bit first: names of the board's header, or sites of the device.
    kind : str
        Key of ``KINDS``.
    reason : str
        Why it is as it is.
    broken : str
        What happens when the wire breaks.
    header : bool
        ``pins`` are names of the header.
    low : bool
        The pin is low when the signal is true.
    pull : str
        ``"UP"``, ``"DOWN"`` or ``"NONE"``, with a bitstream.
    standard : str
        I/O standard.
    drive_ma : int or None
        Drive of an output; None: the tool's default.
    slow : bool
        An output has slow edges.
    hold : str
        What sets the wire's level without a bitstream: ``"ground"`` a resistor of ``GROUND_OHM`` to
        ground on the wire, ``"supply"`` one to 3.3 V, ``"board"`` a part of the board, ``""``
        nothing but the device's own pull.
    behind : str
        The wire acts only while the wire of this pad is active; empty if nothing stands before it.
    """

    pad: str
    pins: str
    kind: str
    reason: str
    broken: str
    header: bool = True
    low: bool = False
    pull: str = "DOWN"
    standard: str = "LVCMOS33"
    drive_ma: int | None = None
    slow: bool = False
    hold: str = ""
    behind: str = ""


def resource(wire: Wire, direction: str, header: tuple[str, int]) -> Resource:
    """Amaranth's resource for a wire; ``header`` is the board's connector."""
    kind = PinsN if wire.low else Pins
    attributes = {"IO_TYPE": wire.standard}
    if wire.pull != "NONE":
        attributes["PULLMODE"] = wire.pull
    if wire.drive_ma is not None:
        attributes["DRIVE"] = str(wire.drive_ma)
    if wire.slow:
        attributes["SLEWRATE"] = "SLOW"
    pins = (kind(wire.pins, dir=direction, conn=header) if wire.header
            else kind(wire.pins, dir=direction))
    return Resource(wire.pad, 0, pins, Attrs(**attributes))


def unloaded_v(wire: Wire) -> tuple[float, float]:
    """Lowest and highest voltage of a wire while the device has no bitstream."""
    away = PULL_MAX_A + RECEIVER_MAX_A
    if wire.hold == "ground":
        return 0.0, min(SUPPLY_V, away * GROUND_OHM)
    if wire.hold in ("supply", "board"):
        return max(0.0, SUPPLY_V - away * GROUND_OHM), SUPPLY_V
    return 0.0, SUPPLY_V


def unloaded_high(wire: Wire) -> bool | None:
    """Level of a wire while the device has no bitstream: high, low, or None if it is not known."""
    lowest, highest = unloaded_v(wire)
    if highest < LOW_MAX_V:
        return False
    return True if lowest > SUPPLY_V - LOW_MAX_V else None
