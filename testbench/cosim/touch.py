# SPDX-License-Identifier: Apache-2.0
"""Scenarios: touch-off on the simulated machines, against the true place of the work."""

import math
import re

from host.touch.cycles import Cycle, Found, drive
from host.touch.zero import set_zero
from testbench.cosim.job import MM, Job
from testbench.native.station import Session

__all__ = ["found", "off", "opens", "twice", "zeroed"]

WATCHED = ("pp", "gap_on", "gap_sense", "safe")
PLACE = re.compile(r"\[PRB:(-?[\d.]+),(-?[\d.]+),(-?[\d.]+):([01])\]")


def _begin(session):
    """A controller with the gap of the simulated machine, not a forced one."""
    job = Job(session, watched=WATCHED)
    session.set("force.short", -1)
    session.set("force.gap_um", math.nan)
    return job


def _touch(job, block):
    """Touch; return the place that is told in mm of the machine frame, x, y and z."""
    said = len(job.said)
    job.link.command(block)
    (found,) = (match for line in job.said[said:] if (match := PLACE.fullmatch(line)))
    assert found[4] == "1", found[0]
    assert not job.probe("safety_status_safe")
    assert not job.told("alarm")
    assert not job.collect().rises("gap_on"), "a discharge pulse"
    return tuple(float(found[axis]) for axis in (1, 2, 3))


def off(session: Session, block: str, axis: int, true_mm: float) -> dict:
    """One touch-off along an axis; ``true_mm`` is where the electrode's surface meets the work.

    Figures in µm: ``error`` of the place that is told, beyond the work's surface positive; how
    far the electrode stood beyond that place at the end (``beyond``).
    """
    job = _begin(session)
    way = -1 if "-" in block else 1
    found = _touch(job, block)[axis]
    stands = job.probe(f"axis_{'xyz'[axis]}_position") / MM
    assert stands == session.positions()["xyz"[axis]] / MM
    # The next block counts from here.
    job.link.command(f"G91 G01 {'XYZ'[axis]}{-0.05 * way:.3f} F60")
    job.until(lambda: session.positions()["xyz"[axis]] == round((stands - 0.05 * way) * MM),
              "the way back")
    return {"error": (found - true_mm) * way * 1000, "beyond": (stands - found) * way * 1000}


def twice(session: Session, axis: int, true_mm: float, *, way: int = -1, quick: float = 30,
          slow: float = 2) -> float:
    """A quick touch, 0.3 mm back, and a slow one; the error of the second in um, as in ``off``.

    After contact the simulated gap stays bridged over some tens of micrometres.
    """
    job = _begin(session)
    letter = "XYZ"[axis]
    job.link.command("G91")
    first = _touch(job, f"G38.2 {letter}{way} F{quick:g}")[axis]
    job.link.command(f"G01 {letter}{-0.3 * way:.1f} F600")
    job.link.command("G04 P20")     # until the axis is there, and no bridge is left
    job.link.command(f"G01 {letter}{0.28 * way:.2f} F60")
    second = _touch(job, f"G38.2 {letter}{0.1 * way:.1f} F{slow:g}")[axis]
    assert abs(first - second) < 0.05
    return (second - true_mm) * way * 1000


def opens(session: Session, axis: int, true_mm: float, *, way: int = -1, feed: float = 2) -> dict:
    """A touch, and away from the work until the gap is open.

    Figures in um, away from the work positive: the place told (``place``) and that of the axis at
    the end (``stands``), both from the work's surface, and the place where the simulated gap has
    really opened (``opened``).
    """
    job = _begin(session)
    letter = "XYZ"[axis]
    job.link.command("G91")
    _touch(job, f"G38.2 {letter}{way} F10")
    assert session.get("read.bridged")
    opened, said = [], len(job.said)

    def look():
        if not opened and not session.get("read.bridged"):
            opened.append(session.get(f"read.{letter.lower()}_pulses") / MM)
        return len(job.said) > said and job.said[-1].startswith("[PRB:")

    job.link.send_line(f"G38.4 {letter}{-way} F{feed:g}")
    job.until(look, "the end of contact", step=200, seconds=60)
    found = PLACE.fullmatch(job.said[-1])
    assert found[4] == "1", found[0]
    job.until(lambda: not job.probe("path_status_moving"), "rest")
    job.run(session.clock_hz // 5)
    stands = session.positions()["xyz"[axis]] / MM
    assert not job.told("alarm")
    return {name: (place - true_mm) * -way * 1000
            for name, place in (("place", float(found[axis + 1])), ("stands", stands),
                                ("opened", opened[0]))}


def found(session: Session, start: str, *cycles: Cycle) -> list[Found]:
    """Go to the start by lines, one to a row, and carry out cycles one after the other."""
    job = _begin(session)
    for line in start.splitlines():
        job.link.command(line)
    results = [drive(job.link, cycle) for cycle in cycles]
    assert not job.told("alarm")
    assert not job.probe("safety_status_safe")
    assert not job.collect().rises("gap_on"), "a discharge pulse"
    return results


def zeroed(session: Session, start: str, cycle: Cycle, systems: list[int]) -> dict[int, dict]:
    """Set the zero of work offsets at what a cycle finds, with an offset of G92 in force.

    Return, by work offset, what the found place reads in it, in mm by axis.
    """
    job = _begin(session)
    for line in start.splitlines():
        job.link.command(line)
    result = drive(job.link, cycle)
    readings = {}
    for system in systems:
        set_zero(job.link, result, system)
    for system in systems:
        job.link.command(f"G{53 + system}")
        told = job.link.status()
        zero = dict(zip("XYZ", map(float, told["WCO"].split(",")), strict=True))
        readings[system] = {axis: place - zero[axis] for axis, place in result.places.items()}
    assert not job.told("alarm")
    return readings
