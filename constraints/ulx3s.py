# SPDX-License-Identifier: Apache-2.0
"""ULX3S: ECP5 with 56 pins of 3.3 V on two headers, and a serial link over USB.

The pins are not 5 V tolerant, and every wire of a machine comes through an isolator. J2's pair 14
is left alone: it leads to channels 0 and 1 of the board's converter, a MAX11125, which read the gap
voltage and the fluid cell.

**Without a bitstream** the device lets its pins go, with pull-downs that are too weak to rely on.
Every output below is high when active, so a resistor of 4.7 kΩ to ground on each keeps discharge
and sensing off, the drives disabled and steps away. The shift registers come up at random: their
output enable must be wired to ``drive_enable`` (inverted), which has such a resistor. ``tx`` has
the USB chip's pull-up: idle. The lamp ``safe`` is then dark.

**With a broken wire** an input falls to its own pull-down. For every input that guards the machine
this is a fault: such inputs are closed contacts, or outputs that say "good", to 3.3 V. The voltage
comparators are high above their level, so that a broken wire is a short and the electrode retracts.
The current comparator is high while no current flows, so that a broken wire is a stuck gate. The
supervision finds a silent encoder, a time-out a lost FIN.

The memory is 304 KiB in the 85F and 184 KiB in the 45F; ``docs/reference/retraction.md`` says how
far back along the path each remembers. The smaller devices have too little memory.

Ref: ULX3S manual, and ``amaranth_boards.ulx3s`` for the headers' pins.
"""

from pathlib import Path

from amaranth.build import Attrs, Pins, PinsN, Resource
from amaranth_boards import ulx3s

from constraints.board import Board

__all__ = ["BOARDS"]

HEADER = ("gpio", 0)
INPUT = Attrs(IO_TYPE="LVCMOS33", PULLMODE="DOWN")
OUTPUT = Attrs(IO_TYPE="LVCMOS33", PULLMODE="DOWN", DRIVE="8", SLEWRATE="SLOW")


def _input(name, pins, *, broken_is_fault=False):
    kind = PinsN if broken_is_fault else Pins
    return Resource(name, 0, kind(pins, dir="i", conn=HEADER), INPUT)


def _output(name, pins):
    return Resource(name, 0, Pins(pins, dir="o", conn=HEADER), OUTPUT)


RESOURCES = (
    # The FT231X of the USB connector US1.
    Resource("rx", 0, Pins("M1", dir="i"), Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP")),
    Resource("tx", 0, Pins("L4", dir="o"), Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP")),

    # J1: what moves. Of a pair, "+" is GP and "-" is GN.
    _input("enc_a", "0+ 1+ 2+"),
    _input("enc_b", "0- 1- 2-"),
    _output("dac", "3+ 4+ 5+"),
    _output("dac_negative", "3- 4- 5-"),
    _output("step", "6+ 7+ 8+"),
    _output("dir", "6- 7- 8-"),
    _output("drive_enable", "9+ 9- 10+"),
    _input("drive_fault", "10- 11+ 11-", broken_is_fault=True),
    _input("estop", "12+", broken_is_fault=True),
    _input("fluid_low", "12-", broken_is_fault=True),
    _input("fin", "13+"),
    _output("gap_sense", "13-"),

    # J2: the gap, the limit switches, the shift registers.
    _output("contactor", "15+"),
    _input("arm", "15-"),
    _input("gap_noise", "16-"),
    _output("gap_reference", "16+ 17+ 17-"),
    _output("gap_on", "18+"),
    _output("gap_level", "18- 19+ 19- 20+ 20- 21+"),
    _input("gap_current", "21-", broken_is_fault=True),
    _input("gap_high", "22+"),
    _input("gap_arc", "22-", broken_is_fault=True),
    _input("gap_short", "23+", broken_is_fault=True),
    _output("chain", "23- 24+ 24-"),
    _input("limit_low", "25+ 26+ 27+", broken_is_fault=True),
    _input("limit_high", "25- 26- 27-", broken_is_fault=True),

    # The converter on the board.
    Resource("adc_select", 0, PinsN("R17", dir="o"), Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP")),
    Resource("adc_clock", 0, Pins("P17", dir="o"), Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP")),
    Resource("adc_command", 0, Pins("R16", dir="o"), Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP")),
    Resource("adc_data", 0, Pins("U16", dir="i"), Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP")),

    # LED 0.
    Resource("safe", 0, Pins("B2", dir="o"), Attrs(IO_TYPE="LVCMOS33", DRIVE="4")),
)


class _WithPads:
    """Adds the machine's pads to a platform of this board."""

    def __init__(self):
        super().__init__()
        self.add_resources(RESOURCES)


class _Ulx3s85F(_WithPads, ulx3s.ULX3S_85F_Platform):
    pass


class _Ulx3s45F(_WithPads, ulx3s.ULX3S_45F_Platform):
    pass


PIN_LIST = Path(__file__).with_name("ulx3s_85f.lpf")  # the sizes differ in the device only

BOARDS = (
    Board("ulx3s", "ULX3S 85F", _Ulx3s85F, clock_hz=50_000_000, memory_size=311_296,
          pin_list=PIN_LIST),
    Board("ulx3s_45f", "ULX3S 45F", _Ulx3s45F, clock_hz=50_000_000, memory_size=188416,
          pin_list=PIN_LIST),
)
