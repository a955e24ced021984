# SPDX-License-Identifier: Apache-2.0
"""Requirements for a board, and its description.

A board is an Amaranth platform with a resource for each of ``constraints.pads.PADS`` (or for
``CHAIN`` in place of those of ``CHAINED``), under the pad's name, and a ``Board`` with the data of
its builds. If a pin
must be inverted so that its wire is active-high, or so that a broken wire is a fault, the resource
says so (``PinsN``).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from amaranth.build import Platform

from constraints.pads import CHAIN, POWER
from constraints.wires import CONFIGURATION_SITES, Wire, unloaded_high

__all__ = ["Board", "Flash", "Header", "Journal", "unsafe_unloaded"]

@dataclass(frozen=True)
class Journal:
    """The region of a flash memory for the firmware's journal and two firmware slots, in bytes.

    It is the only one that the controller ever writes. The journal has ``size`` bytes from ``base``
    on; the slots, of ``slot`` bytes each, follow it. All are whole sectors.
    """

    base: int
    size: int
    slot: int = 0

    @property
    def whole(self) -> int:
        """Bytes of the journal and both slots."""
        return self.size + 2 * self.slot


@dataclass(frozen=True)
class Flash:
    """The serial flash memory of a board: its part, its bytes, and the region of the journal."""

    part: str
    size: int
    journal: Journal


@dataclass(frozen=True)
class Header:
    """A header of a board, seen from above: its name, and its rows of pins, two in each.

    A pin is a name that a ``Wire`` may use, or what else is there, such as ``"3V3"``; ``labels``
    has what is printed beside a pin, where that differs.
    """

    name: str
    rows: tuple[tuple[str, str], ...]
    labels: dict[str, str]


@dataclass(frozen=True)
class Board:
    """A board that bitstreams are built for.

    Members
    -------
    name : str
        Its name for ``gapkeeper build``.
    title : str
        Its maker's name for it.
    platform : callable
        Makes its Amaranth platform.
    clock_hz : int
        Frequency of the controller, which the PLL makes from the board's crystal.
    memory_size : int
        Bytes of block RAM for the processor.
    memory_banks : bool
        They are in banks (``softcore.memory``): for devices with few block RAMs.
    arm_strapped : bool
        The discharge needs no press of the button ``arm``, as the machine's builder has decided.
    scope_depth : int
        Entries of the gap oscilloscope (``rtl.gap.scope``), a power of two; 0 for none. 512 take
        a block RAM of 18 kbit.
    dac : str
        How the velocity command leaves: ``"sigma_delta"``, or ``"pwm"`` with a period of 1024
        clocks (``rtl.motion.dac``).
    current_max_a, supply_step_a : float
        Highest discharge current, and one step of the power supply's current. No register exceeds
        as many whole steps as are in that current, 63 at most.
    reference_rc_us : float
        Time constant of the filters between ``gap_reference`` and the comparators.
    supply_settle_us : float
        Time in which the power supply follows its order, from the pins or shift registers on.
    pin_list : Path
        Its pins as the layout tool reads them; committed, and compared by a test.
    wires : tuple of Wire
        The machine's pads on this board.
    headers : tuple of Header
        Its headers, for the drawing.
    sites : dict
        Site of the device for each pin of the headers.
    flash : Flash
        The flash memory that it loads its bitstream from.
    analogue : str
        Where the gap voltage and the fluid cell go, in sentences for the page of the pins.
    analogue_pins : mapping
        What those pins of the headers are that no wire has because they are analogue.
    """

    name: str
    title: str
    platform: Callable[[], Platform]
    clock_hz: int
    memory_size: int
    pin_list: Path
    wires: tuple[Wire, ...]
    headers: tuple[Header, ...]
    sites: dict[str, str]
    flash: Flash
    memory_banks: bool = False
    scope_depth: int = 4096
    arm_strapped: bool = False
    dac: str = "sigma_delta"
    current_max_a: float = 30.0
    supply_step_a: float = 1.5
    reference_rc_us: float = 200.0
    supply_settle_us: float = 0.0
    analogue: str = ""
    analogue_pins: Mapping[str, str] = field(default_factory=dict)

    def sites_of(self, wire: Wire) -> list[str]:
        """Sites of a wire's pins, first bit first."""
        return [self.sites.get(pin, pin) for pin in wire.pins.split()]


def unsafe_unloaded(board: Board) -> list[str]:
    """Complaints about outputs of power that may be active while the device has no bitstream.

    An output of power must be held at its inactive level by a resistor, or stand behind one that
    is; and none may be at a site that the device drives while it loads its bitstream.
    """
    wires = {wire.pad: wire for wire in board.wires}
    found = []

    def inactive(wire: Wire) -> bool:
        return unloaded_high(wire) is wire.low

    for wire in board.wires:
        if wire.pad not in POWER:
            continue
        if wire.pad == CHAIN.name and not wire.behind:
            found.append("chain stands behind nothing: shift registers come up at random")
        before = wires.get(wire.behind)
        if not inactive(wire) and not (before and inactive(before)):
            found.append(f"{wire.pad} may be active: no resistor holds it")
        if wire.behind and not (before and before.pad in POWER and inactive(before)):
            found.append(f"{wire.pad} stands behind {wire.behind}, which may be active")
        found += [f"{wire.pad} is at {site}, which the device may drive while it loads"
                  for site in board.sites_of(wire) if site in CONFIGURATION_SITES]
    return found
