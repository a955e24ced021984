# SPDX-License-Identifier: Apache-2.0
"""Die-sinking as an environment of Gymnasium: an agent in the place of the gap servo.

Every ``STEP_S`` the agent moves the electrode by a block that it sends to the controller over the
link (``G91 G01 Z``), as a gap servo moves it by a step. It may also choose another pause between
the pulses (``C``). So it can do what a program at a real machine could, and no more. The controller
does everything else: it retracts from a short, with the discharge reduced, whatever the agent does.

Gymnasium is in the project's dependency group ``study``.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from host.errors import UsageError, UserError, shown
from host.link.link import Sent
from host.run.run import count_retractions
from host.study import checks
from host.study.machine import SimulatedMachine

__all__ = ["FEATURES", "MOST_UM", "PAUSES_US", "STEP_S", "Sinking"]

STEP_S = 0.02       # period of the servo's time device by default
MOST_UM = 5.0       # longest step, that of the servo
FEED = 60           # mm/min, within a step
LEAST_UM = 0.05     # half a pulse: anything shorter is no motion
PULSE_US = 15       # on-time, at 1.5 A: suited to 10 mm2
PAUSES_US = (25, 50, 100, 200, 400)
FIRST_CONDITION = 901
DEEPEST_MM = 1000   # that an observation can have
FRONT = 0           # state of the retraction in which the program moves the machine
SEEDS = 2**63
# Features of a step, in the order of the observation, with bounds: all that a controller can know.
FEATURES = {
    "open": (0, 5000), "ok": (0, 5000), "dame": (0, 5000), "short": (0, 5000),
    "gap_v": (0, 500), "z_um": (-1e6, 1e6), "deepest_um": (-1e6, 1e6), "lag_um": (-1e5, 1e5),
    "pause_us": (0, 1000), "busy": (0, 1),
}

Observation = NDArray[np.float32]
Action = NDArray[np.float32]


class Sinking(gymnasium.Env[Observation, Action]):
    """A cavity to be sunk by small steps of the electrode.

    An action is two numbers from -1 to 1. The first is the motion of the electrode within the step,
    as a share of ``MOST_UM``, into the workpiece if above zero; it is rounded to pulses of the
    machine (0.1 µm). The second chooses the pause: -1 is the first of ``PAUSES_US``, 1 the last,
    and any other number the nearest. The controller changes a condition when the axes have come to
    rest: that takes some steps, during which the electrode stands.

    An observation has one number for each of ``FEATURES``, for the step that has ended: discharge
    pulses by class, as the gateware judges them; ``gap_v``, the mean gap voltage; ``z_um``, the
    height of the electrode above the workpiece's top by its coder (below 0 in the cavity);
    ``deepest_um``, the least ``z_um`` so far; ``lag_um``, by which the axis is behind its command;
    ``pause_us`` in force; ``busy``, whether the controller retracts from a short or carries out an
    earlier line: then the action is dropped.

    The reward is removal less damage: depth removed in µm, less ``damage_um`` for each arc and
    each shorted pulse. ``info`` has values that no controller knows: ``gap_um``, ``debris``,
    ``removed_mm3``, and the number of ``retractions`` so far.

    An episode ends at ``depth_mm`` by the coder, or with an alarm, whose text is in ``info``; it is
    truncated after ``steps`` steps. ``reset(seed)`` begins with a newly switched on machine.

    Parameters
    ----------
    machine : str or Path
        A sinker: built-in, or a TOML file.
    depth_mm : float
        Depth of the cavity, 0.0001 (a pulse) to 1000, by the coder from the workpiece's top.
    steps : int
        Most steps of an episode, 1 to 10**9.
    damage_um : float
        Cost of an arc or a shorted pulse, 0 to 10**6.
    servo : bool
        The controller's own gap servo (G95 P1) moves the electrode; actions are ignored.
    trace : bool
        Keep a sample of every millisecond, for ``bench.trace()``.
    progress : callable
        Called with a sentence before every step of a build.

    Raises
    ------
    TypeError
        If the machine is no text or path, or what should be a number is none.
    ValueError
        If a number is out of its range.
    UsageError
        If there is no such machine, or it is not a sinker.

    Attributes
    ----------
    bench : SimulatedMachine or None
        The machine of the episode.
    """

    def __init__(self, machine: str | Path = "small", *, depth_mm: float = 0.25, steps: int = 1000,
                 damage_um: float = 0.02, servo: bool = False, trace: bool = False,
                 progress: Callable[[str], None] = lambda _: None) -> None:
        self.depth_mm = checks.number("depth_mm", depth_mm, 0.0001, DEEPEST_MM)
        self.steps = checks.whole("steps", steps, 1, 10**9)
        self.damage_um = checks.number("damage_um", damage_um, 0, 10**6)
        if (kind := checks.load(machine).kind) == "wire":
            raise UsageError(f"machine {machine}: it is of the kind {kind}, and sinks nothing.")
        self._machine, self._trace, self._progress = machine, trace, progress
        self.servo = servo
        self._over = True
        self.action_space = spaces.Box(-1, 1, (2,))
        lowest, highest = np.array(list(FEATURES.values()), dtype=np.float32).T
        self.observation_space = spaces.Box(lowest, highest)
        self.bench: SimulatedMachine | None = None

    def reset(self, *, seed: int | None = None,
              options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Switch a new machine on and set it up, with the discharge on above the workpiece."""
        super().reset(seed=seed)
        self.close()
        self._over = True       # until all of this is done
        self.bench = bench = SimulatedMachine(
            self._machine, seed=int(self.np_random.integers(SEEDS)), trace=self._trace,
            progress=self._progress)
        bench.set_up()
        bench.command("G21 G91 G94")
        bench.command("G36 R300 L0.5 H600 E60 Q0.1")
        for number, pause_us in enumerate(PAUSES_US, start=FIRST_CONDITION):
            bench.command(f"G10 C{number} I1 P{PULSE_US} Q{pause_us} R{pause_us} E80 H75 K1")
        self._pause = 0     # index, in force
        bench.command(f"C{FIRST_CONDITION}")
        bench.command("M08")
        bench.command("M03")
        if self.servo:
            bench.command("G95 P1")
        self._line: Sent | None = None
        self._wanted = self._pause
        self._done = 0
        self._deepest_um = self._z_um()
        self._area_mm2 = bench.get("gap.area_mm2")
        if self.servo:
            way_mm = self.depth_mm + self._z_um() / 1000
            self._line = bench.send(f"G01 Z-{way_mm:.4f} F{FEED}")
        self._last = self._totals()
        self._over = False
        return self._observe(self._totals()), self._info()

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Carry out an action, and let ``STEP_S`` of the machine's time pass.

        Raises
        ------
        ValueError
            If the action is not two finite numbers.
        UserError
            If the environment has not been reset yet.
        ResetNeeded
            If the episode has ended or been truncated.
        """
        bench = self._need()
        if self._over:
            raise ResetNeeded("the episode is over: call reset() first")
        way, pause = (0.0, 0.0) if self.servo else _checked(action)
        if not self._busy():
            self._act(way, pause)
        bench.step(STEP_S)
        self._hear()
        self._done += 1
        totals = self._totals()
        observation, reward = self._observe(totals), self._reward(totals)
        self._last = totals
        ended = bench.alarm is not None or self._z_um() <= -1000 * self.depth_mm
        truncated = self._done >= self.steps
        self._over = ended or truncated
        return observation, reward, ended, truncated, self._info()

    def render(self) -> NoReturn:
        """Draw nothing: ``bench.trace()`` has the run, if the environment keeps it.

        Raises
        ------
        NotImplementedError
            Always.
        """
        raise NotImplementedError("the environment draws no pictures: make it with trace=True, and "
                                  "bench.trace() has a sample of every millisecond")

    def close(self) -> None:
        """Switch the machine off."""
        if self.bench is not None:
            self.bench.close()

    def _need(self) -> SimulatedMachine:
        if self.bench is None:
            raise UserError("the environment has no machine yet: call reset() first.")
        return self.bench

    def _act(self, way: float, pause: float) -> None:
        if self.servo:
            return
        way_um = MOST_UM * min(max(way, -1), 1)
        at = round((min(max(pause, -1), 1) + 1) / 2 * (len(PAUSES_US) - 1))
        if at != self._pause:
            self._wanted = at
            self._line = self._need().send(f"C{FIRST_CONDITION + at}")
        elif abs(way_um) >= LEAST_UM:
            self._line = self._need().send(f"G01 Z{-way_um / 1000:.4f} F{FEED}")

    def _hear(self) -> None:
        """Take the answer to the last line."""
        if self._line is None or self._line.answer is None:
            return
        if self._line.answer == "ok":
            self._pause = self._wanted
        elif self._need().alarm is None:
            raise UserError(f'the controller refuses "{self._line.text}": {self._line.answer}.')
        self._line = None

    def _busy(self) -> bool:
        return self._line is not None or self._need().signal("path_status_state") != FRONT

    def _z_um(self) -> float:
        bench = self._need()
        return 1000 * (bench.positions_mm()["z"] + bench.machine.start_mm["z"])

    def _totals(self) -> dict[str, float]:
        """Present values of the counters."""
        bench = self._need()
        return {**bench.discharges(), "clock": bench.clock,
                "volts": bench.get("read.gap_v_clocks"), "mm3": bench.get("read.removed_mm3")}

    def _observe(self, totals: dict[str, float]) -> Observation:
        bench = self._need()
        step = {name: totals[name] - last for name, last in self._last.items()}
        z_um = self._z_um()
        self._deepest_um = min(self._deepest_um, z_um)
        return np.array([
            step["open"], step["ok"], step["dame"], step["short"],
            step["volts"] / max(step["clock"], 1), z_um, self._deepest_um,
            bench.lags_mm()["z"] * 1000, PAUSES_US[self._pause], self._busy()], dtype=np.float32)

    def _reward(self, totals: dict[str, float]) -> float:
        step = {name: totals[name] - last for name, last in self._last.items()}
        return (1000 * step["mm3"] / self._area_mm2
                - self.damage_um * (step["dame"] + step["short"]))

    def _info(self) -> dict[str, Any]:
        bench = self._need()
        info: dict[str, Any] = {name: bench.get(f"read.{name}")
                                for name in ("gap_um", "debris", "removed_mm3")}
        info["retractions"] = count_retractions(bench.events)["count"]
        if bench.alarm is not None:
            info["alarm"] = bench.alarm["text"]
        return info


def _checked(action: object) -> tuple[float, float]:
    """Motion and pause of an action."""
    try:
        given = np.asarray(action)
    except ValueError:      # rows of unlike lengths
        given = np.empty(0)
    if given.shape != (2,) or given.dtype.kind not in "iuf" or not np.isfinite(given).all():
        raise ValueError("an action must be two finite numbers, motion and pause, not "
                         f"{shown(action)}")
    return float(given[0]), float(given[1])
