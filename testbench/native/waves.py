# SPDX-License-Identifier: Apache-2.0
"""Waveforms of a run as FST, with saved views for Surfer and GTKWave."""

from collections.abc import Iterator
from pathlib import Path

from testbench.native import views
from testbench.native.probes import PROBES
from testbench.native.signals import NAMES, SCOPE, SIGNALS

__all__ = ["Writer"]

NUMBER = {probe.name: index for index, probe in enumerate(PROBES)}


class Writer:
    """An FST file ``waves.fst`` in a folder, and the views ``waves.gtkw`` and ``waves.sucl``.

    The file has every signal of ``testbench.native.signals``, with a time step of one clock. The
    simulator's C++ writes the values: it calls the functions at ``addresses``, with what
    ``slices`` names. The same run gives the same file, to the byte.

    Parameters
    ----------
    folder : Path
        Made if it does not exist.
    clock_hz : int
        Frequency of the simulated clock.
    kind : str
        Of the machine, which the views are for: of ``testbench.native.views.VIEWS``.
    """

    def __init__(self, folder: Path, clock_hz: int, kind: str):
        # Imported here because only runs with waveforms need it.
        import pylibfst

        self._ffi, self._lib = pylibfst.ffi, pylibfst.lib
        self._kind = kind
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / "waves.fst"
        lib = self._lib
        self._writer = lib.fstWriterCreate(str(self.path).encode(), 1)
        lib.fstWriterSetPackType(self._writer, lib.FST_WR_PT_LZ4)
        # Whole nanoseconds where they fit: GTKWave cannot show a second at once in picoseconds.
        unit, per_second = (b"1ps", 10**12) if 10**9 % clock_hz else (b"1ns", 10**9)
        self._step = round(per_second / clock_hz)
        lib.fstWriterSetTimescaleFromString(self._writer, unit)
        lib.fstWriterSetVersion(self._writer, b"gapkeeper")
        lib.fstWriterSetDate(self._writer, b"")  # the same run gives the same file
        self._declare()

    def _declare(self):
        """Scopes, enumerations and signals, in the order of the table."""
        lib, writer = self._lib, self._writer
        tables: dict[tuple[str, int], int] = {}
        inside: list[str] = []
        for signal in SIGNALS:
            inside = self._enter(inside, [SCOPE, *signal.scope.split(".")])
            if signal.names:
                key = (signal.names, signal.bits)
                if key not in tables:
                    tables[key] = self._enumeration(*key)
                lib.fstWriterEmitEnumTableRef(writer, tables[key])
            # Not as integers: viewers drop their range from the name, and the views need it.
            lib.fstWriterCreateVar(writer, lib.FST_VT_VCD_WIRE, lib.FST_VD_OUTPUT, signal.bits,
                                   signal.name.encode(), 0)
        self._enter(inside, [])

    def _enter(self, inside, wanted):
        """Leave and enter scopes; return those that one is in."""
        lib, same = self._lib, 0
        while same < min(len(inside), len(wanted)) and inside[same] == wanted[same]:
            same += 1
        for _ in inside[same:]:
            lib.fstWriterSetUpscope(self._writer)
        for name in wanted[same:]:
            lib.fstWriterSetScope(self._writer, lib.FST_ST_VCD_MODULE, name.encode(), b"")
        return wanted

    def _enumeration(self, name, bits):
        """Write a table of names; return its number in the file."""
        new, names = self._ffi.new, NAMES[name]
        literals = [new("char[]", word.encode()) for word in names]
        values = [new("char[]", f"{value:0{bits}b}".encode()) for value in range(len(names))]
        return self._lib.fstWriterCreateEnumTable(
            self._writer, new("char[]", name.encode()), len(names), bits,
            new("char*[]", literals), new("char*[]", values))

    def slices(self) -> Iterator[tuple[int, int, int]]:
        """Number of the probe, lowest bit, and bits of each signal, in the order of the file."""
        for signal in SIGNALS:
            yield NUMBER[signal.probe], signal.bit or 0, signal.bits

    def addresses(self) -> tuple[int, int, int, int]:
        """Writer, function for a time, function for a value; and units of time per clock."""
        cast, lib = self._ffi.cast, self._lib

        def address(name):
            return int(cast("uintptr_t", self._ffi.addressof(lib, name)))

        return (int(cast("uintptr_t", self._writer)), address("fstWriterEmitTimeChange"),
                address("fstWriterEmitValueChange64"), self._step)

    def close(self, cycle: int) -> None:
        """End the file at a clock."""
        self._lib.fstWriterEmitTimeChange(self._writer, cycle * self._step)
        self._lib.fstWriterClose(self._writer)
        folder = self.path.parent
        (folder / "waves.gtkw").write_text(views.gtkwave(self._kind, cycle * self._step))
        (folder / "waves.sucl").write_text(views.surfer(self._kind))
