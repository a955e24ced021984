# SPDX-License-Identifier: Apache-2.0
"""The firmware's roughing planner on this computer: basic data, network and staircase in C."""

import ctypes
from collections.abc import Sequence

from host.roughing.basic import BasicData
from host.roughing.staircase import Job, Step
from testbench.firmware import library

RUNS = 33
_SINGLE, _UNSIGNED = ctypes.c_float, ctypes.c_uint32


class _Fault(ctypes.Structure):
    _fields_ = [("code", ctypes.c_int), ("line", _UNSIGNED), ("block", _UNSIGNED),
                ("column", _UNSIGNED), ("text", ctypes.c_char * 120)]


class _Job(ctypes.Structure):
    _fields_ = [(name, _UNSIGNED) for name in ("area", "undersize", "depth_um", "taper", "parts",
                                               "seed", "rmax")]


class _Run(ctypes.Structure):
    _fields_ = [("level", _UNSIGNED), ("depth_um", _UNSIGNED)]


class Result(ctypes.Structure):
    """The inferred staircase: ``staircase_result`` of staircase.h."""

    _fields_ = [("undersize_um", _SINGLE), ("ip", _SINGLE), ("beta_um", _SINGLE),
                ("bottom_um", _SINGLE), ("side_um", _SINGLE),
                ("runs", _Run * RUNS), ("count", _UNSIGNED), ("untrusted", _UNSIGNED),
                ("beyond", _UNSIGNED), ("greatest", ctypes.c_bool), ("ended", ctypes.c_bool),
                ("single", ctypes.c_bool)]

    def steps(self, parts: int) -> tuple[Step, ...]:
        """From the surface down."""
        return tuple(Step(run.level / parts, run.depth_um)
                     for run in reversed(self.runs[:self.count]))


class Planner:
    """The library holds one set of basic data, one network and one job."""

    def __init__(self, sanitize: str = "undefined"):
        self.library = library(sanitize)
        self.library.network_sample.argtypes = [_SINGLE] * 4
        self.library.network_ask.argtypes = [_SINGLE] * 3 + [ctypes.c_char_p]
        self.library.staircase_found.restype = ctypes.POINTER(Result)
        for name in ("network_step", "network_answer", "staircase_begin", "staircase_step",
                     "basic_depths", "basic_finish", "basic_area", "basic_current"):
            getattr(self.library, name).restype = ctypes.c_bool

    def learn(self, samples: Sequence[Sequence[float]], seed: int, inputs: Sequence[float],
              signs: Sequence[int]) -> tuple[float, bool, int]:
        """Answer of a network, whether it is trusted, and the iterations of its learning."""
        self.library.network_begin(_UNSIGNED(seed))
        for sample in samples:
            self.library.network_sample(*sample)
        self.library.network_ask(*inputs, bytes(sign % 256 for sign in signs))
        while self.library.network_step():
            pass
        answer = _SINGLE()
        trusted = self.library.network_answer(ctypes.byref(answer))
        return answer.value, trusted, self.library.network_iterations()

    def _take(self, name, *values):
        fault = _Fault()
        arguments = []
        for value in values:
            arguments += ([(_UNSIGNED * len(value))(*value), len(value)]
                          if isinstance(value, list) else [_UNSIGNED(value)])
        taken = getattr(self.library, name)(*arguments, ctypes.byref(fault))
        return "" if taken else fault.text.decode()

    def select(self, name: str) -> None:
        """Put a pair of materials in force."""
        self.library.basic_select(name.encode())

    def forget(self) -> None:
        """Forget all data."""
        self.library.basic_forget()

    def depths(self, values_um: list[int]) -> str:
        """Begin anew; return the firmware's fault, or None."""
        return self._take("basic_depths", values_um)

    def finish(self, tenths_um: list[int]) -> str:
        """Set the finishes: pairs of a roughness and a difference of the stock."""
        return self._take("basic_finish", [value % 2**32 for value in tenths_um])

    def area(self, hundredths: int) -> str:
        """Begin an area."""
        return self._take("basic_area", hundredths)

    def current(self, hundredths: int, tenths_um: list[int]) -> str:
        """Add a current: its undersizes, and the stock that it leaves, if that is known."""
        return self._take("basic_current", hundredths, tenths_um)

    def enter(self, data: Sequence[BasicData]) -> str:
        """Enter basic data; return the first fault, or None."""
        said = self.depths([round(depth * 1000) for depth in data[0].depth_mm])
        said = said or self.finish([round(value * 10)
                                    for finish in data[0].finish_um for value in finish])
        for one in data:
            said = said or self.area(round(one.area_mm2 * 100))
            for ip, row, *stock in zip(one.ip, one.undersize_um, one.bottom_um, one.side_um,
                                       strict=True):
                said = said or self.current(round(ip * 100),
                                            [round(value * 10) for value in (*row, *stock)])
        return said

    def plan(self, job: Job, seed: int) -> Result | str:
        """Staircase of a job from the entered data; or the reason why there is none."""
        fault = _Fault()
        wanted = _Job(round(job.area_mm2 * 100), round(job.undersize_um * 10),
                      round(job.depth_mm * 1000), round(job.taper_deg * 100), job.steps, seed,
                      round(job.rmax_um * 10))
        if not self.library.staircase_begin(ctypes.byref(wanted), ctypes.byref(fault)):
            return fault.text.decode()
        while self.library.staircase_step():
            pass
        found = self.library.staircase_found(ctypes.byref(fault))
        return Result.from_buffer_copy(found.contents) if found else fault.text.decode()
