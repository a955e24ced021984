# SPDX-License-Identifier: Apache-2.0
"""The figures of ``make bench``, as one table: ``python -m testbench.bench``."""

import argparse
import sys
import time
from dataclasses import dataclass

from host import machine as machines
from host.link import LinkError
from host.run import Run
from host.simulation import Simulation as Piped
from host.tape import encode, load
from testbench.budget.resources import measure_all
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

BARE_CLOCKS = 5_000_000
RUN_S = 14.0         # of the machine's time: shorts on both sides of Zr
BLOCKS = 400
WATCHED = ["completed", "pp", "path_status_reverse", "event_head_valid"]


@dataclass(frozen=True)
class Reaction:
    """What followed a short, in clocks after the sample that completed it."""

    last_forward: int
    reverse: int
    taken: int


def _say(text):
    print(text, file=sys.stderr, flush=True)


def _run(tape, *, watched=(), until_s=None):
    """A tape on the sinker; returns the run, what changed, and CPU seconds."""
    machine = machines.load("sinker")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=not watched) as native:
        if watched:
            native.watch(watched)
        job = Run(machine, tape, Piped(native), until_s=until_s)
        began = time.process_time()
        job.execute()
        return job, native.changes(), time.process_time() - began


def simulation_speed():
    """Rows on the speed of the whole simulated system, and of its netlist alone."""
    machine = machines.load("sinker")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=False) as native:
        began = time.process_time()
        native.bare(BARE_CLOCKS)
        bare = BARE_CLOCKS / (time.process_time() - began)
    job, _, seconds = _run(load(TAPES / "sink_shallow_deep.nc"), until_s=RUN_S)
    whole = job.simulation.cycle / seconds
    yield "simulated clocks per CPU second, whole system", f"{whole / 1e6:.2f} million"
    yield "the netlist alone", f"{bare / 1e6:.2f} million"
    yield "ratio", f"{whole / bare:.2f}"


def firmware_cost():
    """Rows on the clocks that the firmware spends on a block."""
    body = "".join(f"N{n} G01 X{n % 7 * 0.013:.3f} Y{n % 5 * 0.017:.3f} F{600 + n}\n"
                   for n in range(1, BLOCKS))
    told = []
    machine = machines.load("sinker")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=False) as native:
        job = Run(machine, encode(f"%\nG21 G90 G94\n{body}M02\n%\n"), Piped(native))
        job.execute()
        job.link.on_line = told.append
        job.link.command("$P")
    profile = next(line for line in told if line.startswith("[PRF:")).strip("[]").split(":")[1]
    found = dict(item.split() for item in profile.split(","))
    yield f"firmware per block, of {found['blocks']}", (
        f"mean {found['mean']} clocks, worst {found['worst']}")
    yield "worst step of the firmware's main loop", ", ".join(
        f"{part} {found[part]}" for part in ("events", "path", "program", "link")) + " clocks"
    yield "event of the gateware to the end of its interrupt, worst", f"{found['interrupt']} clocks"


def reactions(changes) -> list[Reaction]:
    """Reactions to every short of a run, from the changes of ``WATCHED``.

    The forward pulse that may come in the clock of the sample itself counts as 0.
    """
    found, sample, forward, reverse = [], None, 0, None
    for clock, name, value in changes:
        if name == "completed" and value:
            sample, forward, reverse = clock, 0, None
        elif sample is None:
            continue
        elif name == "pp" and value and reverse is None:
            forward = clock - sample
        elif name == "path_status_reverse" and value:
            reverse = clock - sample
        elif name == "event_head_valid" and not value and reverse is not None:
            found.append(Reaction(forward, reverse, clock - sample))
            sample = None
    return found


def reaction_times():
    """Rows on the clocks from the sample that completes a short to what follows it."""
    _, changes, _ = _run(load(TAPES / "sink_shallow_deep.nc"), watched=WATCHED, until_s=RUN_S)
    found = reactions(changes)
    if not found:
        raise LinkError("there was no short in the run that reactions are measured in.")
    count = f"worst of {len(found)} shorts"
    yield (f"short to last forward pulse, {count}",
           f"{max(one.last_forward for one in found)} clocks")
    yield f"short to reverse command, {count}", f"{max(one.reverse for one in found)} clocks"
    yield f"short taken up by firmware, {count}", f"{max(one.taken for one in found)} clocks"


def resources():
    """Rows on the cells and the clock of every block on an ECP5."""
    for name, cost in measure_all(_say):
        cells = cost.cells
        clock = f", {cost.fmax_mhz:.0f} MHz" if cost.fmax_mhz else ""
        yield (f"ECP5, {name}",
               f"{cells.lut4} LUT4, {cells.ccu2c} CCU2C, {cells.ff} FF, {cells.ram} DPR16X4, "
               f"{cells.bram} DP16KD, {cells.dsp} MULT18{clock}")


SECTIONS = {"speed": simulation_speed, "firmware": firmware_cost, "reaction": reaction_times,
            "resources": resources}


def main() -> None:
    """Measure the sections asked for, or all, and print the table."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("section", nargs="*", choices=[[], *SECTIONS], default=[])
    print("| figure | value |\n| --- | --- |")
    for name in parser.parse_args().section or SECTIONS:
        _say(f"measuring: {name}")
        for figure, value in SECTIONS[name]():
            print(f"| {figure} | {value} |", flush=True)


if __name__ == "__main__":
    main()
