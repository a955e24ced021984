# SPDX-License-Identifier: Apache-2.0
"""How much sooner acceleration feed-forward would clear a short: ``python -m`` this module.

Nothing of it is in the gateware. The drive is that of the machine ``sinker``, with the equations of
``testbench/plant/motor.hpp``. It goes the way back out of a short as in ``rtl/motion/axis.py``: its
input is the ramp's speed, and K times what the error is more than the lag of a model of the drive.
To that comes a lead times the ramp's acceleration, and the model's lag is less by the lead. The
input is limited to what the converter can give. Without dead time and quantisation, from rest at
the sample that completes the short.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from rich import box
from rich.console import Console
from rich.table import Table

from host.experiments.common import markdown
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.clearing import CLEAR_UM, alone
from softcore.tables.settings import named

__all__ = ["LEADS", "Answer", "Way", "answer", "soonest_ms", "table"]

MACHINE = "sinker"
SPEEDS = (300, 900)         # R of the tapes, mm/min
LONGEST_S = 0.1
# Leads, as shares of the drive's lags together, by their name in the table.
LEADS = {"acceleration, 0.7 of the lags": 0.7, "acceleration, the lags": 1.0,
         "acceleration, 1.3 of the lags": 1.3}
RANGE = 1 << 15     # pulses of the error that are the converter's full scale


@dataclass(frozen=True)
class Way:
    """Ramp on the way back, and the lead of the acceleration: mm/s, mm/s2, s."""

    start_mm_s: float
    acceleration_mm_s2: float
    lead_s: float = 0.0


@dataclass(frozen=True)
class Answer:
    """Time to each distance of ``CLEAR_UM`` in ms; the furthest beyond the command, um."""

    clear_ms: dict[int, float]
    beyond_um: float


def _lags_s(machine: Machine) -> float:
    """Speed loop and the converter's filter; the current loop lies within the speed loop."""
    return 1e-3 * sum(machine.number("axis", f"{name}_ms") for name in ("speed_loop", "filter"))


def _setting(machine: Machine, name: str) -> float:
    """A setting in the machine's file, or as delivered."""
    setting = named(name)
    return float(machine.settings.get(str(setting.number), setting.default))


def answer(machine: Machine, speed_mm_min: float, way: Way) -> Answer:
    """What the electrode does if the path goes back at a speed."""
    axis = machine.tables["axis"]
    model_s = _setting(machine, "model_lag_z_us") / 1e6
    step_s, full = machine.tables["tick_us"] * 1e-6, axis["full_speed_mm_s"]
    gain = full * machine.pulses_per_mm / RANGE
    follow = 1 - math.exp(-step_s / (axis["filter_ms"] * 1e-3))
    torque = 1 - math.exp(-step_s / (axis["current_loop_ms"] * 1e-3))
    most, highest = axis["max_acceleration_mm_s2"], axis["max_speed_mm_s"]
    wanted = speed_mm_min / 60
    ramp = min(wanted, way.start_mm_s)
    model = command = place = filtered = acceleration = speed = beyond = 0.0
    clear: dict[int, float] = {}
    for tick in range(1, round(LONGEST_S / step_s) + 1):
        rise = min(way.acceleration_mm_s2, (wanted - ramp) / step_s)
        ramp += rise * step_s
        command += ramp * step_s
        lag = model_s * model - way.lead_s * ramp
        asked = max(-full, min(full, ramp + way.lead_s * rise + gain * (command - place - lag)))
        model += (asked - model) * step_s / model_s
        filtered += (asked - filtered) * follow
        pull = max(-most, min(most, (filtered - speed) / (axis["speed_loop_ms"] * 1e-3)))
        acceleration += (pull - acceleration) * torque
        speed = max(-highest, min(highest, speed + acceleration * step_s))
        place += speed * step_s
        beyond = max(beyond, place - command)
        for um in CLEAR_UM:
            if um not in clear and place * 1000 >= um:
                clear[um] = tick * step_s * 1000
    return Answer(clear, beyond * 1000)


def soonest_ms(machine: Machine, speed_mm_min: float, um: float) -> float:
    """When a drive without lags, but with this greatest acceleration, has gone a distance."""
    most, speed = machine.number("axis", "max_acceleration_mm_s2"), speed_mm_min / 60
    rising_mm = speed**2 / 2 / most
    if um / 1000 <= rising_mm:
        return 1000 * math.sqrt(2 * um / 1000 / most)
    return 1000 * (speed / most + (um / 1000 - rising_mm) / speed)


def _ways(machine: Machine) -> Iterator[tuple[str, Way]]:
    start = (_setting(machine, "back_start_speed_um_s")
             or _setting(machine, "start_speed_um_s")) / 1000
    most = machine.number("axis", "max_acceleration_mm_s2")
    yield "velocity, ramp as delivered", Way(
        start, _setting(machine, "back_acceleration_mm_s2")
        or _setting(machine, "acceleration_mm_s2"))
    yield "velocity, ramp from rest", Way(0.0, most)
    for name, share in LEADS.items():
        yield name, Way(0.0, most, share * _lags_s(machine))


def table(style: box.Box = box.SIMPLE_HEAD) -> Table:
    """Ways of feed-forward down; retraction speeds and distances across."""
    machine = machines.load(MACHINE)
    made = Table(box=style)
    made.add_column("feed-forward of", no_wrap=True)
    for speed in SPEEDS:
        for um in CLEAR_UM:
            made.add_column(f"R{speed}, {um} µm, ms", justify="right", no_wrap=True)
        made.add_column(f"R{speed}, beyond the command, µm", justify="right", no_wrap=True)
    first = {speed: alone(machine.tables["axis"], speed, machine.tables["tick_us"] * 1e-6)
             for speed in SPEEDS}

    def row(name: str, times: dict[int, dict[int, float]], beyond: dict[int, float]) -> None:
        cells = []
        for speed in SPEEDS:
            for um in CLEAR_UM:
                ms, own = times[speed][um], 1000 * (first[speed][um] or math.nan)
                cells.append(f"{ms:.2f} ({ms / own:.2f})")
            cells.append(f"{beyond[speed]:.1f}" if beyond else "")
        made.add_row(name, *cells)

    row("none: the drive alone", {speed: {um: 1000 * (seconds or math.nan)
                                          for um, seconds in own.items()}
                                  for speed, own in first.items()}, {})
    for name, way in _ways(machine):
        found = {speed: answer(machine, speed, way) for speed in SPEEDS}
        row(name, {speed: one.clear_ms for speed, one in found.items()},
            {speed: one.beyond_um for speed, one in found.items()})
    row("a drive of that acceleration without lags", {
        speed: {um: soonest_ms(machine, speed, um) for um in CLEAR_UM} for speed in SPEEDS}, {})
    return made


def main() -> None:
    """Print the table, as Markdown."""
    Console().print("\n".join(markdown(table(box.MARKDOWN))), soft_wrap=True)


if __name__ == "__main__":
    main()
