# SPDX-License-Identifier: Apache-2.0
"""A record of the gap oscilloscope as columns, as CSV and as waveform."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.errors import UsageError, UserError
from host.machines.machine import CONVERTER_V
from softcore.scopemap import SCOPE
from softcore.tables import states

__all__ = ["LEVELS", "PULSES", "STATES", "SUFFIXES", "Record", "write"]

Numbers = NDArray[np.int64]

# Fields of an entry, lowest bit first: name and bits. An entry of ``rtl.gap.scope`` has 36 bits and
# is read from two registers.
FIELDS = [(field.name, field.bits) for name in ("entry", "entry_rest")
          for register in SCOPE.registers if register.name == name for field in register.fields]
# What is high or low, as columns.
LEVELS = ("high", "arc", "short", "current", "noise", "on", "sense", "shorted")
PULSES = ("", *(pulse.name for pulse in states.PULSES[1:]))
STATES = tuple(state.name for state in states.MOTION)
COLUMNS = ("clock", "time_us", "volts", *LEVELS, "pulse", "state")
SUFFIXES = (".csv", ".fst")


@dataclass(frozen=True)
class Record:
    """Entries of a record, oldest first, as columns of equal length.

    Attributes
    ----------
    clock_hz : int
        The controller's clock.
    trigger : int
        Number of the trigger's entry.
    cycle : int
        Lower 32 bits of the controller's clock count in the trigger's clock.
    clock : array of int
        Clocks from the trigger, negative before it.
    volts : array of float
        Sample of the gap voltage, V; NaN where no sample came in this clock.
    code : array of int
        The converter's last code.
    levels : dict of array of bool
        Each of ``LEVELS`` by name: comparators, gates, and Ss as ``shorted``.
    pulse, state : array of int
        Number in ``PULSES`` of the pulse that got its class in this clock; number in ``STATES``.
    """

    clock_hz: int
    trigger: int
    cycle: int
    clock: Numbers
    volts: NDArray[np.float64]
    code: Numbers
    levels: dict[str, NDArray[np.bool_]]
    pulse: Numbers
    state: Numbers

    @classmethod
    def of(cls, words: list[int], *, clock_hz: int, trigger: int, cycle: int) -> "Record":
        """The record of entries of 36 bits.

        Raises
        ------
        ValueError
            If no entry has the trigger's number.
        """
        if not 0 <= trigger < len(words):
            raise ValueError(f"the trigger {trigger} is none of {len(words)} entries")
        rest = np.array(words, dtype=np.int64)
        fields = {}
        for name, bits in FIELDS:
            fields[name] = rest & (1 << bits) - 1
            rest = rest >> bits
        # The stamp of the oldest entry counts from an entry that has been overwritten.
        clock = np.cumsum(fields["stamp"])
        return cls(clock_hz, trigger, cycle, clock - clock[trigger],
                   np.where(fields["sampled"] != 0, fields["voltage"] * CONVERTER_V / 4096, np.nan),
                   fields["voltage"], {name: fields[name].astype(bool) for name in LEVELS},
                   fields["pulse"], fields["state"])

    def __len__(self) -> int:
        return len(self.clock)

    @property
    def time_us(self) -> NDArray[np.float64]:
        """Time from the trigger, µs."""
        return np.asarray(self.clock * (1e6 / self.clock_hz), dtype=np.float64)

    @property
    def samples(self) -> Numbers:
        """Numbers of the entries with a sample of the voltage."""
        return np.flatnonzero(~np.isnan(self.volts))

    def write_csv(self, path: Path) -> None:
        """Write a row for each entry: ``COLUMNS``; ``volts`` is empty without a new sample."""
        with path.open("w", newline="", encoding="ascii") as file:
            rows = csv.writer(file)
            rows.writerow(COLUMNS)
            levels = [self.levels[name] for name in LEVELS]
            for at, (clock, us, volts) in enumerate(zip(self.clock, self.time_us, self.volts,
                                                        strict=True)):
                rows.writerow((clock, f"{us:.3f}", "" if np.isnan(volts) else f"{volts:.3f}",
                               *(int(level[at]) for level in levels),
                               PULSES[self.pulse[at]], STATES[self.state[at]]))

    def write_fst(self, path: Path) -> None:
        """Write a waveform; its time begins with the oldest entry, in clocks and nanoseconds.

        ``trigger`` is high in the trigger's clock, ``pulse`` for one clock with each class.
        """
        # Imported here because only waveforms need it.
        import pylibfst

        ffi, lib = pylibfst.ffi, pylibfst.lib
        writer = lib.fstWriterCreate(str(path).encode(), 1)
        if writer == ffi.NULL:
            raise OSError(0, "it cannot be made")
        lib.fstWriterSetPackType(writer, lib.FST_WR_PT_LZ4)
        unit, per_second = (b"1ps", 10**12) if 10**9 % self.clock_hz else (b"1ns", 10**9)
        lib.fstWriterSetTimescaleFromString(writer, unit)
        lib.fstWriterSetVersion(writer, b"gapkeeper")
        lib.fstWriterSetDate(writer, b"")   # the same record gives the same file
        lib.fstWriterSetScope(writer, lib.FST_ST_VCD_MODULE, b"scope", b"")
        volts = lib.fstWriterCreateVar(writer, lib.FST_VT_VCD_REAL, lib.FST_VD_OUTPUT, 64,
                                       b"volts", 0)
        handles = {}
        for name, bits, words in (*((name, 1, ()) for name in (*LEVELS, "trigger")),
                                  ("pulse", 3, ("none", *PULSES[1:])), ("state", 3, STATES)):
            if words:
                table = self._names(ffi, lib, writer, name, bits, words)
                lib.fstWriterEmitEnumTableRef(writer, table)
            handles[name] = lib.fstWriterCreateVar(writer, lib.FST_VT_VCD_WIRE, lib.FST_VD_OUTPUT,
                                                   bits, name.encode(), 0)
        lib.fstWriterSetUpscope(writer)
        step = round(per_second / self.clock_hz)
        last: dict[str, int] = {}
        for clock, name, value in self._changes():
            if clock != last.get(""):
                lib.fstWriterEmitTimeChange(writer, clock * step)
                last[""] = clock
            if name == "volts":
                lib.fstWriterEmitValueChange(writer, volts, ffi.new("double *", value))
            elif last.get(name) != value:
                last[name] = int(value)
                lib.fstWriterEmitValueChange64(writer, handles[name],
                                               3 if name in ("pulse", "state") else 1, int(value))
        lib.fstWriterEmitTimeChange(writer, (int(self.clock[-1] - self.clock[0]) + 1) * step)
        lib.fstWriterClose(writer)

    def _changes(self) -> Iterator[tuple[int, str, float]]:
        """Values by clock from the oldest entry on; some are those of the clock before."""
        clocks = self.clock - self.clock[0]
        for at, clock in enumerate(map(int, clocks)):
            if not np.isnan(self.volts[at]):
                yield clock, "volts", float(self.volts[at])
            for name in LEVELS:
                yield clock, name, int(self.levels[name][at])
            yield clock, "state", int(self.state[at])
            yield clock, "pulse", int(self.pulse[at])
            yield clock, "trigger", int(at == self.trigger)
            # Both last one clock, be there an entry for the next one or not.
            if at + 1 == len(self) or clocks[at + 1] > clock + 1:
                yield clock + 1, "pulse", 0
                yield clock + 1, "trigger", 0

    @staticmethod
    def _names(ffi: Any, lib: Any, writer: Any, name: str, bits: int,
               words: tuple[str, ...]) -> Any:
        """Write a table of names; return its number in the file."""
        literals = [ffi.new("char[]", word.encode()) for word in words]
        values = [ffi.new("char[]", f"{value:0{bits}b}".encode()) for value in range(len(words))]
        return lib.fstWriterCreateEnumTable(
            writer, ffi.new("char[]", name.encode()), len(words), bits,
            ffi.new("char*[]", literals), ffi.new("char*[]", values))


def write(record: Record, path: Path) -> None:
    """Write a record by the ending of the file: one of ``SUFFIXES``.

    Raises
    ------
    UsageError
        If the file has another ending.
    UserError
        If it cannot be written.
    """
    check(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        (record.write_csv if path.suffix.lower() == ".csv" else record.write_fst)(path)
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}.") from error


def check(path: Path) -> None:
    """Check that a record can be written under this name, before one is made.

    Raises
    ------
    UsageError
        If not.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f'"{path}" is no name for a record: it ends in .csv, or in .fst for a '
                         "waveform.")
