# SPDX-License-Identifier: Apache-2.0
"""Whether a controller is what this checkout makes: firmware, gateware, clock, memory."""

from host.doctor.examination import Examination
from host.errors import UserError
from host.firmware import Firmware, built

__all__ = ["CLOCK_SHARE", "firmware", "gateware", "memory"]

CLOCKED_S = 5.0     # time over which the clock is measured
READ_S = 30.0       # for the whole memory; a simulation is slow
CLOCK_SHARE = 0.02  # the computer and the line take some ms, 0.3 % of that time


def firmware(doctor: Examination, told: list[str]) -> int:
    """Compare the firmware's digest with that of this checkout, compiled for its memory.

    Returns the bytes of its memory; 0 if it does not tell them.
    """
    line = next((text for text in told if text.startswith("[FIRMWARE:")), None)
    if line is None:
        doctor.find("firmware", None, "it tells no digest")
        return 0
    there = Firmware.of(line)
    try:
        image = built(there.memory, doctor.say)
    except UserError as error:
        doctor.find("firmware", None, f"{there.name}; {error}")
        return there.memory
    digest = int.from_bytes(image[-4:], "little")
    same = there.digest == digest
    doctor.find("firmware", same, f"{there.name}, that of this checkout" if same else
                f"{there.name}; this checkout's is {digest:08x}: gapkeeper firmware brings it "
                "there")
    return there.memory


def gateware(doctor: Examination, memory_bytes: int) -> bool:
    """Compare the gateware's digest with this checkout's, and memory and clock with the board's.

    The digest is of the sources, the board and its pins.

    Returns false if the gateware is another board's, by its digest or its memory: its wires are at
    other pins.
    """
    from softcore.build import BOARDS, gateware_digest  # they load Amaranth
    first, began = doctor.build(), doctor.answered_s
    if first is None:
        doctor.find("gateware", False, "it does not know $INPUTS: load a bitstream of this "
                    "checkout (gapkeeper build, gapkeeper flash)")
        return True
    if not first.gateware:
        doctor.find("gateware", True, f"a simulation of {first.clock_hz / 1e6:g} MHz")
        return True
    digests = {name: int(gateware_digest(board)[:8], 16) for name, board in BOARDS.items()}
    own = digests[doctor.board.name]
    there = [name for name, value in digests.items() if value == first.gateware]
    if first.gateware == own:
        doctor.find("gateware", True, f"{own:08x}, that of this checkout for {doctor.board.name}")
    elif there:
        doctor.find("gateware", False, f"{first.gateware:08x}, that of this checkout for "
                    f"{there[0]}, not for {doctor.board.name}: give the board that is there by "
                    "--board, or load its bitstream (gapkeeper flash)")
    else:
        doctor.find("gateware", False, f"{first.gateware:08x}; this checkout's for "
                    f"{doctor.board.name} is {own:08x}: load its bitstream (gapkeeper build, "
                    "gapkeeper flash), else a wire may be at another pin than the one told here")
    if memory_bytes != doctor.board.memory_size:
        doctor.find("board", False, f"the memory has {memory_bytes} bytes, and that of "
                    f"{doctor.board.name} has {doctor.board.memory_size}: give the board that is "
                    "there by --board")
    doctor.listen(CLOCKED_S)
    second, ended = doctor.build(), doctor.answered_s
    counted_hz = first.clocks_to(second) / (ended - began) if second else 0.0
    wanted_hz = doctor.board.clock_hz
    sound = first.clock_hz == wanted_hz and abs(counted_hz / wanted_hz - 1) <= CLOCK_SHARE
    doctor.find("clock", sound, f"{counted_hz / 1e6:.2f} MHz by this computer's time; the gateware "
                f"is made for {first.clock_hz / 1e6:g} MHz, and the board has "
                f"{wanted_hz / 1e6:g} MHz")
    return first.gateware == own or (not there and memory_bytes in (0, doctor.board.memory_size))


def memory(doctor: Examination) -> None:
    """Read every word of the memory. After a wrong parity the processor is held, and says so."""
    said = doctor.command("$MEMORY", refused=True, within_s=READ_S)
    told = next((text for text in said if text.startswith("[MEMORY:")), None)
    if told:
        doctor.find("memory", True, f"all {told[8:-1]} bytes were read, and their parities are "
                    "right")
    else:
        doctor.find("memory", None, "it does not know $MEMORY")
