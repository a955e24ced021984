# SPDX-License-Identifier: Apache-2.0
"""The figures of ``make bench``, as one table: ``python -m testbench.bench``."""

import argparse
import sys
import time

from host import machine as machines
from host.run import Run
from host.simulation import Simulation as Piped
from host.tape import encode, load
from testbench.budget.resources import measure_all
from testbench.cosim import reaction
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

SPEED_S = 6.0        # of the machine's time: setting up, the tape, discharges, retractions
ROUNDS = 3
BLOCKS = 400


def _say(text):
    print(text, file=sys.stderr, flush=True)


def _native(**options):
    machine = machines.load("sinker")
    return Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                      **{"trace": False} | options)


def _run(native, tape, *, until_s=None):
    """A tape on the sinker; returns the run, and CPU seconds."""
    job = Run(machines.load("sinker"), tape, Piped(native), until_s=until_s)
    began = time.process_time()
    job.execute()
    return job, time.process_time() - began


def simulation_speed():
    """Rows on the speed of the whole simulated system, and of its netlist alone on the same inputs.

    So the netlist does the same work in both, with the processor asleep and awake alike. The best
    of some rounds counts: what else runs on the computer can only make one slower.
    """
    tape = load(TAPES / "sink_shallow_deep.nc")
    whole, bare = [], []
    for _ in range(ROUNDS):
        with _native(trace=True) as native, _native() as alone:
            native.keep_inputs()
            _, seconds = _run(native, tape, until_s=SPEED_S)
            whole.append(native.cycle / seconds / 1e6)
            began = time.process_time()
            alone.replay(native)
            bare.append(native.cycle / (time.process_time() - began) / 1e6)
    yield "simulated clocks per CPU second, whole system", f"{max(whole):.2f} million"
    yield "the netlist alone, on the same inputs", f"{max(bare):.2f} million"
    yield "ratio", f"{max(whole) / max(bare):.2f}"


def firmware_cost():
    """Rows on the clocks that the firmware spends on a block."""
    body = "".join(f"N{n} G01 X{n % 7 * 0.013:.3f} Y{n % 5 * 0.017:.3f} F{600 + n}\n"
                   for n in range(1, BLOCKS))
    told = []
    with _native() as native:
        job, _ = _run(native, encode(f"%\nG21 G90 G94\n{body}M02\n%\n"))
        job.link.on_line = told.append
        job.link.command("$P")
    profile = next(line for line in told if line.startswith("[PRF:")).strip("[]").split(":")[1]
    found = dict(item.split() for item in profile.split(","))
    yield f"firmware per block, of {found['blocks']}", (
        f"mean {found['mean']} clocks, worst {found['worst']}")
    yield "worst step of the firmware's main loop", ", ".join(
        f"{part} {found[part]}" for part in ("events", "path", "program", "link")) + " clocks"
    yield "event of the gateware to the end of its interrupt, worst", f"{found['interrupt']} clocks"


def reaction_times():
    """Rows on the clocks from the sample that completes a short to what follows it."""
    for speed, shorts in reaction.SPEEDS:
        with _native() as native:
            found = reaction.at_speed(native, speed, shorts)["reactions"]
        for title, (mean, worst) in reaction.summary(found).items():
            yield f"{shorts} shorts at {speed} mm/min: {title}", f"{worst} clocks, mean {mean:.1f}"


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
