# SPDX-License-Identifier: Apache-2.0
"""Waveforms of the key signals of a run, as FST, with saved views for Surfer and GTKWave."""

import math
from pathlib import Path
from string import ascii_lowercase

from testbench.native.probes import PROBES

__all__ = ["Writer"]

# Name in the waveform (the patent's if it has one), probe, style, description.
SIGNALS = (
    ("Zc", "path_ahead", "analog", "end of what firmware has commanded, path pulses"),
    ("Ps", "path_command", "analog", "path pulses before the ramp, sum"),
    ("Pp", "path_position", "analog", "path pulses behind the ramp, sum"),
    ("Pi", "axis_z_command", "analog", "axis pulses of Z, sum"),
    ("FP", "axis_z_position", "analog", "feedback pulses of Z, sum"),
    ("Er", "axis_z_error", "analog", "error counter of Z, pulses"),
    ("DAC", "dac_z", "analog", "velocity command of Z, of 32768"),
    ("speed", "motor_z_um_s", "analog", "of the motor of Z, um/s"),
    ("Ss", "gap_status_shorted", "digital", "short"),
    ("state", "path_status_state", "digital", "of the retraction"),
    ("machining", "power_control_machining", "digital", "discharge is wanted"),
    ("safe", "safety_status_safe", "digital", "outputs are in their safe state"),
    ("gap_mv", "gap_mv", "analog", "gap voltage, mV"),
    ("gap_width_nm", "gap_width_nm", "analog", "true gap, nm"),
)
SCOPE = "gapkeeper"


class Writer:
    """An FST file ``waves.fst`` in a folder, with a time step of one clock, and the two views.

    ``signals`` are the probes to give it, in order; the simulator calls the file's own functions,
    at ``addresses``.
    """

    def __init__(self, folder: Path, clock_hz: int):
        # Imported here because only runs with waveforms need it.
        import pylibfst

        self._ffi, self._lib = pylibfst.ffi, pylibfst.lib
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / "waves.fst"
        self.signals = [probe for _, probe, _, _ in SIGNALS]
        lib = self._lib
        self._writer = lib.fstWriterCreate(str(self.path).encode(), 1)
        lib.fstWriterSetPackType(self._writer, lib.FST_WR_PT_LZ4)
        # Whole nanoseconds where they fit: GTKWave cannot show a second at once in picoseconds.
        unit, per_second = (b"1ps", 10**12) if 10**9 % clock_hz else (b"1ns", 10**9)
        self._step = round(per_second / clock_hz)
        lib.fstWriterSetTimescaleFromString(self._writer, unit)
        lib.fstWriterSetVersion(self._writer, b"gapkeeper")
        lib.fstWriterSetDate(self._writer, b"")  # the same run gives the same file
        lib.fstWriterSetScope(self._writer, lib.FST_ST_VCD_MODULE, SCOPE.encode(), b"")
        bits = {probe.name: probe for probe in PROBES}
        for name, probe, _, _ in SIGNALS:
            # Not as integers: viewers drop their range from the name, and the views need it.
            lib.fstWriterCreateVar(self._writer, lib.FST_VT_VCD_WIRE, lib.FST_VD_OUTPUT,
                                   bits[probe].bits, name.encode(), 0)
        lib.fstWriterSetUpscope(self._writer)
        (folder / "waves.sucl").write_text(_surfer())

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
        (self.path.parent / "waves.gtkw").write_text(_gtkwave(cycle * self._step))


def _gtkwave(duration) -> str:
    """View of the whole run: GTKWave's zoom is the negative logarithm of the time in 200 pixels."""
    zoom = -math.log2(max(duration, 1) / 6)
    bits = {probe.name: probe.bits for probe in PROBES}
    lines = ['[dumpfile] "waves.fst"', "[timestart] 0", "[size] 1600 900", "[pos] -1 -1",
             f"*{zoom:.6f} 0" + 26 * " -1", "[sst_expanded] 0"]
    for name, probe, style, _ in SIGNALS:
        width = f"[{bits[probe] - 1}:0]" if bits[probe] > 1 else ""
        # GTKWave's flags: 0x420 signed decimal, 0x8420 with an analog step curve, 0x28 binary.
        if style == "analog":
            lines += ["@8420", f"{SCOPE}.{name}{width}", "@20000", "-", "-"]
        else:
            lines += ["@24" if bits[probe] > 1 else "@28", f"{SCOPE}.{name}{width}"]
    return "\n".join(lines) + "\n"


def _surfer() -> str:
    """Commands: ``surfer --command-file waves.sucl waves.fst``. Items go by letter, from a on."""
    lines = []
    for letter, (name, _, style, _) in zip(ascii_lowercase, SIGNALS, strict=False):
        lines.append(f"variable_add {SCOPE}.{name}")
        if style == "analog":
            lines += [f"item_focus {letter}", "item_set_format Signed"]
    return "\n".join([*lines, "item_unfocus", "zoom_fit"]) + "\n"
