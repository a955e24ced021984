# SPDX-License-Identifier: Apache-2.0
"""The roughing planner: at every depth the greatest current that the electrode's undersize allows.

From basic data (``host.roughing.basic``) and a job it infers a staircase of currents. The greatest
current begins at the surface. Each current ends at the depth at which it would make the cavity
wider than the last one will; the last one goes to the end. These are steps S10 to S24 of
CN 1112469 A, Figures 2A to 2F:

* S11: the undersize X of an electrode with a gradient counts as X cos(gradient).
* S12, S13: neighbours are the two files next to the area; in each the two depths next to D; at each
  depth the two currents whose least undersize is next to X. That gives eight samples.
* S14 to S16: the first network learns the current from area, depth and undersize. Its answer,
  rounded down to a step of the supply, is alpha, the current of the last step.
* S17 to S19: the second network learns the undersize from area, depth and current near alpha. Its
  answer is beta, the undersize that alpha needs at D.
* S20 to S24: for alpha + 1, alpha + 2, ... the third network learns the depth from area, current
  and undersize near beta. Its answer is gamma, the depth to which that current may go. The first
  gamma that is not above 0 ends the staircase.

"Next to" means one value on either side, if the data have both. The samples of the third network
have two depths, those between which beta lies at this area and current.

All numbers have single precision, in the order of ``softcore/firmware/roughing/staircase.c``, which
finds the same staircase.

Where the third patent is silent: area and depth outside the data are refused, and so is an
undersize too small for the least current. An undersize larger than the greatest current needs gives
that current. A gamma above the shallowest depth of the data is inferred beyond them. A note says so
in both cases. The last step ends at the job's depth, which is a whole number of um; all other
depths are rounded down to one. beta is never taken above X. A current that would reach as deep as
the current below it, or deeper, is left out.

A network that did not learn all its samples, or is not proved monotone over them, is not trusted:
the multilinear interpolation between the same samples replaces it, and a note says so. Nor is a
network trusted whose answer differs from the interpolation by more than 0.1 step of the supply's
current, or 5 % of the depth (interpolated for a beta that was interpolated too). Near the surface
the depth depends on the last digit of the data: 0.1 um of beta moves a depth of 0.3 mm by 20 um. In
500 random jobs on the shipped data, with steps of 1/10 IP, the interpolation replaced 2 to 4 % of
the depths, and the current in 9 to 34 % of the jobs, depending on the undersizes drawn.

Neither network nor interpolation knows what lies between the data. The undersize of the shipped
data is curved between two areas: by its formula, steps of 350 random jobs down to 40 mm need up to
1.3 um more than beta, and the last one up to 1.0 um more than X.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from math import ceil

import numpy as np

from host.errors import UserError
from host.roughing.basic import BasicData
from host.roughing.network import Number, train
from host.words import exact

__all__ = ["Answers", "Cell", "Job", "Staircase", "Step", "cosine", "current_cell", "depth_cell",
           "neighbours", "plan", "undersize_cell"]

SINGLE = np.float32
GRANTED = 2.0**-10      # part of a step, or of 1 um, by which an answer may be short when rounded
DEGREE = 0.017453292519943295
STEEPEST_DEG = 60.0
TERMS = 8
CURRENT_SHARE, DEPTH_SHARE = 0.1, 0.05
NEIGHBOUR = tuple[int, ...]
Sample = tuple[float, float, float, float]


@dataclass(frozen=True)
class Job:
    """A roughing job. Areas in mm², depths in mm, the undersize per side in um.

    ``steps`` is the number of parts into which the supply divides one IP. ``rmax_um`` is the
    roughness of the finished surface.
    """

    area_mm2: float
    undersize_um: float
    depth_mm: float
    taper_deg: float = 0.0
    steps: int = 1
    rmax_um: float = 1.0


@dataclass(frozen=True)
class Step:
    """A current, and the depth to which it is used."""

    ip: float
    depth_um: int


@dataclass(frozen=True)
class Staircase:
    """An inferred staircase; ``steps`` go from the surface down.

    ``undersize_um`` is X after the correction, ``ip`` the current before rounding. ``bottom_um``
    and ``side_um`` are the stock left by the last step, the side's for the roughness of the job.
    """

    job: Job
    undersize_um: float
    ip: float
    alpha: float
    beta_um: float
    steps: tuple[Step, ...]
    bottom_um: float
    side_um: float
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Cell:
    """Samples of a network, rows of three inputs and the output; and the inputs of the question.

    ``signs`` are those of ``Network.rises``; ``between`` is the multilinear interpolation.
    """

    samples: tuple[Sample, ...]
    inputs: tuple[np.float32, np.float32, np.float32]
    signs: tuple[int, int, int]
    between: np.float32


def cosine(degrees: float) -> np.float32:
    """Cosine by its power series; the soft core does the same."""
    angle = SINGLE(degrees) * DEGREE
    square, total = angle * angle, SINGLE(1)
    for k in range(TERMS, 0, -1):
        total = 1.0 - square / ((2 * k - 1) * (2 * k)) * total
    return total


def _next_to(values: Sequence[Number], value: Number) -> NEIGHBOUR:
    """Indices of the two values next to ``value``, one on either side if possible."""
    if len(values) == 1:
        return (0,)
    at = sum(bool(SINGLE(one) <= value) for one in values) - 1
    at = min(max(at, 0), len(values) - 2)
    return (at, at + 1)


def _line(x: Sequence[Number], y: Sequence[Number], at: Number) -> np.float32:
    """Value at ``at`` of the line through two points, or of the only point."""
    if len(x) == 1:
        return SINGLE(y[0])
    (x0, x1), (y0, y1) = map(SINGLE, x), map(SINGLE, y)
    return y0 + (y1 - y0) * ((SINGLE(at) - x0) / (x1 - x0))


def _undersize(one: BasicData, ip: np.float32, depth: int) -> np.float32:
    """Least undersize of one file at a current and the index of a depth."""
    rows = _next_to(one.ip, ip)
    return _line([one.ip[row] for row in rows], [one.undersize_um[row][depth] for row in rows], ip)


def current_cell(data: Sequence[BasicData], area_mm2: Number, depth_mm: Number,
                 undersize_um: Number) -> Cell:
    """Samples from which the first network learns, of one or two files."""
    area, reached, undersize = SINGLE(area_mm2), SINGLE(depth_mm), SINGLE(undersize_um)
    samples: list[Sample] = []
    by_area = []
    for one in data:
        places, by_depth = _next_to(one.depth_mm, reached), []
        for depth in places:
            column = one.column(depth)
            rows = _next_to(column, undersize)
            samples += [(one.area_mm2, one.depth_mm[depth], column[row], one.ip[row])
                        for row in rows]
            by_depth.append(_line([column[row] for row in rows], [one.ip[row] for row in rows],
                                  undersize))
        by_area.append(_line([one.depth_mm[depth] for depth in places], by_depth, reached))
    return Cell(tuple(samples), (area, reached, undersize), (0, -1, 1),
                _line([one.area_mm2 for one in data], by_area, area))


def undersize_cell(data: Sequence[BasicData], area_mm2: Number, depth_mm: Number,
                   ip: Number) -> Cell:
    """Samples from which the second network learns."""
    area, reached, current = SINGLE(area_mm2), SINGLE(depth_mm), SINGLE(ip)
    samples: list[Sample] = []
    by_area = []
    for one in data:
        places, by_depth = _next_to(one.depth_mm, reached), []
        for depth in places:
            samples += [(one.area_mm2, one.depth_mm[depth], one.ip[row],
                         one.undersize_um[row][depth]) for row in _next_to(one.ip, current)]
            by_depth.append(_undersize(one, current, depth))
        by_area.append(_line([one.depth_mm[depth] for depth in places], by_depth, reached))
    return Cell(tuple(samples), (area, reached, current), (0, 1, 1),
                _line([one.area_mm2 for one in data], by_area, area))


def depth_cell(data: Sequence[BasicData], area_mm2: Number, ip: Number,
               beta_um: Number) -> Cell:
    """Samples from which the third network learns. The files have more than one depth."""
    area, current, beta = SINGLE(area_mm2), SINGLE(ip), SINGLE(beta_um)
    depths = data[0].depth_mm
    needed = [_line([one.area_mm2 for one in data],
                    [_undersize(one, current, depth) for one in data], area)
              for depth in range(len(depths))]
    places = _next_to(needed, beta)
    samples = tuple((one.area_mm2, one.ip[row], one.undersize_um[row][depth], depths[depth])
                    for one in data for row in _next_to(one.ip, current) for depth in places)
    return Cell(samples, (area, current, beta), (0, -1, 1),
                _line([needed[depth] for depth in places], [depths[depth] for depth in places],
                      beta))


class Answers(Enum):
    """What answers a question to the basic data."""

    TRUSTED = "network if trusted"      # else the interpolation: what the planner does
    NETWORK = "network"                 # whether it is trusted or not
    INTERPOLATION = "interpolation"


class _Inference:
    """Trains a network for each question, and notes those that are not trusted."""

    def __init__(self, seed: int, answers: Answers) -> None:
        self.seed = seed
        self.answers = answers
        self.untrusted: list[str] = []

    def __call__(self, cell: Cell, name: str,
                 agree: Callable[[np.float32, np.float32], bool] | None = None) -> np.float32:
        """Answer of a network, or the interpolation; ``agree`` compares the two."""
        if self.answers is Answers.INTERPOLATION:
            return cell.between
        network = train(cell.samples, self.seed)
        inferred = network.infer(cell.inputs)
        if self.answers is Answers.NETWORK:
            return inferred
        if not network.converged:
            why = "did not learn all samples"
        elif not network.rises(cell.signs, cell.inputs):
            why = "was not proved monotone"
        elif agree is not None and not agree(inferred, cell.between):
            why = "departs from that"
        else:
            return inferred
        self.untrusted.append(f"{name}: interpolated, since its network {why}")
        return cell.between


def _same_depth(one: np.float32, two: np.float32) -> bool:
    """Whether two depths agree; all places above the surface count as the same."""
    return bool((one <= 0 and two <= 0) or abs(one - two) <= DEPTH_SHARE * two)


def neighbours(data: Sequence[BasicData], area_mm2: float) -> list[BasicData]:
    """S12: the files next to an area, or the only one.

    Raises
    ------
    UserError
        If the area is outside of the data.
    """
    if not data[0].area_mm2 <= area_mm2 <= data[-1].area_mm2:
        held = (f"{exact(data[0].area_mm2)} to {exact(data[-1].area_mm2)} mm2" if len(data) > 1
                else f"{exact(data[0].area_mm2)} mm2 only")
        raise UserError(f"the area of {exact(area_mm2)} mm2 is outside of the basic data ({held}).")
    return [data[place] for place in _next_to([one.area_mm2 for one in data], area_mm2)]


def _check(near: list[BasicData], job: Job,
           undersize_um: np.float32) -> tuple[np.float32, np.float32]:
    depths = near[0].depth_mm
    if not depths[0] <= job.depth_mm <= depths[-1]:
        held = (f"{exact(depths[0])} to {exact(depths[-1])} mm" if len(depths) > 1
                else f"{exact(depths[0])} mm only")
        raise UserError(f"the depth of {exact(job.depth_mm)} mm is outside of the basic data "
                        f"({held}).")
    if round(job.depth_mm, 3) != job.depth_mm:
        raise UserError(f"the depth of {exact(job.depth_mm)} mm has more than 3 digits behind the "
                        "point.")
    least = SINGLE(max(one.ip[0] for one in near))
    greatest = SINGLE(min(one.ip[-1] for one in near))
    if least > greatest:
        raise UserError(f"{near[0].name} and {near[1].name} have no current in common.")
    needed = undersize_cell(near, job.area_mm2, job.depth_mm, least).between
    if undersize_um < needed:
        counts = (f", which a gradient of {exact(job.taper_deg)} degrees makes "
                  f"{undersize_um:.3f} um," if job.taper_deg else "")
        raise UserError(f"an undersize of {exact(job.undersize_um)} um{counts} is too small: the "
                        f"least current, IP {least:g}, needs {ceil(needed * 10) / 10:.1f} um at "
                        f"{exact(job.depth_mm)} mm.")
    return least, greatest


def _stock(near: list[BasicData], job: Job, alpha: np.float32) -> tuple[float, float]:
    """Stock left on bottom and side by the last step, corrected for the roughness."""
    areas, finish = [one.area_mm2 for one in near], near[0].finish_um
    rough = [one[0] for one in finish]
    if not rough[0] <= job.rmax_um <= rough[-1]:
        held = (f"{exact(rough[0])} to {exact(rough[-1])} um" if len(rough) > 1 else "1 um only")
        raise UserError(f"a finish of {exact(job.rmax_um)} um Rmax is outside of the basic data "
                        f"({held}).")
    places = _next_to(rough, job.rmax_um)
    less = _line([rough[place] for place in places], [finish[place][1] for place in places],
                 job.rmax_um)

    def left(values: Callable[[BasicData], tuple[float, ...]]) -> np.float32:
        by_area = []
        for one in near:
            rows = _next_to(one.ip, alpha)
            by_area.append(_line([one.ip[row] for row in rows],
                                 [values(one)[row] for row in rows], alpha))
        return _line(areas, by_area, job.area_mm2)

    return (float(left(lambda one: one.bottom_um)),
            max(0.0, float(left(lambda one: one.side_um) + less)))


def plan(data: Sequence[BasicData], job: Job, seed: int = 1,
         answers: Answers = Answers.TRUSTED) -> Staircase:
    """Infer the staircase of a job from the basic data of its materials, in order of area.

    ``answers`` is for comparisons (``host.experiments.networks``).

    Raises
    ------
    UserError
        If the job is outside of the data.
    """
    undersize_um = SINGLE(job.undersize_um)
    if job.taper_deg:
        undersize_um = undersize_um * cosine(job.taper_deg)
    near = neighbours(data, job.area_mm2)
    least, greatest = _check(near, job, undersize_um)
    infer, notes = _Inference(seed, answers), []

    def inside_data(ip: np.float32) -> np.float32:
        return min(max(ip, least), greatest)

    def same_current(one: np.float32, two: np.float32) -> bool:
        return bool(abs(inside_data(one) - inside_data(two)) * job.steps <= CURRENT_SHARE)

    ip = inside_data(infer(current_cell(near, job.area_mm2, job.depth_mm, undersize_um), "current",
                           same_current))
    level = int(ip * job.steps + GRANTED)
    alpha = SINGLE(level) / job.steps
    if alpha < least:
        raise UserError(f"the supply has no step between the least current of the basic data, "
                        f"IP {least:g}, and what the undersize allows, IP {ip:.2f}.")
    if ip == greatest:
        notes.append(f"the undersize allows the greatest current of the basic data, IP "
                     f"{greatest:g}, at {exact(job.depth_mm)} mm; whether it allows more is not "
                     "known")

    needs = undersize_cell(near, job.area_mm2, job.depth_mm, alpha)
    beta = min(infer(needs, "least undersize"), undersize_um)
    interpolated = min(needs.between, undersize_um)

    steps = [Step(level / job.steps, round(job.depth_mm * 1000))]
    shallowest, several = SINGLE(near[0].depth_mm[0]), len(near[0].depth_mm) > 1
    while several:
        level += 1
        current = SINGLE(level) / job.steps
        if current > greatest:
            notes.append(f"currents above IP {greatest:g} are not in the basic data")
            break
        between = depth_cell(near, job.area_mm2, current, interpolated).between
        cell = replace(depth_cell(near, job.area_mm2, current, beta), between=between)
        gamma = infer(cell, f"depth at IP {current:g}", _same_depth)
        depth_um = int(gamma * 1000 + GRANTED) if gamma > 0 else 0
        if depth_um == 0:
            break
        if depth_um >= steps[-1].depth_um:
            continue
        if gamma < shallowest:
            notes.append(f"the depth of IP {current:g} is inferred beyond the basic "
                         f"data, which begin at {shallowest:g} mm")
        steps.append(Step(level / job.steps, depth_um))
    if not several:
        notes.append("the basic data have one depth only, from which no other can be inferred")
    notes += infer.untrusted
    bottom_um, side_um = _stock(near, job, alpha)
    assert all(one.depth_um > other.depth_um for one, other in pairwise(steps))
    return Staircase(job, float(undersize_um), float(ip), steps[0].ip, float(beta),
                     tuple(reversed(steps)), bottom_um, side_um, tuple(notes))
