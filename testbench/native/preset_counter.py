# SPDX-License-Identifier: Apache-2.0
"""The preset counters as compiled code, with their inputs of every clock in a table."""

import ctypes
from functools import cache

import numpy as np

from rtl.gap.preset_counter import PresetCounters
from testbench.native.build import HERE
from testbench.native.component import component_library

__all__ = ["INPUTS", "OUTPUTS", "by_name", "compiled"]

# In the order that ``preset_counter.cpp`` takes and gives them in.
INPUTS = ("sample", "kind", "dame", "open", "ok", "mode", "window", "weight", "period", "freeze")
OUTPUTS = "up", "down", "strobe", "dame_full", "open_full", "ok_full"


@cache
def _library():
    return component_library(PresetCounters(), HERE / "preset_counter.cpp")


def compiled(inputs, clocks: int | None = None) -> np.ndarray:
    """Outputs by clock from reset on, a byte each with a bit for each of ``OUTPUTS``.

    ``inputs`` has a row of ``INPUTS`` for each clock; the last row holds for all later ``clocks``.
    """
    inputs = np.ascontiguousarray(inputs, dtype=np.uint32)
    outputs = np.empty(clocks or len(inputs), dtype=np.uint8)
    _library().preset_run(ctypes.c_uint64(len(outputs)), ctypes.c_uint64(len(inputs)),
                          inputs.ctypes.data_as(ctypes.c_void_p),
                          outputs.ctypes.data_as(ctypes.c_void_p))
    return outputs


def by_name(outputs: np.ndarray) -> np.ndarray:
    """Columns of ``OUTPUTS``, 0 or 1, of what ``compiled`` returned."""
    return outputs[:, None] >> np.arange(len(OUTPUTS)) & 1
