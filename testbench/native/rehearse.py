# SPDX-License-Identifier: Apache-2.0
"""A short run from which the compiler learns what is frequent: ``rehearse.py LIBRARY HZ``.

Firmware starts, is idle, takes lines, moves and discharges. It ends with status 1 if nothing was
discharged: the compiler would have learned the wrong things.
"""

import sys
from pathlib import Path

from host.machines.machine import load
from testbench.native.simulation import Simulation

READY = b"$X\n$POSITION=HERE\n"
LINES = b"G92 X0 Y0 Z0.1\nG36 R300 L1 H600 E60 Q0.2\nC130\nM03\nG94 F15\nG01 Z-0.2\n"
STEP = 20_000       # clocks between two looks at what it says
PATIENCE = 500      # looks
CUT = 400_000       # clocks


def until(simulation, text, count=1):
    """Let it run until it has said ``text`` so many times."""
    said = b""
    for _ in range(PATIENCE):
        said += simulation.receive(STEP)
        if said.count(text) >= count:
            return
    sys.exit(f"the rehearsal waits for {text!r}, and hears {said!r}")


def main():
    """Run it."""
    with Simulation(machine=load("sinker").tables, clock_hz=int(sys.argv[2]), seed=1,
                    code=Path(sys.argv[1])) as simulation:
        until(simulation, b"help]")
        simulation.send(READY)
        until(simulation, b"ok", 2)
        simulation.press_arm()
        simulation.send(LINES)
        simulation.run(CUT)
        if not sum(simulation.discharges().values()):
            sys.exit(f"the rehearsal discharged nothing: {simulation.received()!r}")


if __name__ == "__main__":
    main()
