# SPDX-License-Identifier: Apache-2.0
"""A short run from which the compiler learns what is frequent: ``rehearse.py LIBRARY``.

Firmware starts, is idle, takes lines, moves and discharges. It ends with status 1 if nothing was
discharged: the compiler would have learned the wrong things.
"""

import sys
import tomllib
from pathlib import Path

from testbench.native.simulation import Simulation

MACHINE = Path(__file__).parents[1] / "plant" / "sinker.toml"
READY = b"$X\n$POSITION=HERE\n"
LINES = b"G92 X0 Y0 Z0.1\nG36 R300 L1 H600 E60 Q0.2\nC130\nM03\nG94 F15\nG01 Z-0.2\n"
START = 300_000  # clocks until firmware takes lines, and some
UNLOCK = 60_000  # until it has unlocked: a button that is pressed before does not count
CUT = 400_000


def main():
    """Run it."""
    machine = tomllib.loads(MACHINE.read_text())
    with Simulation(machine=machine, clock_hz=int(machine["clock_hz"]), seed=1,
                    code=Path(sys.argv[1])) as simulation:
        simulation.run(START)
        simulation.send(READY)
        simulation.run(UNLOCK)
        simulation.press_arm()
        simulation.send(LINES)
        simulation.run(CUT)
        if not sum(simulation.discharges().values()):
            sys.exit(f"the rehearsal discharged nothing: {simulation.received()!r}")


if __name__ == "__main__":
    main()
