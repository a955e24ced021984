# SPDX-License-Identifier: Apache-2.0
"""The station for Python: the simulated machine and the host's end of the serial line.

One class serves both simulations: the native one and the one under cocotb differ only in how clocks
are run.
"""

import ctypes
from collections.abc import Iterable, Iterator

import numpy as np

from host.machines.machine_file import WORDS
from testbench.native.flash import Flash

__all__ = ["AXES", "Session", "parameters"]

AXES = "xyz"
HARMS = ("bent", "dropped", "doubled", "unstopped")     # of a byte on the line

GRAINS = 65535  # of a whole cell of the workpiece
PRESS_S, CLOSE_S = 0.02, 0.04  # length of a press; then more than the contacts take to close

_POINTER, _UNSIGNED, _DOUBLE = ctypes.c_void_p, ctypes.c_uint64, ctypes.c_double
_FUNCTIONS = {
    "station_set": (ctypes.c_int, [_POINTER, ctypes.c_char_p, _DOUBLE]),
    "station_get": (ctypes.c_int, [_POINTER, ctypes.c_char_p, ctypes.POINTER(_DOUBLE)]),
    "station_clock": (_UNSIGNED, [_POINTER]),
    "station_count": (ctypes.c_int32, [_POINTER, ctypes.c_int]),
    "station_arm": (ctypes.c_int, [_POINTER, _UNSIGNED, ctypes.c_int]),
    "station_send": (None, [_POINTER, ctypes.c_char_p, _UNSIGNED]),
    "station_flash": (_POINTER, [_POINTER]),
    "station_waiting": (_UNSIGNED, [_POINTER]),
    "station_receive": (None, [_POINTER, ctypes.c_char_p]),
    "station_send_broken": (None, [_POINTER, ctypes.c_uint8]),
    "station_damage": (None, [_POINTER, _UNSIGNED, ctypes.POINTER(_DOUBLE)]),
    "station_hits": (_UNSIGNED, [_POINTER]),
    "station_hit": (None, [_POINTER, _UNSIGNED, ctypes.POINTER(_UNSIGNED)]),
    "station_framing_errors": (_UNSIGNED, [_POINTER]),
    "station_extent": (None, [_POINTER, ctypes.POINTER(ctypes.c_int64)]),
    "station_left": (None, [_POINTER, *[ctypes.c_int64] * 4, _POINTER]),
    "station_keep_discharges": (None, [_POINTER]),
    "station_cavity": (_POINTER, [_POINTER]),
    "station_cavity_with": (_POINTER, [_POINTER, _UNSIGNED, ctypes.POINTER(ctypes.c_char_p),
                                       ctypes.POINTER(_DOUBLE)]),
    "cavity_layers": (_UNSIGNED, [_POINTER]),
    "cavity_walls": (None, [_POINTER, _POINTER]),
    "cavity_free": (None, [_POINTER]),
    "station_auxiliaries": (_UNSIGNED, [_POINTER]),
    "station_auxiliary": (None, [_POINTER, _UNSIGNED, ctypes.POINTER(_UNSIGNED)]),
}


def declare(library: ctypes.CDLL, functions: dict) -> None:
    """Tell ctypes the result and argument types of C functions."""
    for name, (result, arguments) in functions.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments


def parameters(machine: dict) -> Iterator[tuple[str, float]]:
    """Numbers of a machine file, named ``key`` or ``table.key``, without the ``[settings]``.

    Settings belong to the controller, and so does ``pitch_error_um`` of an axis. ``stock.steps``,
    pairs of a place and a width, becomes their number and ``stock.at_mm_0``, ``stock.width_um_0``
    and so on.

    Raises
    ------
    ValueError
        If a value is not a number, or a word or list that is not known.
    """
    for key, value in machine.items():
        if key == "settings":
            continue
        for name, one in ([(f"{key}.{inner}", one) for inner, one in value.items()]
                          if isinstance(value, dict) else [(key, value)]):
            if name.endswith(".pitch_error_um"):
                continue
            if name == "stock.steps":
                yield name, float(len(one))
                for index, (at_mm, width_um) in enumerate(one):
                    yield f"stock.at_mm_{index}", float(at_mm)
                    yield f"stock.width_um_{index}", float(width_um)
                continue
            number = WORDS[name].index(one) if one in WORDS.get(name, ()) else one
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise ValueError(f"the machine's {name} must be a number, not {one!r}")
            yield name, float(number)


class Session:
    """A running controller, seen from outside: its serial line, its machine, its probes.

    Subclasses define ``run``, ``receive``, ``probe``, ``poke``, ``load``, ``watch`` and
    ``changes``. The run depends only on the arguments, the seed and the order of calls.

    Parameters
    ----------
    library : ctypes.CDLL
        Library with the functions of ``station.cpp``.
    station : int
        Address of the station.
    machine : dict
        Tables of the machine's file.
    clock_hz : int
        Frequency of the simulated clock, which wins over the file's.

    Raises
    ------
    ValueError
        If the file has a parameter that the plant does not know.
    """

    def __init__(self, library: ctypes.CDLL, station: int, *, machine: dict, clock_hz: int):
        declare(library, _FUNCTIONS)
        self._station_library = library
        self._station = station
        self.clock_hz = clock_hz
        self.began = 0      # clock of the last power-on
        self.flash = Flash(library, library.station_flash(station))
        for name, value in parameters(machine | {"clock_hz": clock_hz}):
            self.set(name, value)

    # ---- defined by subclasses

    def run(self, clocks: int) -> None:
        """Let the clock run."""
        raise NotImplementedError

    def receive(self, clocks: int) -> bytes:
        """Run until the controller has sent something and paused, at most ``clocks``."""
        raise NotImplementedError

    def probe(self, name: str) -> int:
        """Present value of a signal of ``testbench.native.probes``."""
        raise NotImplementedError

    def poke(self, name: str, value: int) -> None:
        """Change a writable signal of ``testbench.native.probes``, between two clocks.

        Raises
        ------
        ValueError
            If it is not writable.
        """
        raise NotImplementedError

    def load(self, image: bytes) -> None:
        """Write the controller's memory from address 0 on; the caches do not change."""
        raise NotImplementedError

    def watch(self, names: Iterable[str]) -> None:
        """Keep every change of these probes from now on."""
        raise NotImplementedError

    def changes(self) -> list[tuple[int, str, int]]:
        """Take the changes of the watched probes: clock, name, value.

        Values are those in the clock before the edge of that number: ``cycle`` is ``n`` while
        clock ``n`` goes on.
        """
        raise NotImplementedError

    # ---- the machine

    def set(self, name: str, value: float) -> None:
        """Set a parameter or a force of the plant: ``force.short``, ``force.estop`` and so on.

        Raises
        ------
        ValueError
            If there is none of that name.
        """
        if not self._station_library.station_set(self._station, name.encode(), value):
            raise ValueError(f"the simulated machine has no parameter {name!r}")

    def get(self, name: str) -> float:
        """Parameter, force or reading (``read.gap_um``) of the plant.

        Raises
        ------
        ValueError
            If there is none of that name.
        """
        value = _DOUBLE()
        if not self._station_library.station_get(self._station, name.encode(), value):
            raise ValueError(f"the simulated machine has no {name!r}")
        return value.value

    @property
    def cycle(self) -> int:
        """Clocks since the start."""
        return self._station_library.station_clock(self._station)

    def button_arm(self, down: bool) -> None:
        """Hold the button ``arm`` down, or let it go."""
        self.set("force.arm", int(down))

    def press_arm(self) -> None:
        """Press the button ``arm`` as a person would, and let the contactor close.

        After power-on it waits first, as a button held since then does not count.
        """
        early = PRESS_S - (self.cycle - self.began) / self.clock_hz
        for level, seconds in ((0, max(0.0, early)), (1, PRESS_S), (0, CLOSE_S)):
            self.button_arm(bool(level))
            self.run(round(seconds * self.clock_hz))

    def positions(self) -> dict[str, int]:
        """Edges that the pulse coders have given, by axis, in pulses."""
        return {axis: self._station_library.station_count(self._station, index)
                for index, axis in enumerate(AXES)}

    def workpiece(self) -> dict:
        """Remaining workpiece of a wire machine, seen from above, around the wire's path.

        ``x`` and ``y`` are the middles of the cells in mm, in the workpiece's coordinates; ``left``
        is the share of each cell that is still there, by ``[y, x]``.
        """
        extent = (ctypes.c_int64 * 4)()
        self._station_library.station_extent(self._station, extent)
        x, y, columns, rows = extent
        left = np.empty((rows, columns), dtype=np.uint16)
        self._station_library.station_left(self._station, x, y, columns, rows, left.ctypes.data)
        cell_mm = self.get("workpiece.cell_um") / 1000
        return {"x": (x + np.arange(columns) + 0.5) * cell_mm,
                "y": (y + np.arange(rows) + 0.5) * cell_mm, "left": left / np.float32(GRAINS)}

    def keep_discharges(self) -> None:
        """Keep every discharge of a sinker with sides from now on, for ``cavity_with``."""
        self._station_library.station_keep_discharges(self._station)

    def cavity(self) -> dict:
        """Walls of a cavity that a sinker with sides has cut, layer by layer from the top.

        ``depth_mm`` is the lower end of each layer, ``opening_um`` by how much it is wider than the
        electrode on each side. Both are empty for another kind of machine.
        """
        return self._walls_of(self._station_library.station_cavity(self._station))

    def cavity_with(self, numbers: dict[str, float]) -> dict:
        """Walls that the kept discharges make with other numbers of ``[cavity]``.

        The electrode's way stays that of the run, although other walls would take more or less from
        the front.
        """
        names = (ctypes.c_char_p * len(numbers))(*(f"cavity.{name}".encode() for name in numbers))
        return self._walls_of(self._station_library.station_cavity_with(
            self._station, len(numbers), names, (_DOUBLE * len(numbers))(*numbers.values())))

    def _walls_of(self, cavity: int) -> dict:
        """Walls of a cavity at an address, which is freed."""
        walls = np.empty((self._station_library.cavity_layers(cavity), 2))
        self._station_library.cavity_walls(cavity, walls.ctypes.data)
        self._station_library.cavity_free(cavity)
        return {"depth_mm": walls[:, 0] / 1000, "opening_um": walls[:, 1]}

    def auxiliaries(self) -> list[tuple[int, str, int]]:
        """Auxiliary functions that the machine side has seen: clock, letter, code."""
        found = []
        for index in range(self._station_library.station_auxiliaries(self._station)):
            row = (_UNSIGNED * 3)()
            self._station_library.station_auxiliary(self._station, index, row)
            found.append((row[0], {1: "M", 2: "S", 4: "T"}[row[1]], row[2]))
        return found

    # ---- the serial line

    def send(self, data: bytes) -> None:
        """Queue bytes for the controller, back to back, from the next clock on."""
        self._station_library.station_send(self._station, data, len(data))

    def send_broken(self, byte: int) -> None:
        """Queue a byte without its stop bit."""
        self._station_library.station_send_broken(self._station, byte)

    def damage(self, seed: int, **shares: float) -> None:
        """Damage the line to the controller: ``shares`` of the bytes, by the kinds of ``HARMS``.

        A bent byte has one inverted bit.
        """
        assert set(shares) <= set(HARMS)
        self._station_library.station_damage(
            self._station, seed, (_DOUBLE * len(HARMS))(*(shares.get(harm, 0) for harm in HARMS)))

    def hits(self) -> list[tuple[str, int, int]]:
        """Bytes damaged so far: kind, byte sent, byte received."""
        found = []
        for index in range(self._station_library.station_hits(self._station)):
            row = (_UNSIGNED * 3)()
            self._station_library.station_hit(self._station, index, row)
            found.append((HARMS[row[0]], row[1], row[2]))
        return found

    def _arm(self, clocks, until_byte) -> bool:
        """Set the clock at which to stop; return whether there is any to run."""
        return bool(self._station_library.station_arm(self._station, clocks, until_byte))

    def received(self) -> bytes:
        """Take what the controller has sent so far."""
        size = self._station_library.station_waiting(self._station)
        buffer = ctypes.create_string_buffer(size + 1)
        self._station_library.station_receive(self._station, buffer)
        return buffer.raw[:size]

    def framing_errors(self) -> int:
        """Bytes from the controller that had no stop bit."""
        return self._station_library.station_framing_errors(self._station)

    # ---- the controller's registers

    def errors(self) -> dict[str, int]:
        """Error counters Er by axis, in pulses."""
        return {axis: self.probe(f"axis_{axis}_error") for axis in AXES}

    def discharges(self) -> dict[str, int]:
        """Main pulses so far, by class."""
        return {kind: self.probe(f"gap_{kind}_count") for kind in ("open", "ok", "dame", "short")}
