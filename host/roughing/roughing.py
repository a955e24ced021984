# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper plan``: the staircase of a roughing job as a table, a plot and a machining program.

The program has a condition for each current: one that is built into the controller
(``softcore.tables.conditions``), or a row that the program enters with G10 and whose pulse lies
between those of the built-in ones. They are for copper on steel, electrode positive; for other
materials enter your own rows instead. If the supply has steps of part of an IP, so have the rows,
and a comment names the setting that the controller needs.

Counted pulse classes control the gap (G95 P1). The retractable limit follows the depth: 0.5 mm down
to Zr = -1.5 mm, where the electrode is near the surface of the fluid; 2 mm from there on; 5 mm from
-6 mm on, where bridges of debris are longer and there is enough fluid above. No limit lets the
electrode rise more than 0.5 mm above the workpiece. Speeds and changeover are those of
``tapes/sink_shallow_deep.nc``: they suit a machine with a start/stop speed of 10 mm/s. With a depth
series (G39) the whole way is one block with one limit of 5 mm. A ceiling 1 mm above the workpiece
keeps the electrode from leaving the fluid.
"""

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.table import Table

from host.errors import UsageError, UserError
from host.roughing.basic import BasicData, read_all
from host.roughing.staircase import Job, Staircase, Step, neighbours, plan, undersize_cell
from host.run import figures
from host.words import exact
from softcore.tables.conditions import (
    CURRENT_MAX_A,
    ENTERED,
    IP_MA,
    PLANNED,
    ladder,
    level_max,
)
from softcore.tables.settings import assign, named

__all__ = ["BUILT_IN", "JUMP", "condition", "conditions", "parts_of_step", "plot", "program",
           "roughing", "table"]

# Of the controller's own conditions: current (IP), number, on- and off-time (us).
BUILT_IN = ladder()
# Whole IP have the number 900 + IP, as on the controller (conditions_planned); parts of one follow.
FIRST_ENTERED, FIRST_PART = PLANNED, 964
MOST_ENTERED, MOST_CHANGES = ENTERED, 32
AMPERES = IP_MA / 1000  # of one IP
# A pulse must be longer than the blanking, in which the gap is not observed.
LEAST_ON_US = (named("blanking_ns").default + named("settle_ns").default) // 1000 + 1
LIMITS = ((0, "R300 L0.5 H600 E60 Q0.1"), (1500, "R900 L2. H900 Q0.2"), (6000, "L5."))
JUMP = "G38 P400 L1. R900 H900"     # 1 mm up after each 0.4 s of machining
DEPTH_SERIES_LIMIT = "R900 L5. H900 E60 Q0.2 Z1."
MOST_PARTS = 20
MOST_LABELS = 8     # in the plot
MOST_COMMENT = 250  # a block has 256 characters, its brackets and its end among them


def parts_of_step(step_ip: float) -> int:
    """Number of parts into which a supply with this step divides one IP.

    Raises
    ------
    UsageError
        If the step is not 1 IP or a whole part of it.
    """
    parts = round(1 / step_ip) if step_ip * (MOST_PARTS + 1) > 1 else 0
    if not 1 <= parts <= MOST_PARTS or abs(parts * step_ip - 1) > 0.005:
        raise UsageError(f"the supply's step must be 1 IP or a whole part of it, down to "
                         f"1/{MOST_PARTS}, not {exact(step_ip)}.")
    return parts


def _step_ma(parts: int) -> int:
    """Step of a supply that divides one IP, in mA, rounded to a whole number for the setting."""
    return round(1000 * AMPERES / parts)


def _current(ip: float) -> str:
    """A current as text, for words and for people: to 1/1000 IP."""
    return f"{ip:.3f}".rstrip("0").rstrip(".")


def condition(ip: float, number: int | None = None) -> tuple[int, str]:
    """Number of the condition for a current, and the G10 block that enters it, or "".

    ``number`` is the condition's number if the current is not a whole number of IP.
    """
    for known, built_in, *_ in BUILT_IN:
        if ip == known:
            return built_in, ""
    lower = max((row for row in BUILT_IN if row[0] < ip), default=BUILT_IN[0])
    upper = min((row for row in BUILT_IN if row[0] > ip), default=None)
    if ip < lower[0]:
        on = max(LEAST_ON_US, round(lower[2] * ip / lower[0]))
        off = round(on * lower[3] / lower[2])
    elif upper is None:
        on, off = (round(time * ip / lower[0]) for time in lower[2:])
    else:
        share = (ip - lower[0]) / (upper[0] - lower[0])
        on, off = (round(one + (other - one) * share)
                   for one, other in zip(lower[2:], upper[2:], strict=True))
    number = FIRST_ENTERED + round(ip) if number is None else number
    return number, f"G10 C{number} I{_current(ip)} P{on} Q{off} R{off}"


def conditions(steps: Sequence[Step]) -> list[tuple[int, str]]:
    """``condition`` of each step; currents that are not whole IP are numbered in order."""
    part = count(FIRST_PART)
    return [condition(step.ip, None if step.ip == round(step.ip) else next(part))
            for step in steps]


def _millimetres(depth_um: int) -> str:
    """A depth as a word's number, with decimal point and without trailing zeros."""
    return f"{depth_um / 1000:.3f}".rstrip("0")


def _conditions(found: Staircase, steps: Sequence[Step]) -> tuple[list[int], list[str]]:
    """Number of each step's condition, as in the table, and the blocks that enter them."""
    parts = found.job.steps
    most = level_max(CURRENT_MAX_A, AMPERES / parts)
    for step in steps:
        if round(step.ip * parts) > most:
            raise UserError(
                f"the controller sets the power supply to {most} of its steps at most, IP "
                f"{_current(most / parts)}, so no program can be written with IP "
                f"{_current(step.ip)}.")
    numbered = dict(zip((step.ip for step in found.steps), conditions(found.steps), strict=True))
    used = [numbered[step.ip] for step in steps]
    entered = [block for _, block in used if block]
    if len(entered) > MOST_ENTERED:
        raise UserError(f"the staircase needs {len(entered)} conditions of its own, and the "
                        f"controller takes {MOST_ENTERED}.")
    return [number for number, _ in used], entered


def _end_um(found: Staircase) -> int:
    """Depth to which a program sinks."""
    return found.steps[-1].depth_um - math.ceil(found.bottom_um)


def sunk(found: Staircase) -> tuple[Step, ...]:
    """The steps that a program sinks: they end above the job's depth by the stock on the bottom.

    Steps that would begin below that end are left out. The last current, whose stock it is, is kept
    in any case: it then removes the last ``bottom_um`` of the way.
    """
    stock, end = math.ceil(found.bottom_um), _end_um(found)
    if end <= 0:
        raise UserError(f"the last step leaves {found.bottom_um:.0f} um on the bottom, so nothing "
                        f"is roughed to {exact(found.job.depth_mm)} mm.")
    last = max(0, end - stock)
    before = [Step(step.ip, min(step.depth_um, last)) for begin, step in _pieces(found.steps[:-1])
              if begin < last]
    return *before, Step(found.steps[-1].ip, end)


def _way(steps: Sequence[Step], numbers: list[int]) -> Iterator[str]:
    """Blocks from the surface down: conditions and limits where they change."""
    changes = {at: f"G36 {words}" for at, words in LIMITS}
    last, feed = 0, " F60"
    for step, following in zip(steps, [*numbers[1:], None], strict=True):
        for at in sorted({at for at in changes if last < at < step.depth_um} | {step.depth_um}):
            yield f"G01 Z-{_millimetres(at)}{feed}" if feed else f"Z-{_millimetres(at)}"
            feed, last = "", at
            # The condition comes first where a step ends and a limit changes at the same depth.
            if at == step.depth_um and following is not None:
                yield f"C{following}"
            if at in changes and (following is not None or at < step.depth_um):
                yield changes[at]


def _depth_series(steps: Sequence[Step], numbers: list[int]) -> Iterator[str]:
    """Blocks of the same way as a depth series and one motion."""
    if len(steps) - 1 > MOST_CHANGES:
        raise UserError(f"the staircase has {len(steps) - 1} changes, and a depth series takes "
                        f"{MOST_CHANGES}.")
    for step, number in zip(steps, numbers[1:], strict=False):
        yield f"G39 Z-{_millimetres(step.depth_um)} C{number}"
    yield f"G01 Z-{_millimetres(steps[-1].depth_um)} F60"
    yield "G39"


def program(found: Staircase, data: list[BasicData], *, depth_series: bool = False,
            jumps: bool = False) -> str:
    """Machining program of a staircase: Z 0 is the top of the workpiece.

    It sinks to the depth of the job less the stock that the last step leaves on the bottom; with
    ``jumps`` it clears the gap by periodic jumps on the way.

    Raises
    ------
    UserError
        If the controller cannot be set to one of the currents, or has no room for them.
    """
    job, steps = found.job, sunk(found)
    numbers, entered = _conditions(found, steps)
    sources = ", ".join(sorted({one.source for one in data}))
    taper = f", {exact(job.taper_deg)} DEG" if job.taper_deg else ""
    comments = [
        f"ROUGHING, {data[0].electrode} ON {data[0].workpiece}, {exact(job.area_mm2)} MM2 TO "
        f"{exact(job.depth_mm)} MM, UNDERSIZE {exact(job.undersize_um)} UM{taper}",
        f"BASIC DATA {sources}",
        f"LEAVES {found.bottom_um:.0f} UM ON THE BOTTOM AND {found.side_um:.0f} UM ON THE SIDE",
    ]
    if job.steps > 1:
        number = named("current_step_ma").number
        comments.append(f"NEEDS SETTING {number} AT {_step_ma(job.steps)}, MA OF ONE STEP OF THE "
                        "POWER SUPPLY")
    way = _depth_series(steps, numbers) if depth_series else _way(steps, numbers)
    blocks = ["G21 G90", *entered, f"C{numbers[0]}", "G95 P1",
              f"G36 {DEPTH_SERIES_LIMIT if depth_series else LIMITS[0][1]}", "M08", "M03",
              *([JUMP, *way, "G38 P0"] if jumps else way), "M05", "G94", "G00 Z2.", "M09", "M02"]
    return "\n".join(["%", *(f"({_plain(one)})" for one in comments),
                      *(f"N{10 * n} {block}" for n, block in enumerate(blocks, 1)), "%", ""])


def _plain(comment: str) -> str:
    """A comment in capitals, with the characters of both tape codes, cut to fit a block."""
    return "".join(char if char in "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+-., /" else " "
                   for char in comment.upper())[:MOST_COMMENT]


def _pieces(steps: Sequence[Step]) -> list[tuple[int, Step]]:
    """Each step with the depth where it begins."""
    return [(one.depth_um, step) for one, step in pairwise([Step(0, 0), *steps])]


def table(found: Staircase, data: list[BasicData],
          style: box.Box = box.SIMPLE_HEAD) -> Table:
    """The staircase from the surface down, with the undersize that each current needs."""
    near = neighbours(data, found.job.area_mm2)
    made = Table(box=style)
    for title in ("from, mm", "to, mm", "IP", "current, A", "condition", "needs there, um"):
        made.add_column(title, justify="right", no_wrap=True)
    for (begin, step), (number, _) in zip(_pieces(found.steps), conditions(found.steps),
                                          strict=True):
        needs = undersize_cell(near, found.job.area_mm2, step.depth_um / 1000, step.ip).between
        made.add_row(f"{begin / 1000:.3f}", f"{step.depth_um / 1000:.3f}", _current(step.ip),
                     _current(step.ip * AMPERES), f"C{number}", f"{needs:.1f}")
    return made


def _sentences(found: Staircase, data: list[BasicData]) -> Iterator[str]:
    job = found.job
    if any(one.source == "synthetic" for one in data):
        yield "The basic data are synthetic: do not machine by them."
    if job.taper_deg:
        yield (f"A gradient of {exact(job.taper_deg)} degrees makes the undersize count as "
               f"{found.undersize_um:.2f} um.")
    yield (f"The undersize allows IP {found.ip:.2f} at {exact(job.depth_mm)} mm: the last step has "
           f"IP {_current(found.alpha)}, which needs {found.beta_um:.2f} um.")
    end = _end_um(found)
    sinks = (f"so that a program sinks to {end / 1000:.3f} mm" if end > 0
             else "more than the depth, so that no program can be written")
    yield (f"It leaves {found.bottom_um:.0f} um on the bottom, {sinks}, and {found.side_um:.0f} um "
           f"on the side, to finish to {exact(job.rmax_um)} um Rmax.")
    for note in found.notes:
        yield f"Note: {note}."


def plot(found: Staircase, data: list[BasicData], path: Path) -> None:
    """Draw the current against the depth, and the undersize that it needs."""
    job, near = found.job, neighbours(data, found.job.area_mm2)

    def needed(ip: float, begin: float, end: float) -> tuple[list[np.float32], NDArray[Any]]:
        depths = np.linspace(max(begin, near[0].depth_mm[0]), end, 60)
        return [undersize_cell(near, job.area_mm2, depth, ip).between for depth in depths], depths

    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(9.6, 5.2), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        currents, depths = [], []
        for begin, step in _pieces(found.steps):
            currents += [step.ip, step.ip]
            depths += [begin / 1000, step.depth_um / 1000]
            right.plot(*needed(step.ip, begin / 1000, step.depth_um / 1000), color=figures.PATH,
                       linewidth=1.8, label="" if begin else "the staircase")
        left.plot(currents, depths, color=figures.PATH, linewidth=1.8)
        left.axvline(found.alpha, color=figures.FAINT, linestyle=(0, (4, 3)), zorder=0)
        left.set(xlabel=f"current, IP of {AMPERES:g} A", ylabel="depth, mm",
                 xlim=(0, found.steps[0].ip + 1), ylim=(job.depth_mm, 0))
        # In a material's name a $ must not begin a formula.
        left.set_title(f"{data[0].electrode} on {data[0].workpiece}, {exact(job.area_mm2)} mm²",
                       parse_math=False)
        for step in found.steps if len(found.steps) <= MOST_LABELS else ():
            left.annotate(f"IP {_current(step.ip)} to {step.depth_um / 1000:.2f} mm",
                          (step.ip, step.depth_um / 1000), xytext=(-4, 5), ha="right",
                          textcoords="offset points", fontsize=8,
                          bbox={"facecolor": "white", "linewidth": 0, "pad": 0.5})
        right.plot(*needed(found.alpha, 0, job.depth_mm), color=figures.FAINT,
                   linestyle=(0, (4, 3)), zorder=1, label=f"IP {_current(found.alpha)} all the way")
        right.axvline(found.beta_um, color=figures.FEED, linewidth=0.9,
                      label=f"what the last step needs, {found.beta_um:.1f} µm")
        right.axvline(found.undersize_um, color=figures.CAUSES["short"], linewidth=0.9,
                      label=f"undersize of the electrode, {found.undersize_um:.1f} µm")
        right.set(xlabel="undersize needed, µm", title="least undersize")
        right.legend(loc="lower left", frameon=True)
        if any(one.source == "synthetic" for one in data):
            figure.suptitle("synthetic basic data", fontsize=8, color=figures.FAINT, x=0.99,
                            ha="right")
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing")   # of a material's name
            figure.savefig(path, dpi=120, format="png")


def _write(path: Path, write: Callable[[], object]) -> None:
    """Write a file, and its folder if there is none."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write()
    except OSError as error:
        # On a full disk the error names no file.
        raise UserError(f"{error.filename or path} cannot be written: {error.strerror}."
                        ) from error


def roughing(*, electrode: str, workpiece: str, job: Job, seed: int, folder: Path,
             target: Path | None, picture: Path | None, depth_series: bool, jumps: bool,
             console: Console) -> None:
    """Infer the staircase of a job and show it; write its program and its plot if asked for."""
    data = read_all(electrode, workpiece, folder)
    found = plan(data, job, seed)
    # Files are written before anything is printed: the reader of a pipe may close it early.
    written = []
    if target is not None:
        text = program(found, neighbours(data, job.area_mm2), depth_series=depth_series,
                       jumps=jumps)
        _write(target, lambda: target.write_text(text, encoding="utf-8"))
        written.append(f"{target}: {text.count(chr(10))} lines")
        if job.steps > 1:
            step = assign("current_step_ma", _step_ma(job.steps))
            written.append(f"It needs the setting {step} (one step of the power supply, mA).")
    if picture is not None:
        _write(picture, lambda: plot(found, data, picture))
        written.append(f"{picture}: plot")
    console.print(table(found, neighbours(data, job.area_mm2)))
    for one in _sentences(found, data):
        console.print(one, soft_wrap=True)
    for one in written:
        console.print(one, soft_wrap=True, markup=False)
