# SPDX-License-Identifier: Apache-2.0
"""The simulated machine in a Python program: step it, speak to its controller, read and change it.

The controller is the real gateware with the real firmware, every clock of it. All time is the
machine's, and the same seed with the same calls gives the same run.
"""

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from host.errors import UsageError
from host.link.link import Sent
from host.run import simulation
from host.run.events import Event
from host.run.run import Run
from host.run.workpiece import Columns
from host.study import checks
from host.tape.tape import Tape, encode, load

__all__ = ["SimulatedMachine"]

EMPTY = "M02"   # a tape for those who send lines


class SimulatedMachine:
    """A simulated machine and its controller, newly switched on.

    Parts that have changed since the last build are built first. Use it in a ``with`` statement, or
    ``close`` it.

    Parameters
    ----------
    machine : str or Path
        A built-in machine, such as ``sinker`` or ``wire``, or a TOML file of one.
    seed : int
        Seed of everything random, 0 to 2**64 - 1.
    clock_hz : int or None
        Clock of the controller, in the range of a machine's file; that of the file if not given.
    trace : bool
        Keep a sample of the run for every millisecond; see ``trace``.
    waves : Path or None
        Folder for waveforms.
    progress : callable
        Called with a sentence before every long step.

    Raises
    ------
    TypeError
        If the machine is no text or path, or seed or clock no number.
    ValueError
        If seed or clock is not whole or out of its range.
    UsageError
        If there is no such machine.
    UserError
        If it cannot be built.
    """

    def __init__(self, machine: str | Path = "sinker", *, seed: int = 1,
                 clock_hz: int | None = None, trace: bool = True, waves: Path | None = None,
                 progress: Callable[[str], None] = lambda _: None) -> None:
        self.machine = checks.load(machine)
        self.clock_hz = self.machine.clock_hz if clock_hz is None else checks.clock(clock_hz)
        seed = checks.whole("seed", seed, 0, checks.SEEDS - 1)
        self._simulation = simulation.start(
            self.machine, clock_hz=self.clock_hz, seed=seed, waves=waves, trace=trace,
            progress=progress)
        self._job = Run(self.machine, encode(EMPTY), self._simulation)
        self._ready = self._closed = False

    def __enter__(self) -> Self:
        self._need_on()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 where: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Switch it off. Trace, events, positions and discharges can still be read."""
        if not self._closed:
            self._closed = True
            self._simulation.close()

    # ---- time

    @property
    def clock(self) -> int:
        """Clocks since it was switched on."""
        return self._simulation.cycle

    @property
    def time_s(self) -> float:
        """Seconds since it was switched on."""
        return self._simulation.time_s()

    def step(self, seconds: float) -> None:
        """Run the machine for exactly ``seconds`` of its time, in whole clocks.

        Raises
        ------
        TypeError
            If that is no number.
        ValueError
            If it is below 0, more than 10**9 or NaN.
        """
        self._need_on()
        seconds = checks.number("seconds", seconds, 0, checks.LONGEST_S)
        end = self.clock + round(seconds * self.clock_hz)
        if not self._ready:     # `set_up` needs the greeting
            self._simulation.run(end - self.clock)
        while (left := end - self.clock) > 0:
            self._job.link.poll(left / self.clock_hz)

    # ---- the controller

    def set_up(self) -> None:
        """Do what an operator does first: unlock, arm, zero the axes, enter the file's settings."""
        self._need_fresh()
        self._ready = True
        self._job.set_up()

    def run_tape(self, tape: str | Path | Tape, *, until_s: float | None = None) -> str:
        """Set up and run a tape; its results are in ``events`` and ``alarm``.

        Parameters
        ----------
        tape : str, Path or Tape
            File of a text or of punched rows, or the tape itself (``host.tape.tape.encode``).
        until_s : float or None
            Machine time at which the run ends early, 0 to 10**9.

        Returns
        -------
        str
            ``end``, ``stopped`` (by ``until_s``), ``alarm`` or ``rejected``.

        Raises
        ------
        TypeError
            If ``until_s`` is no number.
        ValueError
            If it is out of its range.
        TapeError
            If the text cannot be punched.
        UsageError
            If the machine has been set up already.
        """
        self._need_fresh()
        if until_s is not None:
            until_s = checks.number("until_s", until_s, 0, checks.LONGEST_S)
        punched = tape if isinstance(tape, Tape) else load(Path(tape))
        self._job = Run(self.machine, punched, self._simulation, until_s=until_s)
        self._ready = True
        return self._job.execute()

    def command(self, line: str) -> None:
        """Send a line, and run the machine until the controller has answered it.

        Raises
        ------
        TypeError
            If it is no text.
        UsageError
            If the text cannot be a line.
        RefusedError
            If the controller refuses it, with its own sentence.
        """
        self._need_ready()
        self._job.link.command(checks.name_of(line, "a line"))

    def send(self, line: str) -> Sent:
        """Send a line without waiting: its ``answer`` comes in a later ``step``.

        Raises
        ------
        TypeError
            If it is no text.
        UsageError
            If the text cannot be a line.
        """
        self._need_ready()
        return self._job.link.send_line(checks.name_of(line, "a line"))

    def status(self) -> dict[str, str]:
        """Ask for a status report; return its fields, the state as ``state``."""
        self._need_ready()
        return self._job.link.status()

    @property
    def events(self) -> list[Event]:
        """Events of the controller so far, in the form of ``events.jsonl``."""
        return self._job.events

    @property
    def alarm(self) -> dict[str, object] | None:
        """Code and text of the alarm that stopped the machine, or None."""
        return self._job.alarm

    # ---- the machine

    def get(self, name: str) -> float:
        """Number of the machine's file (``gap.area_mm2``), or a reading (``read.gap_um``).

        Raises
        ------
        TypeError
            If the name is no text.
        ValueError
            If there is none of that name.
        """
        self._need_on()
        return self._simulation.get(checks.name_of(name))

    def set(self, name: str, value: float) -> None:
        """Change a number of the machine's file, or force a state (``force.short``).

        A number of the file has its range there. What the machine starts with (``initial_gap_um``,
        ``workpiece``, ``stock``, ``cavity``) can be changed before its first clock only. Words and
        lists cannot be, nor what the simulation is built for (``clock_hz``, ``pulses_per_mm``,
        ``current_max_a``), nor what becomes a setting of the controller.

        Raises
        ------
        TypeError
            If the name is no text, or the value no number.
        ValueError
            If there is none of that name, it cannot be changed, or the value is out of its range.
        """
        self._need_on()
        self._simulation.set(*checks.change(self.machine.kind, name, value,
                                            running=self.clock > 0))

    def signal(self, name: str) -> int:
        """Present value of a signal inside the controller, of ``testbench.native.probes``.

        Raises
        ------
        TypeError
            If the name is no text.
        ValueError
            If there is none of that name.
        """
        self._need_on()
        try:
            return self._simulation.signal(checks.name_of(name))
        except KeyError:
            raise ValueError(f"the controller has no signal {name!r}") from None

    def positions_mm(self) -> dict[str, float]:
        """Positions of the axes by their coders, from the place of switching on."""
        return self._in_mm(self._simulation.positions())

    def lags_mm(self) -> dict[str, float]:
        """Following errors of the axes: command less position."""
        return self._in_mm(self._simulation.errors())

    def _in_mm(self, pulses: dict[str, int]) -> dict[str, float]:
        return {axis: number / self.machine.pulses_per_mm for axis, number in pulses.items()}

    def discharges(self) -> dict[str, int]:
        """Discharge pulses so far, by the gateware's classes: open, ok, dame, short."""
        return self._simulation.discharges()

    def trace(self) -> Columns:
        """Samples of the run, one each millisecond, as arrays by name: those of ``trace.npz``."""
        return self._simulation.trace()

    def workpiece(self) -> Columns:
        """Plan of a wire machine's remaining workpiece."""
        return self._simulation.workpiece()

    def _need_on(self) -> None:
        if self._closed:
            raise UsageError("the simulated machine is switched off.")

    def _need_ready(self) -> None:
        self._need_on()
        if not self._ready:
            raise UsageError("the simulated machine is not set up: call set_up() first.")

    def _need_fresh(self) -> None:
        self._need_on()
        if self._ready:
            raise UsageError("the simulated machine is set up already: this needs a fresh one.")
