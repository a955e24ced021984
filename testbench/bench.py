# SPDX-License-Identifier: Apache-2.0
"""The figures of ``make bench``, as one table: ``python -m testbench.bench``."""

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path
from unittest.mock import patch

from constraints.boards import BOARDS
from host.machines import machine as machines
from host.machines.machine import Machine
from host.roughing.basic import read_all
from host.roughing.staircase import Job
from host.run.clearing import LINKS
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.run.summary import clear_of_shorts
from host.tape.tape import encode, load
from softcore import image
from softcore.tables.settings import named
from testbench.budget.peers import measure_peers
from testbench.budget.resources import measure_all
from testbench.cosim import reaction
from testbench.cosim.netlist import SEEN, compare
from testbench.cosim.panel_browser import chromium_path, first_picture_s
from testbench.cosim.planning import plan_on
from testbench.cosim.pulses import WAYS, clocks_a_pulse
from testbench.cosim.short_blocks import BLOCK, first_pass, retrace
from testbench.native.simulation import Simulation
from testbench.punch import TAPES
from testbench.study import step_cost

SPEED_S = 6.0        # of the machine's time: setting up, the tape, discharges, retractions
ROUNDS = 3
BLOCKS = 400
SHORT = 160          # blocks of 10 um, 120 of which are gone back over
BOARD_HZ = min(board.clock_hz for board in BOARDS)
STUDIED = 150        # steps of the environment, with retractions
LINE_BYTES = 100_000  # a second, on a line of 1 Mbaud
# The planner's calls, for firmware without one, and the source that has them.
PLANNER = "roughing/commands.c"
NO_PLANNER = """#include "roughing/commands.h"
void roughing_init(void) {}
void roughing_stop(void) {}
void roughing_line(const char *from, uint32_t characters) { (void)from, (void)characters; }
bool roughing_busy(void) { return false; }
roughing_step roughing_serve(bool program_runs, char *text, size_t size, fault *f) {
    (void)program_runs, (void)text, (void)size, (void)f;
    return ROUGHING_WAITS;
}
"""


def _say(text):
    print(text, file=sys.stderr, flush=True)


def _native(**options):
    machine = machines.load("sinker")
    return Simulation(clock_hz=machine.clock_hz, seed=1,
                      **{"trace": False, "machine": machine.tables} | options)


def _run(native, tape, *, until_s=None):
    """A tape on the sinker; returns the run, and CPU seconds."""
    job = Run(machines.load("sinker"), tape, Piped(native), until_s=until_s)
    began = time.process_time()
    job.execute()
    return job, time.process_time() - began


def simulation_speed():
    """Rows on the speed of the whole simulated system, and of its netlist alone on the same inputs.

    So the netlist does the same work in both, whether the processor sleeps or not. The best of some
    rounds counts: other programs on the computer can only make a round slower.
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


def environment():
    """Row on the cost of a step of the environment over a native run of the same clocks."""
    found = [step_cost(STUDIED) for _ in range(ROUNDS)]
    assert all(one == other for one, other in (cost.ends for cost in found))
    least = min(found, key=lambda cost: cost.environment_s / cost.native_s)
    yield (f"a step of the environment, 20 ms of the machine's time, {STUDIED} of them",
           f"{1000 * least.environment_s / STUDIED:.1f} ms, natively "
           f"{1000 * least.native_s / STUDIED:.1f} ms: ratios " +
           ", ".join(f"{cost.environment_s / cost.native_s:.3f}" for cost in found))


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


def short_blocks():
    """Rows on blocks of 10 um: the first pass at two clocks, and the way back."""
    mm = BLOCK / 10_000
    for text, circle in (("X.01", False), ("X-0.1234 Y1.2345", True)):
        for clock_hz in (2_000_000, BOARD_HZ):
            cost = first_pass(SHORT, clock_hz, circle=circle)
            yield (f"{SHORT} blocks of 10 um as {text} at {clock_hz / 1e6:.0f} MHz, first pass",
                   f"{clock_hz / cost.clocks * mm:.1f} mm/s, {cost.clocks:.0f} clocks a block; "
                   f"{cost.said:.1f} bytes of events, 1 Mbaud takes them at "
                   f"{LINE_BYTES / cost.said * mm:.0f} mm/s")
    forward, back, again = retrace(SHORT, 120)
    yield (f"{SHORT} blocks of 10 um with rapid feed at 2 MHz: first pass, way back over 120, and "
           "forward again", f"{forward:.2f}, {back.mean:.1f} and {again.mean:.1f} mm/s")


def path_pulses():
    """Rows on the least distance between path pulses at the highest speed."""
    for way in WAYS:
        mean, least = clocks_a_pulse(way)
        yield f"path pulses at the highest speed, {way}", f"{mean:.4f} clocks, least {least}"


def _memory(sources):
    """Bytes of code and constants, and of data, of the firmware."""
    with (tempfile.TemporaryDirectory() as place, patch.object(image, "SOURCES", sources),
          patch.object(image, "BUILD", Path(place))):
        made = image.target_image()
        elf = made.with_suffix(".elf").read_bytes()
        code = made.stat().st_size
    # ELF32, little-endian: place of the program headers, their size and number; sizes in each.
    table, size, number = (int.from_bytes(elf[at:at + width], "little")
                           for at, width in ((28, 4), (42, 2), (44, 2)))
    headers = [[int.from_bytes(elf[at + 4 * word:at + 4 * word + 4], "little") for word in range(8)]
               for at in range(table, table + size * number, size)]
    end = max(address + taken for kind, _, address, _, _, taken, *_ in headers if kind == 1)
    return code, end - code


def planning():
    """Rows on roughing planned by the controller: its clocks, and its memory."""
    data = read_all("copper", "steel")[1:3]
    for undersize_um in (110, 150):
        with _native() as native:
            _, found = plan_on(native, data, Job(70, undersize_um, 15))
        yield (f"planning 70 mm2, {undersize_um} um, 15 mm: {len(found['steps'])} steps",
               f"{found['clocks'] / 1e6:.1f} million clocks, {found['clocks'] / BOARD_HZ:.2f} s at "
               f"{BOARD_HZ / 1e6:.0f} MHz; longest step {found['longest']} clocks")
    with tempfile.TemporaryDirectory() as place:
        without = shutil.copytree(image.SOURCES, Path(place) / "firmware")
        (without / PLANNER).write_text(NO_PLANNER)
        code, data = (one - other for one, other in zip(_memory(image.SOURCES), _memory(without),
                                                        strict=True))
    yield "memory of the planner", f"{code} bytes of code, {data} of data"


def reaction_times():
    """Rows on the reaction to a short, in clocks from the sample that completes it."""
    for speed, shorts in reaction.SPEEDS:
        with _native() as native:
            found = reaction.at_speed(native, speed, shorts)["reactions"]
        for title, (mean, worst) in reaction.summary(found).items():
            yield f"{shorts} shorts at {speed} mm/min: {title}", f"{worst} clocks, mean {mean:.1f}"


def clearing_times():
    """Rows on the electrode: from the sample that completes a short until it is clear of it.

    With the velocity feed-forward, and in the plain loop.
    """
    tape = load(TAPES / "sink_shallow_deep.nc")
    usual = machines.load("sinker")
    number = str(named("feed_forward").number)
    for share, loop in (100, "feed-forward"), (0, "plain loop"):
        machine = Machine(usual.name, usual.tables | {
            "settings": usual.tables["settings"] | {number: share}})
        with _native(trace=True, machine=machine.tables) as native:
            job = Run(machine, tape, Piped(native))
            job.execute()
            rows = clear_of_shorts(job, job.simulation)
        for row in rows:
            begin = f"{row['shorts']} shorts at R{row['speed']:g}, {loop}: "
            for link, (title, unit) in LINKS.items():
                if one := row[link]:
                    own = f"; the drive alone {one['drive']}" if "drive" in one else ""
                    yield begin + title, f"median {one['median']} {unit}, worst {one['worst']}{own}"


def resources():
    """Rows on the cells and the clock of every block on an ECP5."""
    for name, cost in measure_all(_say):
        cells = cost.cells
        clock = f", {cost.fmax_mhz:.0f} MHz" if cost.fmax_mhz else ""
        yield (f"ECP5, {name}",
               f"{cells.lut4} LUT4, {cells.ccu2c} CCU2C, {cells.ff} FF, {cells.ram} DPR16X4, "
               f"{cells.bram} DP16KD, {cells.dsp} MULT18{clock}")


def peers():
    """Rows on blocks beside those of open projects."""
    for peer, cost in measure_peers(_say):
        yield (f"ECP5, {peer.function}",
               f"{cost.cells.lut4} LUT4, {cost.cells.ccu2c} CCU2C, {cost.fmax_mhz:.0f} MHz; "
               f"{peer.theirs}")


def netlist():
    """Row on the motion after synthesis, of the device's cells, beside the Verilog."""
    found = compare("controller.motion")
    if found.difference is not None or found.seen != SEEN:
        raise SystemExit(f"the motion after synthesis is not as its Verilog: {found}")
    yield (f"motion of {found.cells['LUT4']} LUT4, {found.cells['CCU2C']} CCU2C and "
           f"{found.cells['TRELLIS_FF']} FF beside its Verilog: a jump and a short",
           f"equal in every pin, {found.clocks / 1e6:.1f} million clocks")


def panel():
    """Row on the operator's panel: from its command to the first picture, with all built."""
    path = chromium_path()
    said = "not measured: this computer has no Chromium" if path is None else (
        f"{min(first_picture_s(path) for _ in range(ROUNDS)):.1f} s")
    yield "from the command `gapkeeper panel` to the first picture in a browser, all built", said


SECTIONS = {"speed": simulation_speed, "environment": environment,
            "firmware": firmware_cost, "blocks": short_blocks,
            "pulses": path_pulses, "planning": planning, "reaction": reaction_times,
            "clearing": clearing_times, "panel": panel, "netlist": netlist, "peers": peers,
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
