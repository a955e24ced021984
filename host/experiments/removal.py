# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper experiment removal``: a wall is finished under G94 and in the feed modes of G95.

There are two walls: one whose stock has a step, and one of even stock in a flow of fluid that
drifts. Each is finished with constant feed (G94), zero feed at Vs (P2), F at Vs (P3), constant
removal by the mean voltage (P4) and by the discharge per distance (P5), and once more in G94 with
shorts judged by the mean voltage, as in the fourth patent's prior art; all with the same seeds.
Calibration and tuning have seeds of their own.

* Calibration: even nominal stock is cut at the preset speed (P3 with the least possible gain). The
  mean voltage becomes the Vs of P3. The Es of P4 is the drop from the voltage measured in the
  approach.
* P3's gain: each of ``GAINS``, times F/Es, is tried on another stock, with a step and in the drift.
  The gain with the least variation of the removal takes part in the comparison.
* P2 has the slope of P4 at the calibrated place, F/Es. So it stands still at twice the drop Es, and
  its feed is at most 2 F.
* P5's Es is the discharge per distance of that place, measured by P5 at constant feed.
* *capacitor* is P4 on the machine ``relaxation``: a capacitor in place of pulses of 20 A. Its Es is
  the drop of the same place at constant feed.
* P4 measures its no-load voltage (setting ``feed_mode_no_load``). All other settings are the
  defaults.
"""

import copy
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, cast

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from host.errors import UserError
from host.experiments.common import (
    LOOPS,
    Record,
    add_figures,
    build_simulator,
    executed,
    in_loop,
    in_parallel,
    make_folder,
    markdown,
    summed_up,
    write_results,
)
from host.experiments.removal_bound import bounds, parts
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run import figures
from host.run.run import Run, Simulated, count_retractions
from host.run.workpiece import Columns, wall_surface
from host.tape.tape import Tape, encode
from host.words import counted
from softcore.tables.settings import assign, named

__all__ = ["FIGURES", "GAINS", "MODES", "WALLS", "Plan", "Trial", "measure", "plot", "removal",
           "statistics", "table"]

MACHINE = "wall"    # its file has the place of the start and the removal scale
CONDITION = "I1 P10 Q25 R25 E80"    # 20 A for at most 10 us
RELAXATION = "relaxation"           # the machine with a capacitor, and its condition
CHARGING = "I1 P50 Q25 R25 E80 A2"
FEED = 12                           # mm/min, in life a tenth
PATH_MM = -0.11                     # Y of the wire's axis: 10 um off the finished surface
NOMINAL_UM, WIDE_UM = 20.0, 30.0
OTHER_UM = (20.0, 26.0)             # stock on which a gain is tried
DRIFT = 1.0                         # deviation of the logarithm of the flow
WALLS = ("step", "drift")
EVEN = "even"                       # the wall of the calibration: no step, no drift
MODES = {"G94": "G94", "P2": "G95 P2", "P3": "G95 P3", "P4": "G95 P4", "P5": "G95 P5",
         "mean Ss": "G94", "capacitor": "G95 P4"}
SHORT_MV = 5000                     # "mean Ss": the gap is shorted below this mean voltage
OPEN_V = 80
UNIT_MM = 0.001 * named("feed_mode_unit_um").default
GAINS = (0.125, 0.25, 0.5, 1.0)     # of P3, times F/Es
OTHER_SEEDS = (1001, 1002)          # of the runs that are not compared
LONGEST_S = 60.0                    # of the machine's time; a run that takes longer is stopped
LEAST_GAIN = named("feed_mode_gain_feed").lowest

BEGIN, STEP = 0.1, 0.5              # shares of the way: where figures begin, where the step is
AHEAD_MM, BEHIND_MM = 0.08, 0.04    # the wire meets a step before its axis is there
BIN_S, BIN_MM = 0.1, 0.02           # the removal's means over time, and the profile's

# Figure: its name in the table, and digits.
FIGURES = {
    "removal_mm3_s": ("removal, mm3/s", 4), "variation": ("its deviation, %", 1),
    "noise": ("of it, number of craters, %", 1),
    "at_step": ("removal at the step, times", 2), "behind_step": ("behind it, times", 2),
    "surface_um": ("surface, deviation, um", 2), "surface_step_um": ("its step, um", 2),
    "spark_uj": ("energy per spark, uJ", 0), "spark_variation": ("its deviation, %", 1),
    "gap_um": ("gap, um", 1), "retractions": ("retractions", 1), "time_s": ("time, s", 2),
}
COLOURS = {"G94": figures.FAINT, "P2": figures.CAUSES["operator"], "P3": figures.GAP,
           "P4": figures.PATH, "P5": figures.INK, "mean Ss": figures.CAUSES["jump"],
           "capacitor": figures.CLASSES["dame"][1]}


@dataclass(frozen=True)
class Plan:
    """What all runs of an experiment share: length of the way in mm, references in V, loop."""

    way_mm: float
    voltage: float = 1.0
    drop: float = 1.0
    discharge: float = 1.0      # Es of P5
    no_load: float = 22.86
    capacitor_drop: float = 1.0     # Es of P4 with a capacitor
    loop: str = next(iter(LOOPS))


@dataclass(frozen=True)
class Trial:
    """One run. ``gain`` is P3's, times F/Es; ``other``: on the stock of the tuning.

    ``even_feed``: the ratio Es/Ex is 1 whatever is measured.
    """

    plan: Plan
    wall: str
    mode: str
    seed: int
    gain: float = 0.0
    other: bool = False
    even_feed: bool = False


def machine_for(trial: Trial) -> Machine:
    """The machine with this stock on its wall, this flow, and this loop."""
    name = RELAXATION if trial.mode == "capacitor" else MACHINE
    tables = copy.deepcopy(machines.load(name).tables)
    nominal, wide = OTHER_UM if trial.other else (NOMINAL_UM, WIDE_UM)
    steps = [[0.0, nominal]]
    if trial.wall == "step":
        steps.append([STEP * trial.plan.way_mm, wide])
    tables["stock"]["steps"] = steps
    tables["debris"]["flow_spread"] = DRIFT if trial.wall == "drift" else 0.0
    return in_loop(Machine(name, tables), trial.plan.loop)


def tape_for(trial: Trial) -> Tape:
    """Tape of an approach, in which V0 is measured, and of the wall."""
    plan = trial.plan
    voltage = plan.voltage - (plan.drop if trial.mode == "P2" else 0)
    drop = (plan.discharge if trial.mode == "P5" else plan.capacitor_drop
            if trial.mode == "capacitor" else plan.drop)
    condition = CHARGING if trial.mode == "capacitor" else CONDITION
    feed = 2 * FEED if trial.mode == "P2" else FEED
    return encode("\n".join([
        "%", "G21 G90 G94", f"G10 C900 {condition} V{voltage:.3f} U{drop:.3f}", "C900",
        "G36 R60 L0.06 H120 E30 Q0.02", "M08", "M03",
        f"{MODES[trial.mode]} G01 Y{PATH_MM} F{feed // 3}", f"X{plan.way_mm:g} F{feed}",
        "M05", "M09", "M02", "%", ""]))


def settings_for(trial: Trial) -> list[str]:
    """Lines entered by hand: gains in um/min per V, and the setting that V0 is measured."""
    slope = 1000 * FEED / trial.plan.drop
    return [assign("feed_mode_gain_zero", round(slope)),
            assign("feed_mode_gain_feed", max(LEAST_GAIN, round(trial.gain * slope))),
            assign("feed_mode_no_load", 1),
            *([assign("short_mean_mv", SHORT_MV)] if trial.mode == "mean Ss" else []),
            *([assign(f"feed_mode_ratio_{end}", 1000) for end in ("lowest", "highest")]
              if trial.even_feed else [])]


def execute(trial: Trial,
            watch: Callable[[Run], None] = lambda run: None
            ) -> tuple[Run, Columns, Columns, Record]:
    """Run a trial; return it, its trace, what is left of the workpiece, and figures of sparks."""
    with executed(machine_for(trial), tape_for(trial), trial.seed, until_s=LONGEST_S,
                  mdi=settings_for(trial), watch=watch) as (job, machine_on):
        return job, machine_on.trace(), machine_on.workpiece(), spark_energy(machine_on.get)


def spark_energy(get: Callable[[str], float]) -> Record:
    """Mean energy of the whole run's good discharges, and its deviation in percent."""
    count, total = get("read.sparks"), get("read.spark_uj")
    if not count or not total:
        return {"spark_uj": None, "spark_variation": None}
    mean = total / count
    square = max(0.0, get("read.spark_uj2") / count - mean**2)
    return {"spark_uj": mean, "spark_variation": 100 * float(np.sqrt(square)) / mean}


def run(trial: Trial) -> Record:
    """Run a trial; return how it ended, and the figures of a wall that was cut to its end."""
    job, trace, plan, sparks = execute(trial)
    found: Record = {"wall": trial.wall, "mode": trial.mode, "gain": trial.gain, "seed": trial.seed,
             "outcome": job.outcome, "alarm": job.alarm and job.alarm["text"]}
    if job.outcome != "end":
        return found
    found |= measure(trace, plan, trial.plan.way_mm, trial.wall == "step") | sparks
    if trial.wall == "step":
        at, inside = _inside(trace, trial.plan.way_mm)
        found["parts"] = parts(trace, inside & (trace["state"] == 0),
                               at - STEP * trial.plan.way_mm, UNIT_MM, trial.plan.no_load)
    return found | {"retractions": count_retractions(job.events)["count"]}


def _inside(trace: Columns, way_mm: float) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Furthest place so far, mm, and which samples count.

    A retraction counts for the place where it began.
    """
    place = np.maximum.accumulate(trace["x"]) / machines.load(MACHINE).pulses_per_mm
    return place, (place >= BEGIN * way_mm) & (place < way_mm - AHEAD_MM)


def _rate(trace: Columns, inside: NDArray[np.bool_]) -> float:
    """Removal per time of the samples ``inside``, retractions included."""
    step_s = np.diff(trace["t"], prepend=0)
    removed = np.diff(trace["removed_mm3"], prepend=0)
    return float(removed[inside].sum() / step_s[inside].sum())


def measure(trace: Columns, plan: Columns, way_mm: float, step: bool) -> Record:
    """Figures of a wall that has been cut from 0 to ``way_mm``; X of the trace is in pulses.

    They count from ``BEGIN`` of the way to ``AHEAD_MM`` before its end. ``variation`` is the
    deviation of the removal per time in means of ``BIN_S``, in percent; ``noise`` is the part of it
    that the scatter of the number of craters alone would give. ``at_step`` and ``behind_step`` are
    multiples of the removal per time before the step. ``surface_um`` is the deviation of the
    surface in means of ``BIN_MM``; ``surface_step_um`` is how much higher it is behind the step
    (above zero: more was removed there).
    """
    end = way_mm - AHEAD_MM
    place, inside = _inside(trace, way_mm)
    t = trace["t"][inside]
    edges = np.arange(t[0], t[-1], BIN_S)
    removed = np.diff(np.interp(edges, trace["t"], trace["removed_mm3"])) / BIN_S
    sparks = (trace["ok"] + trace["dame"])[inside].sum() * BIN_S / (t[-1] - t[0])
    surface, wall_x = wall_surface(plan) * 1000, plan["x"]
    bins = np.arange(BEGIN * way_mm, end, BIN_MM)

    def means(values: NDArray[Any], at: NDArray[Any]) -> list[float]:
        return [float(values[(at >= x) & (at < x + BIN_MM)].mean()) for x in bins]

    found: Record = {
        "removal_mm3_s": _rate(trace, inside),
        "variation": 100 * float(removed.std() / removed.mean()),
        "noise": 100 / float(np.sqrt(sparks)),
        "surface_um": float(np.std(means(surface, wall_x))),
        "gap_um": float(trace["gap_um"][inside & (trace["state"] == 0)].mean()),
        "time_s": float(t[-1] - t[0]), "at_step": None, "behind_step": None,
        "surface_step_um": None,
        "profile": {"x": [float(x) for x in bins + BIN_MM / 2],
                    "removal": [_rate(trace, (place >= x) & (place < x + BIN_MM)) for x in bins],
                    "surface": means(surface, wall_x)}}
    if step:
        at = STEP * way_mm
        before = _rate(trace, inside & (place < at - AHEAD_MM))
        met = (place >= at - AHEAD_MM) & (place < at + BEHIND_MM)
        found["at_step"] = _rate(trace, met) / before
        found["behind_step"] = _rate(trace, inside & (place >= at + BEHIND_MM)) / before
        found["surface_step_um"] = (
            float(surface[(wall_x >= at + BEHIND_MM) & (wall_x < end)].mean())
            - float(surface[(wall_x >= BEGIN * way_mm) & (wall_x < at - BEHIND_MM)].mean()))
    return found


def _order(one: Record) -> tuple[int, int, float, int]:
    return (WALLS.index(one["wall"]), list(MODES).index(one["mode"]), one["gain"], one["seed"])


def statistics(runs: Iterable[Record]) -> list[Record]:
    """One row for every wall, mode and gain.

    ``outcomes``: how many ended how. For each of ``FIGURES`` mean and spread over the seeds of the
    runs that ended; the spread is the sample's standard deviation, or None for a single run. A
    figure that no run has is None.
    """
    groups: dict[tuple[str, str, float], list[Record]] = {}
    for one in sorted(runs, key=_order):
        groups.setdefault((one["wall"], one["mode"], one["gain"]), []).append(one)
    return [{"wall": wall, "mode": mode, "gain": gain, **summed_up(group, FIGURES)}
            for (wall, mode, gain), group in groups.items()]


def table(rows: list[Record], style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Figures down, walls and modes across; mean and spread over the seeds."""
    made = Table(box=style)
    made.add_column("wall", no_wrap=True)
    for row in rows:
        made.add_column(row["wall"], justify="right", no_wrap=True)
    made.add_row("mode", *(row["mode"] for row in rows))
    add_figures(made, rows, FIGURES)
    return made


def _mean_voltages(trial: Trial) -> tuple[float, float]:
    """Mean voltage in the cut, and without discharges in the approach."""
    free: list[float] = []
    cut: list[float] = []
    way_mm = trial.plan.way_mm

    def watch(job: Run) -> None:
        machine_on = cast(Simulated, job.simulation)
        places, volts = machine_on.positions(), machine_on.mean_voltage()
        x, y = (places[axis] / job.machine.pulses_per_mm for axis in "xy")
        if volts and 0.001 < y < 0.03:
            free.append(volts)
        elif BEGIN * way_mm < x < way_mm - AHEAD_MM:
            cut.append(volts)

    job, *_ = execute(trial, watch)
    if not free or not cut:
        raise UserError(f"the nominal stock was not cut: the run ended as {job.outcome}.")
    return float(np.mean(cut)), float(np.mean(free))


def calibrate(way_mm: float, loop: str) -> Plan:
    """Cut even nominal stock at the preset speed; the plan with Vs and Es, but for a capacitor."""
    plan = Plan(way_mm, loop=loop)
    burnt: list[float] = []
    voltage, no_load = _mean_voltages(Trial(plan, EVEN, "P3", OTHER_SEEDS[0]))

    def watch_discharge(job: Run) -> None:
        machine_on = cast(Simulated, job.simulation)
        x = machine_on.positions()["x"] / job.machine.pulses_per_mm
        if BEGIN * way_mm < x < way_mm - AHEAD_MM:
            burnt.append(OPEN_V * machine_on.measured_share())

    job, *_ = execute(Trial(plan, EVEN, "P5", OTHER_SEEDS[0], even_feed=True), watch_discharge)
    if not burnt:
        raise UserError(f"the nominal stock was not cut: the run ended as {job.outcome}.")
    return replace(plan, voltage=voltage, drop=no_load - voltage, discharge=float(np.mean(burnt)),
                   no_load=no_load)


def capacitor_drop(plan: Plan) -> float:
    """Es of P4 with a capacitor, from even nominal stock at the preset speed."""
    cut, free = _mean_voltages(Trial(plan, EVEN, "capacitor", OTHER_SEEDS[0], even_feed=True))
    return free - cut


def mean_variations(runs: list[Record]) -> dict[float, float | None]:
    """Mean variation of the removal by gain; None if not every run came to its end."""
    kinds: dict[float, list[Record]] = {}
    for one in sorted(runs, key=_order):
        kinds.setdefault(one["gain"], []).append(one)
    return {gain: float(np.mean([one["variation"] for one in kinds[gain]]))
            if all(one["outcome"] == "end" for one in kinds[gain]) else None
            for gain in sorted(kinds)}


def best_gain(variations: dict[float, float | None]) -> float:
    """The gain of the least variation."""
    whole = {gain: variation for gain, variation in variations.items() if variation is not None}
    if not whole:
        raise UserError("P3 did not come to the end of the wall with any of its gains.")
    return min(whole, key=lambda gain: whole[gain])


def plot(runs: list[Record], path: Path) -> None:
    """Draw removal per time and surface along the wall, means over the seeds, and variations."""
    rows = statistics(runs)
    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(9.6, 9.0), layout="constrained")
        axes = figure.subplots(3, 2, sharey="row")
        for column, wall in zip(axes.T, WALLS, strict=True):
            for mode, colour in COLOURS.items():
                profiles = [one["profile"] for one in runs
                            if (one["wall"], one["mode"]) == (wall, mode) and "profile" in one]
                for ax, name in zip(column, ("removal", "surface"), strict=False):
                    if profiles:
                        ax.plot(profiles[0]["x"], np.mean([one[name] for one in profiles], axis=0),
                                color=colour, label=mode)
            column[0].set(title=f"removal per time, mm³/s, {wall}", ylim=(0, None))
            column[1].set(title=f"surface, µm, {wall}", xlabel="along the wall, mm")
            mine = [row for row in rows if row["wall"] == wall and row["variation"]]
            column[2].bar([row["mode"] for row in mine], [row["variation"][0] for row in mine],
                          yerr=[row["variation"][1] or 0 for row in mine], capsize=3,
                          color=[COLOURS[row["mode"]] for row in mine])
            column[2].plot([row["mode"] for row in mine], [row["noise"][0] for row in mine], "_",
                           color=figures.INK, markersize=24, label="number of craters alone")
            column[2].set(title=f"deviation of the removal per time, %, {wall}", ylim=(0, None))
        axes[0, 0].legend(ncols=3, loc="lower right")
        axes[2, 1].legend(loc="upper left")
        figure.savefig(path, dpi=120)


def _page(rows: list[Record], said: list[str], seeds: int) -> str:
    """The table and how it was made, as Markdown."""
    return "\n".join([
        "# A wall finished at constant feed and under the feed modes", "",
        f"Machine {MACHINE}, {counted(seeds, 'seed')}: mean ± sample standard deviation over the "
        "seeds.", "", *(f"* {one}" for one in said), "",
        *markdown(table(rows, box.MARKDOWN)), ""])


def removal(*, seeds: int, way_mm: float, loop: str, folder: Path, console: Console) -> None:
    """Make the experiment; write ``runs.json``, ``table.md`` and ``plot.png``, print the table."""
    make_folder(folder)
    plan = Plan(way_mm, loop=loop)
    build_simulator(machine_for(Trial(plan, EVEN, "P3", OTHER_SEEDS[0])), console)
    plan = calibrate(way_mm, loop)
    plan = replace(plan, capacitor_drop=capacitor_drop(plan))
    said = [f"Loop: {loop}.",
            f"Calibrated on the nominal stock: Vs {plan.voltage:.2f} V, Es {plan.drop:.2f} V, of "
            f"P5 {plan.discharge:.3f} V, with a capacitor {plan.capacitor_drop:.2f} V."]
    console.print(said[1], soft_wrap=True)
    tried = [Trial(plan, wall, "P3", seed, gain, other=True)
             for seed, gain, wall in product(OTHER_SEEDS, GAINS, WALLS)]
    with Progress(console=console) as bar:
        task = bar.add_task("runs", total=len(tried) + seeds * len(WALLS) * len(MODES))

        def tell(one: Record) -> None:
            bar.advance(task)
            end = (f"removal ± {one['variation']:.1f} %, surface ± {one['surface_um']:.2f} um"
                   if one["outcome"] == "end" else one["alarm"])
            bar.console.print(f"{one['wall']}, {one['mode']}, seed {one['seed']}: "
                              f"{one['outcome']}, {end}", soft_wrap=True)

        tuning = in_parallel(run, tried, tell)
        variations = mean_variations(tuning)
        gain = best_gain(variations)
        tries = ", ".join(f"{one:g}: " + ("not cut to the end" if variation is None
                                          else f"{variation:.1f} %")
                          for one, variation in variations.items())
        said.append("P3's gain, times F/Es, and the removal's deviation on other stock and seeds: "
                    f"{tries}. Compared with {gain:g}.")
        trials = [Trial(plan, wall, mode, seed, gain if mode == "P3" else 0.0)
                  for seed, wall, mode in product(range(1, seeds + 1), WALLS, MODES)]
        runs = sorted(in_parallel(run, trials, tell), key=_order)
    said += bounds(runs)
    rows = statistics(runs)
    write_results(folder, {"plan": asdict(plan), "tuning": sorted(tuning, key=_order),
                           "runs": runs}, _page(rows, said, seeds))
    plot(runs, folder / "plot.png")
    for wall in WALLS:
        console.print(table([row for row in rows if row["wall"] == wall]))
    for one in said:
        console.print(one, soft_wrap=True)
    console.print(f"{folder}: runs.json, table.md, plot.png", soft_wrap=True)
