# SPDX-License-Identifier: Apache-2.0
"""The command line ``gapkeeper``.

Exit status: 0 done (program end, or ``--until`` reached); 1 any failure that is not named here;
2 usage; 3 the machine ended in alarm; 4 the tape was rejected before any motion.
"""

import os
import sys
import warnings
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from host.errors import DONE, FAULT, UsageError, UserError
from host.experiments.commands import experiment_app
from host.machines.machine_file import HIGHEST_CLOCK_HZ, LOWEST_CLOCK_HZ
from host.options import (
    BAUD,
    LIVE_PORT,
    Baud,
    ControllerPort,
    FlashFile,
    MachineOfTape,
    WithTcp,
)
from host.places import ROOT
from host.scope.commands import RunScope, record_gap
from host.tape.commands import tape_app
from host.touch.commands import touch_work
from host.tune.commands import tune_drives

app = typer.Typer(
    help="Gapkeeper, an open controller for electric discharge machines: run part programs on a "
         "simulated die-sinker or wire machine whose controller is the real gateware and the real "
         "firmware.",
    epilog="Exit status: 0 done, 1 failure, 2 usage, 3 the machine ended in alarm, 4 the tape was "
           "rejected before any motion.",
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
    rich_markup_mode="markdown")
app.add_typer(tape_app, name="tape")
app.add_typer(experiment_app, name="experiment")


AT_PORT = "With --port"   # heading of the options of --port
INTERRUPTED = 130         # exit status that Typer gives after Ctrl-C
SEEDS = 2**64

out = Console(highlight=False)
err = Console(stderr=True, highlight=False)

TapeFile = Annotated[Path, typer.Argument(
    metavar="TAPE",
    exists=True, dir_okay=False, show_default=False,
    help="Part program as text (.nc) or as punched rows (.ptp).")]


def _seed(seed: int) -> int:
    if not 0 <= seed < SEEDS:
        raise typer.BadParameter(f"a seed is 0 to {SEEDS - 1}.")
    return seed


def _folder(name: str | None) -> str | None:
    if name == "":
        raise typer.BadParameter("an empty name names no folder.")
    return name


@app.command()
def run(
    tape: TapeFile,
    machine: MachineOfTape = None,
    seed: Annotated[int, typer.Option(
        callback=_seed, metavar="N",
        help="Seed of everything random. The same seed gives the same events, to the byte.",
    )] = 1,
    waves: Annotated[bool, typer.Option(
        "--waves", help="Also record waveforms, with a saved view. Slower, and big files.",
    )] = False,
    folder: Annotated[str | None, typer.Option(
        "--out", callback=_folder, metavar="DIR", show_default="build/runs/<tape name>",
        help="Folder for events.jsonl, summary.json, trace.npz and report.html; of a wire machine "
             "also workpiece.npz, what is left of its workpiece.",
    )] = None,
    mdi: Annotated[list[str] | None, typer.Option(
        metavar='"G36 …"', show_default=False,
        help="A line entered by hand before the tape starts, such as retraction data for what the "
             "tape leaves out. May be given several times.",
    )] = None,
    scope: RunScope = None,
    start: Annotated[str | None, typer.Option(
        "--from", metavar="BLOCK", show_default=False,
        help="Begin at a block of the tape: its number as messages have it (7), its N word (N60), "
             "or `last`, where a run with this DIR or the controller's tape broke off. The blocks "
             "before only set modes and places; the way there is without discharge, after Enter.",
    )] = None,
    until: Annotated[float | None, typer.Option(
        min=0.0, metavar="SECONDS", show_default=False,
        help="Stop after so much of the machine's time, the set-up included: the feed is held "
             "within 10 ms, and the axes come to rest. The outcome is then `stopped`.",
    )] = None,
    clock: Annotated[int | None, typer.Option(
        min=LOWEST_CLOCK_HZ, max=HIGHEST_CLOCK_HZ, metavar="HZ",
        show_default="the machine file's",
        help="Clock of the controller, 2 MHz or more: a slow clock simulates faster, but at a "
             "slower one the firmware cannot keep up with its watchdog. With --port: the clock of "
             "the controller there, by which its events count time.",
    )] = None,
    memory: FlashFile = None,
    port: Annotated[str | None, typer.Option(
        metavar="URL", show_default=False, rich_help_panel=AT_PORT,
        help="Run the tape on the controller at a port instead: /dev/ttyUSB0, socket://HOST:PORT, "
             "rfc2217://HOST:PORT. --machine must describe its machine: the settings of that file "
             "are entered, and lengths are counted in its pulses.",
    )] = None,
    baud: Annotated[int, typer.Option(
        min=1, metavar="N", rich_help_panel=AT_PORT,
        help="Bits a second of a serial line.")] = BAUD,
    at_start: Annotated[bool, typer.Option(
        "--at-start", rich_help_panel=AT_PORT,
        help="Declare that the machine stands where the machine's file has it at the start "
             "(`$POSITION=HERE`, `G92`). Without it position and program zero must be declared "
             "already.")] = False,
    no_arm: Annotated[bool, typer.Option(
        "--no-arm", rich_help_panel=AT_PORT,
        help="Do not wait until somebody presses the button `arm`: the tape discharges nothing.",
    )] = False,
    reset: Annotated[bool, typer.Option(
        "--reset", rich_help_panel=AT_PORT,
        help="Take the controller even if it is at work: what it runs is ended.")] = False,
) -> None:
    """Run a tape, and write a report: on the simulated machine, or with --port on a real one.

    The tape is punched (if it is a text) and fed to the controller over its link. In simulation,
    every clock of gateware and firmware is simulated, and the machine with its spark gap around
    them; a programmed stop (M00) is resumed at once. At a port Enter resumes it, and the report
    lacks the values that only a simulated machine can give. Ctrl-C ends a run as --until does:
    feed hold, summary, report.
    """
    if port is not None:
        from host.run.session import run_tape_at
        if waves or seed != 1 or memory:
            raise UsageError("--seed, --waves and --flash are for the simulated machine: a port "
                             "has none.")
        raise typer.Exit(run_tape_at(port, tape, baud=baud, machine=machine,
                                     folder=None if folder is None else Path(folder),
                                     mdi=mdi or [], until_s=until, clock_hz=clock,
                                     at_start=at_start, arm=not no_arm, reset=reset, scope=scope,
                                     start=start, console=out))
    if at_start or no_arm or reset or baud != BAUD:
        raise UsageError("--baud, --at-start, --no-arm and --reset are for a controller at a "
                         "--port.")
    from host.run.session import run_tape
    raise typer.Exit(run_tape(tape, machine=machine, seed=seed, waves=waves,
                              folder=None if folder is None else Path(folder),
                              mdi=mdi or [], until_s=until, clock_hz=clock, scope=scope,
                              flash=memory, start=start, console=out))


app.command("scope")(record_gap)


@app.command(cls=WithTcp)
def simulate(
    tcp: Annotated[str | None, typer.Option(
        metavar="[ADDRESS]", show_default="localhost:3333",
        help="Listen for a TCP connection: HOST:PORT, HOST or PORT. Without an address, and "
             "without this option, on this computer only.")] = None,
    pty: Annotated[bool, typer.Option(
        "--pty", help="Be a serial port of this computer instead: a pseudo-terminal.")] = False,
    machine: Annotated[str, typer.Option(
        metavar="NAME|FILE", help="As of `run`.")] = "sinker",
    arm: Annotated[bool, typer.Option(
        "--arm", help="Press the button `arm` by itself whenever the machine is not armed. Without "
                      "it, Enter presses the button.")] = False,
    seed: Annotated[int, typer.Option(
        callback=_seed, metavar="N", help="Seed of everything random.")] = 1,
    clock: Annotated[int | None, typer.Option(
        min=LOWEST_CLOCK_HZ, max=HIGHEST_CLOCK_HZ, metavar="HZ",
        show_default="the machine file's", help="Clock of the controller, as of `run`.")] = None,
    memory: FlashFile = None,
) -> None:
    """Simulate a controller and its machine, so that any program may connect to them.

    A program that connects talks to the controller's own UART. It may leave and come back. Only one
    program is connected at a time, and bytes sent while there is none are lost. The machine keeps
    to real time, or says how far it falls behind. Ctrl-C switches it off.
    """
    from host.run.live import simulate as live
    if pty and tcp is not None:
        raise UsageError("--tcp and --pty: the controller has one line only.")
    live(machine=machine, tcp=tcp, pty=pty, arm=arm, seed=seed, clock_hz=clock, flash=memory,
         console=out)


@app.command()
def panel(
    port: Annotated[str | None, typer.Option(
        metavar="URL", show_default="a simulated machine",
        help="Port of a controller, as of `run`. It must be idle, and is reset.")] = None,
    machine: Annotated[str, typer.Option(
        metavar="NAME|FILE", help="As of `run`. With --port it describes the machine there; its "
                                  "settings are not entered.")] = "sinker",
    listen: Annotated[str, typer.Option(
        metavar="ADDRESS", show_default="127.0.0.1:8080",
        help="Where the page is served: HOST:PORT, HOST or PORT. Beyond this computer a token is "
             "needed, which stands in the address that is printed.")] = "",
    name: Annotated[list[str] | None, typer.Option(
        metavar="NAME", show_default=False,
        help="A name of this computer by which browsers may call it, beside its own. May be given "
             "several times.")] = None,
    baud: Baud = BAUD,
    seed: Annotated[int, typer.Option(
        callback=_seed, metavar="N", help="Seed of everything random, as of `run`.")] = 1,
    clock: Annotated[int | None, typer.Option(
        min=LOWEST_CLOCK_HZ, max=HIGHEST_CLOCK_HZ, metavar="HZ",
        show_default="the machine file's", help="Clock of the controller, as of `run`.")] = None,
    memory: FlashFile = None,
) -> None:
    """Serve the operator's page: watch, hold, resume, retract, jog, set and run in a browser.

    Several pages may watch; one holds the controls. The page needs no internet. Its Stop is no
    emergency stop. Ctrl-C closes the panel: the machine is held, and the controller reset.
    """
    from host.panel.panel import panel as serve
    if port is not None and memory is not None:
        raise UsageError("--flash is for the simulated machine: a port has none.")
    serve(machine=machine, port=port, baud=baud, clock_hz=clock, seed=seed, listen=listen,
          names=name or [], flash=memory, console=out)


@app.command()
def plan(
    electrode: Annotated[str, typer.Option(metavar="M", show_default=False,
                                           help="Material of the electrode, such as copper.")],
    workpiece: Annotated[str, typer.Option(metavar="M", show_default=False,
                                           help="Material of the workpiece, such as steel.")],
    area: Annotated[float, typer.Option(metavar="MM2", min=0.01, show_default=False,
                                        help="Machined area.")],
    undersize: Annotated[float, typer.Option(
        metavar="UM", min=0.1, max=100_000.0, show_default=False,
        help="Undersize of the electrode, on each side.")],
    depth: Annotated[float, typer.Option(metavar="MM", min=0.001, show_default=False,
                                         help="Depth of the finished cavity; a program sinks less "
                                         "deep by the stock that it leaves on the bottom.")],
    taper: Annotated[float, typer.Option(
        metavar="DEG", min=0.0, max=60.0, help="Gradient of the electrode's sides.")] = 0.0,
    finish: Annotated[float, typer.Option(
        metavar="UM", min=0.1, help="Roughness Rmax of the finished surface. It corrects the "
                                    "stock left on the side.")] = 1.0,
    step: Annotated[float, typer.Option(
        metavar="IP", help="Step of the power supply: 1 IP (1.5 A) or a whole part of it. A "
                           "program then names the setting that the controller needs.")] = 1.0,
    seed: Annotated[int, typer.Option(
        metavar="N", min=0, max=2**32 - 1,
        help="Seed of the networks. The same seed gives the same staircase.")] = 1,
    series: Annotated[bool, typer.Option(
        "--series", help="Write the way as one block behind a depth series (G39).")] = False,
    jumps: Annotated[bool, typer.Option(
        "--jumps", help="Clear the gap by periodic jumps (G38): a deep cavity needs it.")] = False,
    target: Annotated[Path | None, typer.Option(
        "-o", "--output", metavar="PROGRAM", dir_okay=False, show_default="none",
        help="File for the machining program.")] = None,
    picture: Annotated[Path | None, typer.Option(
        "--plot", metavar="PNG", dir_okay=False, show_default="beside the program",
        help="File for a plot of the staircase.")] = None,
    folder: Annotated[Path, typer.Option(
        "--data", metavar="DIR", exists=True, file_okay=False,
        help="Folder of basic data; tapes/basic/README.md says how to enter your own.",
    )] = ROOT / "tapes" / "basic",
    port: Annotated[str | None, typer.Option(
        "--load", metavar="URL", show_default=False,
        help="Enter the basic data of these materials into the controller at a port, which then "
             "plans by itself ($BP). They replace those of the same materials.")] = None,
    baud: Annotated[int, typer.Option(
        min=1, metavar="N", help="Bits a second of that port, if it is a serial line.")] = BAUD,
) -> None:
    """Plan roughing with the greatest current that the electrode's undersize allows at each depth.

    Networks trained on the basic data next to the job infer the current of the last step, and how
    deep each greater one may go before it. The basic data that come with Gapkeeper are synthetic.
    """
    from host.roughing.roughing import parts_of_step, roughing
    from host.roughing.staircase import Job
    if (series or jumps) and target is None:
        raise UsageError(f"--{'series' if series else 'jumps'} needs a program to be written (-o).")
    if picture is None and target is not None:
        picture = target.with_suffix(".png")
    if target and picture and os.path.realpath(picture) == os.path.realpath(target):
        raise UsageError(f"{target} cannot be the program and its plot.")
    if picture is not None and picture.suffix.lower() != ".png":
        raise UsageError(f"{picture} must end with .png: the plot is a PNG.")
    roughing(electrode=electrode, workpiece=workpiece,
             job=Job(area, undersize, depth, taper, parts_of_step(step), finish),
             seed=seed, folder=folder, target=target, picture=picture, depth_series=series,
             jumps=jumps, console=out)
    if port is not None:
        from host.roughing.load import load
        load(electrode, workpiece, folder, port, baud=baud, console=out)


@app.command()
def build(
    boards: Annotated[list[str], typer.Argument(metavar="BOARD", show_default=False,
                                                help="Boards: ulx3s, ulx3s_45f, colorlight_i9.")],
) -> None:
    """Build the bitstream for a board, firmware included; several boards two at a time.

    Prints resources and the clock that the layout reaches; a clock that is missed is a failure.
    Everything goes to build/boards/BOARD/. The first build takes minutes. After a change of the
    firmware alone the layout is kept, and a build takes seconds.
    """
    from host.bitstream import build_boards
    build_boards(boards, out)


@app.command()
def flash(
    board: Annotated[str, typer.Argument(metavar="BOARD", show_default=False,
                                         help="Board: ulx3s, ulx3s_45f or colorlight_i9.")],
    permanent: Annotated[bool, typer.Option(
        "--permanent", help="Write the board's flash memory, so that it starts with Gapkeeper. "
                            "Without it the bitstream is gone at power-off.")] = False,
    cable: Annotated[str | None, typer.Option(
        metavar="NAME", show_default="the board's own",
        help="JTAG cable: ft231X, cmsisdap, ft2232, ft232 or dirtyJtag.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Overwrite without a question.")] = False,
) -> None:
    """Load the bitstream of a board, built by `build`, with openFPGALoader.

    Says what to plug where and what is overwritten, what to do when nothing answers, and whether
    the bitstream is of other gateware than this checkout's.
    """
    from host.flash import flash as load
    load(board, permanent=permanent, cable=cable, console=out,
         confirm=lambda question: yes or typer.confirm(question))


@app.command()
def firmware(
    port: ControllerPort = LIVE_PORT,
    baud: Baud = BAUD,
    image: Annotated[Path | None, typer.Option(
        "--image", metavar="FILE", exists=True, dir_okay=False,
        show_default="this checkout's firmware",
        help="An image for the controller's memory, firmware.bin.")] = None,
    built_in: Annotated[bool, typer.Option(
        "--built-in", help="Back to the firmware of the bitstream, at the next power-on.")] = False,
) -> None:
    """Replace a controller's firmware over its link; the bitstream stays.

    The machine has to be at rest; it is reset, which disarms it. The new firmware is checked and
    kept in the board's flash memory. It runs on trial after the next power-on; the same command
    then keeps it. Until it is whole, and if it does not answer, the old one stays.
    """
    from host.firmware import firmware as bring
    bring(port, baud=baud, file=image, built_in=built_in, console=out)


@app.command()
def doctor(
    port: ControllerPort = LIVE_PORT,
    board: Annotated[str, typer.Option(
        metavar="BOARD", help="Board, by which wires have pins.")] = "ulx3s",
    machine: Annotated[str | None, typer.Option(
        metavar="NAME|FILE", help="As of `run`: its settings are entered first.")] = None,
    baud: Baud = BAUD,
    report: Annotated[Path, typer.Option(
        "-o", "--output", metavar="FILE", dir_okay=False, show_default="build/doctor.txt",
        help="File for the report, to send along with a question.",
    )] = ROOT / "build" / "doctor.txt",
) -> None:
    """Examine a controller and its wires; each wrong wire is named with its pin.

    It checks link, firmware, gateware, clock, memory, inputs and comparators, waits for a press of
    the button `arm`, and after a question each moves an axis by 0.2 mm and sends M09; a lost
    position is taken over. The discharge stays off; at the end a reset disarms. Exit status 1 if
    something is wrong.
    """
    from host.doctor.command import examine
    raise typer.Exit(examine(port, board, baud=baud, report=report, console=out, machine=machine,
                             ask=lambda question: typer.confirm(question)))


app.command("touch")(touch_work)
app.command("tune")(tune_drives)


@app.command()
def bench() -> None:
    """Measure, and print the figures as one table.

    Simulation speed, firmware clocks per block, reaction times, and the size and clock of every
    block of the gateware on an ECP5. Takes minutes.
    """
    from host.bench import bench as measure
    measure()


def main() -> None:
    """Entry of the command ``gapkeeper``: whatever goes wrong is one sentence on the terminal."""
    status = DONE
    # Amaranth warns of gateware that was made and not used; after a failure that is all of it.
    warnings.filterwarnings("ignore", ".* created but never used")
    try:
        app()
    except UserError as error:
        err.print(f"gapkeeper: {error}", style="red", markup=False, soft_wrap=True)
        status = error.status
    except SystemExit as end:
        if end.code != INTERRUPTED:
            raise
        err.print("gapkeeper: interrupted.")
        status = FAULT
    except Exception as error:  # a fault of this program; a traceback helps no user
        if os.environ.get("GAPKEEPER_DEBUG"):
            raise
        err.print(f"gapkeeper: unexpected failure, {type(error).__name__}: {error} "
                  "(GAPKEEPER_DEBUG=1 shows where).", style="red", markup=False, soft_wrap=True)
        status = FAULT
    sys.exit(status)


if __name__ == "__main__":
    main()
