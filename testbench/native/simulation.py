# SPDX-License-Identifier: Apache-2.0
"""The native simulation: millions of clocks a second, driven from Python in large steps."""

import ctypes
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from softcore.flash import SECTOR
from softcore.image import target_image
from softcore.memory import parities, words_of
from softcore.soc import MEMORY_SIZE
from softcore.top import SIMULATED_DIVISOR, SIMULATED_JOURNAL, is_kept
from testbench.native import waves as waveforms
from testbench.native.build import library, options
from testbench.native.probes import PROBES
from testbench.native.station import AXES, Session, declare

__all__ = ["Simulation", "start"]

TRACE_S = 1e-3
NUMBER = {probe.name: index for index, probe in enumerate(PROBES)}
COLUMNS = ["cycle", *AXES, *(f"error_{axis}" for axis in AXES), "path", "state", "shorted",
           "open", "ok", "dame", "short", "gap_v", "gap_um", "debris", "removed_mm3"]

SHORTS = ["short", "cycle", "path", *AXES, "contact", "forward"]

_POINTER, _UNSIGNED = ctypes.c_void_p, ctypes.c_uint64
_FUNCTIONS = {
    "gk_create": (_POINTER, [_UNSIGNED]),
    "gk_free": (None, [_POINTER]),
    "gk_station": (_POINTER, [_POINTER]),
    "gk_load": (None, [_POINTER, ctypes.POINTER(ctypes.c_uint32), ctypes.c_char_p, _UNSIGNED]),
    "gk_flip": (None, [_POINTER, _UNSIGNED, _UNSIGNED]),
    "gk_run": (None, [_POINTER, _UNSIGNED, ctypes.c_int]),
    "gk_power_off": (None, [_POINTER, _UNSIGNED]),
    "gk_keep": (None, [_POINTER]),
    "gk_replay": (None, [_POINTER, _POINTER]),
    "gk_probe": (ctypes.c_int64, [_POINTER, _UNSIGNED]),
    "gk_poke": (None, [_POINTER, _UNSIGNED, ctypes.c_int64]),
    "gk_state": (_UNSIGNED, []),
    "gk_state_name": (ctypes.c_char_p, [_UNSIGNED]),
    "gk_state_bits": (_UNSIGNED, [_UNSIGNED]),
    "gk_kept": (_POINTER, [_POINTER]),
    "gk_kept_count": (_UNSIGNED, [_POINTER]),
    "gk_turn_over": (None, [_POINTER, _UNSIGNED, _UNSIGNED]),
    "gk_trace_period": (None, [_POINTER, _UNSIGNED]),
    "gk_trace_rows": (_UNSIGNED, [_POINTER]),
    "gk_trace_read": (None, [_POINTER, _POINTER]),
    "gk_shorts_rows": (_UNSIGNED, [_POINTER]),
    "gk_shorts_read": (None, [_POINTER, _POINTER]),
    "gk_contact_clocks": (_UNSIGNED, [_POINTER]),
    "gk_tap": (None, [_POINTER, ctypes.POINTER(ctypes.c_uint32), _UNSIGNED]),
    "gk_changes": (_UNSIGNED, [_POINTER]),
    "gk_changes_take": (None, [_POINTER, _POINTER]),
    "gk_waves": (None, [_POINTER, _POINTER, _UNSIGNED, _UNSIGNED, _UNSIGNED]),
    "gk_wave": (None, [_POINTER, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32]),
}


class Simulation(Session):
    """A controller with firmware, switched on, and the machine around it.

    It starts before its first clock. Use it in a ``with`` statement, or ``close`` it.

    Parameters
    ----------
    machine : dict
        Tables of the machine's file.
    clock_hz : int
        Frequency of the simulated clock.
    seed : int
        Seed of everything random. The same seed gives the same run.
    waves : Path or None
        Folder for the waveforms, with views of the machine for Surfer and GTKWave.
    trace : bool
        Keep a sample of the run for every millisecond; see ``trace``.
    progress : callable
        Called with a sentence before every long step.
    code : Path or None
        The built library; made from the sources if not given.
    image : Path or None
        Firmware; compiled from the sources if not given.
    flash : bytes or None
        What the flash memory's region of journal and firmware slots holds; blank if not given, and
        behind what is given. ``power_off`` returns it.

    Raises
    ------
    ValueError
        If ``flash`` has no length of ``softcore.top.is_kept``.
    """

    def __init__(self, *, machine: dict, clock_hz: int, seed: int, waves: Path | None = None,
                 trace: bool = True, progress: Callable[[str], None] = lambda _: None,
                 code: Path | None = None, image: Path | None = None,
                 flash: bytes | None = None):
        if flash is not None and not is_kept(len(flash)):
            raise ValueError(f"the flash memory's journal has {SIMULATED_JOURNAL.size} bytes, and "
                             f"{len(flash)} were given")
        with ThreadPoolExecutor(1) as pool:     # the two compilations are independent
            compiled = pool.submit(target_image, progress=progress) if image is None else None
            code = code or library(clock_hz, progress, options(machine))
            image = compiled.result() if compiled else image
        self._code = ctypes.CDLL(str(code))
        declare(self._code, _FUNCTIONS)
        self._handle = self._code.gk_create(seed)
        self._waves = None
        self._trace = self._shorts = None
        super().__init__(self._code, self._code.gk_station(self._handle), machine=machine,
                         clock_hz=clock_hz)
        self._image = image.read_bytes()
        self.load(self._image)
        if flash is not None:
            self.flash.write(SIMULATED_JOURNAL.base, flash)
        if trace:
            self._code.gk_trace_period(self._handle, max(1, round(TRACE_S * clock_hz)))
        if waves is not None:
            self._waves = waveforms.Writer(waves, clock_hz, machine.get("kind", "sinker"))
            self._code.gk_waves(self._handle, *self._waves.addresses())
            for probe, low, bits in self._waves.slices():
                self._code.gk_wave(self._handle, probe, low, bits)

    byte_clocks = 10 * SIMULATED_DIVISOR    # that a byte takes on the line

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self) -> None:
        """End the simulation and its files. The trace can still be read."""
        if self._handle is None:
            return
        self._trace, self._shorts = self.trace(), self.shorts()
        if self._waves is not None:
            self._waves.close(self.cycle)
        self._last = self.cycle, self.positions(), self.errors(), self.discharges()
        self._left = self.workpiece()
        self._walls = self.cavity()
        self._code.gk_free(self._handle)
        self._handle = None

    def power_off(self) -> bytes:
        """Cut the power of the flash memory now; return what its region holds.

        Blank sectors at its end, behind the journal, are left out.
        """
        self.flash.cut(self.cycle)
        region = SIMULATED_JOURNAL
        held = self.flash.read(region.base, region.whole)
        sectors = -(-len(held.rstrip(b"\xff")) // SECTOR)
        return held[:max(region.size, sectors * SECTOR)]

    def power_off_and_on(self, seconds: float) -> None:
        """Cut the power of the controller and of its flash memory for a time, and boot it again.

        Only the controller is without power: the machine goes on, its axes brake with their drives
        off, and the workpiece is as it is. ``cycle`` goes on too.
        """
        self._code.gk_power_off(self._handle, round(seconds * self.clock_hz))
        self.began = self.cycle
        self.load(self._image)

    @property
    def cycle(self) -> int:
        return self._last[0] if self._handle is None else super().cycle

    def positions(self) -> dict[str, int]:
        return self._last[1] if self._handle is None else super().positions()

    def errors(self) -> dict[str, int]:
        return self._last[2] if self._handle is None else super().errors()

    def discharges(self) -> dict[str, int]:
        return self._last[3] if self._handle is None else super().discharges()

    def workpiece(self) -> dict:
        return self._left if self._handle is None else super().workpiece()

    def cavity(self) -> dict:
        return self._walls if self._handle is None else super().cavity()

    def run(self, clocks: int) -> None:
        self._code.gk_run(self._handle, clocks, False)

    def receive(self, clocks: int) -> bytes:
        self._code.gk_run(self._handle, clocks, True)
        return self.received()

    def probe(self, name: str) -> int:
        return self._code.gk_probe(self._handle, NUMBER[name])

    def poke(self, name: str, value: int) -> None:
        probe = PROBES[NUMBER[name]]
        if not (probe.writable or probe.natively):
            raise ValueError(f"{name} cannot be written")
        self._code.gk_poke(self._handle, NUMBER[name], value)

    def state(self) -> list[tuple[str, int]]:
        """Name and bits of every register of the controller, the processor's among them."""
        return [(self._code.gk_state_name(index).decode(), self._code.gk_state_bits(index))
                for index in range(self._code.gk_state())]

    def turn_over(self, index: int, bit: int) -> None:
        """Invert a bit of ``state()``, between two clocks."""
        self._code.gk_turn_over(self._handle, index, bit)

    def load(self, image: bytes) -> None:
        words = words_of(image)
        self._code.gk_load(self._handle, (ctypes.c_uint32 * len(words))(*words),
                           bytes(parities(image)), len(words))

    def flip(self, address: int, bit: int) -> None:
        """Invert a bit of the memory, between two clocks; the processor's caches do not change.

        Parameters
        ----------
        address : int
            Address of the word, in bytes.
        bit : int
            0 to 31, or 32: the word's parity.

        Raises
        ------
        ValueError
            If there is no such bit.
        """
        if address % 4 or not (0 <= address < MEMORY_SIZE and 0 <= bit <= 32):
            raise ValueError(f"the memory has no bit {bit} in a word at {address:#x}")
        self._code.gk_flip(self._handle, address // 4, bit)

    def keep_inputs(self) -> None:
        """Keep the controller's inputs for ``replay``. Call it before the first clock."""
        self._code.gk_keep(self._handle)

    def kept_inputs(self) -> tuple[int, int]:
        """Address in C++ of the kept inputs, and their number."""
        return self._code.gk_kept(self._handle), self._code.gk_kept_count(self._handle)

    def replay(self, other: "Simulation") -> None:
        """Run the netlist alone, without machine and line, on the inputs that ``other`` has kept.

        Call it on a new simulation with the same firmware: the controller does the same as that of
        ``other`` did. ``cycle`` and the machine do not change.
        """
        self._code.gk_replay(self._handle, other._handle)

    # ---- what happened

    def watch(self, names: Iterable[str]) -> None:
        """Keep every change of these probes from now on; see ``changes``."""
        numbers = [NUMBER[name] for name in names]
        self._code.gk_tap(self._handle, (ctypes.c_uint32 * len(numbers))(*numbers), len(numbers))

    def changes(self) -> list[tuple[int, str, int]]:
        """Take the changes of the watched probes: clock, name, value.

        Values are those in the clock before the edge of that number: ``cycle`` is ``n`` while
        clock ``n`` goes on.
        """
        rows = np.empty((self._code.gk_changes(self._handle), 3), dtype=np.int64)
        self._code.gk_changes_take(self._handle, rows.ctypes.data)
        return [(int(clock), PROBES[index].name, int(value)) for clock, index, value in rows]

    def trace(self) -> dict[str, np.ndarray]:
        """Columns, one row per millisecond, as they were at ``t``.

        ``t`` s; ``x y z`` from the coders and ``error_x/y/z``, pulses; ``path`` path pulses so far;
        ``feed`` mm/min along the path since the last row, negative backwards; ``state`` of the
        retraction; ``shorted`` Ss; ``open ok dame short`` pulses since the last row; ``gap_v`` mean
        voltage since the last row; ``gap_um`` true width; ``debris``; ``removed_mm3`` so far,
        with ``removal_scale``.
        """
        if self._trace is not None:
            return self._trace
        rows = np.empty((self._code.gk_trace_rows(self._handle), len(COLUMNS)))
        self._code.gk_trace_read(self._handle, rows.ctypes.data)
        columns = {name: rows[:, index].copy() for index, name in enumerate(COLUMNS)}
        columns["t"] = columns.pop("cycle") / self.clock_hz
        step_s = np.diff(columns["t"], prepend=0)
        step_s[:1] = 1
        moved = np.diff(columns["path"], prepend=columns["path"][:1])
        moved = (moved + 2**31) % 2**32 - 2**31  # the coordinate wraps
        columns["feed"] = moved / step_s * 60 / self.get("pulses_per_mm")
        for kind in ("open", "ok", "dame", "short"):
            columns[kind] = np.diff(columns[kind], prepend=columns[kind][:1]) % 2**32
        return columns

    def shorts(self) -> dict[str, np.ndarray]:
        """Columns on the way of the electrode after every short that ordered a retraction.

        ``short`` number, from 1 on; ``cycle``; ``path`` coordinate; ``x y z`` from the coders,
        pulses; ``contact`` cycle from which on electrode and work touched, ``forward`` cycle of the
        last pulse forwards so far, each -1 if there is none. The first row of a short is of the
        second clock after its completing sample, the last one of 60 ms later or of the next short.
        There is a row every 1/16 ms, and one of the first clock that shows a pulse back. Without
        ``trace`` there is none.
        """
        if self._shorts is not None:
            return self._shorts
        rows = np.empty((self._code.gk_shorts_rows(self._handle), len(SHORTS)))
        self._code.gk_shorts_read(self._handle, rows.ctypes.data)
        return {name: rows[:, index].copy() for index, name in enumerate(SHORTS)}

    def contact_s(self) -> float:
        """Time for which electrode and work have truly touched, or something between conducted.

        Without ``trace`` it is not counted.
        """
        return self._code.gk_contact_clocks(self._handle) / self.clock_hz


def start(*, machine: dict, clock_hz: int, seed: int, waves: Path | None = None,
          trace: bool = True, flash: bytes | None = None,
          progress: Callable[[str], None] = lambda _: None) -> Simulation:
    """Switch a simulated machine on; builds changed parts first.

    The parameters are those of ``Simulation``.
    """
    return Simulation(machine=machine, clock_hz=clock_hz, seed=seed, waves=waves, trace=trace,
                      flash=flash, progress=progress)
