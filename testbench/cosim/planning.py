# SPDX-License-Identifier: Apache-2.0
"""Planned roughing: basic data of a short job, planning on the controller, and checks."""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from itertools import accumulate, pairwise

from host.roughing.basic import BasicData
from host.roughing.load import lines
from host.roughing.staircase import Job as Roughing
from host.roughing.staircase import Step
from host.roughing.synthetic import undersize_um
from testbench.cosim.job import MM, Job
from testbench.cosim.record import Record
from testbench.native.station import Session

__all__ = ["WATCHED", "check_currents", "check_switches", "plan_on", "steep"]

WATCHED = ("condition_switched", "axis_z_position", "gap_ma", "gap_on")
STEEPER = 18.75     # 15 mm of the synthetic data become 0.8 mm here
DEPTHS_MM = (0.0, 0.1, 0.2, 0.4, 0.8, 1.2)
CURRENTS = (4.0, 6.0, 8.0, 10.0, 12.0, 14.0)
SENSING_MA = 1000   # only main pulses have a higher current
LONGEST_S = 60.0    # of a planning, in the machine's time at 2 MHz
STEP = re.compile(r"\[MSG:IP (\d+) to (\d+)\.(\d{3})0 mm\]")
NEEDS = re.compile(r"\[MSG:The last step needs an undersize of ([\d.]+) um, "
                   r"of ([\d.]+) um allowed\]")
LEAVES = re.compile(r"\[MSG:The last step leaves ([\d.]+) um on the bottom and "
                    r"([\d.]+) um on the side\]")


def steep(area_mm2: float) -> BasicData:
    """Invented basic data of an area.

    The undersize rises within 0.8 mm as much as that of the synthetic data within 15 mm: so a
    shallow cavity has several steps.
    """
    stock = tuple(3 * ip for ip in CURRENTS)
    return BasicData(
        name=f"steep_{area_mm2:g}", electrode="copper", workpiece="steel", area_mm2=area_mm2,
        source="made up", depth_mm=DEPTHS_MM, ip=CURRENTS, bottom_um=stock, side_um=stock,
        undersize_um=tuple(tuple(round(undersize_um(area_mm2, ip, STEEPER * depth), 1)
                                 for depth in DEPTHS_MM) for ip in CURRENTS),
        finish_um=((1.0, 0.0),))


def plan_on(session: Session, data: Sequence[BasicData], roughing: Roughing,
            watched: Sequence[str] = WATCHED) -> tuple[Job, dict]:
    """Enter basic data over the serial line and let the controller plan.

    Returns
    -------
    job : Job
        The controller, for use afterwards.
    found : dict
        ``steps`` from the surface down, as the host has them; ``needs_um`` and ``has_um`` of the
        undersize; the stock ``bottom_um`` and ``side_um`` that the last step leaves; ``clocks``
        from the line to its answer; ``longest`` step of the main loop's task that plans, in clocks.
    """
    job = Job(session, *lines(data), watched=watched)
    job.said.clear()
    begin = session.cycle
    job.link.command(f"$BP{roughing.area_mm2:g},{roughing.undersize_um:g},{roughing.depth_mm:g}")
    clocks = session.cycle - begin
    first, *said, last = (line for line in job.said if not line.startswith("<"))
    bottom_um, side_um = map(float, LEAVES.fullmatch(last).groups())
    needs_um, has_um = map(float, NEEDS.fullmatch(first).groups())
    steps = [STEP.fullmatch(line).groups() for line in said]
    job.link.command("$P")
    profile = dict(item.split() for item in job.said[-1].strip("[]").split(":")[1].split(","))
    return job, {
        "steps": tuple(Step(float(ip), 1000 * int(mm) + int(um)) for ip, mm, um in steps),
        "needs_um": needs_um, "has_um": has_um, "bottom_um": bottom_um, "side_um": side_um,
        "clocks": clocks, "longest": int(profile["link"])}


def check_switches(record: Record, steps: Sequence[Step], origin: int) -> None:
    """Check that the gateware switches exactly at the encoder's pulse, never before."""
    clocks = record.rises("condition_switched")
    assert len(clocks) == len(steps) - 1
    for clock, step in zip(clocks, steps, strict=False):
        reached = -step.depth_um * MM // 1000 - origin
        assert record.at("axis_z_position", clock - 2) == reached
        assert record.lowest("axis_z_position", 0, clock - 2) == reached + 1


def check_currents(record: Record, steps: Sequence[Step], origin: int, step_ma: float,
                   margin: int) -> None:
    """Check that the gap has the planned current of the furthest depth reached so far.

    Pulses that begin within ``margin`` pulses of a border may have the current of either side.
    """
    clocks, places = record.signals["axis_z_position"]
    lowest = list(accumulate(places, min))
    borders = [-step.depth_um * MM // 1000 - origin for step in steps[:-1]]
    begins = [clock for clock, on in record.changes("gap_on") if on]
    flow_clocks, flows = record.signals["gap_ma"]
    seen = [set() for _ in steps]
    for begin, until in pairwise(begins):
        deepest = lowest[max(0, bisect_right(clocks, begin) - 1)]
        if any(abs(deepest - border) <= margin for border in borders):
            continue
        number = sum(deepest < border for border in borders)
        main = flows[bisect_right(flow_clocks, begin):bisect_left(flow_clocks, until)]
        seen[number].update(current for current in main if current > SENSING_MA)
    assert seen == [{step_ma * step.ip} for step in steps]
