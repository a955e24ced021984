# SPDX-License-Identifier: Apache-2.0
"""ULX3S: ECP5 with 56 pins of 3.3 V on two headers, and a serial link over USB.

The pins are not 5 V tolerant, and every wire of a machine comes through an isolator. J2's pair 14
is left alone: it leads to channels 0 and 1 of the board's converter, a MAX11125, which read the gap
voltage and the fluid cell.

On PCBs after version 2.0, GP and GN 11 to 13 also lead to the board's ESP32, whose firmware may
drive 11 and 12, and may load another bitstream. The bitstream holds it in reset by ``wifi_en``, and
holds ``wifi_gpio0`` high, for whose low level that firmware waits. On version 3.1.7 ``wifi_en`` is
reported to have no effect: so no guard, coder, gate or enable is on 11 and 12.

What happens without a bitstream, and when a wire breaks, stands with each wire
(``constraints/machine_wires.py``). The shift registers come up at random: their output enable must
be wired to ``drive_enable`` (inverted), which a resistor holds low.

The memory is 256 KiB in the 85F and 184 KiB in the 45F; ``docs/reference/retraction.md`` says how
far back along the path each remembers. The smaller devices have too little memory. In the 85F 304
KiB would remember twice as far, but with its 176 block RAMs the layout just misses the clock.

Ref: ULX3S manual, and ``amaranth_boards.ulx3s`` for the headers' pins and the ESP32's; issues 58 of
olofk/edalize (GPIO0) and 4 of emard/ulx3s-misc (enable on 3.1.7).
"""

from pathlib import Path

from amaranth_boards import ulx3s

from constraints.board import Board, Flash, Header, Journal
from constraints.machine_wires import machine_wires
from constraints.pads import CHAIN, FIXED, PADS
from constraints.wires import Wire, resource

__all__ = ["BOARDS"]

HEADER = ("gpio", 0)
ON_BOARD = "no wire: it is on the board"

WIRES = (
    # The FT231X of the USB connector US1.
    Wire("rx", "M1", "link", "idle high", "nothing comes: the link stays silent", header=False,
         pull="UP", hold="board"),
    Wire("tx", "L4", "link", "idle high", "the computer hears nothing", header=False, pull="UP",
         hold="board"),

    *machine_wires({
        # J1: what moves. Of a pair, "+" is GP and "-" is GN.
        "enc_a": "0+ 1+ 2+",
        "enc_b": "0- 1- 2-",
        "dac": "3+ 4+ 5+",
        "dac_negative": "3- 4- 5-",
        "step": "6+ 7+ 8+",
        "estop": "6-",
        "drive_fault": "10- 7- 8-",
        "drive_enable": "9+ 9- 10+",
        "dir": "11+ 11- 12+",
        "gap_noise": "12-",
        "fin": "13+",
        "gap_sense": "13-",
        # J2: the gap, the limit switches, the shift registers.
        "contactor": "15+",
        "arm": "15-",
        "fluid_low": "16-",
        "gap_reference": "16+ 17+ 17-",
        "gap_on": "18+",
        "gap_level": "18- 19+ 19- 20+ 20- 21+",
        "gap_current": "21-",
        "gap_high": "22+",
        "gap_arc": "22-",
        "gap_short": "23+",
        "chain": "23- 24+ 24-",
        "limit_low": "25+ 26+ 27+",
        "limit_high": "25- 26- 27-",
    }),

    # The converter on the board.
    Wire("adc_select", "R17", "converter", "low selects", ON_BOARD, header=False, low=True,
         pull="UP", hold="board"),
    Wire("adc_clock", "P17", "converter", "idle high", ON_BOARD, header=False, pull="UP"),
    Wire("adc_command", "R16", "converter", "plain", ON_BOARD, header=False, pull="UP"),
    Wire("adc_data", "U16", "converter", "plain", ON_BOARD, header=False, pull="UP"),

    # The memory that holds the bitstream. Its clock is the device's own (MCLK).
    Wire("flash_select", "R2", "memory", "low selects", ON_BOARD, header=False, low=True,
         pull="UP", hold="board"),
    Wire("flash_command", "W2", "memory", "plain", ON_BOARD, header=False, pull="UP"),
    Wire("flash_data", "V2", "memory", "plain", ON_BOARD, header=False, pull="UP"),
    Wire("flash_keep", "Y2 W1", "memory", "high lets the memory work", ON_BOARD, header=False,
         pull="UP"),

    # Held in reset: its enable and its GPIO0.
    Wire("esp32_quiet", "F1 L2", "esp32", "low is reset; high does not ask for a bitstream",
         ON_BOARD, header=False, pull="UP"),

    # LED 0.
    Wire("safe", "B2", "lamp", "high is lit", ON_BOARD, header=False, pull="NONE", drive_ma=4),
)
DIRECTIONS = {pad.name: pad.direction for pad in (*PADS, CHAIN, *FIXED)}
RESOURCES = [resource(wire, DIRECTIONS[wire.pad], HEADER) for wire in WIRES]


def _pairs(first: int, last: int) -> tuple[tuple[str, str], ...]:
    return tuple((f"{pair}+", f"{pair}-") for pair in range(first, last + 1))


LABELS = {f"{pair}{sign}": f"G{letter}{pair}" for pair in range(28)
          for sign, letter in (("+", "P"), ("-", "N"))}
HEADERS = (Header("J1", _pairs(0, 13), LABELS), Header("J2", _pairs(14, 27), LABELS))
SITES = dict(ulx3s.ULX3S_85F_Platform.connectors[0].mapping)


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

# W25Q128JV or IS25LP128F, 16 MB. The bitstream has its first 2 MB, and other programs of the board
# may have the next: the journal is far above both.
FLASH = Flash("W25Q128JV or IS25LP128F", 1 << 24,
              Journal(0xE0_0000, 0x1_0000, 0x5_0000))

# Where the gap voltage and the fluid cell go: from comments in the pin list of the board's maker.
ANALOGUE = (
    "**The gap voltage goes to J2 GN14 (U17), the fluid cell to J2 GP14 (U18).** They are "
    "channels 0 and 1 of the converter on the board, a MAX11125. Both are analogue, against "
    "the board's ground: from 0 V to the converter's reference, and never above 3.3 V "
    "(assumed: its inputs are single-ended and unipolar after power-on). The voltage of the "
    "reference was not looked up: measure it before you choose a divider. A full reading is "
    "the gap voltage `reference_full_v` of the [machine's file](machine-file.md). The board's "
    "ground is the computer's USB ground: put an isolating amplifier between the divider at "
    "the gap and the board. Untried.")
ANALOGUE_PINS = {"14-": "gap voltage", "14+": "fluid cell"}

BOARDS = (
    Board("ulx3s", "ULX3S 85F", _Ulx3s85F, clock_hz=40_000_000, memory_size=262_144,
          pin_list=PIN_LIST, wires=WIRES, headers=HEADERS, sites=SITES, flash=FLASH,
          analogue=ANALOGUE, analogue_pins=ANALOGUE_PINS),
    Board("ulx3s_45f", "ULX3S 45F", _Ulx3s45F, clock_hz=40_000_000, memory_size=188_416,
          memory_banks=True, scope_depth=512, pin_list=PIN_LIST, wires=WIRES, headers=HEADERS,
          sites=SITES, flash=FLASH, analogue=ANALOGUE,
          analogue_pins=ANALOGUE_PINS),
)
