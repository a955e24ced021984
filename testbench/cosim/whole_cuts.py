# SPDX-License-Identifier: Apache-2.0
"""Whole tapes with on-times from the gate and from the ignition; run it for a table of figures.

``python -m testbench.cosim.whole_cuts`` runs the tapes of ``testbench.cosim.sparks`` to their end:
removal, charge of the sparks, surface, shorts, and the drop Ex of the mean voltage along the path.
"""

import json
from dataclasses import dataclass
from itertools import product
from statistics import fmean, pstdev
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.table import Table

from host.experiments import fluid
from host.experiments.common import (
    add_figures,
    in_parallel,
    markdown,
    seeds_and_folder,
    summed_up,
)
from host.machines import machine as machines
from host.run.workpiece import Columns
from rtl.states import State
from softcore.tables.settings import named
from testbench.cosim.sparks import PLACES, cut, with_words

__all__ = ["FIGURES", "SIDES", "Side", "constancy", "craters", "deviation_um", "figures_of",
           "free_voltage", "wall_um"]

# With the third one the wire's sparks burn for as long as with the second, within 3 % of the mean.
WORDS = {"wire": ("A0", "A1 B20", "A0 P11"), "punch": ("A0", "A1 B20", "A0 P11"),
         "sinker": ("A0", "A1", "A1 B30")}
UNIT_MM = 0.001 * named("feed_mode_unit_um").default    # over which P4 takes a mean
BIN_MM = 0.02           # means of the surface, as in ``gapkeeper experiment removal``
DEEP_MM = 0.2           # from the wire's axis: no gap reaches so deep
ON_THE_LINE_MM = 0.005  # the wire's axis counts as on a side so near to it
FIGURES = {
    "time_s": ("from the first spark to the last, s", 2), "removed_mm3": ("removed, mm³", 3),
    "removal_mm3_min": ("removal, mm³/min, unscaled", 3), "sparks": ("sparks", 0),
    "charge_uc": ("charge of a spark, µC", 1), "charge_spread": ("its deviation, %", 1),
    "whole": ("sparks in full", 0), "whole_uc": ("their charge, µC", 1),
    "whole_spread": ("its deviation, %", 2), "crater_um": ("size of a crater, µm", 2),
    "crater_spread": ("its deviation, %", 1),
    "crater_top": ("the largest tenth, times the mean", 2), "shorts": ("Ss", 1),
    "shorted_s": ("gap shorted (Ss), s", 3), "arcs": ("arcs", 0),
    "short_pulses": ("shorted pulses", 0), "gap_um": ("gap, µm", 1),
    "gap_deviation_um": ("its deviation, µm", 1), "surface_um": ("surface, deviation, µm", 2),
    "drop_v": ("Ex, V", 2), "drop_spread": ("its deviation over 10 µm, %", 1),
    "ratio_spread": ("deviation of Es/Ex, %", 1),
    "removal_spread": ("deviation of the removal over 10 µm, %", 1),
    "agreement": ("correlation of Ex and removal", 2),
}


@dataclass(frozen=True)
class Side:
    """A straight part of a path in even material, and the walls that it leaves.

    The wire's axis goes from ``begin`` to ``end`` along ``axis``, at ``at`` on the other one, all
    in mm. ``walls`` are the sides of it that stay, 1 towards higher coordinates.
    """

    axis: str
    at: float
    begin: float
    end: float
    walls: tuple[int, ...]


# Far enough from the edge of the plate and from corners. The punch is inside its path.
SIDES = {"wire": (Side("x", 0.0, 0.3, 1.9, (1, -1)),),
         "punch": (Side("y", 2.218, 0.4, -0.2, (-1,)), Side("x", -0.618, 1.8, 0.7, (1,))),
         "sinker": ()}


def wall_um(workpiece: Columns, side: Side, wall: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Places along a side in mm, and how far from the wire's axis its wall stands there, in um.

    The wall is placed as if the material of its column had no pores, so differences are volumes.
    """
    across = "y" if side.axis == "x" else "x"
    along, out = workpiece[side.axis], (workpiece[across] - side.at) * wall
    low, high = sorted((side.begin, side.end))
    left = workpiece["left"] if side.axis == "x" else workpiece["left"].T
    taken = 1 - left[(out > 0) & (out < DEEP_MM)][:, (along >= low) & (along < high)]
    cell = workpiece[across][1] - workpiece[across][0]
    return along[(along >= low) & (along < high)], taken.sum(axis=0) * cell * 1000


def deviation_um(workpiece: Columns, sides: tuple[Side, ...]) -> float | None:
    """Deviation of the walls in means of ``BIN_MM``, each wall from its own mean."""
    squares: list[float] = []
    for side in sides:
        for wall in side.walls:
            along, away = wall_um(workpiece, side, wall)
            number = np.floor((along - along[0]) / BIN_MM + 1e-6).astype(int)
            means = np.bincount(number, away) / np.bincount(number)
            squares.extend((means - means.mean())**2)
    return float(np.sqrt(np.mean(squares))) if squares else None


def free_voltage(row: str, open_v: float) -> float:
    """V0 of a condition, its mean voltage if nothing ignites, as the controller calculates it."""
    us = {word[0]: float(word[1:]) for word in row.split()[1:]}
    wait = us.get("B") or us["P"] if us.get("A") else us["P"]
    return open_v * wait / (wait + us["Q"])


def constancy(trace: Columns, sides: tuple[Side, ...], pulses_per_mm: float,
              free: float) -> dict:
    """Ex and the removal in means over the unit distance of P4, at constant feed.

    Ex is how far the mean voltage is below ``free``. ``drop_v`` is the mean of Ex, which is also
    taken as Es; ``agreement`` the correlation of Ex and removal. Deviations are in percent. Ex and
    Es/Ex have the bounds of their settings' defaults. Only samples at the front of the path count.
    """
    removed = np.diff(trace["removed_mm3"], prepend=0)
    drops, volumes = [], []
    for side in sides:
        across = "y" if side.axis == "x" else "x"
        far = (trace[side.axis] / pulses_per_mm - side.begin) * np.sign(side.end - side.begin)
        inside = ((far >= 0) & (far < abs(side.end - side.begin))
                  & (abs(trace[across] / pulses_per_mm - side.at) < ON_THE_LINE_MM)
                  & (trace["state"] == State.FRONT.value))
        unit = np.floor(far[inside] / UNIT_MM).astype(int)
        samples = np.bincount(unit)
        known = samples > 0
        drops.append(free - np.bincount(unit, trace["gap_v"][inside])[known] / samples[known])
        volumes.append(np.bincount(unit, removed[inside])[known])
    drop, volume = np.concatenate(drops), np.concatenate(volumes)
    least = 0.001 * named("feed_mode_least_mv").default
    lowest, highest = (0.001 * named(f"feed_mode_ratio_{end}").default
                       for end in ("lowest", "highest"))
    ratio = np.clip(drop.mean() / np.maximum(drop, least), lowest, highest)
    return {"drop_v": float(drop.mean()), "drop_spread": 100 * float(drop.std() / drop.mean()),
            "ratio_spread": 100 * float(ratio.std() / ratio.mean()),
            "removal_spread": 100 * float(volume.std() / volume.mean()),
            "agreement": float(np.corrcoef(drop, volume)[0, 1])}


def craters(charges: NDArray[Any], removed_mm3: float) -> dict:
    """Sizes of the craters of sparks: the radius of half a ball of what a spark has removed.

    A crater's volume is in proportion to its spark's charge, as in the plant; ``removed_mm3`` is
    unscaled. A sinker's floor has no map in the plant: these sizes are what its surface would be
    made of. ``crater_top`` is the mean of the largest tenth, as a multiple of the mean.
    """
    volumes = 1e9 * removed_mm3 * charges / charges.sum()
    sizes = np.sort(np.cbrt(volumes * 3 / (2 * np.pi)))
    mean = sizes.mean()
    return {"crater_um": float(mean), "crater_spread": 100 * float(sizes.std() / mean),
            "crater_top": float(sizes[-max(1, len(sizes) // 10):].mean() / mean)}


def figures_of(trial: tuple[str, str, int]) -> dict:
    """Figures of a run, by the names of ``FIGURES``; of place, words and seed."""
    place, words, seed = trial
    done, machine = cut(place, words, seconds=None, seed=seed), machines.load(PLACES[place][0])
    trace = done.trace
    level = next(word[1:] for word in PLACES[place][3].split() if word[0] == "I")
    amps = float(level) * machine.number("source", "step_a")
    burnt, whole = (np.array(done.times_us(*ends)) * amps
                    for ends in (("time", "guard", "wait"), ("time",)))
    lit = np.flatnonzero(trace["ok"] + trace["dame"])
    time_s = float(trace["t"][lit[-1]] - trace["t"][lit[0]])
    found = {
        "place": place, "words": words, "seed": seed, "outcome": done.outcome, "time_s": time_s,
        "removed_mm3": done.removed_mm3,
        "removal_mm3_min": done.removed_mm3 / time_s * 60 / machine.removal_scale,
        "sparks": len(burnt), "charge_uc": fmean(burnt),
        "charge_spread": 100 * pstdev(burnt) / fmean(burnt),
        "whole": len(whole), "whole_uc": fmean(whole),
        "whole_spread": 100 * pstdev(whole) / fmean(whole), "shorts": done.shorts,
        "shorted_s": float(np.diff(trace["t"], prepend=0)[trace["shorted"] > 0].sum()),
        "arcs": done.classes[2], "short_pulses": done.classes[3],
        "surface_um": deviation_um(done.workpiece, SIDES[place]),
        **craters(burnt, done.removed_mm3 / machine.removal_scale)}
    if SIDES[place]:
        free = free_voltage(with_words(PLACES[place][3], words),
                            machine.number("source", "open_v"))
        return found | constancy(trace, SIDES[place], machine.pulses_per_mm, free)
    servo = fluid.measure(trace, machine)
    return found | {name: servo[name] for name in ("gap_um", "gap_deviation_um")}


def table(runs: list[dict], style: box.Box = box.MARKDOWN) -> Table:
    """Figures down, tapes and words across; mean and deviation over the seeds."""
    made = Table(box=style)
    made.add_column("mean ± deviation of the seeds", no_wrap=True)
    rows = []
    for place, words in [(place, words) for place, some in WORDS.items() for words in some]:
        mine = [one for one in runs if (one["place"], one["words"]) == (place, words)]
        if mine:
            made.add_column(f"{PLACES[place][1]}, {words}", justify="right", no_wrap=True)
            rows.append(summed_up(mine, FIGURES))
    add_figures(made, rows, FIGURES)
    return made


def main() -> None:
    """Print the table, as Markdown."""
    seeds, folder = seeds_and_folder("testbench.cosim.whole_cuts", main.__doc__, seeds=10,
                                     folder="whole_cuts")
    console, runs = Console(), []

    def tell(one: dict) -> None:
        runs.append(one)
        (folder / "runs.json").write_text(json.dumps(runs, indent=2) + "\n", encoding="utf-8")
        console.print(f"{one['place']}, {one['words']}, seed {one['seed']}: {one['outcome']} after "
                      f"{one['time_s']:.1f} s", soft_wrap=True)
    in_parallel(figures_of, [(place, words, seed) for seed, place in product(
        range(1, seeds + 1), PLACES) for words in WORDS[place]], tell)
    runs.sort(key=lambda one: one["seed"])
    console.print("\n".join(markdown(table(runs))), soft_wrap=True)


if __name__ == "__main__":
    main()
