# SPDX-License-Identifier: Apache-2.0
"""What a controller tells of its inputs at rest, and the wires that may be wrong."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from constraints.board import Board
from host.doctor.complaints import OPEN, Place, place
from softcore.safetymap import SAFETY

__all__ = ["BLOCKING", "CLOSED", "CODES", "FULL", "Build", "Inputs", "open_guards", "resting"]

FULL = 1024         # full scale of a comparator's level
CODES = 4096        # codes of the converter
SILENT = 8          # HAL_FLUID_SILENT of hal/hal.h: the converter does not answer
NO_VOLTAGE = CODES // 50    # codes up to which the gap counts as without voltage, 2 % of full scale

# Checks of ``resting`` without which nothing may move: contact is not seen, a gate is on, or nobody
# can tell a press of the button.
BLOCKING = {"gap voltage", "gap_current", "gap_short", "arm"}

FIELDS = next(register for register in SAFETY.registers if register.name == "inputs").fields
SOURCES = ("gap_on", "gap_sense")
CONVERTER = ("adc_select", "adc_clock", "adc_command", "adc_data")

# What a guard means that is not open.
CLOSED = {
    "estop": "closed: no emergency stop",
    "drive_fault": "closed: no drive reports a fault",
    "limit_low": "closed: no axis is on its lower limit switch",
    "limit_high": "closed: no axis is on its upper limit switch",
    "fluid_low": "closed: the fluid is at its level",
}


@dataclass(frozen=True)
class Build:
    """A line ``[BUILD:…]``: digest of the gateware, its clock in Hz, its clock count."""

    gateware: int
    clock_hz: int
    cycle: int

    @classmethod
    def of(cls, line: str) -> "Build | None":
        """What the line says; None if it is no whole line of this kind."""
        found = re.fullmatch(r"\[BUILD:(\d+),(\d+),(\d+)\]", line)
        return found and cls(*map(int, found.groups()))

    def clocks_to(self, later: "Build") -> int:
        """Clocks from this line to a later one; the count wraps at 2**32."""
        return (later.cycle - self.cycle) % 2**32


@dataclass(frozen=True)
class Inputs:
    """A line ``[INPUTS:…]``: levels by pad, and the converter's codes of gap voltage and cell.

    ``silent``: the converter does not answer.
    """

    levels: dict[str, int]
    voltage: int
    cell: int
    silent: bool

    @classmethod
    def of(cls, line: str) -> "Inputs | None":
        """What the line says; None if it is no whole line of this kind."""
        found = re.fullmatch(r"\[INPUTS:(\d+),(\d+),(\d+),(\d+)\]", line)
        if found is None:
            return None
        word, voltage, cell, fluid = map(int, found.groups())
        levels = {}
        for field in FIELDS:
            levels[field.name] = word & (1 << field.bits) - 1
            word >>= field.bits
        return cls(levels, voltage, cell, bool(fluid & SILENT))


def _bits(word: int) -> list[int]:
    return [bit for bit in range(word.bit_length()) if word >> bit & 1]


def open_guards(board: Board, inputs: Inputs) -> Iterator[tuple[str, Place]]:
    """Meaning and wire of every guard that is open."""
    for pad, meaning in OPEN.items():
        for bit in _bits(inputs.levels[pad]):
            yield meaning, place(board, pad, bit)


def resting(board: Board, inputs: Inputs) -> Iterator[tuple[str, str, list[Place]]]:
    """Check, meaning and wires of what does not belong to a machine at rest.

    Both gates are off, so that the gap has no voltage, and levels of half the full scale are tried.
    """
    levels = inputs.levels

    def wrong(check: str, meaning: str, *pads: str | tuple[str, int]) -> tuple[
            str, str, list[Place]]:
        return check, meaning, [place(board, *((pad,) if isinstance(pad, str) else pad))
                                for pad in pads]

    if levels["fin"]:
        yield wrong("fin", "closed, and no function runs: stuck, or the machine side holds it",
                    "fin")
    if levels["arm"]:
        yield wrong("arm", "closed: the button is pressed, or its wire is stuck", "arm")
    if inputs.silent:
        yield wrong("converter", "it does not answer: it is not there or has no supply, or a wire "
                    "of it is broken", *CONVERTER)
    elif inputs.voltage > NO_VOLTAGE:
        yield wrong("gap voltage", f"{100 * inputs.voltage / CODES:.0f} % of full scale with both "
                    "gates off: a gate is on, or the divider's ground is open", *SOURCES)
        return      # the comparators then say what they should
    if levels["gap_current"]:
        yield wrong("gap_current", "current with both gates off: its wire is broken, or a gate is "
                    "on", "gap_current", *SOURCES)
    if levels["gap_noise"]:
        yield wrong("gap_noise", "high frequencies without a discharge: its wire is stuck, or it "
                    "picks up noise", "gap_noise")
    if levels["gap_high"]:
        yield wrong("gap_high", "above its level without a voltage: its wire is stuck, or its "
                    "reference is broken", "gap_high", ("gap_reference", 0))
    if not levels["gap_arc"]:
        yield wrong("gap_arc", "not below its level without a voltage: its wire is stuck, or its "
                    "reference is broken", "gap_arc", ("gap_reference", 1))
    if not levels["gap_short"]:
        yield wrong("gap_short", "not below its level without a voltage: its wire is stuck, or its "
                    "reference is broken. Contact would not be seen", "gap_short",
                    ("gap_reference", 2))
