# SPDX-License-Identifier: Apache-2.0
"""The plant without a controller, for tests of the physics: the test drives its pins."""

import ctypes

from testbench.native.build import plant_library
from testbench.native.station import Session, declare

__all__ = ["Alone"]

_POINTER, _WORD, _UNSIGNED = ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint64
_FUNCTIONS = {
    "alone_create": (_POINTER, [_UNSIGNED]),
    "alone_free": (None, [_POINTER]),
    "alone_station": (_POINTER, [_POINTER]),
    "alone_outputs": (None, [_POINTER, *[_WORD] * 8]),
    "alone_step": (None, [_POINTER, _WORD, _WORD]),
    "alone_serial": (None, [_POINTER, *[_WORD] * 3]),
    "alone_references": (None, [_POINTER, *[_WORD] * 3]),
    "alone_run": (_UNSIGNED, [_POINTER, _UNSIGNED, ctypes.c_int32, _UNSIGNED,
                              ctypes.POINTER(_UNSIGNED)]),
}
# Inputs of the controller: lowest bit and width.
INPUTS = {"enc_a": (0, 3), "enc_b": (3, 3), "gap_high": (6, 1), "gap_arc": (7, 1),
          "gap_short": (8, 1), "gap_current": (9, 1), "fin": (10, 1), "estop": (11, 1),
          "fluid_low": (12, 1), "drive_fault": (13, 3), "limit_low": (16, 3),
          "limit_high": (19, 3), "gap_noise": (22, 1), "adc_data": (23, 1), "enc_index": (24, 3)}


class Alone(Session):
    """A plant whose pins a test drives.

    ``outputs`` are those of a controller, held until changed; ``density`` is the velocity command
    of Z in 1/32768 of full scale, given as an evenly spread bit stream.
    """

    def __init__(self, *, machine: dict, clock_hz: int = 2_000_000, seed: int = 1):
        self._library = ctypes.CDLL(str(plant_library()))
        declare(self._library, _FUNCTIONS)
        self._handle = self._library.alone_create(seed)
        super().__init__(self._library, self._library.alone_station(self._handle),
                         machine=machine, clock_hz=clock_hz)
        self._outputs = dict.fromkeys(
            ("drive_enable", "gap_on", "gap_sense", "gap_level", "gap_supply", "strobe", "code"),
            0) | {"contactor": 1}
        self.density = 0
        self.inputs = 0

    def __del__(self):
        self._library.alone_free(self._handle)

    def drive(self, **outputs: int) -> None:
        """Change outputs of the controller."""
        unknown = set(outputs) - set(self._outputs)
        if unknown:
            raise ValueError(f"there are no outputs {sorted(unknown)}")
        self._outputs |= outputs
        self._library.alone_outputs(self._handle, *self._outputs.values())

    def step(self, step: int, down: int = 0) -> None:
        """Set the step and direction pins, by axis mask."""
        self._library.alone_step(self._handle, step, down)

    def references(self, open_: int, arc: int, short: int) -> None:
        """Set the comparators' references: densities of evenly spread streams, in 1/32768."""
        self._library.alone_references(self._handle, open_, arc, short)

    def serial(self, select: int, clock: int, command: int) -> None:
        """Set the pins of the converter."""
        self._library.alone_serial(self._handle, select, clock, command)

    def run(self, clocks: int) -> None:
        self.until((), clocks)

    def until(self, names: tuple[str, ...], clocks: int) -> int:
        """Run until one of these inputs changes, at most ``clocks``; return the clocks run."""
        mask = 0
        for name in names:
            at, width = INPUTS[name]
            mask |= (1 << width) - 1 << at
        inputs = _UNSIGNED()
        gone = self._library.alone_run(self._handle, clocks, self.density, mask, inputs)
        self.inputs = inputs.value
        return gone

    def hold(self, *, gap_um: float, debris: float = 0.0) -> None:
        """Freeze the state of the gap, and let it take effect."""
        self.set("force.gap_um", gap_um)
        self.set("force.debris", debris)
        self.run(32)

    def pulse(self, *, on_us: int, off_us: int, level: int = 6) -> float | None:
        """Make one main pulse; return the ignition delay in us from the gate, or None."""
        mhz = self.clock_hz // 1_000_000
        self.drive(gap_on=1, gap_level=level)
        delay, began = 0, None
        while delay < on_us * mhz:
            delay += self.until(("gap_current",), on_us * mhz - delay)
            if self.input("gap_current") and began is None:
                began = delay / mhz
        self.drive(gap_on=0)
        self.run(off_us * mhz)
        return began

    def input(self, name: str) -> int:
        """Present value of an input of the controller."""
        at, width = INPUTS[name]
        return self.inputs >> at & (1 << width) - 1
