# SPDX-License-Identifier: Apache-2.0
"""Moves of the firmware's model machine along a loaded program, as a test wants them."""

from testbench.firmware import Controller
from testbench.programs import punched

__all__ = ["DATA", "go", "load"]

DATA = "G36 R300 L{limit} H600 E60 Q.1{more}"


def load(machine: Controller, *blocks, limit=5, more="", passes=300):
    """Start a program with the machine standing still; leave the tape open for more."""
    machine.library.gk_speed(0)
    machine.tape(punched([DATA.format(limit=limit, more=more), *blocks]), passes=passes)


def go(machine: Controller, pulses, passes=8):
    """Move along the path in small steps, which firmware follows; return the pulses made."""
    made = idle = 0
    while made != pulses and idle < 20:
        step = min(37, pulses - made) if pulses > 0 else max(-37, pulses - made)
        part = machine.library.gk_go(step)
        machine.run(passes)
        made += part
        idle = 0 if part else idle + 1
    return made
