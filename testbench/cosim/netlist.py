# SPDX-License-Identifier: Apache-2.0
"""The cells of the device run a tape beside the Verilog that they were synthesised from."""

from dataclasses import dataclass
from pathlib import Path

from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from testbench.native import synthesised
from testbench.native.pair import difference, pair_library
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

__all__ = ["SEEN", "Compared", "compare"]

MACHINE = machines.load("sinker")
UNTIL_S = 1.8   # 3.6 million clocks
SEEN = ["jump", "resume", "short", "resume"]    # in that time


@dataclass(frozen=True)
class Compared:
    """What ran: its cells by kind, causes of the retractions in order, and clocks.

    ``difference`` is the clock and the pin of the first difference, or None.
    """

    cells: dict[str, int]
    seen: list[str]
    clocks: int
    difference: tuple[int, str] | None


def compare(part: str = "", changed: Path | None = None) -> Compared:
    """Run a tape with a jump and a short; compare every pin in every clock.

    Parameters
    ----------
    part : str
        The part that is synthesised, below ``soc``; the whole controller if it is empty.
    changed : Path, optional
        Folder with another netlist of it.
    """
    made = changed or synthesised.netlist(MACHINE.clock_hz, part)
    library = pair_library(MACHINE.clock_hz, model=synthesised.model(made))
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as native:
        native.keep_inputs()
        seen: list[str] = []

        def shorted(run):
            """After the first jump, a short until the electrode backs."""
            for event in run.events[len(seen):]:
                seen.append(event.get("cause", event["event"]))
                if seen[-1] in {"resume", "short"}:
                    native.set("force.short", int(seen[-1] == "resume" and "short" not in seen))

        Run(MACHINE, load(TAPES / "sink_jump.nc"), Piped(native), until_s=UNTIL_S,
            watch=shorted).execute()
        causes = [cause for cause in seen if cause in {"jump", "short", "resume"}]
        return Compared(synthesised.cells(made), causes, native.cycle,
                        difference(native, library))
