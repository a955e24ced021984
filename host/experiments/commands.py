# SPDX-License-Identifier: Apache-2.0
"""The commands ``gapkeeper experiment``. Each loads its experiment when it is called."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

__all__ = ["experiment_app"]

experiment_app = typer.Typer(
    help="Experiments on the simulated machine that anybody can repeat.",
    no_args_is_help=True, rich_markup_mode="markdown")
out = Console(highlight=False)

# Options of several experiments.
Seeds = Annotated[int, typer.Option(
    min=1, max=100, metavar="N", help="Runs of each kind: seeds 1 to N.")]
Folder = Annotated[Path, typer.Option(
    "--out", metavar="DIR", file_okay=False, help="Folder for runs.json and table.md.")]
FolderWithPlot = Annotated[Path, typer.Option(
    "--out", metavar="DIR", file_okay=False,
    help="Folder for runs.json, table.md and plot.png.")]


@experiment_app.command("fluid")
def experiment_fluid(
    seeds: Seeds = 3,
    folder: FolderWithPlot = Path("build/experiments/fluid"),
) -> None:
    """Hold the gap with fixed presets and with presets switched by the fluid's resistance.

    Both at four resistivities, with two pulses and the same seeds: stability of the gap, shares of
    the pulse classes, removal and retractions. Takes minutes for each seed, on all cores.
    """
    from host.experiments.fluid import fluid
    fluid(seeds=seeds, folder=folder, console=out)


@experiment_app.command("gap")
def experiment_gap(
    seeds: Seeds = 5,
    depth: Annotated[float, typer.Option(
        min=0.1, max=10.0, metavar="MM", help="Depth to sink to.")] = 0.25,
    folder: FolderWithPlot = Path("build/experiments/gap"),
) -> None:
    """Hold the gap by every way to count pulses, and by every criterion for arcs.

    Each is a tape of its own on the same machine, with the same pulse and seeds: stability of the
    gap, shares of the pulse classes, removal and retractions. Takes a minute for each seed, on all
    cores.
    """
    from host.experiments.gap import gap
    gap(seeds=seeds, depth_mm=depth, folder=folder, console=out)


@experiment_app.command("removal")
def experiment_removal(
    seeds: Seeds = 3,
    way: Annotated[float, typer.Option(
        min=0.3, max=20.0, metavar="MM", help="Length of the wall.")] = 1.0,
    plain_loop: Annotated[bool, typer.Option(
        "--plain-loop", help="Without velocity feed-forward: the loop of the first patent.")
    ] = False,
    folder: FolderWithPlot = Path("build/experiments/removal"),
) -> None:
    """Finish a wall at constant feed and in the feed modes P2 to P5 of G95.

    One wall has a step in its stock; the other has even stock in a flow that drifts. All modes run
    with the same seeds. Results: variation of the removal per time, the finished surface,
    retractions and time; what the signal of P4 is made of, and the best that P4 and P5 could do by
    theirs beside what they did. Once more in G94, shorts are judged by the mean voltage, and once
    more in P4 a capacitor takes the place of pulses; energy per spark and its deviation are told of
    all. P3's gain is tuned before, on another stock. Takes minutes, on all cores.
    """
    from host.experiments.common import LOOPS
    from host.experiments.removal import removal
    usual, plain = LOOPS
    removal(seeds=seeds, way_mm=way, loop=plain if plain_loop else usual, folder=folder,
            console=out)


@experiment_app.command("roughing")
def experiment_roughing(
    seeds: Seeds = 3,
    depth: Annotated[float, typer.Option(
        min=0.5, max=40.0, metavar="MM", help="Depth to rough to.")] = 8.0,
    step: Annotated[float, typer.Option(
        min=0.05, max=1.0, metavar="IP", help="Step of the power supply, in IP of 1.5 A.")] = 1.0,
    folder: FolderWithPlot = Path("build/experiments/roughing"),
) -> None:
    """Rough a cavity with one current all the way, and with the planned staircase of currents.

    One current is the planner's last, or its first. All with the same seeds: time, the undersize
    that is consumed in the simulated cavity, and with other constants of its walls; shares of the
    pulse classes, retractions. Takes several minutes for each seed, on all cores.
    """
    from host.experiments.roughing import roughing
    roughing(seeds=seeds, depth_mm=depth, folder=folder, console=out, step_ip=step)


@experiment_app.command("shorts")
def experiment_shorts(
    seeds: Seeds = 10,
    folder: Folder = Path("build/experiments/shorts"),
) -> None:
    """Sink with velocity feed-forward and in the plain loop: how soon a short is cleared.

    From the contact of electrode and work to the sample that completes the short, to the last
    command forwards and the first one backwards, until the electrode turns, and until it is 20 and
    100 um clear; beside it what the drive takes alone. Time, retractions, arcs and the time that
    the gap was shorted. Takes a minute for each seed, on all cores.
    """
    from host.experiments.shorts import shorts
    shorts(seeds=seeds, folder=folder, console=out)


@experiment_app.command("servo")
def experiment_servo(
    seeds: Seeds = 5,
    folder: Folder = Path("build/experiments/servo"),
) -> None:
    """Hold the gap by the servo P1 with velocity feed-forward and in the plain loop.

    With several steps and times between them, and the same seeds: stability of the gap, shares of
    the pulse classes, removal and retractions. Takes minutes for each seed, on all cores.
    """
    from host.experiments.servo import servo
    servo(seeds=seeds, folder=folder, console=out)


@experiment_app.command("networks")
def experiment_networks(
    jobs: Annotated[int, typer.Option(
        min=1, max=10_000, metavar="N", help="Random jobs for each kind of data.")] = 100,
    folder: Folder = Path("build/experiments/networks"),
) -> None:
    """Plan roughing from poor basic data: by networks, and by interpolation alone.

    The data are made from a formula, by which the staircases are then judged: whole, with gaps,
    with noise, few, without the area next to the job, and all of that together. Takes a minute.
    """
    from host.experiments.networks import networks
    networks(jobs=jobs, folder=folder, console=out)
