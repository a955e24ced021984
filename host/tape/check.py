# SPDX-License-Identifier: Apache-2.0
"""Check a tape with the firmware's own reader and parser, compiled for this computer."""

import ctypes
from collections.abc import Sequence

from host.errors import TapeError, UsageError
from host.link.framing import check_line
from host.machines.machine import Machine
from host.tape.tape import Tape

NO_AXIS = 15    # number of the jump axis if there is none, as on a wire machine
JUMP_AXIS = 2


def check(tape: Tape, mdi: Sequence[str] = (), machine: Machine | None = None) -> int:
    """Check a tape after the lines ``mdi`` entered by hand; return the number of its blocks.

    With a ``machine`` its clock, its settings and the ends of its travel are checked too, from the
    start place of its file.

    Raises
    ------
    TapeError
        If the tape has a fault; with the firmware's sentence.
    UsageError
        If a line cannot be entered by hand, or the firmware refuses it.
    """
    from softcore.image import host_library
    library = ctypes.CDLL(str(host_library()))
    sentence = ctypes.create_string_buffer(200)

    def enter(line: str, name: str) -> None:
        if library.gk_check_line(line.encode(), sentence, len(sentence)):
            raise UsageError(f"{name} is refused by the controller: {sentence.value.decode()}")

    library.gk_check_forget()
    if machine is not None:
        library.gk_check_machine(machine.clock_hz, machine.pulses_per_mm,
                                 NO_AXIS if machine.kind == "wire" else JUMP_AXIS,
                                 machine.level_max)
        for number, value in machine.settings.items():
            enter(f"${number}={value}", f"machine {machine.name}: settings.{number}")
        enter(machine.start_line, f"machine {machine.name}: its place at the start")
    for line in mdi:
        check_line(line)
        enter(line.upper(), f'the line "{line}" entered by hand')
    blocks = int(library.gk_check(tape.rows, len(tape.rows), sentence, len(sentence)))
    if blocks < 0:
        raise TapeError(tape.told(sentence.value.decode()))
    return blocks
