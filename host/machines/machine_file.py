# SPDX-License-Identifier: Apache-2.0
"""Contents of a machine's file: every number with its unit, its range and its meaning.

There is one model for the sinker and one for the wire machine. ``host.machines.machine`` checks
files with them, and ``host.pages`` makes ``docs/reference/machine-file.md`` of them. The plant uses
the same names of tables and numbers. The built-in machines' files name the sources of the values.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, field_validator
from pydantic.fields import FieldInfo

from host.machines.axis_tables import DIVISOR, SHARE, Apart, Axis, Drive, Flag, Table, number
from softcore.tables.settings import named

__all__ = ["DRIVES", "HIGHEST_CLOCK_HZ", "LOWEST_CLOCK_HZ", "MACHINES",
           "STEPS", "WORDS", "Drive", "MachineFile", "SinkerFile", "Table", "WireFile", "allows",
           "bounds", "entries", "least", "said_range"]

# Below this range the firmware cannot keep up with its watchdog; no device runs above it.
LOWEST_CLOCK_HZ, HIGHEST_CLOCK_HZ = 2_000_000, 100_000_000

STEPS = 16  # of the stock's width, at most
DRIVES = "xyz"  # tables of single axes

# Ranges within which the controller works and the plant's formulas are defined (they divide by most
# numbers).
ANY, SHAPE = (0, 10**9), (0.1, 10)
SPEED_UP, OHM_CM = (0.001, 1_000_000), (1, 10**12)
# No step is finer than the controller can count, nor coarser than the highest current.
STEP_A = (named("current_step_ma").lowest / 1000, 10_000)


class Gap(Table):
    """The spark gap and how it ignites."""

    arc_removal: float = number("", SHARE, "What an arc removes, as a share of a good discharge.")
    ignition_debris: float = number("", ANY,
        "Debris helps ignition: the mean delay is divided by 1 + this times the debris.")
    ignition_power: float = number("", (0, 100),
        "Voltage helps ignition: the mean delay is divided by the gap's voltage over "
        "`source.open_v`, to this power.")
    ignition_conductivity: float = number("", (0, 10),
        "A conducting fluid helps ignition: the mean delay is divided by 10⁶ Ω cm over the fluid's "
        "resistivity, to this power; never by less than 1.")
    ignition_law: Flag = number("", SHARE,
        "Distribution of the delay: 0 exponential, 1 a mixture of two Weibull distributions.")
    weibull_gap_um: float = number("µm", ANY,
        "Gap in the middle between the two Weibull distributions.")
    weibull_width_um: float = number("µm", DIVISOR,
        "Width of gap over which one distribution changes into the other.")
    weibull_narrow_shape: float = number("", SHAPE, "Weibull shape of a narrow gap.")
    weibull_wide_shape: float = number("", SHAPE, "Weibull shape of a wide gap.")
    formative_us: float = number("µs", ANY,
        "Time from the start of a pulse in which nothing ignites, except arcs.")
    contact_um: float = number("µm", ANY, "Gap below which electrode and workpiece touch.")
    fluid_ohm_cm: float = number("Ω cm", OHM_CM,
        "Resistivity of the fluid when the program starts.")


class SinkerGap(Gap):
    """The spark gap under an electrode."""

    area_mm2: float = number("mm²", DIVISOR, "Area of the electrode.")
    removal_mm3_min_a: float = number("mm³/(min A)", ANY,
        "Removal for each ampere of mean current.")
    removal_spread: float = number("", ANY, "Spread of the craters: standard deviation over mean.")
    ignition_gap_um: float = number("µm", ANY,
        "Gap at which the mean delay is `ignition_delay_us`.")
    ignition_delay_us: float = number("µs", DIVISOR, "Mean delay of ignition at that gap.")
    ignition_slope_um: float = number("µm", DIVISOR,
        "Width of gap for which the mean delay grows e-fold.")


class WireGap(Gap):
    """The spark gap about a wire."""

    delay_square_us: float = number("µs/µm²", DIVISOR,
        "Mean delay of ignition is (this g² + `delay_linear_us` g + `delay_constant_us`) / ln 2 at "
        "a gap g in µm that faces half of the wire's surface.")
    delay_linear_us: float = number("µs/µm", (-1000, 1000), "Linear coefficient of that delay.")
    delay_constant_us: float = number("µs", DIVISOR, "Constant term of that delay.")
    delay_least_um: float = number("µm", (0, 100),
        "Gap below which the mean delay stays the same.")
    reach_um: float = number("µm", (10, 200), "Gap across which nothing ignites any more.")
    engagement_um: float = number("µm", (0, 50),
        "Discharges are e times rarer for each such increase of the gap over its narrowest place; "
        "0: they occur at the narrowest place only.")


class Fluid(Table):
    """The fluid's drift, and the cell that measures it."""

    drift_end_ohm_cm: float = number("Ω cm", OHM_CM,
        "Resistivity to which the fluid goes, from `gap.fluid_ohm_cm`, by equal ratios in equal "
        "times.")
    drift_s: float = number("s", ANY, "Time that it takes, of the machine's; 0: the fluid stays.")
    cell_per_cm: float = number("1/cm", DIVISOR, "Constant of the conductivity cell.")
    cell_parallel_ohm: float = number("Ω", DIVISOR,
        "Resistor parallel to the cell, so that a broken wire can be told from oil.")
    cell_series_ohm: float = number("Ω", DIVISOR,
        "Resistor between the cell and the converter's supply.")


class Source(Table):
    """The power supply, and the discharges that it feeds."""

    open_v: float = number("V", (1, 1000), "Open voltage with the supply's code at 0.")
    supply_step_v: float = number("V", (1, 1000), "Open voltage for each step of that code.")
    negative_removal: float = number("", SHARE,
        "Removal with the electrode negative, as a share of that with it positive.")
    rise_us: float = number("µs", DIVISOR, "Time constant with which the open voltage rises.")
    fall_us: float = number("µs", DIVISOR, "Time constant with which it falls after a pulse.")
    source_ohm: float = number("Ω", DIVISOR, "Resistance of the source before ignition.")
    step_a: float = number("A", STEP_A, "Discharge current for each step of the current level.")
    burning_v: float = number("V", ANY, "Burning voltage of a good discharge.")
    burning_spread_v: float = number("V", (0, 10), "Its standard deviation.")
    arc_v: float = number("V", ANY, "Burning voltage of an arc.")
    arc_spread_v: float = number("V", (0, 10), "Its standard deviation.")
    short_v: float = number("V", ANY, "Contact drop of a short.")
    short_ohm: float = number("Ω", ANY, "Resistance of a short.")
    sensing_v: float = number("V", (1, 60),
        "Voltage of the sensing source, below the 60 V DC that may be touched.")
    sensing_a: float = number("A", DIVISOR,
        "Highest current of the sensing source, by its resistor alone.")


class Relaxation(Table):
    """A capacitor at the main source, which is charged until the gap breaks down.

    It takes the place of discharges of `source.step_a`. The source charges it through a resistor
    while its gate is on, the breakdown empties it, and a transistor does while the gate is off. The
    table, and each of its numbers, may be left out: there is no capacitor then.
    """

    step_nf: float = number("nF", ANY,
        "Capacitor for each step of the current level, which chooses it here. 0: there is none, "
        "and the discharges have `source.step_a`.", 0.0)
    charging_ohm: float = number("Ω", DIVISOR, "Resistor through which it is charged.", 20.0)
    emptying_ohm: float = number("Ω", DIVISOR,
        "Resistor through which a transistor empties it while the gate is off.", 2.0)
    inductance_nh: float = number("nH", DIVISOR,
        "Stray inductance of the leads from it to the gap: with the capacitor it gives the time of "
        "the discharge, half a period.", 500.0)


class Comparator(Table):
    """The comparators at the gap, and the detector of a spark's noise."""

    fixed: Flag = number("", SHARE,
        "1: the comparators have the levels below; 0: those that the controller's reference pins "
        "give, filtered.")
    high_level_v: float = number("V", ANY, "Level of an open gap.")
    arc_level_v: float = number("V", ANY, "Level below which a discharge is an arc.")
    short_level_v: float = number("V", ANY, "Level below which the gap is shorted.")
    current_level_a: float = number("A", ANY,
        "Level of the current, which sees what leaks through the fluid as well.")
    sensing_level_a: float = number("A", ANY,
        "The same while the gate of the sensing source is on: that gate lowers the level.")
    reference_full_v: float = number("V", (1, 1000),
        "Gap voltage that a reference pin stands for if it is always high, and full scale of the "
        "converter.")
    reference_rc_us: float = number("µs", DIVISOR,
        "Time constant of the filter behind each reference pin. After a change of a reference the "
        "controller waits 4.6 times as long before the first discharge pulse, unless levels are "
        "fixed.")
    noise_miss: float = number("", SHARE, "Share of the sparks whose noise the detector misses.")


class Debris(Table):
    """Debris in the gap, as its share of the volume, and its effects."""

    deionisation_us: float = number("µs", DIVISOR,
        "Time constant with which the channel of a discharge deionises.")
    deionisation_conductivity: float = number("", ANY,
        "It is longer by this part for each decade of the fluid's resistivity below 10⁶ Ω cm.")
    arc_share: float = number("", ANY,
        "Share of the ignitions without a pause that become arcs, for each unit of debris.")
    single_short: float = number("", ANY,
        "Share of the pulses that are shorted singly, for each unit of debris.")
    bridge_gap_um: float = number("µm", DIVISOR,
        "Width of gap for which shorts by debris become e times rarer.")
    stretch_um: float = number("µm", ANY,
        "Mean way back that ends such a short; of a sinker, at the surface.")


class SinkerDebris(Debris):
    """Debris under an electrode, and how it is flushed out."""

    time_s: float = number("s", DIVISOR,
        "Time constant of the flushing at the surface, before it is speeded up.")
    depth_mm: float = number("mm", DIVISOR, "Depth at which the flushing takes twice as long.")
    exchange_depth_mm: float = number("mm", DIVISOR,
        "Of the fluid that a lift draws in, gap / (gap + depth / this) is fresh.")
    bridge_rate_per_s: float = number("1/s", ANY,
        "Rate of bridges in a closed gap, for each square of debris, before it is speeded up.")
    stretch_depth_mm: float = number("mm", DIVISOR,
        "Depth at which breaking a bridge takes twice the lift.")
    stretch_debris: float = number("", ANY,
        "Breaking a bridge takes 1 + this times the debris as much lift.")


class WireDebris(Debris):
    """Debris about a wire, and the flow that carries it away."""

    flow_mm3_s: float = number("mm³/s", ANY, "Fluid through a gap of `flow_gap_um` or more.")
    flow_gap_um: float = number("µm", DIVISOR,
        "Gap below which the flow goes with the cube of the width.")
    flow_debris: float = number("", ANY,
        "The flow is e times less for debris of 1 over this number.")
    flow_spread: float = number("", (0, 3),
        "The flow drifts: standard deviation of its logarithm.")
    flow_time_s: float = number("s", DIVISOR,
        "Time for which the flow is much the same, before it is speeded up.")
    clog_least: float = number("", (0.01, 1), "Debris beyond which a gap of width 0 is shorted.")
    clog_per_um: float = number("1/µm", ANY,
        "Increase of that debris for each µm of gap.")
    clog_most: float = number("", SHARE, "Debris beyond which a gap of any width is shorted.")
    random_short_per_us: float = number("1/µs", SHARE,
        "Rate of other shorts in a gap of width 0.")
    random_short_um: float = number("µm", DIVISOR, "Gap from which on there are no such shorts.")
    random_short_us: float = number("µs", ANY, "How long such a short lasts.")


class Side(Table):
    """The machine side: auxiliary functions, contactor, limit switches."""

    fin_delay_us: float = number("µs", ANY,
        "Time from the strobe of an auxiliary function to its FIN.")
    fin_answers: Flag = number("", SHARE, "1: the machine side answers with FIN; 0: never.")
    contactor_ms: float = number("ms", (0, 1000),
        "Time that the main contactor takes to close, and to open.")
    limit_low_mm: float = number("mm", (-10_000, -0.1),
        "Place of every axis's lower limit switch, from where the axis started.")
    limit_high_mm: float = number("mm", (0.1, 10_000), "Place of the upper limit switch.")
    limit_scatter_um: float = number("µm", (0, 1000),
        "Each time, a limit switch is pressed at another place: anywhere, equally likely, in a "
        "width of this about its own.")
    limit_hysteresis_um: float = number("µm", (0, 10_000),
        "It is released so much further back than it was pressed.")


class Work(Table):
    """What a sinker's electrode can touch: the work's shape, seen by a round electrode.

    The top of the work is where it always is, `initial_gap_um` below the electrode's start. Beside
    and in a shape the electrode can touch, but not cut: removal is that of an endless work.
    """

    shape: Literal["plane", "block", "hole", "boss"] = Field(
        description="`plane`: endless, as far as the axes go. `block`: square, its sides along X "
        "and Y. `hole`: a round hole in an endless work. `boss`: round, on an endless base.")
    centre_x_mm: float = number("mm", (-1000, 1000),
        "X of the middle of a block, hole or boss, from where the electrode starts.")
    centre_y_mm: float = number("mm", (-1000, 1000), "Y of it.")
    size_mm: float = number("mm", DIVISOR, "Side of a block; diameter of a hole or boss.")
    depth_mm: float = number("mm", DIVISOR,
        "Depth of a hole; height of a block or boss above what it stands on.")
    electrode_mm: float = number("mm", DIVISOR, "Diameter of the electrode, as it touches.")


class Cavity(Table):
    """Side walls of the cavity that a sinker cuts.

    The cavity is wider than its electrode by the overcut of the discharges at its front; debris
    carries a part of each discharge to the walls beside the electrode, which widens them further.
    """

    perimeter_mm: float = number("mm", DIVISOR, "Perimeter of the electrode, which is convex.")
    layer_um: float = number("µm", (5, 10_000),
        "Thickness of the layers in which the walls are counted.")
    overcut_um: float = number("µm", (0, 1000),
        "Overcut on each side of discharges of `reference_a` that burn for `reference_us`.")
    reference_a: float = number("A", DIVISOR, "Current that this overcut is for.")
    reference_us: float = number("µs", DIVISOR, "Duration of a discharge that it is for.")
    current_power: float = number("", (0, 3), "The overcut goes with the current to this power.")
    time_power: float = number("", (0, 3), "And with the duration to this power.")
    wall_debris: float = number("", (0, 1000),
        "Share of a discharge that a wall gets for each unit of debris, area for area with the "
        "front, where the wall is as far off as the overcut.")
    slope_um: float = number("µm", DIVISOR,
        "It is e times less for each such distance that the wall is further off.")


class Wire(Table):
    """The wire."""

    diameter_mm: float = number("mm", (0.02, 1), "Diameter.")
    crater_us: float = number("µs", (0.1, 1000),
        "Discharge duration for which the table of craters holds; others are scaled by energy.")
    deflection_um_a: float = number("µm/A", (0, 100),
        "Bending of the wire, away from the discharges, for each ampere of mean current.")
    deflection_ms: float = number("ms", (0.01, 10_000), "Time constant of the bending.")
    break_a: float = number("A", ANY,
        "Mean current of good discharges and arcs at which the wire breaks (0: never); the third "
        "drive then reports a fault.")
    break_ms: float = number("ms", (0.1, 10_000), "Time over which that mean is taken.")


class Workpiece(Table):
    """The workpiece of a wire machine."""

    thickness_mm: float = number("mm", (0.1, 1000), "Thickness.")
    cell_um: float = number("µm", (0.5, 10),
        "Side of the cells of the plan view in which its material is counted.")
    start_x_mm: float = number("mm", (-1000, 1000),
        "X of the wire when the program starts, from the workpiece's zero, which is the program's.")
    start_y_mm: float = number("mm", (-1000, 1000), "Y of the wire when the program starts.")


Step = Annotated[list[float], Field(min_length=2, max_length=2)]


class Stock(Table):
    """Stock of a wire machine's workpiece before the cut."""

    kind: Literal["solid", "wall", "circle", "rectangle"] = Field(
        description="`solid`: a plate from X = `edge_mm` on. `wall`: along X, its finished surface "
        "at Y 0 and the workpiece at Y above. `circle`: a punch about zero, of diameter "
        "`size_x_mm`; its contour begins at +X. `rectangle`: one of `size_x_mm` by `size_y_mm`; "
        "its contour begins at the lower left corner. Contours go counter-clockwise.")
    edge_mm: float = number("mm", (-1000, 1000), "X of a solid plate's edge.")
    hole_mm: float = number("mm", (0, 1000), "Diameter of a hole about the wire's start; 0: none.")
    size_x_mm: float = number("mm", (0, 1000), "Size of a punch along X.")
    size_y_mm: float = number("mm", (0, 1000), "Size of a rectangle along Y.")
    steps: list[Step] = Field(
        min_length=1, max_length=STEPS,
        description="What a first cut has left on the surface of a wall or a punch: pairs of a "
        "place along the contour (mm) and the width from there on (µm). Before the first place it "
        "is the first width.")

    @field_validator("steps")
    @classmethod
    def _in_order(cls, steps: list[list[float]]) -> list[list[float]]:
        if not all(abs(place) <= 10_000 and 0 <= width <= 10_000 for place, width in steps):
            raise ValueError("a place or width is out of range")
        if any(after[0] <= before[0] for before, after in pairwise(steps)):
            raise ValueError("the places do not grow")
        return steps


Number = Annotated[str, Field(pattern="^(0|[1-9][0-9]{0,9})$")]     # the controller has 32 bits
Value = Annotated[int, Field(ge=0, lt=10**10)]

WHAT_MOVES = ("What moves: the electrode of a sinker, without or with side walls (`cavity`), or a "
              "wire; `sinker` if not given.")


class MachineFile(Table):
    """Numbers that the files of both kinds of machine have."""

    clock_hz: float = number("Hz", (LOWEST_CLOCK_HZ, HIGHEST_CLOCK_HZ),
        "Clock of the simulated controller. A board runs at 25 MHz or more; a slow clock simulates "
        "faster.")
    pulses_per_mm: float = number("1/mm", (10_000, 10_000),
        "Pulses of a millimetre of the path, for which the gateware is built. A pulse is an edge "
        "of the coder, too; a step has its own size, see `[x]`.")
    tick_us: float = number("µs", (1, 100), "Step of the slow physics: motors, debris, shorts.")
    removal_scale: float = number("", SPEED_UP,
        "Number of real discharges for which each simulated one stands. Flushing goes as much "
        "faster; axes do not.")
    current_max_a: float = number("A", STEP_A,
        "Highest discharge current: as many whole steps of `source.step_a` as are in it, 63 at "
        "most, are what the gateware is built for, and no register exceeds them.")
    axis: Axis
    x: Drive = Drive()
    y: Drive = Drive()
    z: Drive = Drive()
    fluid: Fluid
    source: Source
    relaxation: Relaxation = Relaxation()
    comparator: Comparator
    side: Side
    settings: dict[Number, Value] = Field(
        default={}, description="The controller's [settings](settings.md), as number = value.")


class SinkerFile(MachineFile):
    """A die-sinking machine: an electrode that Z moves, above a workpiece."""

    kind: Literal["sinker"] = Field("sinker", description=WHAT_MOVES)
    initial_gap_um: float = number("µm", (0, 100_000),
        "Height of the electrode above the top of the workpiece when the program starts.")
    gap: SinkerGap
    debris: SinkerDebris
    work: Work


class CavityFile(SinkerFile):
    """A die-sinking machine whose cavity has side walls."""

    kind: Literal["cavity"] = Field("cavity", description=WHAT_MOVES)  # type: ignore[assignment]
    cavity: Cavity


class WireFile(MachineFile):
    """A wire machine: a wire along Z that X and Y move through a workpiece."""

    kind: Literal["wire"] = Field("wire", description=WHAT_MOVES)
    wire: Wire
    workpiece: Workpiece
    stock: Stock
    gap: WireGap
    debris: WireDebris


MACHINES: dict[str, type[MachineFile]] = {"sinker": SinkerFile, "wire": WireFile,
                                       "cavity": CavityFile}

# Words of a file, in the plant's order, numbered from 0. A file without a kind is a sinker's.
WORDS: dict[str, tuple[str, ...]] = {
    "kind": tuple(MACHINES), "axis.dac": get_args(Axis.model_fields["dac"].annotation),
    **{f"{axis}.output": get_args(Drive.model_fields["output"].annotation) for axis in DRIVES},
    "stock.kind": get_args(Stock.model_fields["kind"].annotation),
    "work.shape": get_args(Work.model_fields["shape"].annotation)}


def entries(model: type[Table], prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Yield the entries of a file by name, ``key`` or ``table.key``, in order."""
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Table):
            yield from entries(field.annotation, f"{prefix}{name}.")
        else:
            yield prefix + name, field


def bounds(field: FieldInfo) -> tuple[float, float]:
    """Lowest and highest of a number, both allowed."""
    lowest: Any = next(one.ge for one in field.metadata if hasattr(one, "ge"))
    highest: Any = next(one.le for one in field.metadata if hasattr(one, "le"))
    return lowest, highest


def least(field: FieldInfo) -> float | None:
    """Lowest value above 0, of a number that may be 0 or at least this; else None."""
    return next((one.least for one in field.metadata if isinstance(one, Apart)), None)


def allows(field: FieldInfo, value: float) -> bool:
    """Whether a number may have a value. NaN is never allowed."""
    lowest, highest = bounds(field)
    return lowest <= value <= highest and Apart(least(field) or 0).allows(value)


def said_range(field: FieldInfo, said: Callable[[float], str] = str) -> str:
    """Range of a number in words; ``said`` writes a bound."""
    lowest, highest = bounds(field)
    above = least(field)
    if lowest == highest:
        return said(lowest)
    if above is None:
        return f"{said(lowest)} to {said(highest)}"
    if above == highest:
        return f"{said(lowest)} or {said(highest)}"
    return f"{said(lowest)}, or {said(above)} to {said(highest)}"
