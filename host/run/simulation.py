# SPDX-License-Identifier: Apache-2.0
"""The simulated machine as the host sees it: a pipe of bytes, and values of the simulation."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from host import door
from host.errors import UsageError, UserError
from host.machines.machine import CONVERTER_V, Machine
from host.places import ROOT
from host.run.workpiece import Columns

Progress = Callable[[str], None]     # called with a sentence before every long step

LOG = ROOT / "build" / "failure.log"


class Native(Protocol):
    """The test bench's native simulation, which has the contracts of these methods."""

    clock_hz: int
    byte_clocks: int

    @property
    def cycle(self) -> int: ...
    def send(self, data: bytes) -> None: ...
    def run(self, clocks: int) -> None: ...
    def receive(self, clocks: int) -> bytes: ...
    def press_arm(self) -> None: ...
    def button_arm(self, down: bool) -> None: ...
    def positions(self) -> dict[str, int]: ...
    def errors(self) -> dict[str, int]: ...
    def discharges(self) -> dict[str, int]: ...
    def probe(self, name: str) -> int: ...
    def get(self, name: str) -> float: ...
    def set(self, name: str, value: float) -> None: ...
    def trace(self) -> Columns: ...
    def shorts(self) -> Columns: ...
    def contact_s(self) -> float: ...
    def workpiece(self) -> Columns: ...
    def cavity(self) -> Columns: ...
    def cavity_with(self, numbers: dict[str, float]) -> Columns: ...
    def keep_discharges(self) -> None: ...
    def power_off(self) -> bytes: ...
    def close(self) -> None: ...


class Simulation:
    """A simulated machine as a pipe of bytes with a clock; see ``host.link.link.BytePipe``."""

    def __init__(self, native: Native, memory: Path | None = None) -> None:
        self._native = native
        self._memory = memory
        self.clock_hz = native.clock_hz
        self.byte_s = native.byte_clocks / native.clock_hz  # that a byte takes on the line

    @property
    def cycle(self) -> int:
        """Clocks since reset."""
        return self._native.cycle

    def write(self, data: bytes) -> None:
        """Send bytes, back to back."""
        self._native.send(data)

    def read(self, timeout_s: float) -> bytes:
        """Run until the controller sends something, at most ``timeout_s`` of machine time."""
        return self._native.receive(max(1, round(timeout_s * self.clock_hz)))

    def run(self, clocks: int) -> None:
        """Run for so many clocks; bytes that come wait for ``read``."""
        self._native.run(clocks)

    def time_s(self) -> float:
        """Seconds of the machine's time since reset."""
        return self.cycle / self.clock_hz

    def press_arm(self) -> None:
        """Press the button ``arm`` as a person would, and let the contactor close."""
        self._native.press_arm()

    def button_arm(self, down: bool) -> None:
        """Hold the button ``arm`` down, or let it go."""
        self._native.button_arm(down)

    def armed(self) -> bool:
        """Whether the main contactor is closed."""
        return bool(self._native.probe("contactor"))

    def positions(self) -> dict[str, int]:
        """Encoder positions by axis, in pulses."""
        return self._native.positions()

    def errors(self) -> dict[str, int]:
        """Error counters by axis, in pulses."""
        return self._native.errors()

    def discharges(self) -> dict[str, int]:
        """Discharge pulses so far, by class."""
        return self._native.discharges()

    def signal(self, name: str) -> int:
        """Present value of a signal inside the controller."""
        return self._native.probe(name)

    def get(self, name: str) -> float:
        """Number of the machine's file, or a reading of the machine (``read.gap_um``)."""
        return self._native.get(name)

    def set(self, name: str, value: float) -> None:
        """Change a number of the machine, or force a state (``force.short``)."""
        self._native.set(name, value)

    def front(self) -> int:
        """Furthest path coordinate commanded, in pulses; a tape begins at 0."""
        return self._native.probe("path_front")

    def servo_steps(self) -> dict[str, int]:
        """UP and DOWN pulses of the preset counters so far, even those that moved nothing.

        Call it before ``close``.
        """
        return {way: self._native.probe(f"servo_{way}s") for way in ("up", "down")}

    def mean_voltage(self) -> float:
        """Mean gap voltage that the feed mode used last, V; 0 before the first."""
        return self._native.probe("feed_voltage_mean") / 2**16 * CONVERTER_V

    def measured_share(self) -> float:
        """Ex that G95 P5 measured last: share of the time with discharge, at the feed F."""
        return self._native.probe("feed_voltage_drop") / 2**16

    def trace(self) -> Columns:
        """Samples of the run as columns."""
        return self._native.trace()

    def shorts(self) -> Columns:
        """Way of the electrode after every short, as columns; see ``host.run.clearing``."""
        return self._native.shorts()

    def contact_s(self) -> float:
        """Time for which electrode and work have truly touched, or been bridged."""
        return self._native.contact_s()

    def workpiece(self) -> Columns:
        """Plan of what is left of a wire machine's workpiece; see ``host.run.workpiece``."""
        return self._native.workpiece()

    def cavity(self) -> Columns:
        """Walls of the cavity that a sinker with sides has cut, by layers from the top down.

        ``depth_mm`` is the lower end of a layer, ``opening_um`` by how much it is wider than the
        electrode on each side. Both are empty for other machines.
        """
        return self._native.cavity()

    def keep_discharges(self) -> None:
        """Keep every discharge of such a machine from now on, for ``cavity_with``."""
        self._native.keep_discharges()

    def cavity_with(self, numbers: dict[str, float]) -> Columns:
        """Walls that the kept discharges make with other numbers of the file's ``[cavity]``.

        The electrode's way stays that of the run. Call it before ``close``.
        """
        return self._native.cavity_with(numbers)

    def close(self) -> None:
        """Switch the controller off, which ends the simulation and its files.

        Raises
        ------
        UserError
            If the file of the flash memory cannot be written.
        """
        memory, self._memory = self._memory, None
        contents = self._native.power_off() if memory else b""
        self._native.close()
        if memory:
            try:
                memory.write_bytes(contents)
            except OSError as error:
                raise UserError(f"{memory}: what the flash memory holds cannot be written: "
                                f"{error.strerror}.") from error


def _contents(memory: Path | None) -> bytes | None:
    """What the flash memory's file holds; None if there is no such file yet."""
    if memory is None or not memory.exists():
        return None
    from softcore.top import SIMULATED_JOURNAL, is_kept
    try:
        contents = memory.read_bytes()
    except OSError as error:
        raise UserError(f"{memory} cannot be read: {error.strerror}.") from error
    if not is_kept(len(contents)):
        raise UsageError(f"{memory} is not what a flash memory holds: it has {len(contents)} "
                         f"bytes, not {SIMULATED_JOURNAL.size} or whole sectors more.")
    return contents


def start(machine: Machine, *, clock_hz: int, seed: int, waves: Path | None,
          progress: Progress, trace: bool = True, flash: Path | None = None) -> Simulation:
    """Switch a simulated machine on; builds it first where it has changed.

    ``flash`` is a file with the contents of its flash memory, which ``close`` writes; without one,
    or if there is no such file yet, the memory is fresh.

    ``trace`` says whether samples of the run are kept: 100 MB for some ten minutes. ``progress`` is
    called with a sentence before every long step.
    """
    try:
        return Simulation(door.start(machine=machine.tables, clock_hz=clock_hz, seed=seed,
                                     waves=waves, trace=trace, flash=_contents(flash),
                                     progress=progress), flash)
    except ValueError as error:
        raise UsageError(f"machine {machine.name}: {error}.") from error
    except RuntimeError as error:  # of a compiler or Verilator, with pages of output
        LOG.parent.mkdir(exist_ok=True)
        LOG.write_text(f"{error}\n", encoding="utf-8")
        raise UserError("the simulated machine or its firmware could not be built; what the tool "
                        f"said is in {LOG}.") from error
