# SPDX-License-Identifier: Apache-2.0
"""Whether a controller is what this checkout makes: firmware, gateware, clock, memory."""

import time

from host.doctor.examination import Examination
from host.errors import UserError
from host.firmware import Firmware, built

__all__ = ["CLOCK_SHARE", "firmware", "gateware", "memory"]

CLOCKED_S = 1.0     # time over which the clock is measured
READ_S = 30.0       # for the whole memory; a simulation is slow
CLOCK_SHARE = 0.02  # by which the time of this computer and of the line may be wrong


def firmware(doctor: Examination, told: list[str]) -> None:
    """Compare the firmware's digest with that of this checkout, compiled for its memory."""
    line = next((text for text in told if text.startswith("[FIRMWARE:")), None)
    if line is None:
        doctor.find("firmware", None, "it tells no digest")
        return
    there = Firmware.of(line)
    try:
        image = built(there.memory, doctor.say)
    except UserError as error:
        doctor.find("firmware", None, f"{there.name}; {error}")
        return
    digest = int.from_bytes(image[-4:], "little")
    same = there.digest == digest
    doctor.find("firmware", same, f"{there.name}, that of this checkout" if same else
                f"{there.name}; this checkout's is {digest:08x}: gapkeeper firmware brings it "
                "there")


def gateware(doctor: Examination) -> None:
    """Compare the gateware's digest with this checkout's, and measure its clock."""
    from softcore.top import digest  # it loads Amaranth
    first, began = doctor.build(), time.monotonic()
    if first is None:
        doctor.find("gateware", False, "it does not know $INPUTS: load a bitstream of this "
                    "checkout (gapkeeper build, gapkeeper flash)")
        return
    if not first.gateware:
        doctor.find("gateware", True, f"a simulation of {first.clock_hz / 1e6:g} MHz")
        return
    own = int(digest()[:8], 16)
    same = first.gateware == own
    doctor.find("gateware", same, f"{first.gateware:08x}, that of this checkout" if same else
                f"{first.gateware:08x}; this checkout's is {own:08x}: load its bitstream "
                "(gapkeeper build, gapkeeper flash)")
    doctor.listen(CLOCKED_S)
    second, ended = doctor.build(), time.monotonic()
    counted_hz = first.clocks_to(second) / (ended - began) if second else 0.0
    wanted_hz = doctor.board.clock_hz
    sound = first.clock_hz == wanted_hz and abs(counted_hz / wanted_hz - 1) <= CLOCK_SHARE
    doctor.find("clock", sound, f"{counted_hz / 1e6:.2f} MHz by this computer's time; the gateware "
                f"is made for {first.clock_hz / 1e6:g} MHz, and the board has "
                f"{wanted_hz / 1e6:g} MHz")


def memory(doctor: Examination) -> None:
    """Read every word of the memory. After a wrong parity the processor is held, and says so."""
    said = doctor.command("$MEMORY", refused=True, within_s=READ_S)
    told = next((text for text in said if text.startswith("[MEMORY:")), None)
    if told:
        doctor.find("memory", True, f"all {told[8:-1]} bytes were read, and their parities are "
                    "right")
